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

/// Maximum number of random draws before settling fails.
const MAX_ATTEMPTS: usize = 20;
/// Every draw whose number is a multiple of this interval draws the poses of all bodies; all other draws are for
/// rejected bodies only.
const FULL_DRAW_INTERVAL: usize = 10;
/// Maximum number of times that penetrating bodies are lifted and dropped again, for each draw.
const MAX_LIFTS: usize = 3;

/// The result: objects at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// world_from_mesh of each moving object, in the request's order.
    pub transforms: Vec<DAffine3>,
    /// Measurements and counts of the accepted result.
    pub report: Report,
}

/// Measurements and counts of the accepted result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Number of draws: the first draw of all bodies, and further draws of rejected bodies.
    pub attempts: usize,
    /// Number of steps of 1/240 s since the poses of all bodies were drawn.
    pub steps: usize,
    /// Maximum depth in metres to which objects penetrate each other.
    pub penetration: f64,
    /// Maximum motion in metres of any point of an object during one further second.
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
    let judge =
        |simulation: &Simulation<'_>| Judge::new(&bodies, &simulation.poses(), &obstacles, up).check(region.as_ref());
    let lowest = region.as_ref().map(|region| region.bounds.mins.dot(up));
    let mut simulation = Simulation::new(request, up, &bodies, &shapes);
    let (mut rejected, mut fault): (Vec<usize>, String) = ((0..bodies.len()).collect(), String::new());
    for attempt in 0..MAX_ATTEMPTS {
        if attempt > 0 && attempt % FULL_DRAW_INTERVAL == 0 {
            simulation = Simulation::new(request, up, &bodies, &shapes);
            rejected = (0..bodies.len()).collect();
        }
        let starts = match &region {
            Some(region) => region.starts(&bodies, &obstacles, &rejected, request.seed, attempt as u64),
            None if attempt > 0 => break,
            None => present_starts(&bodies),
        };
        match try_once(&mut simulation, &starts, request.seconds, lowest, stop, judge)? {
            Ok((measures, motion)) => {
                let report = Report {
                    attempts: attempt + 1,
                    steps: simulation.steps,
                    penetration: measures.penetration,
                    motion,
                };
                return Ok(Settled { transforms: transforms(world, &bodies, &simulation), report });
            }
            Err(Rejection { bodies, text }) => {
                bodies.iter().for_each(|&number| simulation.remove(number));
                (rejected, fault) = (bodies, text);
            }
        }
    }
    let attempts = if region.is_some() { MAX_ATTEMPTS } else { 1 };
    Err(SettleError::NotSettled { message: fault, attempts })
}

/// Bodies whose poses must be drawn again.
struct Rejection {
    bodies: Vec<usize>,
    text: String,
}

/// Drops the bodies from their starting poses; if bodies penetrate each other, lifts these bodies and simulates again.
/// Returns the measurements with the motion in another second, or the rejected bodies.
fn try_once<'a>(
    simulation: &mut Simulation<'a>,
    starts: &[Start],
    seconds: f64,
    lowest: Option<f64>,
    stop: &dyn Fn() -> bool,
    judge: impl Fn(&Simulation<'a>) -> std::result::Result<Measures, Fault>,
) -> Result<std::result::Result<(Measures, f64), Rejection>> {
    let mut rejection = Rejection { bodies: Vec::new(), text: String::new() };
    for _ in 0..=MAX_LIFTS {
        let motions = simulation.fall(starts, seconds, lowest, stop).ok_or(SettleError::Cancelled)?;
        let mut lost = lowest.map(|lowest| simulation.below(lowest)).unwrap_or_default();
        if let Some(&first) = lost.first() {
            let text = format!("{} fell next to its target", simulation.name(first));
            lost.extend(simulation.missing());
            return Ok(Err(Rejection { bodies: lost, text }));
        }
        let moving: Vec<usize> = (0..motions.len()).filter(|i| motions[*i] > REST_MOTION).collect();
        let motion = motions.iter().copied().fold(0.0, f64::max);
        if let Some(&worst) = moving.iter().max_by(|a, b| motions[**a].total_cmp(&motions[**b])) {
            let text = format!("{} still moves by {:.2} mm per second", simulation.name(worst), 1e3 * motion);
            return Ok(Err(Rejection { bodies: moving, text }));
        }
        match judge(simulation) {
            Ok(measures) => return Ok(Ok((measures, motion))),
            Err(Fault::Other { bodies, text }) => return Ok(Err(Rejection { bodies, text })),
            Err(Fault::Penetration { depths, text }) => {
                let deep: Vec<usize> = (0..depths.len()).filter(|i| depths[*i] > 0.0).collect();
                deep.iter().for_each(|&number| simulation.lift(number, depths[number]));
                rejection = Rejection { bodies: deep, text };
            }
        }
    }
    Ok(Err(rejection))
}

/// Returns world_from_mesh of each body.
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
