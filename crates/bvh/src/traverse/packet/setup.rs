//! How rays are made a packet: in one pass over them, of which the extremes tell whether they run alike.

use crate::ray::Ray;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::soa::{bits, extremes, store};
use crate::traverse::packet::{Packet, SIZE};
use crate::traverse::trav_ray::{
    END_PAD, EPS, Extent, ORIGIN_LIMIT, ORIGIN_PAD, REACH_LIMIT, RELATIVE, STEEPEST,
};

impl Packet {
    /// Makes rays ready; false where they do not run alike, or one of them is odd in any way, and nothing may be
    /// concluded. Boxes are padded by `pad` of the largest coordinate of ray and tree in addition.
    #[inline(always)]
    pub fn set<I: Isa>(&mut self, rays: &[Ray], extent: &Extent, pad: f32, apex: Apex) -> bool {
        let n = rays.len();
        debug_assert!(0 < n && n <= SIZE);
        let mut room;
        let all: &[Ray; SIZE] = match rays.try_into() {
            Ok(all) => all,
            Err(_) => {
                room = [rays[0]; SIZE];
                room[..n].copy_from_slice(rays);
                &room
            }
        };
        self.active = u64::MAX >> (SIZE - n);
        // Each is compiled by itself: what starts at one point needs much less.
        let set = match apex == Apex::Origin && start_at_one_point::<I>(all) {
            true => self.set_all::<I, true>(all, extent, pad, apex),
            false => self.set_all::<I, false>(all, extent, pad, apex),
        };
        self.t_max[n..].fill(0.0);
        set
    }

    /// The same with all rays there; `ONE` where they start at one point.
    #[inline(always)]
    fn set_all<I: Isa, const ONE: bool>(
        &mut self,
        rays: &[Ray; SIZE],
        extent: &Extent,
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
        self.entry =
            std::array::from_fn(|axis| 2 * axis + usize::from(first.direction[axis] < 0.0));
        let at: [f32; 3] = std::array::from_fn(|axis| match apex {
            Apex::Origin => first.origin[axis],
            Apex::Target => first.origin[axis] + first.direction[axis] * first.t_max,
        });
        let groups = (SIZE - self.active.leading_zeros() as usize).div_ceil(16);
        let (zero, one) = (I::F16::splat(0.0), I::F16::splat(1.0));
        let reach = extent.reach();
        let mut sum = zero;
        let mut ahead = zero.eq(zero);
        let (mut early, mut late) = ([zero; 3], [zero; 3]);
        for g in 0..groups {
            let from: [*const f32; 16] =
                std::array::from_fn(|i| (&raw const rays[16 * g + i]).cast());
            // SAFETY: a ray is seven floats: origin, direction, t_max.
            let [dx, dy, dz, t] = unsafe { I::columns(from.map(|ray| ray.wrapping_add(3))) };
            let o = if ONE {
                first.origin.map(I::F16::splat)
            } else {
                // SAFETY: as above. (What the last column says of directions, the others say again.)
                let [x, y, z, _] = unsafe { I::columns(from) };
                [x, y, z]
            };
            let d = [dx, dy, dz];
            store::<I>(&mut self.t_max, g, t);
            ahead = <I::F16 as Vector>::and(ahead, zero.le(t));
            sum = sum.add(dx.add(dy).add(dz));
            if !ONE {
                sum = sum.add(o[0].add(o[1]).add(o[2]));
            }
            let main = one.div(d[z]);
            store::<I>(&mut self.shear[0], g, d[x].div(d[z]));
            store::<I>(&mut self.shear[1], g, d[y].div(d[z]));
            store::<I>(&mut self.shear[2], g, main);
            // The latest t at which anything is: T of END_PAD.
            let above = I::F16::splat(extent.upper[z]).sub(o[z]);
            let below = o[z].sub(I::F16::splat(extent.lower[z]));
            let end = above.max(below).mul(main.abs());
            let end_pad = end.mul(I::F16::splat(END_PAD));
            for axis in 0..3 {
                let reciprocal = match axis == z {
                    true => main,
                    false => one.div(d[axis]),
                };
                let mut wide = o[axis].mul(reciprocal).abs().mul(I::F16::splat(ORIGIN_PAD));
                if pad != 0.0 {
                    let distance = o[0].abs().max(o[1].abs()).max(o[2].abs());
                    let slack = distance.add(I::F16::splat(reach)).mul(I::F16::splat(pad));
                    wide = wide.add(slack.mul(reciprocal.abs()));
                }
                wide = wide.add(end_pad);
                let near = reciprocal.mul(I::F16::splat(1.0 - RELATIVE));
                let far = reciprocal.mul(I::F16::splat(1.0 + RELATIVE));
                store::<I>(&mut self.origin[axis], g, o[axis]);
                store::<I>(&mut self.reciprocal[axis], g, reciprocal);
                store::<I>(&mut self.near.reciprocal[axis], g, near);
                store::<I>(&mut self.near.offset[axis], g, o[axis].mul(near).add(wide));
                store::<I>(&mut self.far.reciprocal[axis], g, far);
                store::<I>(&mut self.far.offset[axis], g, o[axis].mul(far).sub(wide));
                if !ONE {
                    // A ray from `p` enters at (b - p) r = (b - apex) r - (p - apex) r.
                    let aside = match apex {
                        Apex::Origin => o[axis].sub(I::F16::splat(at[axis])),
                        Apex::Target => I::F16::splat(at[axis]).sub(o[axis].add(d[axis].mul(t))),
                    }
                    .mul(reciprocal);
                    early[axis] = early[axis].max(aside);
                    late[axis] = late[axis].min(aside);
                }
            }
        }
        self.shears = [
            extremes::<I>(&self.shear[0], groups),
            extremes::<I>(&self.shear[1], groups),
        ];
        let ranges = [
            extremes::<I>(&self.reciprocal[0], groups),
            extremes::<I>(&self.reciprocal[1], groups),
            extremes::<I>(&self.reciprocal[2], groups),
        ];
        self.origins = if ONE {
            first.origin.map(|x| [x, x])
        } else {
            [
                extremes::<I>(&self.origin[0], groups),
                extremes::<I>(&self.origin[1], groups),
                extremes::<I>(&self.origin[2], groups),
            ]
        };
        // NaN and infinity make the sum NaN; all else the extremes say.
        let finite = bits::<I>(sum.mul(zero).eq(zero)) & bits::<I>(ahead) == 0xffff;
        let [sx, sy] = self.shears;
        let main = steepest(ranges[z]);
        let distance = self.distance();
        let away = largest(&at);
        if !(finite
            && runs_less(sx, x < z)
            && runs_less(sy, y < z)
            && flattest(ranges[z]) >= 1.0 / REACH_LIMIT
            && main <= REACH_LIMIT
            && ranges.iter().zip(&first.direction).all(|(range, d)| {
                // All of one sign, and none flat along an axis: rare enough to go alone.
                (if *d < 0.0 {
                    range[1] < 0.0
                } else {
                    range[0] > 0.0
                }) && steepest(*range) <= STEEPEST
            })
            && distance <= ORIGIN_LIMIT
            && away <= ORIGIN_LIMIT)
        {
            return false;
        }
        let slack = (distance + reach + away) * pad * 1.5;
        // That of every ray is less, and so is what is relative to its t.
        let end = extent.farthest(z, self.origins[z]) * main;
        let backwards = apex == Apex::Target;
        for axis in 0..3 {
            let [least, greatest] = self.origins[axis];
            // Where the rays start off the apex, three more roundings than their own boxes see.
            let farthest = least.abs().max(greatest.abs());
            let off = if backwards {
                farthest + at[axis].abs()
            } else {
                greatest - least
            };
            let range = ranges[axis];
            let wide =
                32.0 * EPS * end + ((4.0 * farthest + 16.0 * off) * EPS + slack) * steepest(range);
            self.fan.apex[axis] = at[axis];
            self.fan.reciprocal[axis] = if backwards {
                [-range[1], -range[0]]
            } else {
                range
            };
            let (early, late) = match ONE {
                true => (0.0, 0.0),
                false => (early[axis].greatest(), late[axis].least()),
            };
            self.fan.near[axis] = early + wide;
            self.fan.far[axis] = wide - late;
            self.fan.entry[axis] = self.entry[axis] ^ usize::from(backwards);
        }
        true
    }
}

/// The largest of reciprocals of one sign.
#[inline(always)]
fn steepest([least, greatest]: [f32; 2]) -> f32 {
    if least < 0.0 { -least } else { greatest }
}

/// The smallest of reciprocals of one sign.
#[inline(always)]
fn flattest([least, greatest]: [f32; 2]) -> f32 {
    if least < 0.0 { -greatest } else { least }
}

/// Whether rays run less along an axis than along the main one, by the extremes of one over the other, which says it in
/// spite of its rounding: ties go to the first, as for a single ray.
#[inline(always)]
fn runs_less([least, greatest]: [f32; 2], other_is_first: bool) -> bool {
    match other_is_first {
        true => -1.0 < least && greatest < 1.0,
        false => -1.0 <= least && greatest <= 1.0,
    }
}

#[inline(always)]
fn largest(point: &[f32; 3]) -> f32 {
    let [x, y, z] = point.map(f32::abs);
    x.max(y).max(z)
}

/// Floats in sixteen rays, sixteen at a time: those that are of no origin.
const OF_NO_ORIGIN: [u32; 7] = {
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
fn start_at_one_point<I: Isa>(rays: &[Ray; SIZE]) -> bool {
    let first = rays[0].origin;
    if first != rays[SIZE / 2].origin || first != rays[SIZE - 1].origin {
        return false;
    }
    let from = std::array::from_fn(|i| (&raw const rays[i]).cast());
    // SAFETY: a ray is seven floats.
    let [x, y, z, _] = unsafe { I::columns(from) };
    let (no, yes) = (I::F16::splat(0.0), I::F16::splat(1.0));
    let mut same = I::F16::select(x.eq(I::F16::splat(first[0])), yes, no);
    same = I::F16::select(y.eq(I::F16::splat(first[1])), same, no);
    same = I::F16::select(z.eq(I::F16::splat(first[2])), same, no);
    let floats: *const f32 = rays.as_ptr().cast();
    for (i, others) in OF_NO_ORIGIN.into_iter().enumerate() {
        // SAFETY: sixteen rays are seven times sixteen floats.
        let start = unsafe { I::F16::load(floats.add(16 * i)) };
        let mut these = yes;
        for group in 1..SIZE / 16 {
            // SAFETY: as above, in a group of sixteen rays.
            let next = unsafe { I::F16::load(floats.add(16 * (7 * group + i))) };
            these = I::F16::select(next.eq(start), these, no);
        }
        these = I::F16::select(<I::F16 as Vector>::mask(others), yes, these);
        same = same.min(these);
    }
    bits::<I>(same.eq(yes)) == 0xffff
}
