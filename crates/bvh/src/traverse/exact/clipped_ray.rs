//! A float64 ray that traverses float32 trees, and the error bounds of float32.
//!
//! Every float32 quantity (ray, vertices, transform) has a bounded error. Boxes and triangles are padded by this error,
//! so that no float64 hit is missed. Hits are computed only from [`ExactTriangles::corners`]. A ray that starts far
//! away is first clipped, in float64, to the bounds of the scene, so that its error bound does not depend on the
//! distance.

use crate::limits::MACHINE_EPSILON;
use crate::node::NodeRef;
use crate::ray::{ExactHit, ExactRay};
use crate::scene::{ExactTriangles, InstanceRecord, Scene};
use crate::traverse::exact::ties::TieWindow;
use crate::traverse::exact::triangle::{HitSoFar, Intersection, ShearedRay, max_f64};

/// The relative error of a few float64 roundings.
pub const F64_ERROR: f64 = 1.0 / (1u64 << 50) as f64;

/// Factor by which float32 upper bounds are multiplied; it exceeds the rounding errors of a conversion from float64 and
/// of a sum.
const ROUNDED_UP: f32 = 1.0 + 16.0 * MACHINE_EPSILON;

/// Value of the closest hit's t that marks a ray which requires no more hits.
pub const DONE: f64 = f64::NEG_INFINITY;

/// A ray clipped to the bounds of the scene.
#[derive(Clone, Copy)]
pub struct ClippedRay {
    /// The given ray in world coordinates; its direction is scaled by a power of two so that the largest component is
    /// in 1..2.
    pub ray: ShearedRay,
    /// Power of two by which t along `ray.direction` is divided to get t along the given direction.
    pub direction_scale: f64,
    /// Clipped origin in scaled scene coordinates, at `t_offset` along the ray.
    pub local_origin: [f64; 3],
    pub t_offset: f64,
    /// The error bound of `local_origin`.
    pub origin_error: f64,
    /// The smallest valid t, along `ray.direction`.
    pub t_min: f64,
    /// The error bound of the t of `best`.
    pub t_error: f64,
    /// True if any hit is sufficient; the search ends at the first hit.
    pub any_hit: bool,
    pub ties: TieWindow,
    /// True if the ray may have hit two surfaces at equal distances.
    pub contested: bool,
    /// The closest hit so far; its `t` is measured along `ray.direction`.
    pub best: ExactHit,
}

impl ClippedRay {
    #[inline(always)]
    pub fn new(scene: &Scene, ray: &ExactRay) -> Option<ClippedRay> {
        let steepest = ray.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        let finite = ray.origin.iter().chain(&ray.direction).all(|x| x.is_finite());
        // This is false if a limit is NaN.
        let ordered = ray.t_min <= ray.t_max;
        // This check also excludes subnormal directions, whose scaling would not be exact.
        if !finite || steepest < f64::MIN_POSITIVE || !ordered || scene.root == NodeRef::EMPTY {
            return None;
        }
        let power = f64::from_bits(steepest.to_bits() & (0x7ff << 52));
        let (origin, [x, y, z], fraction) = (ray.origin, ray.direction, 1.0 / power);
        let direction = [x * fraction, y * fraction, z * fraction];
        let (world, scale) = (scene.origin, scene.scale);
        let far = [(origin[0] - world[0]) * scale, (origin[1] - world[1]) * scale, (origin[2] - world[2]) * scale];
        // In scaled scene coordinates, the direction is `scale` times as long, so t does not change.
        let along = [direction[0] * scale, direction[1] * scale, direction[2] * scale];
        let fat = f64::from(scene.box_padding(scene.max_abs_coord)) * 2.0 + 1e-5 * f64::from(scene.max_abs_coord);
        let (mut enter, mut leave) = (ray.t_min * power, ray.t_max * power);
        let offset = (0..3).fold(0.0, |m: f64, a| m.max(far[a].abs()).max((world[a] * scale).abs()));
        let drift = F64_ERROR * (offset + f64::from(scene.max_abs_coord));
        for axis in 0..3 {
            let lower = f64::from(scene.bounds.lower[axis]) - fat - drift - far[axis];
            let upper = f64::from(scene.bounds.upper[axis]) + fat + drift - far[axis];
            if along[axis] == 0.0 {
                if lower > 0.0 || upper < 0.0 {
                    return None;
                }
                continue;
            }
            let reciprocal = 1.0 / along[axis];
            let (a, b) = (lower * reciprocal, upper * reciprocal);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // `enter` has a rounding error, which the padding of the bounds exceeds.
        if enter > leave {
            return None;
        }
        let start = [far[0] + enter * along[0], far[1] + enter * along[1], far[2] + enter * along[2]];
        let best = ExactHit { t: ray.t_max * power, ..ExactHit::MISS };
        Some(ClippedRay {
            ray: ShearedRay::new(ray.origin, direction),
            direction_scale: power,
            local_origin: start,
            t_offset: enter,
            origin_error: drift,
            t_min: ray.t_min * power,
            t_error: 0.0,
            any_hit: false,
            ties: TieWindow::new(scene),
            contested: false,
            best,
        })
    }

    /// True if the ray needs no more hits.
    #[inline(always)]
    pub fn is_done(&self) -> bool {
        self.best.t == DONE
    }

    /// The t up to which boxes must be visited, counted from `local_origin`.
    #[inline(always)]
    pub fn t_max_f32(&self) -> f32 {
        t_max_f32(self.best.t, self.t_offset, &self.ties)
    }

    /// The closest hit, with t in units of the given direction's length.
    pub fn to_hit(&self) -> ExactHit {
        if self.best.triangle == crate::INVALID_ID {
            return ExactHit::MISS;
        }
        ExactHit { t: self.best.t / self.direction_scale, ..self.best }
    }

    /// Bounds of the t of the closest hit so far, or of the end of the ray, counted from `t_offset`.
    #[inline(always)]
    pub fn best_t_f32(&self) -> [f32; 2] {
        let error = self.t_error + F64_ERROR * self.t_offset.abs();
        let t = self.best.t - self.t_offset;
        [((t - error) as f32).next_down(), ((t + error) as f32).next_up()]
    }

    /// Width of the range of t around a hit in which other hits may tie with it. The arguments are bounds of the hit's
    /// t, counted from `t_offset`.
    #[inline(always)]
    pub fn tie_width_f32(&self, [least, greatest]: [f32; 2]) -> f32 {
        if !self.ties.may_exist {
            return 0.0;
        }
        let t = max_f64((f64::from(least) + self.t_offset).abs(), (f64::from(greatest) + self.t_offset).abs());
        (self.ties.width(t) * 2.0) as f32 * ROUNDED_UP
    }

    /// Keeps an intersection with a triangle if the filter accepts it and it is the closest so far; returns true if it
    /// is kept.
    #[inline(always)]
    pub fn keep_closer(
        &mut self,
        found: &Intersection,
        (instance, triangle): (u32, u32),
        corners: [[f64; 3]; 3],
        triangles: &dyn ExactTriangles,
        accepts: impl Fn(&ExactHit) -> bool,
    ) -> bool {
        let so_far = HitSoFar::new(self.t_min, self.best.t, self.t_error, &self.best);
        self.contested |= self.ties.may_tie((found.t, (instance, triangle)), (so_far.t, &self.best));
        if !self.ray.precedes(found, corners, (instance, triangle), &so_far, triangles) {
            return false;
        }
        let t = if self.any_hit { DONE } else { found.t };
        let hit = ExactHit { t, ..found.to_hit(instance, triangle) };
        let is_accepted = accepts(&hit);
        if is_accepted {
            self.t_error = if self.any_hit { 0.0 } else { found.t_error };
            self.best = hit;
        }
        is_accepted
    }
}

/// The t, counted from `t_offset`, up to which boxes must be visited to find all hits before `t` and all hits that tie
/// with a hit at `t`.
#[inline(always)]
pub fn t_max_f32(t: f64, forward: f64, ties: &TieWindow) -> f32 {
    if t == DONE {
        return -1.0;
    }
    let limit = t + ties.width(t) - forward + F64_ERROR * forward.abs();
    (limit as f32).next_up().max(0.0)
}

/// Transforms a ray to tree coordinates of the mesh.
#[inline(always)]
pub fn to_mesh_space(
    scene: &Scene,
    instance_record: &InstanceRecord,
    (start, [x, y, z]): ([f64; 3], [f64; 3]),
) -> ([f32; 3], [f32; 3]) {
    let along = [x * scene.scale, y * scene.scale, z * scene.scale];
    let (mut origin, mut direction) = ([0.0; 3], [0.0; 3]);
    for (row, [a, b, c, d]) in instance_record.mesh_from_scene.iter().enumerate() {
        let [a, b, c, d] = [f64::from(*a), f64::from(*b), f64::from(*c), f64::from(*d)];
        origin[row] = (a * start[0] + b * start[1] + c * start[2] + d) as f32;
        direction[row] = (a * along[0] + b * along[1] + c * along[2]) as f32;
    }
    (origin, direction)
}

/// The largest absolute coordinate.
pub fn max_abs(point: [f32; 3]) -> f32 {
    point[0].abs().max(point[1].abs()).max(point[2].abs())
}

/// Error bound of float32 coordinates in the mesh, for rays within `distance` of the scene's origin. The rounding
/// errors of ray, matrix and vertices depend on the sizes of the scene and of the mesh.
pub fn coordinate_error(scene: &Scene, instance_record: &InstanceRecord, distance: f32, drift: f64) -> f32 {
    instance_record.max_scale * (32.0 * MACHINE_EPSILON * (distance + scene.max_abs_coord) + drift as f32 * 2.0)
        + 8.0 * MACHINE_EPSILON * instance_record.bvh.max_abs_coord()
}
