//! Ground truth in addition to a frame's channels: flow, silhouettes, boxes.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::PreparedWorld;
use raycam_render::annotations::amodal;
use raycam_render::annotations::flow::flow as follow;
use raycam_render::annotations::keypoints::{Keypoint, KeypointSource, keypoints as find};
use raycam_render::annotations::viewpoint::Viewpoint;
use raycam_scene::counted;

use crate::arrays::{DictResult, Floats, NewArray, array, rows, rows_of, vector};
use crate::camera::Camera;
use crate::error::settings_error;
use crate::interruptible::run_interruptible;
use crate::world::state::World;

/// Viewpoint of a camera in a world.
fn viewpoint<'a>(world: &'a (Arc<raycam_scene::World>, Arc<PreparedWorld>), camera: &'a Camera) -> Viewpoint<'a> {
    Viewpoint { world: &world.1, animated_world: Some(&world.0), camera: &camera.inner }
}

/// Returns optical and scene flow from the first camera and world to the second: arrays [height, width] or [height,
/// width, components] by name.
#[pyfunction]
pub(crate) fn flow<'py>(
    py: Python<'py>,
    first: (PyRef<'py, World>, PyRef<'py, Camera>),
    second: (PyRef<'py, World>, PyRef<'py, Camera>),
    threads: Option<usize>,
) -> DictResult<'py> {
    let worlds = (first.0.prepared_world(py, threads)?, second.0.prepared_world(py, threads)?);
    let [width, height] = first.1.inner.size().map(|side| side as usize);
    let (from, to) = (viewpoint(&worlds.0, &first.1), viewpoint(&worlds.1, &second.1));
    let found = run_interruptible(py, None, |control| follow(from, to, threads, control))?;
    let dict = PyDict::new(py);
    let flat = [height, width];
    dict.set_item("flow", array(py, found.flow.into_flattened(), &[height, width, 2])?)?;
    dict.set_item("scene_flow", array(py, found.scene_flow.into_flattened(), &[height, width, 3])?)?;
    dict.set_item("depth", array(py, found.depth, &flat)?)?;
    dict.set_item("occluded", array(py, found.occluded, &flat)?)?;
    dict.set_item("outside", array(py, found.outside, &flat)?)?;
    Ok(dict)
}

/// For each object that covers any pixel: (object, (x, y, width, height), mask [height, width]).
type Silhouettes<'py> = Vec<(usize, (i32, i32, i32, i32), NewArray<'py, bool>)>;

/// Returns amodal masks: the pixels that each object would cover without the other objects, in an image that is
/// extended by a margin on each side.
#[pyfunction(name = "silhouettes")]
pub(crate) fn amodal_masks<'py>(
    py: Python<'py>,
    world: PyRef<'py, World>,
    camera: PyRef<'py, Camera>,
    objects: Vec<usize>,
    margin: [u32; 2],
    threads: Option<usize>,
) -> PyResult<Silhouettes<'py>> {
    let world = world.prepared_world(py, threads)?;
    let seen = viewpoint(&world, &camera);
    let found = run_interruptible(py, None, |control| amodal::amodal_masks(seen, &objects, margin, threads, control))?;
    found
        .into_iter()
        .map(|found| {
            let [_, _, width, height] = found.region;
            let mask = array(py, found.mask, &[height as usize, width as usize])?;
            Ok((found.object, found.region.into(), mask))
        })
        .collect()
}

/// Returns the projections of points [n, 3], as arrays with the names of `raycam.Keypoints`. `objects` and
/// `triangles`, if given, have one entry per point. With `triangles`, points are barycentric coordinates.
#[pyfunction]
pub(crate) fn keypoints<'py>(
    py: Python<'py>,
    seen: (PyRef<'py, World>, PyRef<'py, Camera>),
    points: Floats<'py>,
    objects: Option<Vec<usize>>,
    triangles: Option<Vec<usize>>,
    tolerance: f64,
    threads: Option<usize>,
) -> DictResult<'py> {
    let points = rows::<f64, 3>(&points, "points")?;
    let of = |numbers: &Option<Vec<usize>>, i: usize| numbers.as_ref()?.get(i).copied();
    let anchor = |(i, point): (usize, &[f64; 3])| match (of(&objects, i), of(&triangles, i)) {
        (None, _) => KeypointSource::World(vector(*point)),
        (Some(object), None) => KeypointSource::Mesh { object, point: vector(*point) },
        (Some(object), Some(triangle)) => KeypointSource::Triangle { object, triangle, weights: vector(*point) },
    };
    let anchors: Vec<KeypointSource> = points.iter().enumerate().map(anchor).collect();
    let world = seen.0.prepared_world(py, threads)?;
    let seen = viewpoint(&world, &seen.1);
    let found = run_interruptible(py, None, |control| find(seen, &anchors, tolerance, threads, control))?;
    let n = found.len();
    let occluder = |point: &Keypoint| point.occluder.map_or(-1, |object| object as i32);
    let dict = PyDict::new(py);
    let points: Vec<f64> = found.iter().flat_map(|p| p.point.to_array()).collect();
    dict.set_item("points", array(py, points, &[n, 3])?)?;
    let pixels: Vec<f64> = found.iter().flat_map(|p| p.pixel.to_array()).collect();
    dict.set_item("pixels", array(py, pixels, &[n, 2])?)?;
    let inside: Vec<bool> = found.iter().map(|p| p.inside).collect();
    dict.set_item("in_picture", array(py, inside, &[n])?)?;
    let occluders: Vec<i32> = found.iter().map(occluder).collect();
    dict.set_item("occluder", array(py, occluders, &[n])?)?;
    let on_surface: Vec<bool> = found.iter().map(|p| p.on_surface).collect();
    dict.set_item("on_surface", array(py, on_surface, &[n])?)?;
    Ok(dict)
}

/// Rotation world_from_box, centre and size of a box.
type OrientedBox = ([[f64; 3]; 3], [f64; 3], [f64; 3]);

/// Returns the box around each object along the object's own axes.
#[pyfunction]
pub(crate) fn oriented_boxes(py: Python<'_>, world: &World, objects: Vec<usize>) -> PyResult<Vec<OrientedBox>> {
    let inner = world.snapshot();
    let found: Result<Vec<_>, usize> =
        py.detach(|| objects.iter().map(|&object| inner.oriented_box(object).ok_or(object)).collect());
    let boxes = found.map_err(|object| {
        let count = inner.objects.len();
        settings_error(format!("object {object} does not exist; the world has {}", counted(count, "object")))
    })?;
    Ok(boxes.iter().map(|one| (rows_of(one.rotation), one.center.to_array(), one.size.to_array())).collect())
}
