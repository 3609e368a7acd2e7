//! Edge tests of a packet against the triangles of a leaf, before any division.

use crate::node::LeafNode;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::Packet;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::packet::soa::{load, load_xyz, store, to_bitmask};
use crate::traverse::triangle::edge::inside_mask;
use crate::traverse::triangle::edge::{corner_lanes, indices, vertices_minus};

/// Maximum number of rays that are tested against all triangles of a leaf, because culling would take as long.
const ALL_TRIANGLES_THRESHOLD: u32 = 6;

/// The triangles of a leaf that pass a ray's edge tests; they are processed one per ray at a time. Most rays have one.
#[repr(C, align(64))]
pub struct PotentialHits {
    /// The current triangle of each ray of `hit_mask`.
    pub triangle: [u32; PACKET_SIZE],
    pub hit_mask: u64,
    /// For each ray of `multi_mask`, a bit mask of its triangles after the current one, stored as a float.
    remaining: [f32; PACKET_SIZE],
    multi_mask: u64,
}

impl PotentialHits {
    pub const EMPTY: PotentialHits =
        PotentialHits { triangle: [0; PACKET_SIZE], hit_mask: 0, remaining: [0.0; PACKET_SIZE], multi_mask: 0 };

    /// Tests the rays `active` against the leaf's triangles. `COMMON_ORIGIN` is true if all rays may share their
    /// origin.
    #[inline(always)]
    pub fn test_edges<I: Isa, const COMMON_ORIGIN: bool>(&mut self, leaf: &LeafNode, active: u64, packet: &Packet) {
        (self.hit_mask, self.multi_mask) = (0, 0);
        let mut triangles = u32::MAX;
        if active.count_ones() > ALL_TRIANGLES_THRESHOLD {
            triangles = packet.candidate_triangles::<I>(leaf);
        }
        let by_triangles = triangles.count_ones() * count_groups(active) < active.count_ones();
        // If the rays have a common origin, the leaf's vertices are translated only once.
        let start = if COMMON_ORIGIN { packet.common_origin() } else { None };
        match (by_triangles, start) {
            (true, None) => self.test_edges_by_triangle::<I, false>(leaf, active, packet, triangles),
            (true, Some(start)) => {
                let leaf = &leaf.translated::<I>(start);
                self.test_edges_by_triangle::<I, true>(leaf, active, packet, triangles);
            }
            (false, None) => self.test_edges_by_ray::<I, false>(leaf, active, packet),
            (false, Some(_)) => self.test_edges_by_ray::<I, true>(leaf, active, packet),
        }
    }

    /// Tests one ray at a time against all triangles of the leaf. `COMMON_ORIGIN` is true if all rays share their
    /// origin.
    #[inline(always)]
    fn test_edges_by_ray<I: Isa, const COMMON_ORIGIN: bool>(
        &mut self,
        leaf: &LeafNode,
        mut active: u64,
        packet: &Packet,
    ) {
        let [kx, ky, kz] = packet.axes;
        let (x, y, z) = (&packet.origin[kx], &packet.origin[ky], &packet.origin[kz]);
        let mut rx = vertices_minus::<I>(leaf, kx, x[0]);
        let mut ry = vertices_minus::<I>(leaf, ky, y[0]);
        let mut rz = vertices_minus::<I>(leaf, kz, z[0]);
        let index = indices::<I>(leaf);
        // The masks are local variables, which stay in registers: stores in the loop would delay the loads of the next
        // iteration.
        let (mut some, mut more) = (0, 0);
        while active != 0 {
            let i = active.trailing_zeros() as usize & (PACKET_SIZE - 1);
            active &= active - 1;
            if !COMMON_ORIGIN {
                rx = vertices_minus::<I>(leaf, kx, x[i]);
                ry = vertices_minus::<I>(leaf, ky, y[i]);
                rz = vertices_minus::<I>(leaf, kz, z[i]);
            }
            let px = rx.sub(I::F32x16::splat(packet.shear[0][i]).mul(rz));
            let py = ry.sub(I::F32x16::splat(packet.shear[1][i]).mul(rz));
            let near = inside_mask::<I>(px, py, leaf, &index) & leaf.non_degenerate;
            self.triangle[i] = near.trailing_zeros();
            some |= u64::from(near != 0) << i;
            let rest = near & near.wrapping_sub(1);
            if rest != 0 {
                self.remaining[i] = rest as f32;
                more |= 1 << i;
            }
        }
        (self.hit_mask, self.multi_mask) = (some, more);
    }

    /// Tests one triangle against sixteen rays at a time. `COMMON_ORIGIN` is true if the leaf's vertices are relative
    /// to the shared origin.
    #[inline(always)]
    fn test_edges_by_triangle<I: Isa, const COMMON_ORIGIN: bool>(
        &mut self,
        leaf: &LeafNode,
        active: u64,
        packet: &Packet,
        triangles: u32,
    ) {
        let [kx, ky, kz] = packet.axes;
        let zero = I::F32x16::splat(0.0);
        for group in 0..PACKET_SIZE / 16 {
            let lanes = (active >> (16 * group)) as u32 & 0xffff;
            if lanes == 0 {
                continue;
            }
            let origin = load_xyz::<I>(&packet.origin, group);
            let origin = [origin[kx], origin[ky], origin[kz]];
            let (sx, sy) = (load::<I>(&packet.shear[0], group), load::<I>(&packet.shear[1], group));
            let (mut first, mut some) = (zero, 0);
            let (mut rest, mut more) = (zero, 0);
            let mut left = triangles;
            while left != 0 {
                let k = left.trailing_zeros();
                left &= left - 1;
                let corner = corner_lanes(leaf, k as usize);
                let [x, y, z] = [kx, ky, kz].map(|axis| corner.map(|lane| leaf.vertices[axis][lane]));
                let (ax, ay) = shear_corner::<I, COMMON_ORIGIN>([x[0], y[0], z[0]], &origin, sx, sy);
                let (bx, by) = shear_corner::<I, COMMON_ORIGIN>([x[1], y[1], z[1]], &origin, sx, sy);
                let (cx, cy) = shear_corner::<I, COMMON_ORIGIN>([x[2], y[2], z[2]], &origin, sx, sy);
                let u = cx.mul(by).sub(cy.mul(bx));
                let v = ax.mul(cy).sub(ay.mul(cx));
                let w = bx.mul(ay).sub(by.mul(ax));
                let inside = <I::F32x16 as Vector>::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero));
                let near = to_bitmask::<I>(inside) & lanes;
                let again = near & some;
                let power = I::F32x16::splat((1u32 << k) as f32);
                let also = <I::F32x16 as Vector>::from_bitmask(again);
                rest = rest.add(I::F32x16::select(also, power, zero));
                more |= again;
                let new = <I::F32x16 as Vector>::from_bitmask(near & !some);
                first = I::F32x16::select(new, I::F32x16::splat(f32::from_bits(k)), first);
                some |= near;
            }
            // SAFETY: a row contains 64 words, of which a group takes at most 16; the words are moved as floats without
            // arithmetic.
            unsafe { first.store(self.triangle.as_mut_ptr().add(16 * group).cast()) };
            store::<I>(&mut self.remaining, group, rest);
            self.hit_mask |= u64::from(some) << (16 * group);
            self.multi_mask |= u64::from(more) << (16 * group);
        }
    }

    /// Advances every ray to its next triangle.
    #[inline(always)]
    pub fn next_triangle(&mut self) {
        self.hit_mask = self.multi_mask;
        let mut left = self.multi_mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize & (PACKET_SIZE - 1);
            left &= left - 1;
            let rest = self.remaining[i] as u32;
            self.triangle[i] = rest.trailing_zeros();
            let rest = rest & rest.wrapping_sub(1);
            self.remaining[i] = rest as f32;
            self.multi_mask &= !(u64::from(rest == 0) << i);
        }
    }

    /// Bit g: some ray of group g of [`Isa::RAY_LANES`] rays has a triangle.
    #[inline(always)]
    pub fn active_groups<I: Isa>(&self) -> u32 {
        (0..PACKET_SIZE / I::RAY_LANES).fold(0, |groups, g| groups | u32::from(self.hit_lanes::<I>(g) != 0) << g)
    }

    /// Bit i: ray i of a group of [`Isa::RAY_LANES`] rays has a triangle.
    #[inline(always)]
    pub fn hit_lanes<I: Isa>(&self, group: usize) -> u32 {
        (self.hit_mask >> (I::RAY_LANES * group)) as u32 & ((1 << I::RAY_LANES) - 1)
    }
}

/// The x and y of a corner, sheared for each of sixteen rays.
#[inline(always)]
fn shear_corner<I: Isa, const COMMON_ORIGIN: bool>(
    corner: [f32; 3],
    origin: &[I::F32x16; 3],
    sx: I::F32x16,
    sy: I::F32x16,
) -> (I::F32x16, I::F32x16) {
    let [x, y, z] = corner;
    let (mut x, mut y, mut z) = (I::F32x16::splat(x), I::F32x16::splat(y), I::F32x16::splat(z));
    if !COMMON_ORIGIN {
        (x, y, z) = (x.sub(origin[0]), y.sub(origin[1]), z.sub(origin[2]));
    }
    (x.sub(sx.mul(z)), y.sub(sy.mul(z)))
}

/// The number of groups of 16 rays with an active ray.
#[inline(always)]
fn count_groups(active: u64) -> u32 {
    (0..PACKET_SIZE / 16).map(|g| u32::from(active >> (16 * g) & 0xffff != 0)).sum()
}
