//! Which triangles of a leaf the rays of a packet run through: all edges first, before anything is divided.

use crate::node::LeafNode;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::soa::{bits, load, load3, store};
use crate::traverse::packet::{Packet, SIZE};
use crate::traverse::triangle::packet::{corner_lanes, indices, relative};
use crate::traverse::triangle::single::inside;

/// Rays of a packet that are as few at a leaf are tested against all its triangles: finding those that may be met costs
/// as much.
const ALL_TRIANGLES: u32 = 6;

/// Triangles within whose edges rays run, one for each ray at a time; most have no other.
#[repr(C, align(64))]
pub struct Near {
    /// One of those of each ray of `some`.
    pub triangle: [u32; SIZE],
    pub some: u64,
    /// The others, of each ray of `more`: the sum of two to their powers.
    rest: [f32; SIZE],
    more: u64,
}

impl Near {
    pub const NOTHING: Near = Near {
        triangle: [0; SIZE],
        some: 0,
        rest: [0.0; SIZE],
        more: 0,
    };

    /// Finds those of the rays `active`. `ONE` where all rays may well start at one point.
    #[inline(always)]
    pub fn find<I: Isa, const ONE: bool>(&mut self, leaf: &LeafNode, active: u64, packet: &Packet) {
        (self.some, self.more) = (0, 0);
        let mut triangles = u32::MAX;
        if active.count_ones() > ALL_TRIANGLES {
            triangles = packet.candidates::<I>(leaf);
        }
        let by_triangles = triangles.count_ones() * groups(active) < active.count_ones();
        // Where all rays start at one point, corners are counted from there once.
        let start = if ONE { packet.start() } else { None };
        match (by_triangles, start) {
            (true, None) => self.find_by_triangles::<I, false>(leaf, active, packet, triangles),
            (true, Some(start)) => {
                let leaf = &leaf.around::<I>(start);
                self.find_by_triangles::<I, true>(leaf, active, packet, triangles);
            }
            (false, None) => self.find_by_rays::<I, false>(leaf, active, packet),
            (false, Some(_)) => self.find_by_rays::<I, true>(leaf, active, packet),
        }
    }

    /// One ray and sixteen triangles at a time. `ONE` where all rays start at one point.
    #[inline(always)]
    fn find_by_rays<I: Isa, const ONE: bool>(
        &mut self,
        leaf: &LeafNode,
        mut active: u64,
        packet: &Packet,
    ) {
        let [kx, ky, kz] = packet.axes;
        let (x, y, z) = (&packet.origin[kx], &packet.origin[ky], &packet.origin[kz]);
        let mut rx = relative::<I>(leaf, kx, x[0]);
        let mut ry = relative::<I>(leaf, ky, y[0]);
        let mut rz = relative::<I>(leaf, kz, z[0]);
        let index = indices::<I>(leaf);
        // In registers: stores of them in the loop may hold up the loads of its next turn, two- or threefold.
        let (mut some, mut more) = (0, 0);
        while active != 0 {
            let i = active.trailing_zeros() as usize & (SIZE - 1);
            active &= active - 1;
            if !ONE {
                rx = relative::<I>(leaf, kx, x[i]);
                ry = relative::<I>(leaf, ky, y[i]);
                rz = relative::<I>(leaf, kz, z[i]);
            }
            let px = rx.sub(I::F16::splat(packet.shear[0][i]).mul(rz));
            let py = ry.sub(I::F16::splat(packet.shear[1][i]).mul(rz));
            let near = inside::<I>(px, py, leaf, &index) & leaf.solid;
            self.triangle[i] = near.trailing_zeros();
            some |= u64::from(near != 0) << i;
            let rest = near & near.wrapping_sub(1);
            if rest != 0 {
                self.rest[i] = rest as f32;
                more |= 1 << i;
            }
        }
        (self.some, self.more) = (some, more);
    }

    /// One triangle and sixteen rays at a time. `ONE` where the leaf is counted from where all rays start.
    #[inline(always)]
    fn find_by_triangles<I: Isa, const ONE: bool>(
        &mut self,
        leaf: &LeafNode,
        active: u64,
        packet: &Packet,
        triangles: u32,
    ) {
        let [kx, ky, kz] = packet.axes;
        let zero = I::F16::splat(0.0);
        for group in 0..SIZE / 16 {
            let lanes = (active >> (16 * group)) as u32 & 0xffff;
            if lanes == 0 {
                continue;
            }
            let origin = load3::<I>(&packet.origin, group);
            let origin = [origin[kx], origin[ky], origin[kz]];
            let (sx, sy) = (
                load::<I>(&packet.shear[0], group),
                load::<I>(&packet.shear[1], group),
            );
            let (mut first, mut some) = (zero, 0);
            let (mut rest, mut more) = (zero, 0);
            let mut left = triangles;
            while left != 0 {
                let k = left.trailing_zeros();
                left &= left - 1;
                let corner = corner_lanes(leaf, k as usize);
                let [x, y, z] = [kx, ky, kz].map(|axis| corner.map(|lane| leaf.vertex[axis][lane]));
                let (ax, ay) = sheared::<I, ONE>([x[0], y[0], z[0]], &origin, sx, sy);
                let (bx, by) = sheared::<I, ONE>([x[1], y[1], z[1]], &origin, sx, sy);
                let (cx, cy) = sheared::<I, ONE>([x[2], y[2], z[2]], &origin, sx, sy);
                let u = cx.mul(by).sub(cy.mul(bx));
                let v = ax.mul(cy).sub(ay.mul(cx));
                let w = bx.mul(ay).sub(by.mul(ax));
                let inside =
                    <I::F16 as Vector>::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero));
                let near = bits::<I>(inside) & lanes;
                let again = near & some;
                let power = I::F16::splat((1u32 << k) as f32);
                let also = <I::F16 as Vector>::mask(again);
                rest = rest.add(I::F16::select(also, power, zero));
                more |= again;
                let new = <I::F16 as Vector>::mask(near & !some);
                first = I::F16::select(new, I::F16::splat(f32::from_bits(k)), first);
                some |= near;
            }
            // SAFETY: a row of 64 words, of which a group takes 16; floats are only moved.
            unsafe { first.store(self.triangle.as_mut_ptr().add(16 * group).cast()) };
            store::<I>(&mut self.rest, group, rest);
            self.some |= u64::from(some) << (16 * group);
            self.more |= u64::from(more) << (16 * group);
        }
    }

    /// Goes on to the next triangle of each ray that has one.
    #[inline(always)]
    pub fn next(&mut self) {
        self.some = self.more;
        let mut left = self.more;
        while left != 0 {
            let i = left.trailing_zeros() as usize & (SIZE - 1);
            left &= left - 1;
            let rest = self.rest[i] as u32;
            self.triangle[i] = rest.trailing_zeros();
            let rest = rest & rest.wrapping_sub(1);
            self.rest[i] = rest as f32;
            self.more &= !(u64::from(rest == 0) << i);
        }
    }

    /// Bit g: of group g of [`Isa::RAYS`] rays some run through a triangle.
    #[inline(always)]
    pub fn groups<I: Isa>(&self) -> u32 {
        (0..SIZE / I::RAYS).fold(0, |groups, g| {
            groups | u32::from(self.lanes::<I>(g) != 0) << g
        })
    }

    /// Of such a group those rays that run through a triangle.
    #[inline(always)]
    pub fn lanes<I: Isa>(&self, group: usize) -> u32 {
        (self.some >> (I::RAYS * group)) as u32 & ((1 << I::RAYS) - 1)
    }
}

/// A corner, sheared for sixteen rays.
#[inline(always)]
fn sheared<I: Isa, const ONE: bool>(
    corner: [f32; 3],
    origin: &[I::F16; 3],
    sx: I::F16,
    sy: I::F16,
) -> (I::F16, I::F16) {
    let [x, y, z] = corner;
    let (mut x, mut y, mut z) = (I::F16::splat(x), I::F16::splat(y), I::F16::splat(z));
    if !ONE {
        (x, y, z) = (x.sub(origin[0]), y.sub(origin[1]), z.sub(origin[2]));
    }
    (x.sub(sx.mul(z)), y.sub(sy.mul(z)))
}

/// How many groups of 16 rays have an active one.
#[inline(always)]
fn groups(active: u64) -> u32 {
    (0..SIZE / 16)
        .map(|g| u32::from(active >> (16 * g) & 0xffff != 0))
        .sum()
}
