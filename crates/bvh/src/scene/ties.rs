//! The rule for coplanar surfaces of several instances, applied to the rays that traversal has marked (see
//! [`crate::traverse::exact::ties`]).

use crate::limits::MACHINE_EPSILON;
use crate::node::cross;
use crate::ray::{ExactHit, ExactRay, HitFilter, INVALID_ID};
use crate::scene::instance_ranges::InstanceRanges;
use crate::scene::{ExactTriangles, Scene};
use crate::traverse;
use crate::traverse::exact::ties::{RELATIVE_WIDTH, absolute_width};

/// Largest distance of tied planes, in rounding units of the coordinates across them.
const TIE_UNITS: f64 = 8.0;

/// Range of t behind the closest hit in which other instances tie with it: planes that differ by [`TIE_UNITS`] rounding
/// units of the coordinates across them, of the triangle and of the ray's origin. At most the width in which traversal marks rays.
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
