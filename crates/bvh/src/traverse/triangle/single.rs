//! Intersection of one ray and the triangles of a leaf by the test of [`crate::traverse::packet::triangle`]: all edges
//! at once, then the few remaining triangles one by one.

use std::hint::select_unpredictable;

use crate::node::{LeafNode, cross};
use crate::simd::{Isa, Vector};
use crate::traverse::trav_ray::TravRay;
use crate::traverse::triangle::edge::{corner_lanes, edge_functions_f64, indices, inside_mask, vertices_minus};

/// The properties of a ray that triangle tests require; implemented for single rays and for rays in a packet.
pub trait RayView: Copy {
    /// See [`TravRay::axes`].
    fn axes(&self) -> [usize; 3];
    fn origin(&self, axis: usize) -> f32;
    fn shear(&self, k: usize) -> f32;
    fn reciprocal(&self, axis: usize) -> f32;
    /// The padded t at which the slab of a bound is entered.
    fn t_near(&self, axis: usize, bound: f32) -> f32;
    /// The padded t at which the slab of a bound is left.
    fn t_far(&self, axis: usize, bound: f32) -> f32;
}

impl RayView for &TravRay {
    #[inline(always)]
    fn axes(&self) -> [usize; 3] {
        let [x, y, z, _] = self.axes;
        [x as usize, y as usize, z as usize]
    }
    #[inline(always)]
    fn origin(&self, axis: usize) -> f32 {
        self.origin[axis]
    }
    #[inline(always)]
    fn shear(&self, k: usize) -> f32 {
        self.shear[k]
    }
    #[inline(always)]
    fn reciprocal(&self, axis: usize) -> f32 {
        self.reciprocal[axis]
    }
    #[inline(always)]
    fn t_near(&self, axis: usize, bound: f32) -> f32 {
        self.near.t_at(axis, bound)
    }
    #[inline(always)]
    fn t_far(&self, axis: usize, bound: f32) -> f32 {
        self.far.t_at(axis, bound)
    }
}

/// The vertices of a leaf in x and y, sheared so that the ray is the z axis.
#[inline(always)]
pub fn shear_vertices<I: Isa>(leaf: &LeafNode, ray: impl RayView) -> [I::F32x16; 2] {
    let [kx, ky, kz] = ray.axes();
    let rx = vertices_minus::<I>(leaf, kx, ray.origin(kx));
    let ry = vertices_minus::<I>(leaf, ky, ray.origin(ky));
    let rz = vertices_minus::<I>(leaf, kz, ray.origin(kz));
    let px = rx.sub(I::F32x16::splat(ray.shear(0)).mul(rz));
    let py = ry.sub(I::F32x16::splat(ray.shear(1)).mul(rz));
    [px, py]
}

/// Bit i: the ray passes the edge test of triangle i, or is so close that [`intersect_triangle`] decides.
#[inline(always)]
pub fn edge_test<I: Isa>(leaf: &LeafNode, ray: impl RayView) -> u32 {
    let [px, py] = shear_vertices::<I>(leaf, ray);
    inside_mask::<I>(px, py, leaf, &indices::<I>(leaf)) & leaf.non_degenerate
}

/// The intersection of a ray and a triangle.
#[derive(Clone, Copy, Debug)]
pub struct TriangleIntersection {
    pub t: f32,
    pub u: f32,
    pub v: f32,
}

/// Intersects triangle `k` of the leaf, which passed the [`edge_test`], at a t of `0..=t_max`.
#[inline(always)]
pub fn intersect_triangle(leaf: &LeafNode, k: usize, ray: impl RayView, t_max: f32) -> Option<TriangleIntersection> {
    intersect::<_, false>(leaf, k, ray, t_max)
}

/// Intersects a sliver. This is a separate function, to keep the common path small.
#[cold]
#[inline(never)]
fn intersect_sliver(leaf: &LeafNode, k: usize, ray: impl RayView, t_max: f32) -> Option<TriangleIntersection> {
    intersect::<_, true>(leaf, k, ray, t_max)
}

#[inline(always)]
fn intersect<L: RayView, const SLIVER: bool>(
    leaf: &LeafNode,
    k: usize,
    ray: L,
    t_max: f32,
) -> Option<TriangleIntersection> {
    let corner = corner_lanes(leaf, k);
    let [kx, ky, kz] = ray.axes();
    let at = |axis: usize| corner.map(|lane| leaf.vertices[axis][lane]);
    let along = |axis: usize, at: [f32; 3]| at.map(|x| x - ray.origin(axis));
    let (px, py) = (at(kx), at(ky));
    let (x, y, z) = (along(kx, px), along(ky, py), along(kz, at(kz)));
    // The interval of t in which the ray is inside the triangle's own bounds, see SLAB_PAD.
    let ends = |axis: usize, [a, b, c]: [f32; 3]| {
        let (lower, upper) = (min_f32(min_f32(a, b), c), max_f32(max_f32(a, b), c));
        let backwards = ray.reciprocal(axis) < 0.0;
        (select_unpredictable(backwards, upper, lower), select_unpredictable(backwards, lower, upper))
    };
    let slab = |axis: usize, corners: [f32; 3]| {
        let (first, last) = ends(axis, corners);
        (ray.t_near(axis, first), ray.t_far(axis, last))
    };
    let (ex, lx) = slab(kx, px);
    let (ey, ly) = slab(ky, py);
    let (first, last) = ends(kz, z);
    let (ez, lz) = (first * ray.reciprocal(kz), last * ray.reciprocal(kz));
    let (enter, leave) = (max_f32(max_f32(ex, ey), ez), min_f32(min_f32(lx, ly), lz));
    // t is clamped to this interval below, so the ray certainly misses if the interval is out of range.
    if (enter > t_max) | ((enter < 0.0) & (leave < 0.0)) {
        return None;
    }
    if !SLIVER && leaf.is_sliver(k) && enter < 0.0 {
        // The result is copied field by field, because a copy of the whole struct would go through memory and stall on
        // store forwarding.
        let TriangleIntersection { t, u, v } = intersect_sliver(leaf, k, ray, t_max)?;
        return Some(TriangleIntersection { t, u, v });
    }
    let (sx, sy) = (ray.shear(0), ray.shear(1));
    let sheared = |i: usize| (x[i] - sx * z[i], y[i] - sy * z[i]);
    let ((ax, ay), (bx, by), (cx, cy)) = (sheared(0), sheared(1), sheared(2));
    let mut u = cx * by - cy * bx;
    let mut v = ax * cy - ay * cx;
    let mut w = bx * ay - by * ax;
    if u == 0.0 || v == 0.0 || w == 0.0 {
        [u, v, w] = edge_functions_f64([ax, ay, bx, by, cx, cy])?;
    }
    let det = u + v + w;
    // The division for t comes before the division for the weights, because hits behind the closest hit are rejected
    // without the weights.
    let mut depth = (u * z[0] + v * z[1] + w * z[2]) / det;
    if SLIVER {
        depth = plane_depth_f64(leaf, k, ray, depth);
    }
    let t = max_f32(min_f32(depth * ray.shear(2), leave), enter);
    (0.0 <= t && t <= t_max).then(|| TriangleIntersection { t, u: v / det, v: w / det })
}

/// The depth along the major axis at which the ray hits triangle `k` of the leaf, by the float64 plane of its corners;
/// `depth` if the corners define no plane.
///
/// For a sliver, the weighted sum of the corners' depths has an error as large as the distance between the corners. If
/// the sliver's bounds contain the ray's origin, the sign of such a sum is unreliable.
pub fn plane_depth_f64(leaf: &LeafNode, k: usize, ray: impl RayView, depth: f32) -> f32 {
    let axes = ray.axes();
    let [a, b, c] = corner_lanes(leaf, k)
        .map(|lane| axes.map(|axis| f64::from(leaf.vertices[axis][lane]) - f64::from(ray.origin(axis))));
    let normal = cross([a, b, c]);
    let along = |p: [f64; 3]| normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2];
    let slope = along([f64::from(ray.shear(0)), f64::from(ray.shear(1)), 1.0]);
    if slope == 0.0 {
        return depth;
    }
    (along(a) / slope) as f32
}

/// [`Vector::min`] of one lane.
#[inline(always)]
pub fn min_f32(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// [`Vector::max`] of one lane.
#[inline(always)]
pub fn max_f32(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
