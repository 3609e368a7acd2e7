//! The rule for coplanar surfaces of several instances, applied to the rays that traversal has marked (see
//! [`crate::traverse::exact::ties`]).

use crate::limits::MACHINE_EPSILON;
use crate::node::cross;
use crate::ray::{ExactHit, ExactRay, HitFilter, INVALID_ID, Tie};
use crate::scene::instance_ranges::InstanceRanges;
use crate::scene::{ExactTriangles, Scene};
use crate::traverse;
use crate::traverse::exact::ties::{MarkedHits, RELATIVE_WIDTH, absolute_width};

/// Largest distance between planes that tie, in float32 rounding units of the coordinates along the planes' normal.
const TIE_UNITS: f64 = 8.0;

/// Sine of the largest angle between planes that count as coplanar: rounding to float32 tilts small triangles.
const MAX_SINE: f64 = 1.0 / (1u64 << 10) as f64;

/// Smallest barycentric weight of a hit that is not at an edge. If the weight is smaller, surfaces may only touch, as a
/// box touches the floor at its bottom edges.
const MIN_WEIGHT: f64 = 1.0 / (1u64 << 16) as f64;

/// Range of t behind the closest hit in which hits of other instances tie with it. Along the normal, the planes may
/// differ by [`TIE_UNITS`] rounding units of the coordinates of the triangle and of the ray's origin. This range is at
/// most as wide as the range within which traversal marks rays.
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

/// Filter that accepts all instances except `instance` or, if `only_later` is true, only instances with larger indices.
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

/// Index of the instance of a hit, for flattened scenes too.
fn instance_of(ranges: Option<&InstanceRanges>, hit: &ExactHit) -> u32 {
    ranges.map_or(hit.instance, |ranges| ranges.locate(hit.triangle).0)
}

/// True if the triangles of two hits are coplanar and neither is hit at an edge.
fn are_coplanar_inside(a: &ExactHit, b: &ExactHit) -> bool {
    let is_inside = |hit: &ExactHit| hit.u.min(hit.v).min(1.0 - hit.u - hit.v) > MIN_WEIGHT;
    let square = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
    let across = cross([[0.0; 3], a.normal, b.normal]);
    is_inside(a) && is_inside(b) && square(across) <= MAX_SINE * MAX_SINE * square(a.normal) * square(b.normal)
}

impl Scene {
    /// Applies the rule for coplanar surfaces to marked rays. Returns the ties of rays that hit several instances
    /// within a [`tie_width`], in the order of the rays.
    #[cold]
    #[inline(never)]
    pub(crate) fn settle_ties(
        &self,
        rays: &[ExactRay],
        triangles: &dyn ExactTriangles,
        filter: Option<&dyn HitFilter>,
        mut marked: Vec<u32>,
        hits: &mut [ExactHit],
    ) -> Vec<Tie> {
        marked.sort_unstable();
        marked.dedup();
        marked.into_iter().filter_map(|ray| self.settle_tie(rays, triangles, filter, ray, hits)).collect()
    }

    /// Applies the rule for coplanar surfaces to a ray. Returns `None` unless the ray hits several instances within a
    /// [`tie_width`].
    fn settle_tie(
        &self,
        rays: &[ExactRay],
        triangles: &dyn ExactTriangles,
        filter: Option<&dyn HitFilter>,
        ray_id: u32,
        hits: &mut [ExactHit],
    ) -> Option<Tie> {
        let number = ray_id as usize;
        let (ray, first) = (&rays[number], hits[number]);
        if first.instance == INVALID_ID {
            return None;
        }
        let limit = first.t + tie_width(self, ray, &first, triangles.corners(first.instance, first.triangle));
        let ray = ExactRay { t_max: limit.min(ray.t_max), ..*ray };
        let ranges = self.mesh_ranges.as_ref();
        let find = |instance: u32, only_later: bool| {
            let others = OtherInstances { ranges, instance, only_later, number, inner: filter };
            let mut found = [first];
            let answers = MarkedHits { hits: &mut found, marked: &mut vec![] };
            traverse::filter_exact(self.dispatch, self, &[ray], triangles, &others, false, answers);
            let [found] = found;
            (found.instance != INVALID_ID).then_some(found)
        };
        let mut others = vec![];
        while let Some(later) = find(instance_of(ranges, &hits[number]), true) {
            hits[number] = later;
            others.push(later);
        }
        if others.is_empty() {
            others.extend(find(instance_of(ranges, &first), false));
        }
        let is_coplanar = others.iter().any(|other| are_coplanar_inside(&first, other));
        (!others.is_empty()).then_some(Tie { ray: ray_id, is_coplanar })
    }
}
