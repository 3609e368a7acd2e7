//! Vertices and edge functions of the triangles of a leaf.

use crate::node::LeafNode;
use crate::simd::{Isa, Vector, packed_index};

/// Looks up the corners of a leaf's triangles in a vector of its vertices.
#[inline(always)]
pub fn corners<I: Isa>(v: I::F32x16, index: &[I::LaneIndices; 3]) -> [I::F32x16; 3] {
    [I::permute(v, index[0]), I::permute(v, index[1]), I::permute(v, index[2])]
}

/// The corners of a leaf's triangles as vertex indices, for [`corners`].
#[inline(always)]
pub fn indices<I: Isa>(leaf: &LeafNode) -> [I::LaneIndices; 3] {
    [
        I::unpack_indices(leaf.packed_indices[0]),
        I::unpack_indices(leaf.packed_indices[1]),
        I::unpack_indices(leaf.packed_indices[2]),
    ]
}

/// The vertices of a leaf along an axis, relative to an origin.
#[inline(always)]
pub fn vertices_minus<I: Isa>(leaf: &LeafNode, axis: usize, origin: f32) -> I::F32x16 {
    // SAFETY: each row of `vertices` contains 16 floats.
    let row = unsafe { I::F32x16::load(leaf.vertices[axis].as_ptr()) };
    row.sub(I::F32x16::splat(origin))
}

impl LeafNode {
    /// A copy of the leaf with vertices relative to a point.
    #[inline(always)]
    pub fn translated<I: Isa>(&self, point: [f32; 3]) -> LeafNode {
        let mut leaf = *self;
        for (axis, row) in leaf.vertices.iter_mut().enumerate() {
            // SAFETY: the row holds 16 floats.
            unsafe { vertices_minus::<I>(self, axis, point[axis]).store(row.as_mut_ptr()) };
        }
        leaf
    }
}

/// The lanes of the corners of triangle `k`.
#[inline(always)]
pub fn corner_lanes(leaf: &LeafNode, k: usize) -> [usize; 3] {
    leaf.packed_indices.map(|packed| usize::from(packed_index(packed, k)))
}

/// [`inside_mask`] in two halves, because sixteen triangles exceed the registers; many leaves have at most eight.
#[inline(always)]
fn inside_mask_by_halves<I: Isa>(px: I::F32x16, py: I::F32x16, leaf: &LeafNode) -> u32 {
    let lower = inside_mask_half::<I, 0>(px, py, leaf);
    if leaf.count <= 8 {
        return lower;
    }
    lower | inside_mask_half::<I, 1>(px, py, leaf) << 8
}

/// [`inside_mask`] of the eight triangles from `8 * HALF` on.
#[inline(always)]
fn inside_mask_half<I: Isa, const HALF: usize>(px: I::F32x16, py: I::F32x16, leaf: &LeafNode) -> u32 {
    let [a, b, c] = leaf.packed_indices;
    edge_functions_agree(
        (I::permute_half::<HALF>(px, a), I::permute_half::<HALF>(py, a)),
        (I::permute_half::<HALF>(px, b), I::permute_half::<HALF>(py, b)),
        (I::permute_half::<HALF>(px, c), I::permute_half::<HALF>(py, c)),
    )
}

/// Bit mask of the triangles that contain the origin (the sheared ray), from sheared vertices; `index` is the
/// result of [`indices`].
#[inline(always)]
pub fn inside_mask<I: Isa>(px: I::F32x16, py: I::F32x16, leaf: &LeafNode, index: &[I::LaneIndices; 3]) -> u32 {
    if I::RAY_LANES < 16 {
        return inside_mask_by_halves::<I>(px, py, leaf);
    }
    let ([ax, bx, cx], [ay, by, cy]) = (corners::<I>(px, index), corners::<I>(py, index));
    edge_functions_agree((ax, ay), (bx, by), (cx, cy))
}

/// Bit mask of the triangles that contain the origin, from the x and y of their sheared corners: triangles whose edge
/// functions do not differ in sign.
#[inline(always)]
fn edge_functions_agree<V: Vector>((ax, ay): (V, V), (bx, by): (V, V), (cx, cy): (V, V)) -> u32 {
    let u = cx.mul(by).sub(cy.mul(bx));
    let v = ax.mul(cy).sub(ay.mul(cx));
    let w = bx.mul(ay).sub(by.mul(ax));
    let zero = V::splat(0.0);
    V::to_bitmask(V::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero)))
}

/// The normalised edge functions, computed in float64 because float64 products are exact; `None` if the ray misses the
/// triangle.
#[cold]
#[inline(never)]
pub fn edge_functions_f64(corners: [f32; 6]) -> Option<[f32; 3]> {
    let [ax, ay, bx, by, cx, cy] = corners.map(f64::from);
    let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    let det = u + v + w;
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    (inside && det != 0.0).then(|| [u, v, w].map(|value| (value / det) as f32))
}
