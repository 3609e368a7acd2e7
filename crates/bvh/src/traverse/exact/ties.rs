//! The rule that decides which of several coplanar surfaces of different instances a ray hits.
//!
//! If the planes of several surfaces differ by a few float32 rounding units, rounding decides which surface is closer,
//! and neighbouring rays hit different surfaces. Therefore the rule is: of all hits within a few rounding units of the
//! closest hit, the ray hits the instance with the largest index. Traversal only marks rays that meet two instances at
//! nearly the same t, and may mark more rays than necessary. [`Scene::settle_ties`] applies the rule to marked rays.
//! Hits therefore do not depend on the order of traversal.

use crate::ray::{ExactHit, INVALID_ID};
use crate::scene::Scene;

/// Width of the range of t in which hits may tie: a fraction of t plus a fraction of the scene's size.
pub const RELATIVE_WIDTH: f64 = 1.0 / (1u64 << 15) as f64;
const ABSOLUTE_WIDTH: f64 = 1.0 / (1u64 << 18) as f64;

/// Hits of exact rays, and the rays that may have hit coplanar surfaces of several instances.
pub struct MarkedHits<'a> {
    pub hits: &'a mut [ExactHit],
    pub marked: &'a mut Vec<u32>,
}

/// Window of t around a hit in which other hits may tie with it, along a direction whose largest component is at least
/// 1.
#[derive(Clone, Copy)]
pub struct TieWindow {
    /// Width of the window at t = 0.
    absolute: f64,
    /// True if hits can tie; false in a scene with one instance.
    pub may_exist: bool,
    /// True if instances share one BLAS, so that the instance of a triangle is not known during traversal.
    is_flattened: bool,
}

impl TieWindow {
    pub const EMPTY: TieWindow = TieWindow { absolute: 0.0, may_exist: false, is_flattened: false };

    #[inline(always)]
    pub fn new(scene: &Scene) -> TieWindow {
        let is_flattened = scene.mesh_ranges.is_some();
        TieWindow {
            absolute: absolute_width(scene),
            may_exist: is_flattened || scene.instances.len() > 1,
            is_flattened,
        }
    }

    /// Width of the window around a hit at `t`.
    #[inline(always)]
    pub fn width(&self, t: f64) -> f64 {
        t.abs() * RELATIVE_WIDTH + self.absolute
    }

    /// True if a new hit may tie with the closest hit so far. Their t may differ by twice the width, because ties are
    /// measured from the closest of all hits.
    #[inline(always)]
    pub fn may_tie(&self, (t, (instance, triangle)): (f64, (u32, u32)), (known_t, known): (f64, &ExactHit)) -> bool {
        (t - known_t).abs() <= 2.0 * self.width(t)
            && known.triangle != INVALID_ID
            && (instance != known.instance || self.is_flattened && triangle != known.triangle)
    }
}

/// The width of the window at t = 0, as a length in world units.
#[inline(always)]
pub fn absolute_width(scene: &Scene) -> f64 {
    f64::from(scene.max_abs_coord) / scene.scale * ABSOLUTE_WIDTH
}
