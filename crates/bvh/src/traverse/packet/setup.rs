//! How rays are made a packet: in one pass over them, of which the min_max tell whether they run alike.

use crate::aabb::Aabb;
use crate::limits::{MACHINE_EPSILON, MAX_COORD};
use crate::ray::Ray;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::Packet;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::packet::soa::{min_max, store, to_bitmask};
use crate::traverse::trav_ray::{MAX_ORIGIN, MAX_RECIPROCAL, ORIGIN_PAD, RELATIVE_PAD, SLAB_PAD};

impl Packet {
    /// Makes rays ready; false where they do not run alike, or one of them is odd in any way, and nothing may be
    /// concluded. Boxes are padded by `pad` of the max_abs coordinate of ray and tree in addition.
    #[inline(always)]
    pub fn setup<I: Isa>(&mut self, rays: &[Ray], extent: &Aabb, pad: f32, apex: Apex) -> bool {
        let n = rays.len();
        debug_assert!(0 < n && n <= PACKET_SIZE);
        let mut room;
        let all: &[Ray; PACKET_SIZE] = match rays.try_into() {
            Ok(all) => all,
            Err(_) => {
                room = [rays[0]; PACKET_SIZE];
                room[..n].copy_from_slice(rays);
                &room
            }
        };
        self.active = u64::MAX >> (PACKET_SIZE - n);
        // Each is compiled by itself: what starts at one point needs much less.
        let set = match apex == Apex::Origin && have_common_origin::<I>(all) {
            true => self.setup_lanes::<I, true>(all, extent, pad, apex),
            false => self.setup_lanes::<I, false>(all, extent, pad, apex),
        };
        self.t_max[n..].fill(0.0);
        set
    }

    /// The same with all rays there; `COMMON_ORIGIN` where they start at one point.
    #[inline(always)]
    fn setup_lanes<I: Isa, const COMMON_ORIGIN: bool>(
        &mut self,
        rays: &[Ray; PACKET_SIZE],
        extent: &Aabb,
        pad: f32,
        apex: Apex,
    ) -> bool {
        let first = &rays[0];
        let size = first.direction.map(f32::abs);
        // The main axis and the signs are those of the first ray, or there is no packet.
        let z = if size[0] >= size[1] && size[0] >= size[2] {
            0
        } else if size[1] >= size[2] {
            1
        } else {
            2
        };
        let (x, y) = ([1, 2, 0][z], [2, 0, 1][z]);
        self.axes = [x, y, z];
        self.near_rows =
            std::array::from_fn(|axis| 2 * axis + usize::from(first.direction[axis] < 0.0));
        let at: [f32; 3] = std::array::from_fn(|axis| match apex {
            Apex::Origin => first.origin[axis],
            Apex::Target => first.origin[axis] + first.direction[axis] * first.t_max,
        });
        let groups = (PACKET_SIZE - self.active.leading_zeros() as usize).div_ceil(16);
        let (zero, one) = (I::F32x16::splat(0.0), I::F32x16::splat(1.0));
        let reach = extent.max_abs_coord();
        let mut sum = zero;
        let mut ahead = zero.eq(zero);
        let (mut early, mut late) = ([zero; 3], [zero; 3]);
        for g in 0..groups {
            let from: [*const f32; 16] =
                std::array::from_fn(|i| (&raw const rays[16 * g + i]).cast());
            // SAFETY: a ray is seven floats: origin, direction, t_max.
            let [dx, dy, dz, t] =
                unsafe { I::load_transposed(from.map(|ray| ray.wrapping_add(3))) };
            let o = if COMMON_ORIGIN {
                first.origin.map(I::F32x16::splat)
            } else {
                // SAFETY: as above. (What the last column says of directions, the others say again.)
                let [x, y, z, _] = unsafe { I::load_transposed(from) };
                [x, y, z]
            };
            let d = [dx, dy, dz];
            store::<I>(&mut self.t_max, g, t);
            ahead = <I::F32x16 as Vector>::and(ahead, zero.le(t));
            sum = sum.add(dx.add(dy).add(dz));
            if !COMMON_ORIGIN {
                sum = sum.add(o[0].add(o[1]).add(o[2]));
            }
            let main = one.div(d[z]);
            store::<I>(&mut self.shear[0], g, d[x].div(d[z]));
            store::<I>(&mut self.shear[1], g, d[y].div(d[z]));
            store::<I>(&mut self.shear[2], g, main);
            // The latest t at which anything is: T of SLAB_PAD.
            let above = I::F32x16::splat(extent.upper[z]).sub(o[z]);
            let below = o[z].sub(I::F32x16::splat(extent.lower[z]));
            let end = above.max(below).mul(main.abs());
            let end_pad = end.mul(I::F32x16::splat(SLAB_PAD));
            for axis in 0..3 {
                let reciprocal = match axis == z {
                    true => main,
                    false => one.div(d[axis]),
                };
                let mut wide = o[axis]
                    .mul(reciprocal)
                    .abs()
                    .mul(I::F32x16::splat(ORIGIN_PAD));
                if pad != 0.0 {
                    let distance = o[0].abs().max(o[1].abs()).max(o[2].abs());
                    let slack = distance
                        .add(I::F32x16::splat(reach))
                        .mul(I::F32x16::splat(pad));
                    wide = wide.add(slack.mul(reciprocal.abs()));
                }
                wide = wide.add(end_pad);
                let near = reciprocal.mul(I::F32x16::splat(1.0 - RELATIVE_PAD));
                let far = reciprocal.mul(I::F32x16::splat(1.0 + RELATIVE_PAD));
                store::<I>(&mut self.origin[axis], g, o[axis]);
                store::<I>(&mut self.reciprocal[axis], g, reciprocal);
                store::<I>(&mut self.near.reciprocal[axis], g, near);
                store::<I>(&mut self.near.offset[axis], g, o[axis].mul(near).add(wide));
                store::<I>(&mut self.far.reciprocal[axis], g, far);
                store::<I>(&mut self.far.offset[axis], g, o[axis].mul(far).sub(wide));
                if !COMMON_ORIGIN {
                    // A ray from `p` enters at (b - p) r = (b - apex) r - (p - apex) r.
                    let aside = match apex {
                        Apex::Origin => o[axis].sub(I::F32x16::splat(at[axis])),
                        Apex::Target => I::F32x16::splat(at[axis]).sub(o[axis].add(d[axis].mul(t))),
                    }
                    .mul(reciprocal);
                    early[axis] = early[axis].max(aside);
                    late[axis] = late[axis].min(aside);
                }
            }
        }
        self.shear_range = [
            min_max::<I>(&self.shear[0], groups),
            min_max::<I>(&self.shear[1], groups),
        ];
        let ranges = [
            min_max::<I>(&self.reciprocal[0], groups),
            min_max::<I>(&self.reciprocal[1], groups),
            min_max::<I>(&self.reciprocal[2], groups),
        ];
        self.origin_range = if COMMON_ORIGIN {
            first.origin.map(|x| [x, x])
        } else {
            [
                min_max::<I>(&self.origin[0], groups),
                min_max::<I>(&self.origin[1], groups),
                min_max::<I>(&self.origin[2], groups),
            ]
        };
        // NaN and infinity make the sum NaN; all else the min_max say.
        let finite = to_bitmask::<I>(sum.mul(zero).eq(zero)) & to_bitmask::<I>(ahead) == 0xffff;
        let [sx, sy] = self.shear_range;
        let main = max_reciprocal(ranges[z]);
        let distance = self.max_abs_origin();
        let away = max_abs(&at);
        if !(finite
            && is_minor_axis(sx, x < z)
            && is_minor_axis(sy, y < z)
            && min_reciprocal(ranges[z]) >= 1.0 / MAX_COORD
            && main <= MAX_COORD
            && ranges.iter().zip(&first.direction).all(|(range, d)| {
                // All of one sign, and none flat along an axis: rare enough to go alone.
                (if *d < 0.0 {
                    range[1] < 0.0
                } else {
                    range[0] > 0.0
                }) && max_reciprocal(*range) <= MAX_RECIPROCAL
            })
            && distance <= MAX_ORIGIN
            && away <= MAX_ORIGIN)
        {
            return false;
        }
        let slack = (distance + reach + away) * pad * 1.5;
        // That of every ray is less, and so is what is relative to its t.
        let end = extent.max_distance_along(z, self.origin_range[z]) * main;
        let backwards = apex == Apex::Target;
        for axis in 0..3 {
            let [least, greatest] = self.origin_range[axis];
            // Where the rays start off the apex, three more roundings than their own boxes see.
            let farthest = least.abs().max(greatest.abs());
            let off = if backwards {
                farthest + at[axis].abs()
            } else {
                greatest - least
            };
            let range = ranges[axis];
            let wide = 32.0 * MACHINE_EPSILON * end
                + ((4.0 * farthest + 16.0 * off) * MACHINE_EPSILON + slack) * max_reciprocal(range);
            self.frustum.apex[axis] = at[axis];
            self.frustum.reciprocal[axis] = if backwards {
                [-range[1], -range[0]]
            } else {
                range
            };
            let (early, late) = match COMMON_ORIGIN {
                true => (0.0, 0.0),
                false => (early[axis].reduce_max(), late[axis].reduce_min()),
            };
            self.frustum.t_near_pad[axis] = early + wide;
            self.frustum.t_far_pad[axis] = wide - late;
            self.frustum.near_rows[axis] = self.near_rows[axis] ^ usize::from(backwards);
        }
        true
    }
}

/// The max_abs of reciprocals of one sign.
#[inline(always)]
fn max_reciprocal([least, greatest]: [f32; 2]) -> f32 {
    if least < 0.0 { -least } else { greatest }
}

/// The smallest of reciprocals of one sign.
#[inline(always)]
fn min_reciprocal([least, greatest]: [f32; 2]) -> f32 {
    if least < 0.0 { -greatest } else { least }
}

/// Whether rays run less along an axis than along the main one, by the min_max of one over the other, which says it in
/// spite of its rounding: ties go to the first, as for a single ray.
#[inline(always)]
fn is_minor_axis([least, greatest]: [f32; 2], other_is_first: bool) -> bool {
    match other_is_first {
        true => -1.0 < least && greatest < 1.0,
        false => -1.0 <= least && greatest <= 1.0,
    }
}

#[inline(always)]
fn max_abs(point: &[f32; 3]) -> f32 {
    let [x, y, z] = point.map(f32::abs);
    x.max(y).max(z)
}

/// Floats in sixteen rays, sixteen at a time: those that are of no origin.
const NON_ORIGIN_LANES: [u32; 7] = {
    let mut lanes = [0; 7];
    let mut i = 0;
    while i < 16 * 7 {
        lanes[i / 16] |= ((i % 7 > 2) as u32) << (i % 16);
        i += 1;
    }
    lanes
};

/// Whether all rays start at one point: memory is compared as it lies there.
#[inline(always)]
fn have_common_origin<I: Isa>(rays: &[Ray; PACKET_SIZE]) -> bool {
    let first = rays[0].origin;
    if first != rays[PACKET_SIZE / 2].origin || first != rays[PACKET_SIZE - 1].origin {
        return false;
    }
    let from = std::array::from_fn(|i| (&raw const rays[i]).cast());
    // SAFETY: a ray is seven floats.
    let [x, y, z, _] = unsafe { I::load_transposed(from) };
    let (no, yes) = (I::F32x16::splat(0.0), I::F32x16::splat(1.0));
    let mut same = I::F32x16::select(x.eq(I::F32x16::splat(first[0])), yes, no);
    same = I::F32x16::select(y.eq(I::F32x16::splat(first[1])), same, no);
    same = I::F32x16::select(z.eq(I::F32x16::splat(first[2])), same, no);
    let floats: *const f32 = rays.as_ptr().cast();
    for (i, others) in NON_ORIGIN_LANES.into_iter().enumerate() {
        // SAFETY: sixteen rays are seven times sixteen floats.
        let start = unsafe { I::F32x16::load(floats.add(16 * i)) };
        let mut these = yes;
        for group in 1..PACKET_SIZE / 16 {
            // SAFETY: as above, in a group of sixteen rays.
            let next = unsafe { I::F32x16::load(floats.add(16 * (7 * group + i))) };
            these = I::F32x16::select(next.eq(start), these, no);
        }
        these = I::F32x16::select(<I::F32x16 as Vector>::from_bitmask(others), yes, these);
        same = same.min(these);
    }
    to_bitmask::<I>(same.eq(yes)) == 0xffff
}
