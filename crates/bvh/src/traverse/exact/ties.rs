//! Coplanar surfaces of different instances: which one a ray hits.
//!
//! Of surfaces whose planes differ by a few float32 rounding units, rounding decides which one is closer, and neighbouring
//! rays hit different ones. Therefore the rule is: of all hits within a [`tie_width`] of the closest, the instance with
//! the largest index wins. Traversal only marks rays that meet two instances at nearly the same t; the marks are generous,
//! and [`Scene::settle_ties`] applies the rule to marked rays, so that hits do not depend on the order of traversal.

use crate::limits::MACHINE_EPSILON;
use crate::node::cross;
use crate::ray::{ExactHit, ExactRay, HitFilter, INVALID_ID};
use crate::scene::instance_ranges::InstanceRanges;
use crate::scene::{ExactTriangles, Scene};
use crate::traverse;

/// Largest distance of tied planes, in rounding units of the coordinates across them.
const TIE_UNITS: f64 = 8.0;

/// Width of the window of t in which hits may tie: a fraction of t, and a fraction of the scene's size.
const RELATIVE_WIDTH: f64 = 1.0 / (1u64 << 15) as f64;
const ABSOLUTE_WIDTH: f64 = 1.0 / (1u64 << 18) as f64;

/// Window of t around a hit in which other hits may tie with it, along a direction whose largest component is at least 1.
#[derive(Clone, Copy)]
pub struct TieWindow {
    /// Width at t = 0.
    absolute: f64,
    /// True if instances share one BLAS, so that the instance of a triangle is not known during traversal.
    is_flattened: bool,
}

impl TieWindow {
    pub const EMPTY: TieWindow = TieWindow { absolute: 0.0, is_flattened: false };

    #[inline(always)]
    pub fn new(scene: &Scene) -> TieWindow {
        TieWindow { absolute: absolute_width(scene), is_flattened: scene.mesh_ranges.is_some() }
    }

    /// Width of the window at a t.
    #[inline(always)]
    pub fn width(&self, t: f64) -> f64 {
        t.abs() * RELATIVE_WIDTH + self.absolute
    }

    /// True if a new hit and the closest one so far may tie. Their t may differ by twice the width, because ties are
    /// measured from the closest of all hits.
    #[inline(always)]
    pub fn may_tie(&self, (t, (instance, triangle)): (f64, (u32, u32)), (known_t, known): (f64, &ExactHit)) -> bool {
        (t - known_t).abs() <= 2.0 * self.width(t)
            && known.triangle != INVALID_ID
            && (instance != known.instance || self.is_flattened && triangle != known.triangle)
    }
}

/// The absolute part of the window's width, in the world.
#[inline(always)]
fn absolute_width(scene: &Scene) -> f64 {
    f64::from(scene.max_abs_coord) / scene.scale * ABSOLUTE_WIDTH
}

/// Range of t behind the closest hit in which other instances tie with it: planes that differ by [`TIE_UNITS`] rounding
/// units of the coordinates across them, of the triangle and of the ray's origin. At most the width of [`TieWindow`].
fn tie_width(scene: &Scene, ray: &ExactRay, hit: &ExactHit, corners: [[f64; 3]; 3]) -> f64 {
    let (mut units, mut along) = (0.0, 0.0);
    let normal = cross(corners);
    for axis in 0..3 {
        let from = |x: f64| (x - scene.origin[axis]).abs();
        let farthest = corners.iter().fold(from(ray.origin[axis]), |farthest, corner| farthest.max(from(corner[axis])));
        units += normal[axis].abs() * farthest * f64::from(2.0 * MACHINE_EPSILON);
        along += normal[axis] * ray.direction[axis];
    }
    let largest = ray.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
    let most = hit.t.abs() * RELATIVE_WIDTH + absolute_width(scene) / largest;
    let width = TIE_UNITS * units / along.abs();
    if width < most { width } else { most }
}

/// Filter of instances other than one, or only later ones.
struct OtherInstances<'a> {
    ranges: Option<&'a InstanceRanges>,
    instance: u32,
    only_later: bool,
    /// The ray's index, for the inner filter.
    number: usize,
    inner: Option<&'a dyn HitFilter>,
}

impl HitFilter for OtherInstances<'_> {
    fn accepts_instance(&self, _: usize, instance: u32) -> bool {
        self.ranges.is_some()
            || self.is_other(instance) && self.inner.is_none_or(|inner| inner.accepts_instance(self.number, instance))
    }

    fn accepts(&self, _: usize, hit: &ExactHit) -> bool {
        self.is_other(instance_of(self.ranges, hit)) && self.inner.is_none_or(|inner| inner.accepts(self.number, hit))
    }
}

impl OtherInstances<'_> {
    fn is_other(&self, instance: u32) -> bool {
        if self.only_later { instance > self.instance } else { instance != self.instance }
    }
}

/// Instance of a hit, also in a flattened scene.
fn instance_of(ranges: Option<&InstanceRanges>, hit: &ExactHit) -> u32 {
    ranges.map_or(hit.instance, |ranges| ranges.locate(hit.triangle).0)
}

impl Scene {
    /// Applies the rule for coplanar surfaces to marked rays. Returns the rays that hit several instances within a
    /// [`tie_width`], each once, ascending.
    #[cold]
    #[inline(never)]
    pub(crate) fn settle_ties(
        &self,
        rays: &[ExactRay],
        triangles: &dyn ExactTriangles,
        filter: Option<&dyn HitFilter>,
        mut marked: Vec<u32>,
        hits: &mut [ExactHit],
    ) -> Vec<u32> {
        marked.sort_unstable();
        marked.dedup();
        marked.retain(|&number| self.settle_tie(rays, triangles, filter, number as usize, hits));
        marked
    }

    /// Applies the rule for coplanar surfaces to a ray. True if it hits several instances within a [`tie_width`].
    fn settle_tie(
        &self,
        rays: &[ExactRay],
        triangles: &dyn ExactTriangles,
        filter: Option<&dyn HitFilter>,
        number: usize,
        hits: &mut [ExactHit],
    ) -> bool {
        let (ray, first) = (&rays[number], hits[number]);
        if first.instance == INVALID_ID {
            return false;
        }
        let limit = first.t + tie_width(self, ray, &first, triangles.corners(first.instance, first.triangle));
        let ray = ExactRay { t_max: limit.min(ray.t_max), ..*ray };
        let ranges = self.mesh_ranges.as_ref();
        let find = |instance: u32, only_later: bool, any_hit: bool| {
            let others = OtherInstances { ranges, instance, only_later, number, inner: filter };
            let mut found = [first];
            traverse::filter_exact(self.dispatch, self, &[ray], triangles, &others, any_hit, &mut found, &mut vec![]);
            let [found] = found;
            (found.instance != INVALID_ID).then_some(found)
        };
        let mut is_tied = false;
        while let Some(later) = find(instance_of(ranges, &hits[number]), true, false) {
            (hits[number], is_tied) = (later, true);
        }
        is_tied || find(instance_of(ranges, &first), false, true).is_some()
    }
}
