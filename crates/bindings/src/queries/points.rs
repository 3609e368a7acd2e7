//! Queries of points and of pairs of points. Python has already converted the arrays to C order and broadcast them to
//! equal shapes.

use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::queries::camera_sight::{self, SurfacePoints};
use raycam_render::queries::face_sight::{self, SampledFaces};
use raycam_render::queries::points::{self, PointArrays};
use raycam_render::queries::selection::Selection;
use raycam_render::queries::signed_distance::{self, Sign};
use raycam_render::queries::velocity::{self, MovingPoints};
use raycam_render::queries::visible::{self, PointPairs};
use raycam_render::queries::{inside, winding};
use raycam_scene::counted;
use raycam_scene::mesh::surface::SurfaceTopology;

use crate::arrays::{ArrayResult, DictResult, Floats, NewArray, array, flat, rows};
use crate::camera::Camera;
use crate::error::settings_error;
use crate::interruptible::run_for_work;
use crate::queries::rays::{mask, surface};
use crate::queries::{answer, answer_array};
use crate::world::state::World;

/// One flag per object of the world; true selects the object.
type Mask<'py> = PyReadonlyArrayDyn<'py, bool>;

/// Points from a dict: points \[n, 3], their maximum distances \[1] or \[n], and one flag per object that selects it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PointArguments<'py> {
    points: Floats<'py>,
    max_distance: Floats<'py>,
    objects: Option<Mask<'py>>,
    threads: Option<usize>,
}

impl PointArguments<'_> {
    fn arrays(&self) -> PyResult<PointArrays<'_>> {
        let limits = self.max_distance.as_slice();
        Ok(PointArrays {
            points: rows(&self.points, "points")?,
            max_distance: limits.map_err(|_| settings_error("max_distance: expected a C-contiguous array"))?,
            objects: mask(self.objects.as_ref())?,
        })
    }
}

/// Returns the closest surface point for each query point, as a dict with the field names of `World.closest_points`.
#[pyfunction]
pub(crate) fn world_closest_points<'py>(world: &Bound<'py, World>, query: PointArguments<'py>) -> DictResult<'py> {
    let (arrays, threads) = (query.arrays()?, query.threads);
    let found = answer(world, threads, points::is_brief(arrays.points.len()), |prepared, control| {
        points::closest_points(prepared, &arrays, threads, control)
    })?;
    let (py, n) = (world.py(), found.distance.len());
    let dict = PyDict::new(py);
    dict.set_item("distance", array(py, found.distance, &[n])?)?;
    dict.set_item("position", array(py, found.position.into_flattened(), &[n, 3])?)?;
    dict.set_item("instance", array(py, found.instance, &[n])?)?;
    dict.set_item("triangle", array(py, found.triangle, &[n])?)?;
    dict.set_item("barycentric", array(py, found.barycentric.into_flattened(), &[n, 3])?)?;
    dict.set_item("normal", array(py, found.normal.into_flattened(), &[n, 3])?)?;
    Ok(dict)
}

/// Returns the distance of each point to the nearest selected object, in metres; +inf beyond the maximum distance.
#[pyfunction]
pub(crate) fn world_distance<'py>(world: &Bound<'py, World>, query: PointArguments<'py>) -> ArrayResult<'py, f64> {
    let (arrays, threads) = (query.arrays()?, query.threads);
    answer_array(world, threads, points::is_brief(arrays.points.len()), |prepared, control| {
        points::distance(prepared, &arrays, threads, control)
    })
}

/// Returns the distance of each point to the nearest selected object, in metres; negative inside the object, and +inf
/// beyond the maximum distance.
#[pyfunction]
pub(crate) fn world_signed_distance<'py>(
    world: &Bound<'py, World>,
    query: PointArguments<'py>,
    sign: &str,
) -> ArrayResult<'py, f64> {
    let (arrays, threads) = (query.arrays()?, query.threads);
    let sign = match sign {
        "auto" => Sign::Auto,
        "winding" => Sign::Winding,
        "pseudonormal" => Sign::Pseudonormal,
        name => {
            return Err(settings_error(format!(
                "unknown sign {name:?}; expected \"auto\", \"winding\" or \"pseudonormal\""
            )));
        }
    };
    answer_array(world, threads, points::is_brief(arrays.points.len()), |prepared, control| {
        signed_distance::signed_distance(prepared, &arrays, sign, threads, control)
    })
}

/// Returns for each point [n, 3] true if it is inside any of the selected objects.
#[pyfunction]
pub(crate) fn world_inside<'py>(
    world: &Bound<'py, World>,
    points: Floats<'py>,
    objects: Option<Mask<'py>>,
    threads: Option<usize>,
) -> ArrayResult<'py, bool> {
    let (rows, chosen) = (rows(&points, "points")?, mask(objects.as_ref())?);
    answer_array(world, threads, points::is_brief(rows.len()), |prepared, control| {
        inside::inside(prepared, rows, chosen, threads, control)
    })
}

/// Returns the winding number of the selected objects around each point [n, 3].
#[pyfunction]
pub(crate) fn world_winding_number<'py>(
    world: &Bound<'py, World>,
    points: Floats<'py>,
    objects: Option<Mask<'py>>,
    threads: Option<usize>,
) -> ArrayResult<'py, f64> {
    let (rows, chosen) = (rows(&points, "points")?, mask(objects.as_ref())?);
    answer_array(world, threads, points::is_brief(rows.len()), |prepared, control| {
        winding::winding_number(prepared, rows, chosen, threads, control)
    })
}

/// Returns for each pair of points [n, 3] true if no triangle is between them.
#[pyfunction]
pub(crate) fn world_visible<'py>(
    world: &Bound<'py, World>,
    a: Floats<'py>,
    b: Floats<'py>,
    margin: f64,
    objects: Option<Mask<'py>>,
    surface_name: &str,
    threads: Option<usize>,
) -> ArrayResult<'py, bool> {
    let selection =
        Selection { objects: mask(objects.as_ref())?, surface: surface(surface_name)?, ..Selection::default() };
    let pairs = PointPairs { from: rows(&a, "a")?, to: rows(&b, "b")?, margin, selection };
    answer_array(world, threads, points::is_brief(pairs.from.len()), |prepared, control| {
        visible::visible(prepared, &pairs, threads, control)
    })
}

/// A dict of surface points [n, 3] with unit normals [n, 3], and the conditions under which a camera shows them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SurfacePointArguments<'py> {
    positions: Floats<'py>,
    normals: Floats<'py>,
    both_sides: bool,
    min_cosine: f64,
    footprints: bool,
    threads: Option<usize>,
}

/// Returns the surface points that a camera shows, in a dict with the field names of `Sight`.
#[pyfunction]
pub(crate) fn world_points_in_sight<'py>(
    world: &Bound<'py, World>,
    camera: &Camera,
    query: SurfacePointArguments<'py>,
) -> DictResult<'py> {
    let points = SurfacePoints {
        positions: rows(&query.positions, "positions")?,
        normals: rows(&query.normals, "normals")?,
        both_sides: query.both_sides,
        min_cosine: query.min_cosine,
    };
    let (camera, threads) = (&camera.inner, query.threads);
    let found = answer(world, threads, points::is_brief(points.positions.len()), |prepared, control| {
        camera_sight::points_in_sight(prepared, camera, &points, query.footprints, threads, control)
    })?;
    let (py, n) = (world.py(), found.index.len());
    let dict = PyDict::new(py);
    dict.set_item("index", array(py, found.index, &[n])?)?;
    dict.set_item("pixels", array(py, found.pixels.into_flattened(), &[n, 2])?)?;
    dict.set_item("cosine", array(py, found.cosines, &[n])?)?;
    dict.set_item("origins", array(py, found.origins.into_flattened(), &[n, 3])?)?;
    let footprints = found.footprints.len();
    dict.set_item("footprints", array(py, found.footprints.into_flattened(), &[footprints, 2, 2])?)?;
    Ok(dict)
}

/// A dict of faces \[n], the pattern of sample points on each face, and the conditions under which cameras show them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct FaceArguments<'py> {
    corners: Floats<'py>,
    normals: Floats<'py>,
    min_samples: PyReadonlyArrayDyn<'py, u16>,
    pattern: Floats<'py>,
    both_sides: bool,
    pairs: bool,
    threads: Option<usize>,
}

/// Returns the faces that cameras show, in a dict with the field names of `FaceSight`.
#[pyfunction]
pub(crate) fn world_faces_in_sight<'py>(
    world: &Bound<'py, World>,
    cameras: Vec<PyRef<'_, Camera>>,
    query: FaceArguments<'py>,
) -> DictResult<'py> {
    let faces = SampledFaces {
        corners: rows(&query.corners, "corners")?.as_chunks().0,
        normals: rows(&query.normals, "normals")?,
        min_samples: flat(&query.min_samples, "min_samples")?,
        pattern: rows(&query.pattern, "pattern")?,
        both_sides: query.both_sides,
    };
    let cameras: Vec<_> = cameras.iter().map(|camera| camera.inner.clone()).collect();
    let threads = query.threads;
    let found = answer(world, threads, false, |prepared, control| {
        face_sight::faces_in_sight(prepared, &cameras, &faces, query.pairs, threads, control)
    })?;
    let (py, n) = (world.py(), found.views.len());
    let dict = PyDict::new(py);
    let (shown, pairs) = (found.is_shown.len(), found.pairs.len());
    dict.set_item("samples", array(py, found.samples, &[n])?)?;
    dict.set_item("is_shown", array(py, found.is_shown, &[shown])?)?;
    dict.set_item("views", array(py, found.views, &[n])?)?;
    dict.set_item("best_view", array(py, found.best_view, &[n])?)?;
    dict.set_item("best_resolution", array(py, found.best_resolution, &[n])?)?;
    dict.set_item("best_cosine", array(py, found.best_cosine, &[n])?)?;
    dict.set_item("faces_shown", array(py, found.faces_shown, &[cameras.len()])?)?;
    dict.set_item("pairs", array(py, found.pairs.into_flattened(), &[pairs, 3])?)?;
    Ok(dict)
}

/// A dict of points \[n]: their objects, triangles, barycentric coordinates, and times in seconds after the world's
/// time.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct MovingPointArguments<'py> {
    instance: PyReadonlyArrayDyn<'py, i32>,
    triangle: PyReadonlyArrayDyn<'py, i32>,
    barycentric: Floats<'py>,
    time: Floats<'py>,
    threads: Option<usize>,
}

/// Returns the velocities [n, 3] of points of surfaces, in metres per second.
#[pyfunction]
pub(crate) fn world_velocities<'py>(
    world: &Bound<'py, World>,
    points: MovingPointArguments<'py>,
) -> ArrayResult<'py, f64> {
    let (py, state) = (world.py(), world.get().snapshot());
    let moving = MovingPoints {
        instances: flat(&points.instance, "instance")?,
        triangles: flat(&points.triangle, "triangle")?,
        barycentrics: rows(&points.barycentric, "barycentric")?,
        times: flat(&points.time, "time")?,
    };
    let threads = points.threads;
    let found = run_for_work(py, false, None, |control| velocity::velocities(&state, &moving, threads, control))?;
    let n = found.len();
    array(py, found.into_flattened(), &[n, 3])
}

/// Topology of a mesh: (is closed, is oriented, boundary edges [k, 2], volume, number of components).
type TopologyParts<'py> = (bool, bool, NewArray<'py, i32>, f64, usize);

/// Returns the topology of an object's mesh; the volume is in world units, scaled by the object's transform.
#[pyfunction]
pub(crate) fn world_topology<'py>(py: Python<'py>, world: &World, object: usize) -> PyResult<TopologyParts<'py>> {
    let world = world.snapshot();
    let placed = world.objects.get(object).ok_or_else(|| {
        settings_error(format!(
            "object {object} does not exist; the world has {}",
            counted(world.objects.len(), "object")
        ))
    })?;
    let surface = py.detach(|| SurfaceTopology::new(&world.meshes[placed.mesh]));
    let edges: Vec<i32> = surface.boundary_edges.iter().flatten().map(|&vertex| vertex as i32).collect();
    let count = surface.boundary_edges.len();
    let volume = surface.volume * placed.world_from_mesh.matrix3.determinant().abs();
    Ok((surface.is_closed, surface.is_oriented, array(py, edges, &[count, 2])?, volume, surface.components))
}
