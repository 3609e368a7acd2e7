//! Triangles of a leaf that a float64 ray may hit, or certainly hits, according to their float32 vertices.
//!
//! The shear adds at most the error along its axis, so the error of a sheared corner is at most e = 2 `off`. The error
//! of an edge function x1 y2 - y1 x2 is then at most e (|x1| + |y1| + |x2| + |y2|) + 2 e^2. Rounding adds less than the
//! same amount again, because `off` is much larger than the rounding errors. The largest corner coordinate of the leaf
//! bounds all corners.

use crate::node::LeafNode;
use crate::simd::{Isa, Vector};
use crate::traverse::triangle::edge::vertices_minus;
use crate::traverse::triangle::single::{RayView, shear_vertices};

/// The rounding error of t is less than this fraction of t.
const T_ERROR: f32 = 1e-5;

/// The smallest and the largest edge function of each of eight triangles.
struct EdgeRange<V> {
    least: V,
    greatest: V,
}

/// Sheared vertices, and the error bound of edge functions of the leaf.
#[inline(always)]
fn sheared<I: Isa>(leaf: &LeafNode, ray: impl RayView, off: f32) -> ([I::F32x16; 2], f32) {
    let [px, py] = shear_vertices::<I>(leaf, ray);
    let farthest = px.abs().add(py.abs()).reduce_max();
    ([px, py], off * (8.0 * farthest + 16.0 * off))
}

/// The edge functions of triangles `8 * HALF ..`.
#[inline(always)]
fn edge_functions<I: Isa, const HALF: usize>([px, py]: [I::F32x16; 2], leaf: &LeafNode) -> EdgeRange<I::F32x8> {
    let [a, b, c] = leaf.packed_indices;
    let (ax, ay) = (I::permute_half::<HALF>(px, a), I::permute_half::<HALF>(py, a));
    let (bx, by) = (I::permute_half::<HALF>(px, b), I::permute_half::<HALF>(py, b));
    let (cx, cy) = (I::permute_half::<HALF>(px, c), I::permute_half::<HALF>(py, c));
    let u = cx.mul(by).sub(cy.mul(bx));
    let v = ax.mul(cy).sub(ay.mul(cx));
    let w = bx.mul(ay).sub(by.mul(ax));
    EdgeRange { least: u.min(v).min(w), greatest: u.max(v).max(w) }
}

/// Bit i: the ray may hit triangle i if ray and corners are off by at most `off`.
#[inline(always)]
pub fn candidate_triangles<I: Isa>(leaf: &LeafNode, ray: impl RayView, off: f32) -> u32 {
    let (points, slack) = sheared::<I>(leaf, ray, off);
    let mut near = candidate_half::<I, 0>(points, leaf, slack);
    if leaf.count > 8 {
        near |= candidate_half::<I, 1>(points, leaf, slack) << 8;
    }
    near & ((1u32 << leaf.count) - 1)
}

#[inline(always)]
fn candidate_half<I: Isa, const HALF: usize>(points: [I::F32x16; 2], leaf: &LeafNode, slack: f32) -> u32 {
    let EdgeRange { least, greatest } = edge_functions::<I, HALF>(points, leaf);
    let (low, high) = (I::F32x8::splat(-slack), I::F32x8::splat(slack));
    <I::F32x8 as Vector>::to_bitmask(<I::F32x8 as Vector>::or(low.le(least), greatest.le(high)))
}

/// Triangles that a ray certainly crosses.
pub struct SureCrossings {
    /// Bit i: the ray crosses triangle i between its ends, whatever the errors are.
    pub crossed: u32,
    /// Bit i: the ray leaves through the back of triangle i, as seen in the mesh.
    pub leaving: u32,
}

/// The triangles that a ray certainly crosses between 0 and `t_max`: edge functions and t exceed their errors.
#[inline(always)]
pub fn sure_crossings<I: Isa>(leaf: &LeafNode, ray: impl RayView, off: f32, t_max: f32) -> SureCrossings {
    let (points, slack) = sheared::<I>(leaf, ray, off);
    let [_, _, z] = ray.axes();
    let reciprocal = ray.reciprocal(z);
    let depths = vertices_minus::<I>(leaf, z, ray.origin(z)).mul(I::F32x16::splat(reciprocal));
    let pad = 2.0 * off * reciprocal.abs();
    let range = [pad, t_max * (1.0 - T_ERROR) - pad];
    let (mut crossed, mut positive) = sure_half::<I, 0>((points, depths), leaf, slack, range);
    if leaf.count > 8 {
        let upper = sure_half::<I, 1>((points, depths), leaf, slack, range);
        (crossed, positive) = (crossed | upper.0 << 8, positive | upper.1 << 8);
    }
    let leaving = if reciprocal > 0.0 { !positive } else { positive };
    SureCrossings { crossed: crossed & ((1u32 << leaf.count) - 1), leaving }
}

/// Two bit masks for half of a leaf: the triangles that are certainly crossed, and the triangles with positive edge
/// functions.
#[inline(always)]
fn sure_half<I: Isa, const HALF: usize>(
    (points, depths): ([I::F32x16; 2], I::F32x16),
    leaf: &LeafNode,
    slack: f32,
    [t_min, t_max]: [f32; 2],
) -> (u32, u32) {
    let EdgeRange { least, greatest } = edge_functions::<I, HALF>(points, leaf);
    let [a, b, c] = leaf.packed_indices;
    let a = I::permute_half::<HALF>(depths, a);
    let (b, c) = (I::permute_half::<HALF>(depths, b), I::permute_half::<HALF>(depths, c));
    let positive = I::F32x8::splat(slack.next_up()).le(least);
    let either = <I::F32x8 as Vector>::or(positive, greatest.le(I::F32x8::splat(-slack.next_up())));
    let ahead = I::F32x8::splat(t_min.next_up()).le(a.min(b).min(c));
    let within = a.max(b).max(c).le(I::F32x8::splat(t_max));
    let sure = <I::F32x8 as Vector>::and(either, <I::F32x8 as Vector>::and(ahead, within));
    (<I::F32x8 as Vector>::to_bitmask(sure), <I::F32x8 as Vector>::to_bitmask(positive))
}
