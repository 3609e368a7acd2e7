//! Checks of settled objects, using their real meshes.

use rapier3d_f64::math::{Pose, Vector};
use rapier3d_f64::parry::bounding_volume::Aabb;

use crate::bodies::{Body, Obstacle};
use crate::request::Place;
use crate::start::Region;
use crate::surface::Placed;

/// Tolerated penetration in metres, for objects of 0.1 m and more.
const MAX_PENETRATION: f64 = 2e-4;
/// Maximum distance in metres by which a resting object can be lowered before it touches something. The gap of the
/// contact skins is smaller, but a ball between steep surfaces must be lowered by several times this gap.
const MAX_GAP: f64 = 5e-4;
/// The same distance as a fraction of the object's size, for objects with several convex parts, because the parts
/// enclose some empty space around the mesh.
const MAX_GAP_OF_PARTS: f64 = 0.02;
/// Maximum distance in metres by which an object may extend beyond the sides of its target.
const MAX_OUTSIDE: f64 = 1e-3;

/// A failed check.
pub(crate) enum Fault {
    /// Bodies penetrate by these depths; lifting the bodies may resolve this.
    Penetration { depths: Vec<f64>, text: String },
    /// Another check failed: these bodies require new random poses.
    Other { bodies: Vec<usize>, text: String },
}

/// Measurements of the judge.
#[derive(Clone, Copy, Default)]
pub(crate) struct Measures {
    /// Maximum penetration in metres.
    pub(crate) penetration: f64,
}

/// Checks of bodies at their poses among the obstacles.
pub(crate) struct Judge<'a> {
    bodies: &'a [Body],
    placed: Vec<Placed<'a>>,
    obstacles: Vec<(&'a Obstacle, Placed<'a>)>,
    up: Vector,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(bodies: &'a [Body], poses: &[Pose], obstacles: &'a [Obstacle], up: Vector) -> Self {
        let placed = bodies.iter().zip(poses).map(|(body, pose)| body.surface.at(*pose)).collect();
        let obstacles = obstacles.iter().map(|obstacle| (obstacle, obstacle.placed())).collect();
        Self { bodies, placed, obstacles, up }
    }

    /// Checks position, penetration and support.
    pub(crate) fn check(&self, region: Option<&Region>) -> Result<Measures, Fault> {
        if let Some(region) = region {
            self.check_place(region)?;
        }
        let measures = self.check_penetration()?;
        self.check_support(region)?;
        Ok(measures)
    }

    /// Checks that every body is in the region.
    fn check_place(&self, region: &Region) -> Result<(), Fault> {
        let level = Vector::ONE - self.up;
        let is_outside = |number: &usize| {
            let placed = &self.placed[*number];
            let center = Aabb::new(placed.bounds.center(), placed.bounds.center());
            let inner = if region.place == Place::Into { placed.bounds } else { center };
            let outside = (region.bounds.mins - inner.mins).max(inner.maxs - region.bounds.maxs) * level;
            let below = (region.bounds.mins - placed.bounds.mins).dot(self.up);
            outside.max_element().max(below) > MAX_OUTSIDE
        };
        self.reject((0..self.bodies.len()).filter(is_outside).collect(), "fell next to its target")
    }

    /// Returns a fault of these bodies; no fault if the list is empty.
    fn reject(&self, bodies: Vec<usize>, problem: &str) -> Result<(), Fault> {
        match bodies.first() {
            Some(&first) => {
                let text = format!("object {:?} {problem}", self.bodies[first].name);
                Err(Fault::Other { bodies, text })
            }
            None => Ok(()),
        }
    }

    fn check_penetration(&self) -> Result<Measures, Fault> {
        let mut depths = vec![0.0; self.bodies.len()];
        let (mut measures, mut worst) = (Measures::default(), None);
        let mut note = |i: usize, name: &str, depth: f64| {
            measures.penetration = measures.penetration.max(depth);
            let limit = MAX_PENETRATION * self.bodies[i].tolerance();
            if depth > limit {
                depths[i] = f64::max(depths[i], depth);
                if worst.as_ref().is_none_or(|(known, _)| depth > *known) {
                    let mm = 1e3 * depth;
                    worst =
                        Some((depth, format!("objects {:?} and {name:?} overlap by {mm:.2} mm", self.bodies[i].name)));
                }
            }
        };
        for (i, one) in self.placed.iter().enumerate() {
            for (j, other) in self.placed.iter().enumerate().take(i) {
                // Only the upper of the two objects is lifted.
                let is_upper = (one.bounds.center() - other.bounds.center()).dot(self.up) > 0.0;
                let (upper, lower) = if is_upper { (i, j) } else { (j, i) };
                note(upper, &self.bodies[lower].name, one.penetration(other));
            }
            for (obstacle, other) in &self.obstacles {
                note(i, &obstacle.name, one.penetration(other));
            }
        }
        match worst {
            Some((_, text)) => Err(Fault::Penetration { depths, text }),
            None => Ok(measures),
        }
    }

    /// Checks that every body touches something if it is lowered slightly, and that a target carries its bodies,
    /// directly or through other bodies.
    fn check_support(&self, region: Option<&Region>) -> Result<(), Fault> {
        let is_target = |obstacle: &Obstacle| match region {
            Some(region) if region.place == Place::On => region.objects.contains(&obstacle.object),
            _ => true,
        };
        let mut carriers = Vec::new();
        let mut is_carried = Vec::new();
        let mut hovering = Vec::new();
        for number in 0..self.bodies.len() {
            let lowered = self.lowered(number);
            let below = (0..self.bodies.len()).filter(|i| *i != number && lowered.touches(&self.placed[*i]));
            let below: Vec<usize> = below.collect();
            let mut touched = self.obstacles.iter().filter(|(_, other)| lowered.touches(other)).peekable();
            if below.is_empty() && touched.peek().is_none() {
                hovering.push(number);
            }
            is_carried.push(touched.any(|(obstacle, _)| is_target(obstacle)));
            carriers.push(below);
        }
        self.reject(hovering, "does not rest on anything")?;
        for _ in 0..self.bodies.len() {
            for number in 0..self.bodies.len() {
                is_carried[number] |= carriers[number].iter().any(|i| is_carried[*i]);
            }
        }
        let fallen = is_carried.iter().enumerate().filter(|(_, carried)| !**carried).map(|(i, _)| i).collect();
        self.reject(fallen, "fell next to its target")
    }

    /// The body, moved down by the distance within which a resting body must touch something.
    fn lowered(&self, number: usize) -> Placed<'a> {
        let body = &self.bodies[number];
        let parts = if body.parts.len() > 1 { MAX_GAP_OF_PARTS * body.size } else { 0.0 };
        let gap = f64::max(MAX_GAP, parts);
        let pose = self.placed[number].pose;
        body.surface.at(Pose::from_parts(pose.translation - self.up * gap, pose.rotation))
    }
}
