//! Float64 intersection of a ray and a closed triangle: edges and corners belong to the triangle. Sheared edge
//! functions with an error bound decide; if they cannot, the exact signs of [`crate::exact::predicates`] decide.

use crate::exact::predicates::RayPredicates;
use crate::node::cross;
use crate::ray::{ExactHit, INVALID_ID};
use crate::scene::ExactTriangles;

/// Factors of the error bound of a sheared edge function. The first factor is multiplied by the largest coordinate and
/// the sum of all sheared coordinates, the second by the square of the largest coordinate.
const NEAR_EDGE_ERROR: f64 = 16.0 * (f64::EPSILON / 2.0);
const SQUARED_ERROR: f64 = 256.0 * (f64::EPSILON / 2.0) * (f64::EPSILON / 2.0);

/// Maximum relative error of t and of the weights; if it is exceeded, they are computed in double-double arithmetic.
const MAX_RELATIVE_ERROR: f64 = 1.0 / (1u64 << 24) as f64;

/// The axis that follows each axis cyclically.
const NEXT_AXES: [usize; 3] = [1, 2, 0];

/// A ray with its shear along the major axis, the axis of the direction's largest component.
#[derive(Clone, Copy)]
pub struct ShearedRay {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
    pub major_axis: usize,
    pub shear: [f64; 2],
}

/// An intersection of a line and a triangle.
#[derive(Clone, Copy)]
pub struct Intersection {
    pub t: f64,
    /// The error bound of `t`.
    pub t_error: f64,
    /// Weights of the second and third corner.
    pub u: f64,
    pub v: f64,
    /// The normal of the triangle a, b, c: (b - a) x (c - a).
    pub normal: [f64; 3],
    /// The exact sign of the direction along the normal.
    pub side: i32,
}

impl Intersection {
    /// The intersection as a hit of the triangle with these ids; t is not converted.
    #[inline(always)]
    pub fn to_hit(&self, instance: u32, triangle: u32) -> ExactHit {
        let Intersection { t, u, v, normal, side, .. } = *self;
        ExactHit { t, u, v, instance, triangle, normal, side }
    }
}

/// The range of t of a ray, which ends at its closest hit so far, or at a limit if there is no hit.
#[derive(Clone, Copy)]
pub struct HitSoFar {
    pub t_min: f64,
    pub t: f64,
    /// The error bound of `t`; 0 if `t` is a limit.
    pub t_error: f64,
    /// Instance and triangle of the hit; `None` if `t` is a limit.
    pub id: Option<(u32, u32)>,
}

impl HitSoFar {
    #[inline(always)]
    pub fn new(t_min: f64, t: f64, t_error: f64, hit: &ExactHit) -> HitSoFar {
        let id = (hit.triangle != INVALID_ID).then_some((hit.instance, hit.triangle));
        HitSoFar { t_min, t, t_error, id }
    }
}

/// Sheared edge functions of a triangle with their error bound, and the t of the triangle's corners along the major
/// axis.
struct EdgeFunctions {
    values: [f64; 3],
    depths: [f64; 3],
    error: f64,
}

impl EdgeFunctions {
    /// True if the computed signs are certainly the signs of the exact values.
    #[inline(always)]
    fn are_sure(&self) -> bool {
        let [u, v, w] = self.values;
        min_f64(min_f64(u.abs(), v.abs()), w.abs()) > self.error
    }
}

impl ShearedRay {
    #[inline(always)]
    pub fn new(origin: [f64; 3], direction: [f64; 3]) -> ShearedRay {
        let [x, y, z] = direction;
        let size = [x.abs(), y.abs(), z.abs()];
        let z = if size[0] >= size[1] && size[0] >= size[2] {
            0
        } else if size[1] >= size[2] {
            1
        } else {
            2
        };
        let (x, y) = (NEXT_AXES[z], NEXT_AXES[NEXT_AXES[z]]);
        let shear = [direction[x] / direction[z], direction[y] / direction[z]];
        ShearedRay { origin, direction, major_axis: z, shear }
    }

    #[inline(always)]
    pub fn predicates(&self) -> RayPredicates {
        RayPredicates { origin: self.origin, direction: self.direction }
    }

    /// Returns a corner, sheared so that the ray is the axis `z`; the third coordinate is the corner's t along the ray.
    /// In addition, returns the corner's largest absolute coordinate relative to the ray's origin.
    #[inline(always)]
    fn sheared(&self, p: [f64; 3], z: usize) -> ([f64; 3], f64) {
        let (x, y) = (NEXT_AXES[z], NEXT_AXES[NEXT_AXES[z]]);
        let [rx, ry, rz] = [p[x] - self.origin[x], p[y] - self.origin[y], p[z] - self.origin[z]];
        let [sx, sy] = self.shear;
        ([rx - sx * rz, ry - sy * rz, rz / self.direction[z]], max_f64(max_f64(rx.abs(), ry.abs()), rz.abs()))
    }

    /// The sheared edge functions of a triangle, if the line may pass it. This is the watertight test of
    /// [`crate::traverse::packet::triangle`] in float64.
    #[inline(always)]
    fn edges(&self, corners: [[f64; 3]; 3]) -> Option<EdgeFunctions> {
        let z = self.major_axis % 3;
        let [a, b, c] = corners;
        let ((a, far_a), (b, far_b), (c, far_c)) = (self.sheared(a, z), self.sheared(b, z), self.sheared(c, z));
        let largest = max_f64(max_f64(far_a, far_b), far_c);
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let sum = a[0].abs() + a[1].abs() + b[0].abs() + b[1].abs() + c[0].abs() + c[1].abs();
        let error = largest * (NEAR_EDGE_ERROR * sum + SQUARED_ERROR * largest);
        let depths = [a[2], b[2], c[2]];
        same_sign(u, v, w, error).then_some(EdgeFunctions { values: [u, v, w], depths, error })
    }

    /// Intersection of the line with a closed triangle; `None` if the line misses the triangle or is parallel to its
    /// plane, and for a triangle without area.
    #[inline(always)]
    pub fn intersect(&self, corners: [[f64; 3]; 3]) -> Option<Intersection> {
        let edges = self.edges(corners)?;
        let side = if edges.are_sure() { self.sure_side(&edges) } else { self.passing_side(corners) };
        (side != 0).then(|| self.intersect_plane(&edges, corners, side))
    }

    /// Crossing of the line, shifted by an infinitesimal vector, with a triangle: see [`RayPredicates::crossing_side`].
    #[inline(always)]
    pub fn cross(&self, corners: [[f64; 3]; 3]) -> Option<Intersection> {
        let edges = self.edges(corners)?;
        let side = if edges.are_sure() { self.sure_side(&edges) } else { self.crossing_side(corners) };
        (side != 0).then(|| self.intersect_plane(&edges, corners, side))
    }

    #[inline(always)]
    fn sure_side(&self, edges: &EdgeFunctions) -> i32 {
        let [u, ..] = edges.values;
        if (u > 0.0) == (self.direction[self.major_axis % 3] > 0.0) { -1 } else { 1 }
    }

    #[cold]
    #[inline(never)]
    fn crossing_side(&self, corners: [[f64; 3]; 3]) -> i32 {
        self.predicates().crossing_side(corners)
    }

    /// The intersection of the line with the plane of a triangle through which the line passes.
    #[inline(always)]
    fn intersect_plane(&self, edges: &EdgeFunctions, corners: [[f64; 3]; 3], side: i32) -> Intersection {
        let ([u, v, w], [za, zb, zc]) = (edges.values, edges.depths);
        let normal = cross(corners);
        let det = u + v + w;
        // If the ray passes through an edge, rounding may make a weight negative.
        let relative = 3.0 * edges.error / det.abs();
        let sure = relative <= MAX_RELATIVE_ERROR;
        if !sure || min_f64(u * det, min_f64(v * det, w * det)) < 0.0 {
            return self.intersect_precisely(corners, normal, side);
        }
        let (wa, wb, wc) = (u / det, v / det, w / det);
        let t = wa * za + wb * zb + wc * zc;
        let farthest = max_f64(max_f64(za.abs(), zb.abs()), zc.abs());
        Intersection { t, t_error: (relative + 8.0 * f64::EPSILON) * farthest, u: wb, v: wc, normal, side }
    }

    /// The side from which the line passes through a closed triangle, by exact signs; 0 if the line misses the
    /// triangle.
    #[cold]
    #[inline(never)]
    fn passing_side(&self, [a, b, c]: [[f64; 3]; 3]) -> i32 {
        let ray = self.predicates();
        let signs = [ray.edge_sign(a, b), ray.edge_sign(b, c), ray.edge_sign(c, a)];
        i32::from(signs.contains(&1)) - i32::from(signs.contains(&-1))
    }

    #[cold]
    #[inline(never)]
    fn intersect_precisely(&self, corners: [[f64; 3]; 3], normal: [f64; 3], side: i32) -> Intersection {
        let [t, u, v] = self.predicates().intersection(corners);
        Intersection { t, t_error: f64::EPSILON * t.abs(), u, v, normal, side }
    }

    /// True if the intersection is at the ray's origin or ahead of it.
    #[inline(always)]
    fn is_ahead(&self, found: &Intersection, corners: [[f64; 3]; 3]) -> bool {
        if found.t.abs() > found.t_error { found.t > 0.0 } else { self.is_ahead_exactly(corners, found.side) }
    }

    #[cold]
    #[inline(never)]
    fn is_ahead_exactly(&self, corners: [[f64; 3]; 3], side: i32) -> bool {
        let start = self.predicates().start_sign(corners);
        start == 0 || start == side
    }

    /// True if an intersection lies in the range of t and precedes the closest hit so far, by (t, instance, triangle).
    /// If float64 cannot decide, both t are computed in double-double arithmetic, so that the decision depends only on
    /// the ray and the triangles.
    #[inline(always)]
    pub fn precedes(
        &self,
        found: &Intersection,
        corners: [[f64; 3]; 3],
        triangle: (u32, u32),
        so_far: &HitSoFar,
        triangles: &dyn ExactTriangles,
    ) -> bool {
        let HitSoFar { t_min, t, t_error, .. } = *so_far;
        if found.t - found.t_error > t + t_error {
            return false;
        }
        let starts = if t_min == 0.0 {
            self.is_ahead(found, corners)
        } else if (found.t - t_min).abs() > found.t_error {
            found.t > t_min
        } else {
            self.precise_t(corners) >= t_min
        };
        starts
            && (found.t + found.t_error < t - t_error || self.precedes_precisely(corners, triangle, so_far, triangles))
    }

    #[cold]
    #[inline(never)]
    fn precedes_precisely(
        &self,
        corners: [[f64; 3]; 3],
        triangle: (u32, u32),
        so_far: &HitSoFar,
        triangles: &dyn ExactTriangles,
    ) -> bool {
        let t = self.precise_t(corners);
        let Some((other_instance, other_triangle)) = so_far.id else { return t <= so_far.t };
        let other = self.precise_t(triangles.corners(other_instance, other_triangle));
        t < other || t == other && triangle < (other_instance, other_triangle)
    }

    /// True if a crossing is within a range of t. If `t_min` is 0, the shifted origin decides whether the crossing is
    /// ahead.
    #[inline(always)]
    pub fn is_within(&self, found: &Intersection, corners: [[f64; 3]; 3], [t_min, t_max]: [f64; 2]) -> bool {
        let starts = if (found.t - t_min).abs() > found.t_error {
            found.t > t_min
        } else if t_min == 0.0 {
            self.predicates().moved_start_sign(corners) == found.side
        } else {
            self.precise_t(corners) >= t_min
        };
        starts
            && if (found.t - t_max).abs() > found.t_error { found.t < t_max } else { self.precise_t(corners) <= t_max }
    }

    #[cold]
    #[inline(never)]
    fn precise_t(&self, corners: [[f64; 3]; 3]) -> f64 {
        self.predicates().intersection(corners)[0]
    }
}

/// True if edge functions with errors of up to `error` may all have the same sign.
#[inline(always)]
fn same_sign(u: f64, v: f64, w: f64, error: f64) -> bool {
    ((u >= -error) & (v >= -error) & (w >= -error)) | ((u <= error) & (v <= error) & (w <= error))
}

#[inline(always)]
pub fn max_f64(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn min_f64(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
