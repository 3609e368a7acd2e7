//! Poses from which objects are dropped.

use glam::DVec3;
use rapier3d_f64::math::{Pose, Vector};
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingVolume};
use raycam_scene::Up;

use crate::bodies::{Body, Obstacle};
use crate::convert::vector;
use crate::random::Stream;
use crate::request::Place;

/// Simulated time between two objects, in seconds.
const INTERVAL: f64 = 0.1;
/// Maximum number of draws of a pose that must not start inside an obstacle.
const MAX_DRAWS: usize = 64;

/// Start position and time of a body.
#[derive(Clone, Copy)]
pub(crate) struct Start {
    pub(crate) time: f64,
    pub(crate) pose: Pose,
}

/// The region above which objects are dropped: the bounds of the target.
pub(crate) struct Region {
    /// Indices of the target's objects.
    pub(crate) objects: Vec<usize>,
    pub(crate) bounds: Aabb,
    pub(crate) place: Place,
    pub(crate) up: Vector,
}

impl Region {
    /// Region of the given obstacles; `None` without obstacles.
    pub(crate) fn new<'a>(targets: impl Iterator<Item = &'a Obstacle>, place: Place, up: Up) -> Option<Self> {
        let targets: Vec<&Obstacle> = targets.collect();
        let bounds = targets.iter().map(|target| target.bounds).reduce(|a, b| a.merged(&b))?;
        let objects = targets.iter().map(|target| target.object).collect();
        Some(Self { objects, bounds, place, up: vector(up.axis()) })
    }

    /// Returns random starts above the region for the bodies in `drawn`, one after the other, in ascending order. All
    /// other bodies are placed at their poses in the world at the beginning, unless they are already present.
    pub(crate) fn starts(
        &self,
        bodies: &[Body],
        obstacles: &[Obstacle],
        drawn: &[usize],
        seed: u64,
        attempt: u64,
    ) -> Vec<Start> {
        let start = |(order, number): (usize, &usize)| {
            let body = &bodies[*number];
            let mut stream = Stream::new(seed, &body.name, attempt);
            let mut pose = self.draw(body, &mut stream);
            for _ in 1..MAX_DRAWS {
                let is_free = |other: &Obstacle| {
                    other.bounds.distance_to_local_point_at_least(pose.translation, body.radius)
                        || other.surface.distance(pose.translation) > body.radius
                };
                if obstacles.iter().all(is_free) {
                    break;
                }
                pose = self.draw(body, &mut stream);
            }
            (*number, Start { time: INTERVAL * order as f64, pose })
        };
        let mut starts = present_starts(bodies);
        for (number, start) in drawn.iter().enumerate().map(start) {
            starts[number] = start;
        }
        starts
    }

    fn draw(&self, body: &Body, stream: &mut Stream) -> Pose {
        let level = Vector::ONE - self.up;
        let middle = self.bounds.center();
        // A body that is wider than the region starts above the region's centre.
        let room = (self.bounds.half_extents() - Vector::splat(body.radius)).max(Vector::ZERO) * level;
        let height = self.bounds.maxs.dot(self.up) + 1.05 * body.radius;
        let (low, high) = (middle * level - room, middle * level + room);
        let [low, high] = [low, high].map(|corner| DVec3::from_array(corner.to_array()));
        let point = vector(stream.point(low, high)) + self.up * height;
        Pose::from_parts(point, stream.rotation())
    }
}

trait DistanceAtLeast {
    fn distance_to_local_point_at_least(&self, point: Vector, distance: f64) -> bool;
}

impl DistanceAtLeast for Aabb {
    fn distance_to_local_point_at_least(&self, point: Vector, distance: f64) -> bool {
        (point - point.clamp(self.mins, self.maxs)).length() >= distance
    }
}

/// Returns starts of all bodies at their poses in the world, at the beginning.
pub(crate) fn present_starts(bodies: &[Body]) -> Vec<Start> {
    bodies.iter().map(|body| Start { time: 0.0, pose: body.origin }).collect()
}
