//! Simulation in attempts until the judge accepts the result.

use glam::DAffine3;
use raycam_scene::World;

use crate::bodies::{Body, Obstacle};
use crate::convert::{affine, vector};
use crate::error::{Result, SettleError};
use crate::judge::{Fault, Judge, Measures};
use crate::request::Request;
use crate::simulation::{REST_MOTION, Simulation, shapes};
use crate::start::{Region, Start, present_starts};

/// Maximum number of random draws of all poses before settling fails.
const MAX_ATTEMPTS: usize = 10;
/// Maximum number of times that penetrating bodies are lifted and dropped again, for each draw.
const MAX_LIFTS: usize = 3;

/// Objects at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// world_from_mesh of each moving object, in the request's order.
    pub transforms: Vec<DAffine3>,
    /// Results of the checks.
    pub report: Report,
}

/// Results of the checks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Number of draws that were required.
    pub attempts: usize,
    /// Number of steps of 1/240 s in the last attempt.
    pub steps: usize,
    /// Maximum penetration in metres.
    pub penetration: f64,
    /// Maximum motion of a point, in metres, during one more second.
    pub motion: f64,
}

/// Simulates falling objects of a world until they are at rest. `stop` is called several times per simulated second; if
/// it returns true, the work ends.
///
/// # Errors
/// [`SettleError`] for numbers out of range, objects without volume, no attempt that passes the checks, or a cancelled
/// call.
pub fn settle(world: &World, request: &Request, stop: &dyn Fn() -> bool) -> Result<Settled> {
    check(request)?;
    let moving = |&object: &usize| Body::new(world, object, request.physics_of(object));
    let bodies: Vec<Body> = request.moving.iter().map(moving).collect::<Result<_>>()?;
    let fixed = (0..world.objects.len()).filter(|i| world.objects[*i].visible && !request.moving.contains(i));
    let obstacles: Vec<Obstacle> = fixed.filter_map(|i| Obstacle::new(world, i, request.physics_of(i))).collect();
    let region = request.target.as_ref().and_then(|target| {
        let targets = obstacles.iter().filter(|obstacle| target.objects.contains(&obstacle.object));
        Region::new(targets, target.place, world.up)
    });
    let shapes = shapes(&obstacles);
    let up = vector(world.up.axis());
    let mut fault = String::new();
    for attempt in 0..MAX_ATTEMPTS {
        let starts = match &region {
            Some(region) => region.starts(&bodies, &obstacles, request.seed, attempt as u64),
            None if attempt > 0 => break,
            None => present_starts(&bodies),
        };
        let mut simulation = Simulation::new(request, up, &bodies, &shapes);
        match try_once(&mut simulation, &starts, request.seconds, stop, |simulation| {
            Judge::new(&bodies, &simulation.poses(), &obstacles, up).check(region.as_ref())
        })? {
            Ok((measures, motion)) => {
                let report = Report {
                    attempts: attempt + 1,
                    steps: simulation.steps,
                    penetration: measures.penetration,
                    motion,
                };
                return Ok(Settled { transforms: transforms(world, &bodies, &simulation), report });
            }
            Err(text) => fault = text,
        }
    }
    let attempts = if region.is_some() { MAX_ATTEMPTS } else { 1 };
    Err(SettleError::NotSettled { message: fault, attempts })
}

/// Drops the bodies from their starts, and again after lifting those that penetrate. Returns the measurements, or the
/// text of the failed check.
fn try_once<'a>(
    simulation: &mut Simulation<'a>,
    starts: &[Start],
    seconds: f64,
    stop: &dyn Fn() -> bool,
    judge: impl Fn(&Simulation<'a>) -> std::result::Result<Measures, Fault>,
) -> Result<std::result::Result<(Measures, f64), String>> {
    let mut fault = String::new();
    for _ in 0..=MAX_LIFTS {
        simulation.fall(starts, seconds, stop).ok_or(SettleError::Cancelled)?;
        let (motion, body) = simulation.wait();
        if motion > REST_MOTION {
            let mm = 1e3 * motion;
            return Ok(Err(format!("{} still moves by {mm:.2} mm in a second", simulation.name(body))));
        }
        match judge(simulation) {
            Ok(measures) => return Ok(Ok((measures, motion))),
            Err(Fault::Other(text)) => return Ok(Err(text)),
            Err(Fault::Penetration { depths, text }) => {
                for (i, depth) in depths.iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
                    simulation.lift(i, *depth);
                }
                fault = text;
            }
        }
    }
    Ok(Err(fault))
}

/// world_from_mesh of each body.
fn transforms(world: &World, bodies: &[Body], simulation: &Simulation<'_>) -> Vec<DAffine3> {
    let transform = |(body, pose): (&Body, &rapier3d_f64::math::Pose)| {
        let before = world.objects[body.object].world_from_mesh;
        affine(pose) * (affine(&body.origin).inverse() * before)
    };
    bodies.iter().zip(&simulation.poses()).map(transform).collect()
}

/// Checks the numbers of a request.
fn check(request: &Request) -> Result<()> {
    let positive = |name: &str, value: f64| match value.is_finite() && value > 0.0 {
        true => Ok(()),
        false => Err(SettleError::OutOfRange(format!("{name} must be a finite number above 0, got {value}"))),
    };
    positive("seconds", request.seconds)?;
    positive("gravity", request.gravity)?;
    for (_, physics) in &request.physics {
        positive("density", physics.density)?;
        if !(1..=128).contains(&physics.parts) {
            return Err(SettleError::OutOfRange(format!("parts must be between 1 and 128, got {}", physics.parts)));
        }
        for (name, value, high) in [("friction", physics.friction, f64::MAX), ("restitution", physics.restitution, 1.0)]
        {
            if !(0.0..=high).contains(&value) {
                let range = if high == 1.0 { "between 0 and 1" } else { "at least 0" };
                return Err(SettleError::OutOfRange(format!("{name} must be {range}, got {value}")));
            }
        }
    }
    Ok(())
}
