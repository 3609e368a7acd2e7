//! Triangles of a leaf that a float64 ray may hit, or certainly hits, according to their float32 vertices.
//!
//! The shear adds at most the error along its axis, so the error of a sheared corner is at most e = 2 `off`. The error
//! of an edge function x1 y2 - y1 x2 is then at most e (|x1| + |y1| + |x2| + |y2|) + 2 e^2. Rounding at most doubles
//! this bound, because `off` is much larger than the rounding errors. The largest corner coordinate of the leaf bounds
//! all corners.

use crate::limits::MACHINE_EPSILON;
use crate::node::LeafNode;
use crate::simd::{Isa, Vector};
use crate::traverse::triangle::edge::{corner_lanes, corners, indices};
use crate::traverse::triangle::single::{RayView, max_f32, min_f32, shear_vertices};

/// Upper bound on the rounding error of t, as a fraction of t.
pub const T_ERROR: f32 = 1e-5;

/// Width of a range of t, as a fraction of t, above which the corners' weights are used to narrow the range.
pub const MAX_T_WIDTH: f32 = 1.0 / 16.0;

/// The sheared vertices of a leaf, and the error bound of the edge functions of its triangles.
#[inline(always)]
fn sheared<I: Isa>(leaf: &LeafNode, ray: impl RayView, off: f32) -> ([I::F32x16; 2], f32) {
    let [px, py] = shear_vertices::<I>(leaf, ray);
    let farthest = px.abs().add(py.abs()).reduce_max();
    ([px, py], off * (8.0 * farthest + 16.0 * off))
}

/// Result of testing a ray against the triangles of a leaf, as bit masks.
#[derive(Clone, Copy)]
pub struct LeafCandidates {
    /// Bit i: the ray may hit triangle i, if the ray and the corners are inaccurate by at most the given error.
    pub near: u32,
    /// Bit i: the ray's line certainly passes through triangle i, for all errors within the bound.
    pub sure: u32,
    /// Bit i: triangle i is certainly counter-clockwise around the sheared ray.
    pub positive: u32,
}

impl LeafCandidates {
    pub const NONE: LeafCandidates = LeafCandidates { near: 0, sure: 0, positive: 0 };
}

/// Classifies the triangles of a leaf: those that the ray may hit, and those that its line certainly passes through.
#[inline(always)]
pub fn classify_triangles<I: Isa>(leaf: &LeafNode, ray: impl RayView, off: f32) -> LeafCandidates {
    let ([px, py], slack) = sheared::<I>(leaf, ray, off);
    let [near, positive, negative] = if I::RAY_LANES < 16 {
        classify_halves::<I>(px, py, leaf, slack)
    } else {
        let index = indices::<I>(leaf);
        let ([ax, bx, cx], [ay, by, cy]) = (corners::<I>(px, &index), corners::<I>(py, &index));
        classify_lanes((ax, ay), (bx, by), (cx, cy), slack)
    };
    let all = (1u32 << leaf.count) - 1;
    LeafCandidates { near: near & all, sure: (positive | negative) & all, positive: positive & all }
}

/// [`classify_lanes`] in two halves, because sixteen triangles do not fit in the registers; many leaves have at most
/// eight.
#[inline(always)]
fn classify_halves<I: Isa>(px: I::F32x16, py: I::F32x16, leaf: &LeafNode, slack: f32) -> [u32; 3] {
    let lower = classify_half::<I, 0>(px, py, leaf, slack);
    if leaf.count <= 8 {
        return lower;
    }
    let upper = classify_half::<I, 1>(px, py, leaf, slack);
    [lower[0] | upper[0] << 8, lower[1] | upper[1] << 8, lower[2] | upper[2] << 8]
}

/// [`classify_lanes`] of the eight triangles from `8 * HALF` on.
#[inline(always)]
fn classify_half<I: Isa, const HALF: usize>(px: I::F32x16, py: I::F32x16, leaf: &LeafNode, slack: f32) -> [u32; 3] {
    let [a, b, c] = leaf.packed_indices;
    classify_lanes(
        (I::permute_half::<HALF>(px, a), I::permute_half::<HALF>(py, a)),
        (I::permute_half::<HALF>(px, b), I::permute_half::<HALF>(py, b)),
        (I::permute_half::<HALF>(px, c), I::permute_half::<HALF>(py, c)),
        slack,
    )
}

/// Three bit masks of triangles, from the sheared x and y of their corners: triangles that the ray may hit, triangles
/// with certainly positive edge functions, and triangles with certainly negative edge functions.
#[inline(always)]
fn classify_lanes<V: Vector>((ax, ay): (V, V), (bx, by): (V, V), (cx, cy): (V, V), slack: f32) -> [u32; 3] {
    let u = cx.mul(by).sub(cy.mul(bx));
    let v = ax.mul(cy).sub(ay.mul(cx));
    let w = bx.mul(ay).sub(by.mul(ax));
    let (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
    let near = V::or(V::splat(-slack).le(least), greatest.le(V::splat(slack)));
    let (positive, negative) = (V::splat(slack.next_up()).le(least), greatest.le(V::splat(-slack.next_up())));
    [V::to_bitmask(near), V::to_bitmask(positive), V::to_bitmask(negative)]
}

/// Bounds of the t at which the ray meets triangle `k` if it hits the triangle, for all errors within the bound.
#[inline(always)]
pub fn t_range(leaf: &LeafNode, k: usize, ray: impl RayView, off: f32, is_sure: bool) -> [f32; 2] {
    let [_, _, z] = ray.axes();
    let scale = ray.reciprocal(z);
    let depths = corner_lanes(leaf, k).map(|lane| (leaf.vertices[z][lane] - ray.origin(z)) * scale);
    let mut least = min_f32(min_f32(depths[0], depths[1]), depths[2]);
    let mut greatest = max_f32(max_f32(depths[0], depths[1]), depths[2]);
    if is_sure && greatest - least > MAX_T_WIDTH * greatest.abs() {
        [least, greatest] = narrow_t_range(leaf, k, ray, off, depths, [least, greatest]);
    }
    let pad = 2.0 * off * scale.abs();
    [least - least.abs() * T_ERROR - pad, greatest + greatest.abs() * T_ERROR + pad]
}

/// The range of t of a triangle that the line certainly passes through, from the weights of its corners; `depths`
/// contains the t of each corner.
///
/// An edge function is off by `slack`, so a weight w is off by at most (1 + 3 w) `slack` / `det`, and the three weights
/// by 6 `slack` / `det` in total.
#[inline(never)]
fn narrow_t_range(
    leaf: &LeafNode,
    k: usize,
    ray: impl RayView,
    off: f32,
    depths: [f32; 3],
    [least, greatest]: [f32; 2],
) -> [f32; 2] {
    let [kx, ky, kz] = ray.axes();
    let [a, b, c] = corner_lanes(leaf, k).map(|lane| {
        let along = |axis: usize| leaf.vertices[axis][lane] - ray.origin(axis);
        let depth = along(kz);
        [along(kx) - ray.shear(0) * depth, along(ky) - ray.shear(1) * depth]
    });
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    let det = u + v + w;
    let farthest = [a, b, c].iter().fold(0.0, |most, p| max_f32(most, p[0].abs() + p[1].abs()));
    let slack = off * (8.0 * farthest + 16.0 * off);
    let t = (u * depths[0] + v * depths[1] + w * depths[2]) / det;
    let error =
        6.0 * slack / det.abs() * (greatest - least) + 8.0 * MACHINE_EPSILON * max_f32(least.abs(), greatest.abs());
    [max_f32(least, t - error), min_f32(greatest, t + error)]
}
