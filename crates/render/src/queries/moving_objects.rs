//! Objects that rays with different times can hit, in worlds whose objects follow keyframes.
//!
//! Rays are processed in slices of similar times. For each slice, boxes contain every object during the
//! slice, and a bundle contains its rays. Only objects whose boxes the bundle meets are placed at the times
//! of the slice's rays.

use std::ops::Range;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use raycam_bvh::TlasLeaves;
use raycam_scene::world::ObjectMotion;
use raycam_scene::{MaterialModel, Object, World};

use crate::error::RenderError;
use crate::prepare::geometry::{Geometry, build_scene};
use crate::prepare::instance::{PreparedInstance, transformed_bounds};
use crate::prepare::mesh::PreparedMesh;
use crate::prepare::stretch::StretchedMeshes;
use crate::queries::rays::RayArrays;

/// Growth of boxes, relative to the coordinates, that exceeds the rounding of the tests.
const BOX_MARGIN: f64 = 1e-9;

/// Corners of a box.
type Bounds = [DVec3; 2];

/// Objects of a world, with boxes that contain them while they move.
pub(super) struct MovingObjects<'a> {
    world: &'a World,
    geometry: &'a Geometry,
    /// The world's own time, to which the rays' times are added.
    time: f64,
    /// For each object: its motion, if it moves, and its box.
    objects: Vec<(Option<ObjectMotion<'a>>, Place)>,
}

/// Box that contains an object at any time.
enum Place {
    /// Box of a static object.
    Static(Bounds),
    /// Box of a rigid object, relative to the object's location.
    Moving(Bounds),
    /// The object may be anywhere.
    Anywhere,
    /// Nothing hits the object.
    Hidden,
}

impl<'a> MovingObjects<'a> {
    /// The objects of a world; `None` if anything other than objects with keyframes moves. `geometry` is the
    /// world's prepared geometry.
    pub fn new(world: &'a World, geometry: &'a Geometry) -> Option<Self> {
        let time = world.time?.time;
        let mut objects: Vec<_> = geometry.instances.iter().map(|instance| (None, static_place(instance))).collect();
        for motion in world.object_motions()? {
            let (known, place) = &mut objects[motion.id];
            if !matches!(place, Place::Hidden) {
                *place = moving_place(&motion, &geometry.instances[motion.id].mesh);
            }
            *known = Some(motion);
        }
        Some(Self { world, geometry, time, objects })
    }

    /// Objects that rays of a bundle may hit at times between `start` and `end`, in seconds after the world's own time.
    pub fn within_reach(&self, bundle: &Bundle, [start, end]: [f64; 2]) -> Result<ReachableObjects<'_>, RenderError> {
        let clock = [self.time + start, self.time + end];
        let is_reached = |(motion, place): &(Option<ObjectMotion>, Place)| match place {
            Place::Static(bounds) => bundle.meets(*bounds),
            Place::Moving([lower, upper]) => motion.is_some_and(|motion| {
                let [first, last] = motion.locations_during(clock);
                bundle.meets([first + *lower, last + *upper])
            }),
            Place::Anywhere => true,
            Place::Hidden => false,
        };
        let ids: Vec<usize> = (0..self.objects.len()).filter(|&id| is_reached(&self.objects[id])).collect();
        let mut instances = Vec::with_capacity(ids.len());
        let mut moving = vec![];
        for (at, &id) in ids.iter().enumerate() {
            instances.push(self.geometry.instances[id].clone());
            if let Some(motion) = self.objects[id].0 {
                moving.push((at, motion, self.world.objects[id].clone()));
            }
        }
        let geometry = self.geometry.with_instances(instances)?;
        Ok(ReachableObjects { world: self.world, time: self.time, ids, moving, geometry })
    }
}

fn static_place(instance: &PreparedInstance) -> Place {
    if instance.is_visible { Place::Static(instance.bounds()) } else { Place::Hidden }
}

fn moving_place(motion: &ObjectMotion, mesh: &PreparedMesh) -> Place {
    if !motion.is_rigid() {
        return Place::Anywhere;
    }
    let bounds @ [lower, upper] = transformed_bounds(mesh, &DAffine3::from_mat3(motion.shape()));
    if motion.is_translation() {
        return Place::Moving(bounds);
    }
    let radius = DVec3::splat(lower.abs().max(upper.abs()).length());
    Place::Moving([-radius, radius])
}

/// Objects that a slice's rays may hit, and their geometry at one time.
pub(super) struct ReachableObjects<'a> {
    world: &'a World,
    time: f64,
    /// For each instance of the geometry, the object's index in the world. The indices ascend, so that the
    /// same object as in the whole world is hit if distances are equal.
    ids: Vec<usize>,
    /// For each object that moves: the index of its instance, its motion and its description.
    moving: Vec<(usize, ObjectMotion<'a>, Object)>,
    geometry: Geometry,
}

impl ReachableObjects<'_> {
    /// True if the geometry is the same at all times of the slice.
    pub fn is_static(&self) -> bool {
        self.moving.is_empty()
    }

    /// Index in the world of an instance's object; -1 (a miss) stays -1.
    pub fn id(&self, instance: i32) -> i32 {
        usize::try_from(instance).map_or(-1, |at| self.ids[at] as i32)
    }

    /// Instance of the object with this index in the world; -1 if the rays cannot reach the object.
    pub fn instance(&self, id: i32) -> i32 {
        let found = usize::try_from(id).ok().and_then(|id| self.ids.binary_search(&id).ok());
        found.map_or(-1, |at| at as i32)
    }

    /// Selects the values of the objects that the rays can reach.
    pub fn select<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.ids.iter().map(|&id| values[id]).collect()
    }

    /// Geometry at a time in seconds after the world's own time.
    ///
    /// # Errors
    /// [`RenderError::World`] if an object cannot be placed at this time.
    pub fn at(&mut self, seconds: f64) -> Result<&Geometry, RenderError> {
        if self.moving.is_empty() {
            return Ok(&self.geometry);
        }
        let origin = self.geometry.origin;
        for (at, motion, object) in &mut self.moving {
            object.world_from_mesh = motion.world_from_mesh_at(self.time + seconds).map_err(RenderError::world)?;
            let instance = &self.geometry.instances[*at];
            let (mesh, category) = (instance.mesh.clone(), instance.category);
            self.geometry.instances[*at] = placed(self.world, object, mesh, origin, category)?;
        }
        self.geometry.scene = build_scene(TlasLeaves::Instances, &self.geometry.instances, origin)?.into();
        Ok(&self.geometry)
    }
}

/// Creates the instance of an object at the object's transform.
fn placed(
    world: &World,
    object: &Object,
    mesh: Arc<PreparedMesh>,
    origin: DVec3,
    category: i32,
) -> Result<PreparedInstance, RenderError> {
    let place = object.world_from_mesh;
    if !(place.is_finite() && place.inverse().is_finite()) {
        return Err(RenderError::world(format!(
            "object {:?} has the transform {place:?}; expected an invertible transform",
            object.name
        )));
    }
    let stretched = StretchedMeshes::default().of_instance(object, &mesh)?;
    let is_boundary = object.materials.iter().all(|&at| world.materials[at].model == MaterialModel::Boundary);
    Ok(PreparedInstance::new(object, mesh, stretched, origin, category, is_boundary))
}

/// Bounds of rays `origin + t * direction` with t of at least 0.
pub(super) struct Bundle {
    /// Boxes of the origins and of the directions; `None` if a coordinate is not finite or a ray starts at a
    /// negative t. A bundle without bounds meets every box.
    bounds: Option<[Bounds; 2]>,
}

impl Bundle {
    /// Creates the bundle that contains a range of rays.
    pub fn around(rays: &RayArrays, range: Range<usize>) -> Self {
        let first = if rays.t_min.len() == 1 { &rays.t_min[..1] } else { &rays.t_min[range.clone()] };
        let around = |points: &[[f64; 3]]| {
            let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            let grow = |[l, u]: Bounds, point: &[f64; 3]| [l.min(DVec3::from(*point)), u.max(DVec3::from(*point))];
            points[range.clone()].iter().fold(nothing, grow)
        };
        let known = [rays.origins, rays.directions]
            .iter()
            .all(|points| points[range.clone()].iter().flatten().all(|x| x.is_finite()));
        let is_forward = first.iter().all(|&t| t >= 0.0);
        Self { bounds: (known && is_forward).then(|| [around(rays.origins), around(rays.directions)]) }
    }

    /// False if no ray of the bundle meets the box.
    pub fn meets(&self, [lower, upper]: Bounds) -> bool {
        let Some([[first, last], [slowest, fastest]]) = self.bounds else { return true };
        let size = lower.abs().max(upper.abs()).max(first.abs()).max(last.abs()).max_element();
        let margin = BOX_MARGIN * size;
        let (mut start, mut end) = (0.0f64, f64::INFINITY);
        for axis in 0..3 {
            // At parameter t, the coordinates of all rays are between first + t * slowest and last + t * fastest.
            for (ahead, speed) in [
                (upper[axis] - first[axis] + margin, slowest[axis]),
                (last[axis] - lower[axis] + margin, -fastest[axis]),
            ] {
                // The condition t * speed <= ahead limits t.
                if speed > 0.0 {
                    end = end.min(ahead / speed);
                } else if speed < 0.0 {
                    start = start.max(ahead / speed);
                } else if ahead < 0.0 {
                    return false;
                }
            }
        }
        start <= end * (1.0 + BOX_MARGIN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bundle(origins: [[f64; 3]; 2], directions: [[f64; 3]; 2]) -> Bundle {
        Bundle { bounds: Some([origins.map(DVec3::from), directions.map(DVec3::from)]) }
    }

    #[test]
    fn bounded_ray_bundle_meets_only_boxes_in_front_of_it() {
        let forward = bundle([[0.0; 3]; 2], [[1.0, -0.1, -0.1], [1.0, 0.1, 0.1]]);
        let cube = |x: f64, y: f64| [DVec3::new(x, y, 0.0) - 0.5, DVec3::new(x, y, 0.0) + 0.5];
        assert!(forward.meets(cube(0.0, 0.0)));
        assert!(forward.meets(cube(10.0, 0.0)));
        assert!(forward.meets(cube(10.0, 1.5)));
        assert!(!forward.meets(cube(10.0, 1.6)));
        assert!(!forward.meets(cube(-10.0, 0.0)));
        assert!(Bundle { bounds: None }.meets(cube(-10.0, 0.0)));
    }

    #[test]
    fn bundle_meets_a_flat_box_that_a_ray_touches() {
        let ray = bundle([[0.1, 0.2, 0.3]; 2], [[0.7, 0.9, -0.3]; 2]);
        let touched = DVec3::new(0.1, 0.2, 0.3) + 3.3 * DVec3::new(0.7, 0.9, -0.3);
        assert!(ray.meets([touched; 2]));
        assert!(!ray.meets([touched + DVec3::new(1e-6, 0.0, 0.0); 2]));
        let along = bundle([[0.0; 3]; 2], [[1.0, 0.0, 0.0]; 2]);
        assert!(along.meets([DVec3::ZERO, DVec3::new(1.0, 0.0, 0.0)]));
        assert!(along.meets([DVec3::new(2.0, 0.0, -1.0), DVec3::new(2.0, 1.0, 1.0)]));
    }
}
