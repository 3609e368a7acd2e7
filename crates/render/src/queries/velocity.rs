//! Velocities of points that belong to surfaces, at a time for each point.

use glam::{DAffine3, DVec3};
use raycam_scene::world::{ObjectMotion, WorldTime};
use raycam_scene::{Object, World};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::thread_pool::with_pool;

/// Time between the positions from which a velocity is computed, in seconds.
const STEP: f64 = 1e-5;
/// Times at which positions are computed, relative to the point's time, in units of [`STEP`].
const STENCIL: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];
/// Rounding error of a second difference of positions, relative to their largest coordinate.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Points of triangles, which move with the triangles.
#[derive(Clone, Copy, Debug)]
pub struct MovingPoints<'a> {
    /// The object of each point; -1 for a point without an object.
    pub instances: &'a [i32],
    /// The triangle of each point in the object's mesh.
    pub triangles: &'a [i32],
    /// The weights of the triangle's corners.
    pub barycentrics: &'a [[f64; 3]],
    /// The times of the points, in seconds after the world's time.
    pub times: &'a [f64],
}

impl MovingPoints<'_> {
    fn check(&self) -> Result<(), RenderError> {
        let n = self.instances.len();
        let others = [self.triangles.len(), self.barycentrics.len(), self.times.len()];
        if others != [n; 3] {
            return Err(RenderError::settings(format!(
                "triangles, barycentrics and times have {others:?} entries; expected {n}, one per point"
            )));
        }
        match self.times.iter().position(|time| !time.is_finite()) {
            None => Ok(()),
            Some(at) => {
                Err(RenderError::settings(format!("times[{at}] is {}; expected a finite number", self.times[at])))
            }
        }
    }

    /// The position of point `at` in its mesh; `None` for a point without a triangle.
    fn in_mesh(&self, at: usize, world: &World, object: &Object) -> Option<DVec3> {
        let mesh = &world.meshes[object.mesh];
        let corners = mesh.triangles.get(usize::try_from(self.triangles[at]).ok()?)?;
        let weighted = corners.iter().zip(self.barycentrics[at]);
        Some(weighted.map(|(&corner, weight)| mesh.vertices[corner as usize] * weight).sum())
    }
}

/// Velocity of each point in the world, in metres per second; 0 in worlds without a time or without motion,
/// for points without a triangle, and while the point's object appears or disappears.
///
/// Velocities are differences of exact positions up to 20 microseconds before and after each point's time. If the
/// velocity jumps within this interval, only positions on one side of the jump are used; for a point at the time of the
/// jump, the positions after the jump.
///
/// # Errors
/// [`RenderError::Settings`] for malformed points, [`RenderError::World`] if the world cannot be evaluated at a time,
/// [`RenderError::Cancelled`], and errors of `with_pool`.
pub fn velocities(
    world: &World,
    points: &MovingPoints,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<[f64; 3]>, RenderError> {
    points.check()?;
    let n = points.instances.len();
    let Some(clock) = world.time.filter(|_| world.is_animated()) else { return Ok(vec![[0.0; 3]; n]) };
    match world.object_motions() {
        Some(motions) => {
            let mut by_object = vec![None; world.objects.len()];
            motions.into_iter().for_each(|motion| by_object[motion.id] = Some(motion));
            let velocity = |at: usize| {
                let object = usize::try_from(points.instances[at]).ok();
                let Some(motion) = object.and_then(|id| by_object.get(id).copied().flatten()) else {
                    return Ok([0.0; 3]);
                };
                if at.is_multiple_of(4096) {
                    control.check()?;
                }
                keyframed_velocity(world, points, at, &motion, clock.time)
            };
            with_pool(threads, || (0..n).into_par_iter().map(velocity).collect())?
        }
        None => animated_velocities(world, clock, points, threads, control),
    }
}

/// Velocity of a point whose object follows keyframes.
fn keyframed_velocity(
    world: &World,
    points: &MovingPoints,
    at: usize,
    motion: &ObjectMotion,
    start: f64,
) -> Result<[f64; 3], RenderError> {
    let Some(local) = points.in_mesh(at, world, &world.objects[motion.id]) else { return Ok([0.0; 3]) };
    let mut places = [DVec3::ZERO; 5];
    for (place, step) in places.iter_mut().zip(STENCIL) {
        let time = start + points.times[at] + step * STEP;
        let world_from_mesh: DAffine3 = motion.world_from_mesh_at(time).map_err(RenderError::world)?;
        *place = world_from_mesh.transform_point3(local);
    }
    Ok(derivative(&places).to_array())
}

/// Velocities in a world with animated nodes, skins or morph targets; the world is evaluated around each distinct time.
fn animated_velocities(
    world: &World,
    clock: WorldTime,
    points: &MovingPoints,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<[f64; 3]>, RenderError> {
    let mut order: Vec<usize> = (0..points.instances.len()).collect();
    order.sort_by(|a, b| points.times[*a].total_cmp(&points.times[*b]));
    let runs: Vec<&[usize]> = order.chunk_by(|&a, &b| points.times[a] == points.times[b]).collect();
    let of_run = |run: &&[usize]| -> Result<Vec<DVec3>, RenderError> {
        control.check()?;
        let time = clock.time + points.times[run[0]];
        let mut places = vec![[DVec3::ZERO; 5]; run.len()];
        for (moment, step) in STENCIL.iter().enumerate() {
            let moved = world.at_time(WorldTime { time: time + step * STEP, ..clock }).map_err(RenderError::world)?;
            for (places, &at) in places.iter_mut().zip(*run) {
                let object = usize::try_from(points.instances[at]).ok().and_then(|id| moved.objects.get(id));
                let place = object.and_then(|object| {
                    Some(object.world_from_mesh.transform_point3(points.in_mesh(at, &moved, object)?))
                });
                places[moment] = place.unwrap_or(DVec3::NAN);
            }
        }
        Ok(places.iter().map(derivative).collect())
    };
    let parts: Result<Vec<Vec<DVec3>>, RenderError> = with_pool(threads, || runs.par_iter().map(of_run).collect())?;
    let mut found = vec![[0.0; 3]; order.len()];
    for (&at, velocity) in order.iter().zip(parts?.iter().flatten()) {
        // While its object appears or disappears, a point has no velocity.
        found[at] = if velocity.is_finite() { velocity.to_array() } else { [0.0; 3] };
    }
    Ok(found)
}

/// Derivative of the positions at the times of [`STENCIL`]. It is computed from three consecutive positions:
/// the middle three, the first three or the last three, whichever are on the smoothest curve (as in ENO
/// schemes: A. Harten et al. 1987).
fn derivative(places: &[DVec3; 5]) -> DVec3 {
    let [p0, p1, p2, p3, p4] = *places;
    let bend = |a: DVec3, b: DVec3, c: DVec3| (a - 2.0 * b + c).length();
    let [before, middle, after] = [bend(p0, p1, p2), bend(p1, p2, p3), bend(p2, p3, p4)];
    let rounding = ROUNDING * p2.abs().max_element();
    if middle <= 2.0 * before.min(after) + rounding {
        (p3 - p1) / (2.0 * STEP)
    } else if after <= before + rounding {
        (4.0 * p3 - 3.0 * p2 - p4) / (2.0 * STEP)
    } else {
        (3.0 * p2 - 4.0 * p1 + p0) / (2.0 * STEP)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn positions(curve: impl Fn(f64) -> DVec3) -> [DVec3; 5] {
        STENCIL.map(|step| curve(step * STEP))
    }

    #[test]
    fn derivative_of_a_circle_has_the_speed_of_rotation() {
        let omega = 30.0;
        let found = derivative(&positions(|t| 2.0 * DVec3::new((omega * t).cos(), (omega * t).sin(), 0.0)));
        assert!((found - DVec3::new(0.0, 60.0, 0.0)).length() < 1e-5);
    }

    #[test]
    fn derivative_next_to_a_jump_of_the_velocity_uses_only_its_own_side() {
        for jump in [-1.5 * STEP, -0.3 * STEP, 0.3 * STEP, 1.5 * STEP] {
            let curve = |t: f64| DVec3::new(if t < jump { 0.0 } else { 3.0 * (t - jump) }, 7.0, 0.0);
            let expected = if jump < 0.0 { 3.0 } else { 0.0 };
            assert!((derivative(&positions(curve)).x - expected).abs() < 1e-8, "jump at {jump}");
        }
    }

    #[test]
    fn derivative_at_a_jump_of_the_velocity_is_the_velocity_after_the_jump() {
        let found = derivative(&positions(|t: f64| DVec3::new(3.0 * t.max(0.0), 7.0, 0.0)));
        assert!((found.x - 3.0).abs() < 1e-8);
    }
}
