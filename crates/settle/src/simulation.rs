//! Simulation of falling bodies with rapier.

use rapier3d_f64::math::{Pose, Vector};
use rapier3d_f64::parry::bounding_volume::BoundingVolume;
use rapier3d_f64::prelude::*;

use crate::bodies::{Body, Obstacle};
use crate::request::{Physics, Request};
use crate::start::Start;

/// Time step in seconds.
const STEP: f64 = 1.0 / 240.0;
/// Number of steps between two checks for motion.
const WINDOW_STEPS: usize = 60;
/// Number of steps of the final check, one second.
const REST_STEPS: usize = 240;
/// Maximum motion in metres during the final check that counts as rest.
pub(crate) const REST_MOTION: f64 = 1e-4;
/// Skin thickness in metres around each shape, for objects of 0.1 m and more, so that contacts leave a gap instead of
/// an overlap.
const SKIN: f64 = 1e-4;
/// Natural frequency in Hz and damping ratio of contacts. They are as stiff as the solver's substeps of 1/960 s allow,
/// because the sag under a load decreases with the square of the frequency.
const CONTACT_FREQUENCY: f64 = 240.0;
const CONTACT_DAMPING: f64 = 10.0;
/// Damping rates of rotations and translations in 1/s.
const ANGULAR_DAMPING: f64 = 0.1;
const LINEAR_DAMPING: f64 = 0.02;
/// Coefficient of rolling resistance: the ratio of the force that stops a rolling ball to its weight. rapier has no
/// rolling friction. Without it, balls roll for a long time, and small errors of the contacts turn cylinders forever.
const ROLLING_RESISTANCE: f64 = 0.01;
/// Time in seconds between the last start and the beginning of the drag. The drag slows all motion, so that a ball in a
/// smooth bowl does not roll to and fro for a minute. It is off during the final check, and cannot hold an object on a
/// slope.
const DRAG_DELAY_S: f64 = 1.0;
/// Growth of the drag's damping rate per second, in 1/s².
const DRAG_GROWTH: f64 = 2.0;

/// Falling bodies among obstacles.
pub(crate) struct Simulation<'a> {
    physics: PhysicsWorld,
    bodies: &'a [Body],
    handles: Vec<Option<RigidBodyHandle>>,
    up: Vector,
    gravity: f64,
    /// Damping rate of the drag in 1/s.
    drag: f64,
    /// Number of steps so far.
    pub(crate) steps: usize,
}

impl<'a> Simulation<'a> {
    /// Simulation with the obstacles, without bodies.
    pub(crate) fn new(request: &Request, up: Vector, bodies: &'a [Body], obstacles: &[(SharedShape, Physics)]) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.gravity = up * -request.gravity;
        physics.integration_parameters = parameters(bodies);
        let tolerance = bodies.iter().map(Body::tolerance).fold(1.0, f64::min);
        for (shape, properties) in obstacles {
            physics.insert_collider(collider(shape.clone(), properties, tolerance), None);
        }
        Self { physics, bodies, handles: vec![None; bodies.len()], up, gravity: request.gravity, drag: 0.0, steps: 0 }
    }

    /// Inserts each missing body at its start time, and simulates until nothing moves during one further second,
    /// `seconds` have passed after the last start, or a body is lost because it is completely below `lowest`. Returns
    /// the motion of each body during the last second, or `None` if `stop` returns true.
    pub(crate) fn fall(
        &mut self,
        starts: &[Start],
        seconds: f64,
        lowest: Option<f64>,
        stop: &dyn Fn() -> bool,
    ) -> Option<Vec<f64>> {
        let last = starts.iter().map(|start| start.time).fold(0.0, f64::max);
        let count = ((last + seconds) / STEP).ceil() as usize;
        let mut before = self.poses();
        let mut step = 0;
        while step < count {
            let time = step as f64 * STEP;
            for (i, start) in starts.iter().enumerate() {
                if self.handles[i].is_none() && start.time <= time {
                    self.insert(i, start.pose);
                    before = self.poses();
                }
            }
            self.drag = DRAG_GROWTH * (time - last - DRAG_DELAY_S).max(0.0);
            self.step();
            step += 1;
            if step % WINDOW_STEPS == 0 {
                if stop() {
                    return None;
                }
                let motions = self.motions_since(&before);
                if lowest.is_some_and(|lowest| !self.below(lowest).is_empty()) {
                    return Some(motions);
                }
                if self.missing().is_empty() && is_rest(&motions) {
                    let motions = self.wait();
                    if is_rest(&motions) {
                        return Some(motions);
                    }
                    step += REST_STEPS;
                }
                before = self.poses();
            }
        }
        Some(self.wait())
    }

    /// Simulates one more second without drag; returns the motion of each body.
    fn wait(&mut self) -> Vec<f64> {
        self.drag = 0.0;
        let before = self.poses();
        for _ in 0..REST_STEPS {
            self.step();
        }
        self.motions_since(&before)
    }

    /// Returns the bodies that are not in the simulation.
    pub(crate) fn missing(&self) -> Vec<usize> {
        (0..self.bodies.len()).filter(|number| self.handles[*number].is_none()).collect()
    }

    /// Returns the bodies that are completely below a height.
    pub(crate) fn below(&self, height: f64) -> Vec<usize> {
        let is_below = |(number, pose): (usize, &Pose)| {
            let is_present = self.handles[number].is_some();
            (is_present && self.bodies[number].surface.at(*pose).bounds.maxs.dot(self.up) < height).then_some(number)
        };
        self.poses().iter().enumerate().filter_map(is_below).collect()
    }

    /// Removes a body, so that it can be inserted again.
    pub(crate) fn remove(&mut self, number: usize) {
        if let Some(handle) = self.handles[number].take() {
            self.physics.remove_body(handle);
        }
    }

    /// Poses of the bodies; bodies that have not started are at their poses in the world.
    pub(crate) fn poses(&self) -> Vec<Pose> {
        let pose = |(handle, body): (&Option<RigidBodyHandle>, &Body)| {
            handle.map_or(body.origin, |handle| *self.physics.bodies[handle].position())
        };
        self.handles.iter().zip(self.bodies).map(pose).collect()
    }

    /// Name of a body in messages.
    pub(crate) fn name(&self, body: usize) -> String {
        format!("object {:?}", self.bodies[body].name)
    }

    /// Moves a body up and sets its velocity to zero.
    pub(crate) fn lift(&mut self, body: usize, height: f64) {
        let up = self.up;
        let Some(handle) = self.handles[body] else { return };
        let Some(body) = self.physics.bodies.get_mut(handle) else { return };
        let pose = Pose::from_parts(body.translation() + up * height, *body.rotation());
        body.set_position(pose, true);
        body.set_linvel(Vector::ZERO, true);
        body.set_angvel(Vector::ZERO, true);
    }

    fn step(&mut self) {
        self.physics.step();
        self.steps += 1;
        for (handle, body) in self.handles.iter().zip(self.bodies) {
            let Some(moving) = handle.and_then(|handle| self.physics.bodies.get_mut(handle)) else { continue };
            // A ball of radius r with the moment of inertia 0.4 m r² loses this angular speed per step.
            let loss = ROLLING_RESISTANCE * self.gravity / (0.4 * body.radius) * STEP;
            let speed = moving.angvel().length();
            let kept = if speed > loss { 1.0 - loss / speed } else { 0.0 };
            let slowed = 1.0 / (1.0 + self.drag * STEP);
            moving.set_angvel(moving.angvel() * kept * slowed, false);
            moving.set_linvel(moving.linvel() * slowed, false);
        }
    }

    /// For each body, the maximum motion of one of its points, in metres.
    fn motions_since(&self, before: &[Pose]) -> Vec<f64> {
        let motion = |((now, then), body): ((&Pose, &Pose), &Body)| {
            let turn = (then.rotation.inverse() * now.rotation).normalize();
            // The chord of the rotation angle, computed without trigonometric functions.
            let chord = 2.0 * Vector::new(turn.x, turn.y, turn.z).length();
            (now.translation - then.translation).length() + chord * body.radius
        };
        self.poses().iter().zip(before).zip(self.bodies).map(motion).collect()
    }

    /// Inserts a body above all bodies that block its start.
    fn insert(&mut self, number: usize, mut pose: Pose) {
        let body = &self.bodies[number];
        let present = self.poses();
        let mut others: Vec<_> = present
            .iter()
            .enumerate()
            .filter(|(i, _)| self.handles[*i].is_some())
            .map(|(i, pose)| self.bodies[i].surface.at(*pose).bounds.loosened(0.05 * self.bodies[i].radius))
            .collect();
        others.sort_by(|a, b| a.maxs.dot(self.up).total_cmp(&b.maxs.dot(self.up)));
        for other in others {
            let own = body.surface.at(pose).bounds;
            if own.intersects(&other) {
                pose.translation += self.up * (other.maxs - own.mins).dot(self.up);
            }
        }
        let built = RigidBodyBuilder::dynamic()
            .pose(pose)
            .can_sleep(false)
            .allow_fast_rotation(false)
            .angular_damping(ANGULAR_DAMPING)
            .linear_damping(LINEAR_DAMPING);
        let handle = self.physics.insert_body(built);
        for part in &body.parts {
            self.physics.insert_collider(collider(part.clone(), &body.physics, body.tolerance()), Some(handle));
        }
        self.handles[number] = Some(handle);
    }
}

/// True if no body moves.
fn is_rest(motions: &[f64]) -> bool {
    motions.iter().all(|motion| *motion <= REST_MOTION)
}

fn collider(shape: SharedShape, physics: &Physics, tolerance: f64) -> ColliderBuilder {
    ColliderBuilder::new(shape)
        .density(physics.density)
        .friction(physics.friction)
        .restitution(physics.restitution)
        .contact_skin(SKIN * tolerance)
}

/// Returns rapier's parameters for objects of this size; rapier's defaults are for objects of one metre.
fn parameters(bodies: &[Body]) -> IntegrationParameters {
    let mut sizes: Vec<f64> = bodies.iter().map(|body| body.size).collect();
    sizes.sort_by(f64::total_cmp);
    let stiff = SpringCoefficients::new(CONTACT_FREQUENCY, CONTACT_DAMPING);
    IntegrationParameters {
        dt: STEP,
        contact_softness: stiff,
        static_contact_softness: stiff,
        length_unit: sizes.get(sizes.len() / 2).copied().unwrap_or(1.0),
        contact_recycling: false,
        friction_model: FrictionModel::Coulomb,
        ..IntegrationParameters::default()
    }
}

/// The shapes of the obstacles, with friction and restitution.
pub(crate) fn shapes(obstacles: &[Obstacle]) -> Vec<(SharedShape, Physics)> {
    obstacles.iter().map(|obstacle| (obstacle.shape(), obstacle.physics)).collect()
}
