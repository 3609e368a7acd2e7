//! Culling of triangles that no ray of a packet can hit.

use crate::node::LeafNode;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::Packet;
use crate::traverse::triangle::edge::{corners, indices, vertices_minus};

impl Packet {
    /// Bit k: some ray may hit triangle k. All other triangles are entirely on one side of the axis after shearing, for
    /// every ray. Rounding is monotonic, so interval bounds are valid for the values that the test computes.
    #[inline(always)]
    pub fn candidate_triangles<I: Isa>(&self, leaf: &LeafNode) -> u32 {
        self.candidate_triangles_within::<I>(leaf, 0.0) & leaf.non_degenerate
    }

    /// Same as [`Packet::candidate_triangles`], for sheared corners with errors of up to `slack`.
    #[inline(always)]
    pub fn candidate_triangles_within<I: Isa>(&self, leaf: &LeafNode, slack: f32) -> u32 {
        let [kx, ky, kz] = self.axes;
        let index = indices::<I>(leaf);
        let [least, greatest] = self.origin_range[kz];
        let depth = [vertices_minus::<I>(leaf, kz, greatest), vertices_minus::<I>(leaf, kz, least)];
        let (before, beyond) = (I::F32x16::splat(-slack), I::F32x16::splat(slack));
        let mut near = (1u32 << leaf.count) - 1;
        for (axis, shears) in [(kx, self.shear_range[0]), (ky, self.shear_range[1])] {
            let [least, greatest] = self.origin_range[axis];
            let (low, high) = (vertices_minus::<I>(leaf, axis, greatest), vertices_minus::<I>(leaf, axis, least));
            let (s, t) = (I::F32x16::splat(shears[0]), I::F32x16::splat(shears[1]));
            let products = [s.mul(depth[0]), s.mul(depth[1]), t.mul(depth[0]), t.mul(depth[1])];
            let least = products[0].min(products[1]).min(products[2].min(products[3]));
            let greatest = products[0].max(products[1]).max(products[2].max(products[3]));
            let (low, high) = (low.sub(greatest), high.sub(least));
            let [a, b, c] = corners::<I>(low, &index);
            let low = a.min(b).min(c);
            let [a, b, c] = corners::<I>(high, &index);
            let high = a.max(b).max(c);
            near &= <I::F32x16 as Vector>::to_bitmask(<I::F32x16 as Vector>::and(low.le(beyond), before.le(high)));
        }
        near
    }
}
