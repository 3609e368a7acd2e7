//! Objects that fall and come to rest.

use glam::DMat4;
use pyo3::prelude::*;
use raycam_render::RenderError;
use raycam_settle::{Physics, Place, Request, SettleError, Settled, Target, overlaps, settle};

use crate::error::{OrRaise, world_error};
use crate::interruptible::run_interruptible;
use crate::world::state::World;

/// Physical properties of a body: density, friction, restitution and the number of convex parts.
type PhysicsParts = (f64, f64, f64, u32);
/// Report about settled bodies: numbers of attempts and steps, remaining penetration and remaining motion.
type ReportParts = (usize, usize, f64, f64);

fn properties((density, friction, restitution, parts): PhysicsParts) -> Physics {
    Physics { density, friction, restitution, parts }
}

/// The report, and the world_from_mesh of each moved object.
type SettledParts = (ReportParts, Vec<[[f64; 4]; 4]>);
/// Code and message of an error while bodies settle.
type Fault = (&'static str, String);

/// Returns the moved objects at rest, or the error's code and message. `target` contains objects, and a flag: if true,
/// bodies must end completely within the sides of these objects; otherwise, the bodies' centres must end above them.
#[pyfunction]
#[pyo3(signature = (world, moving, physics, target, seed, seconds, gravity))]
pub(crate) fn world_settle(
    world: &Bound<'_, World>,
    moving: Vec<usize>,
    physics: Vec<(usize, PhysicsParts)>,
    target: Option<(Vec<usize>, bool)>,
    seed: u64,
    seconds: f64,
    gravity: f64,
) -> PyResult<(Option<SettledParts>, Option<Fault>)> {
    let inner = world.get().snapshot();
    let request = Request {
        moving,
        physics: physics.into_iter().map(|(object, parts)| (object, properties(parts))).collect(),
        target: target
            .map(|(objects, is_into)| Target { objects, place: if is_into { Place::Into } else { Place::On } }),
        seed,
        seconds,
        gravity,
    };
    for &object in request.moving.iter().chain(request.target.iter().flat_map(|target| &target.objects)) {
        inner.check_object(object).or_raise()?;
    }
    let settled =
        run_interruptible(world.py(), None, |control| match settle(&inner, &request, &|| control.is_cancelled()) {
            Err(SettleError::Cancelled) => Err(RenderError::Cancelled),
            result => Ok(result),
        })?;
    let rows = |transform: &glam::DAffine3| DMat4::from(*transform).transpose().to_cols_array_2d();
    Ok(match settled {
        Ok(Settled { transforms, report }) => {
            let figures = (report.attempts, report.steps, report.penetration, report.motion);
            (Some((figures, transforms.iter().map(rows).collect())), None)
        }
        Err(error) => (None, Some((error.code(), error.to_string()))),
    })
}

/// Returns pairs of visible objects of different groups that overlap by more than `limit` metres, with the depth.
#[pyfunction]
pub(crate) fn world_overlaps(
    world: &Bound<'_, World>,
    groups: Vec<usize>,
    limit: f64,
) -> PyResult<Vec<(usize, usize, f64)>> {
    let inner = world.get().snapshot();
    if groups.len() != inner.objects.len() {
        return Err(world_error(format!(
            "groups: expected one number per object ({}), got {}",
            inner.objects.len(),
            groups.len()
        )));
    }
    let found = run_interruptible(world.py(), None, |_| Ok(overlaps(&inner, &groups, limit)))?;
    Ok(found.iter().map(|overlap| (overlap.objects[0], overlap.objects[1], overlap.depth)).collect())
}
