//! Keypoints: projections of given points, and the surfaces that occlude them.

use std::cell::RefCell;

use glam::{DAffine3, DVec2, DVec3};
use raycam_bvh::ExactHit;
use raycam_scene::camera::Center;
use raycam_scene::{Camera, Mesh, World, counted};
use rayon::prelude::*;

use crate::annotations::viewpoint::Viewpoint;
use crate::control::Control;
use crate::error::RenderError;
use crate::ground_truth::convert::exact_ray;
use crate::motion::shutter::ShutterSlices;
use crate::prepare::world::PreparedWorld;
use crate::thread_pool::with_pool;

/// Number of points that one task processes.
const POINTS_PER_TASK: usize = 4096;

/// Point to be projected, given in world coordinates, in mesh coordinates or on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeypointSource {
    /// Point in world coordinates; it does not move.
    World(DVec3),
    /// Point in mesh coordinates; it moves with the object.
    Mesh {
        /// Index of the object.
        object: usize,
        /// Position in mesh coordinates.
        point: DVec3,
    },
    /// Point on a triangle; it moves with the vertices, also in deforming meshes.
    Triangle {
        /// Index of the object.
        object: usize,
        /// Index of the triangle in its mesh.
        triangle: usize,
        /// Barycentric coordinates; their sum is 1.
        weights: DVec3,
    },
}

impl KeypointSource {
    fn object(&self) -> Option<usize> {
        match *self {
            Self::World(_) => None,
            Self::Mesh { object, .. } | Self::Triangle { object, .. } => Some(object),
        }
    }

    /// World-space position of the point. `of` returns an object's transform and mesh. The result is `None`
    /// if the mesh lacks the triangle, because the object is hidden at this time and shows a different mesh.
    fn position_with<'m>(&self, of: impl Fn(usize) -> Option<(DAffine3, &'m Mesh)>) -> Option<DVec3> {
        match *self {
            Self::World(point) => Some(point),
            Self::Mesh { object, point } => Some(of(object)?.0.transform_point3(point)),
            Self::Triangle { object, triangle, weights } => {
                let (world_from_mesh, mesh) = of(object)?;
                let [a, b, c] = mesh.triangles.get(triangle)?.map(|i| mesh.vertices[i as usize]);
                let point = a + (b - a) * weights.y + (c - a) * weights.z;
                Some(world_from_mesh.transform_point3(point))
            }
        }
    }

    fn position_in(&self, world: &World) -> DVec3 {
        let of = |i: usize| {
            let object = world.objects.get(i)?;
            Some((object.world_from_mesh, &**world.meshes.get(object.mesh)?))
        };
        self.position_with(of).unwrap_or(DVec3::NAN)
    }

    fn position_in_prepared(&self, world: &PreparedWorld) -> DVec3 {
        let of = |i: usize| {
            let object = world.geometry.instances.get(i)?;
            Some((object.world_from_mesh, &*object.mesh.mesh))
        };
        self.position_with(of).unwrap_or(DVec3::NAN)
    }
}

/// Projection of a point, and the point's visibility.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// World-space position at the time at which the point's pixel is exposed. For points without a pixel:
    /// the position in the viewpoint's world.
    pub point: DVec3,
    /// Position of the point in the image, in pixels; NaN if the camera cannot project the point.
    pub pixel: DVec2,
    /// True if the pixel position is inside the image.
    pub inside: bool,
    /// Index of the object that occludes the point, if any.
    pub occluder: Option<usize>,
    /// True if the point is visible and lies on a surface.
    pub on_surface: bool,
}

/// Projects points and tests their visibility. An occluder is nearer to the camera than the point by more than
/// `tolerance` times the distance; a surface within that range counts as the point's own surface.
///
/// With a rolling shutter, the solver finds a point's row together with its position in the world at exactly that row's
/// time. Occluders are searched for in the world at the middle of the row's exposure, which the image shows.
///
/// # Errors
/// [`RenderError::Settings`] for missing objects and triangles, weights whose sum is not 1, and mesh coordinates of a
/// skinned mesh; [`RenderError::World`] if the world cannot be evaluated at a time; [`RenderError::Cancelled`]; and
/// errors of `with_pool`.
pub fn keypoints(
    view: Viewpoint,
    anchors: &[KeypointSource],
    tolerance: f64,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<Keypoint>, RenderError> {
    anchors.iter().enumerate().try_for_each(|(i, anchor)| check(&view, i, anchor))?;
    let shutter = view.rolling_shutter();
    let camera = &view.world.geometry.camera_outside(view.camera);
    let view = Viewpoint { camera, ..view };
    control.start(anchors.len());
    with_pool(threads, || {
        let find = |anchor: &KeypointSource| {
            control.check()?;
            project_keypoint(&view, shutter.as_ref(), anchor)
        };
        let mut found = anchors.par_iter().map(find).collect::<Result<Vec<_>, RenderError>>()?;
        // Points in the same row are processed together, because they are tested in the same world.
        let center = |pixel: DVec2| {
            let [x, y] = camera.offset_from_corner(pixel).to_array();
            camera.pixel_center_of(x as u32, y as u32)
        };
        let time = |i: usize| camera.shutter_offset(center(found[i].pixel), 0.5);
        let mut inside: Vec<(f64, usize)> =
            (0..found.len()).filter(|&i| found[i].inside).map(|i| (time(i), i)).collect();
        if shutter.is_some() {
            inside.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let groups: Vec<_> = inside
            .chunk_by(|a, b| shutter.is_none() || a.0.to_bits() == b.0.to_bits())
            .flat_map(|line| line.chunks(POINTS_PER_TASK))
            .collect();
        let seen = groups
            .par_iter()
            .map(|group| {
                control.check()?;
                let pixel = center(found[group[0].1].pixel);
                let then = shutter.as_ref().map(|m| m.row_world(camera, pixel, control));
                let then = then.transpose()?;
                let world = then.as_deref().unwrap_or(view.world);
                let points: Vec<_> =
                    group.iter().map(|&(_, i)| (anchors[i].position_in_prepared(world), found[i].pixel)).collect();
                control.advance_by(group.len());
                Ok(find_occluders(world, camera, &points))
            })
            .collect::<Result<Vec<_>, RenderError>>()?;
        for (&(_, i), (distance, hit)) in inside.iter().zip(seen.into_iter().flatten()) {
            let hidden = hit.t < distance * (1.0 - tolerance);
            found[i].occluder = hidden.then_some(hit.instance as usize);
            found[i].on_surface = !hidden && hit.t <= distance * (1.0 + tolerance);
        }
        Ok(found)
    })?
}

fn check(view: &Viewpoint, i: usize, anchor: &KeypointSource) -> Result<(), RenderError> {
    let fail = |message: String| Err(RenderError::settings(format!("point {i}: {message}")));
    let Some(number) = anchor.object() else {
        return Ok(());
    };
    let Some(object) = view.world.geometry.instances.get(number) else {
        let count = view.world.geometry.instances.len();
        return fail(format!("object {number} does not exist; the world has {}", counted(count, "object")));
    };
    match *anchor {
        KeypointSource::Triangle { triangle, weights, .. } => {
            let count = object.mesh.mesh.triangles.len();
            if triangle >= count {
                return fail(format!(
                    "triangle {triangle} does not exist; object {number} has {}",
                    counted(count, "triangle")
                ));
            }
            let sum = weights.element_sum();
            // Weights rounded to float32 are accepted as a sum of 1.
            if (sum - 1.0).abs() <= 1e-5 {
                return Ok(());
            }
            fail(format!("the weights {weights} of the triangle's corners add up to {sum}; expected 1"))
        }
        _ if is_skinned(view.animated_world, number) => fail(format!(
            "the mesh of object {number} is deformed by a skin, so a point in mesh coordinates does not follow it; \
             use a triangle and the weights of its corners instead"
        )),
        _ => Ok(()),
    }
}

fn is_skinned(world: Option<&World>, object: usize) -> bool {
    let rig = world.and_then(|world| world.node_tree.as_ref());
    let mounts = rig.iter().flat_map(|rig| &rig.objects);
    mounts.into_iter().any(|mount| mount.object == object && mount.skin.is_some())
}

/// Projects a point; [`find_occluders`] determines its visibility later.
fn project_keypoint(
    view: &Viewpoint,
    shutter: Option<&ShutterSlices>,
    anchor: &KeypointSource,
) -> Result<Keypoint, RenderError> {
    let camera = view.camera;
    let failed = RefCell::new(None);
    let still = anchor.position_in_prepared(view.world);
    let at = |line: f64| {
        let Some(shutter) = shutter.filter(|_| anchor.object().is_some()) else {
            return still;
        };
        match shutter.scene_at_row(line) {
            Ok(world) => anchor.position_in(&world),
            Err(error) => {
                failed.replace(Some(error));
                DVec3::NAN
            }
        }
    };
    let (pixel, sees) = camera.project_moving(at);
    let sees = sees && pixel.is_finite();
    let point = if sees { at(camera.line_fraction(pixel)) } else { still };
    if let Some(error) = failed.into_inner() {
        return Err(error);
    }
    let past = camera.offset_from_corner(pixel);
    let size = DVec2::from(camera.size().map(f64::from));
    Ok(Keypoint {
        point,
        pixel: if sees { pixel } else { DVec2::NAN },
        inside: sees && past.cmpge(DVec2::ZERO).all() && past.cmplt(size).all(),
        occluder: None,
        on_surface: false,
    })
}

/// For each point: its distance along the ray through its pixel, and the first hit of this ray.
fn find_occluders(world: &PreparedWorld, camera: &Camera, points: &[(DVec3, DVec2)]) -> Vec<(f64, ExactHit)> {
    let (distances, rays): (Vec<_>, Vec<_>) = points
        .iter()
        .map(|&(point, pixel)| {
            let (origin, direction) = camera.ray(pixel);
            // With a rolling shutter, the point's own time differs slightly from the time of the row's world,
            // so the ray is aimed at the point itself.
            let way = point - origin;
            let direction = match camera.center() {
                Center::Point => way.normalize(),
                _ => direction,
            };
            (way.dot(direction), exact_ray((origin, direction)))
        })
        .unzip();
    let mut hits = vec![ExactHit::MISS; rays.len()];
    world.geometry.closest_visible(&rays, &mut hits);
    distances.into_iter().zip(hits).collect()
}
