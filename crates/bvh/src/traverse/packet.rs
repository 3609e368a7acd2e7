//! Sixty-four rays that run alike: boxes are tested once for all.
//!
//! The rays of a packet share their signs and their main axis. Around an apex (the common origin, the light all of them
//! run to, or just the first origin) the t at which any of them may enter a box lies in an interval that follows from
//! the extremes of their reciprocal directions: one test serves 64 rays, and is as sharp as their fan is narrow.

use super::fan::{Apex, Fan};
use super::local::{
    END_PAD, EPS, Extent, ORIGIN_LIMIT, ORIGIN_PAD, REACH_LIMIT, RELATIVE, STEEPEST,
};
use super::rows::{Sides, bits, extremes, load, load3, store};
use crate::ray::Ray;
use crate::simd::{Isa, Vector};

/// The most rays in a packet.
pub const SIZE: usize = 64;

/// Rays in the coordinates of one tree, component by component.
#[repr(C, align(64))]
pub struct Packet {
    pub origin: [[f32; SIZE]; 3],
    pub reciprocal: [[f32; SIZE]; 3],
    pub near: Sides,
    pub far: Sides,
    pub shear: [[f32; SIZE]; 3],
    /// The t up to which a ray is of interest.
    pub t_max: [f32; SIZE],
    pub axes: [usize; 3],
    /// Rows of a node's bounds where boxes are entered.
    pub entry: [usize; 3],
    /// Bit i: there is a ray i.
    pub active: u64,
    pub fan: Fan,
    /// The least and greatest origin by axis, and shear in x and y.
    pub origins: [[f32; 2]; 3],
    pub shears: [[f32; 2]; 2],
}

impl Packet {
    /// An empty one.
    pub const NONE: Packet = Packet {
        origin: [[0.0; SIZE]; 3],
        reciprocal: [[0.0; SIZE]; 3],
        near: Sides::NONE,
        far: Sides::NONE,
        shear: [[0.0; SIZE]; 3],
        t_max: [0.0; SIZE],
        axes: [0; 3],
        entry: [0; 3],
        active: 0,
        fan: Fan {
            apex: [0.0; 3],
            reciprocal: [[0.0; 2]; 3],
            near: [0.0; 3],
            far: [0.0; 3],
            entry: [0; 3],
        },
        origins: [[0.0; 2]; 3],
        shears: [[0.0; 2]; 2],
    };

    /// Makes rays ready; false where they do not run alike, or one of them is odd in any way, and nothing may be
    /// concluded. Boxes are padded by `pad` of the largest coordinate of ray and tree in addition.
    #[inline(always)]
    pub fn set<I: Isa>(&mut self, rays: &[Ray], extent: &Extent, pad: f32, apex: Apex) -> bool {
        let n = rays.len();
        debug_assert!(0 < n && n <= SIZE);
        let mut direction = [[0.0; SIZE]; 3];
        let mut room;
        let all: &[Ray; SIZE] = match rays.try_into() {
            Ok(all) => all,
            Err(_) => {
                room = [rays[0]; SIZE];
                room[..n].copy_from_slice(rays);
                &room
            }
        };
        for group in 0..SIZE / 16 {
            let first: *const Ray = &all[16 * group];
            let from: [*const f32; 16] = std::array::from_fn(|i| first.wrapping_add(i).cast());
            // SAFETY: a ray is seven floats: origin, direction, t_max. (What the first columns say of directions, the
            // others say again.)
            let ([x, y, z, _], [dx, dy, dz, t]) = unsafe {
                (
                    I::columns(from),
                    I::columns(from.map(|ray| ray.wrapping_add(3))),
                )
            };
            for (row, values) in self.origin.iter_mut().zip([x, y, z]) {
                store::<I>(row, group, values);
            }
            for (row, values) in direction.iter_mut().zip([dx, dy, dz]) {
                store::<I>(row, group, values);
            }
            store::<I>(&mut self.t_max, group, t);
        }
        self.active = u64::MAX >> (SIZE - n);
        let groups = n.div_ceil(16);
        let zero = I::F16::splat(0.0);
        let every = (1 << 16) - 1;
        // The main axis and the signs are those of the first ray, or there is no packet.
        let first = [direction[0][0], direction[1][0], direction[2][0]];
        let size = first.map(f32::abs);
        let z = if size[0] >= size[1] && size[0] >= size[2] {
            0
        } else if size[1] >= size[2] {
            1
        } else {
            2
        };
        let (x, y) = ([1, 2, 0][z], [2, 0, 1][z]);
        self.axes = [x, y, z];
        let reach = extent.reach();
        let mut magnitudes = [zero; 4];
        for g in 0..groups {
            let o = load3::<I>(&self.origin, g);
            let d = load3::<I>(&direction, g);
            let size = [d[0].abs(), d[1].abs(), d[2].abs()];
            let distance = o[0].abs().max(o[1].abs()).max(o[2].abs());
            let steepest = size[0].max(size[1]).max(size[2]);
            // NaN and infinity fail these; a product with 0 finds those that a maximum hides.
            let sum = (o[0].add(o[1]).add(o[2]))
                .add(d[0].add(d[1]).add(d[2]))
                .mul(zero);
            let sane = bits::<I>(distance.le(I::F16::splat(ORIGIN_LIMIT)))
                & bits::<I>(steepest.le(I::F16::splat(REACH_LIMIT)))
                & bits::<I>(I::F16::splat(1.0 / REACH_LIMIT).le(steepest))
                & bits::<I>(sum.eq(zero))
                & bits::<I>(zero.le(load::<I>(&self.t_max, g)));
            if sane & below::<I>(size[x], size[z], x < z) & below::<I>(size[y], size[z], y < z)
                != every
            {
                return false;
            }
            magnitudes[g] = distance.add(I::F16::splat(reach));
            let slack = magnitudes[g].mul(I::F16::splat(pad));
            // The latest t at which anything is: T of END_PAD.
            let above = I::F16::splat(extent.upper[z]).sub(o[z]);
            let below = o[z].sub(I::F16::splat(extent.lower[z]));
            let main = I::F16::splat(1.0).div(d[z]);
            let end = above.max(below).mul(main.abs());
            let end_pad = end.mul(I::F16::splat(END_PAD));
            for axis in 0..3 {
                let steep = I::F16::splat(1.0).le(size[axis].mul(I::F16::splat(STEEPEST)));
                if bits::<I>(steep) != every {
                    // Flat along an axis: rare enough to go alone.
                    return false;
                }
                let reciprocal = match axis == z {
                    true => main,
                    false => I::F16::splat(1.0).div(d[axis]),
                };
                let negative = bits::<I>(reciprocal.le(zero));
                if negative != if first[axis] < 0.0 { every } else { 0 } {
                    return false;
                }
                let at = o[axis].mul(reciprocal);
                let wide = (at.abs().mul(I::F16::splat(ORIGIN_PAD)))
                    .add(slack.mul(reciprocal.abs()))
                    .add(end_pad);
                let near = reciprocal.mul(I::F16::splat(1.0 - RELATIVE));
                let far = reciprocal.mul(I::F16::splat(1.0 + RELATIVE));
                store::<I>(&mut self.reciprocal[axis], g, reciprocal);
                store::<I>(&mut self.near.reciprocal[axis], g, near);
                store::<I>(&mut self.near.offset[axis], g, o[axis].mul(near).add(wide));
                store::<I>(&mut self.far.reciprocal[axis], g, far);
                store::<I>(&mut self.far.offset[axis], g, o[axis].mul(far).sub(wide));
            }
            store::<I>(&mut self.shear[0], g, d[x].div(d[z]));
            store::<I>(&mut self.shear[1], g, d[y].div(d[z]));
            store::<I>(&mut self.shear[2], g, main);
        }
        self.entry = std::array::from_fn(|axis| 2 * axis + usize::from(first[axis] < 0.0));
        let set = self.set_fan::<I>(&direction, groups, &magnitudes, extent, pad, apex);
        self.t_max[n..].fill(0.0);
        set
    }

    #[inline(always)]
    fn set_fan<I: Isa>(
        &mut self,
        direction: &[[f32; SIZE]; 3],
        groups: usize,
        magnitudes: &[I::F16; 4],
        extent: &Extent,
        pad: f32,
        apex: Apex,
    ) -> bool {
        let at: [f32; 3] = std::array::from_fn(|axis| match apex {
            Apex::Origin => self.origin[axis][0],
            Apex::Target => self.origin[axis][0] + direction[axis][0] * self.t_max[0],
        });
        let away = at
            .iter()
            .fold(0.0f32, |m, x| if x.abs() > m { x.abs() } else { m });
        if away.is_nan() || away > ORIGIN_LIMIT {
            return false;
        }
        // No closure over vectors: one that is not inlined makes a call of every operation.
        let mut magnitude = magnitudes[0];
        for other in &magnitudes[1..groups] {
            magnitude = magnitude.max(*other);
        }
        let magnitude = magnitude.greatest();
        let slack = (magnitude + away) * pad * 1.5;
        let z = self.axes[2];
        let main = extremes::<I>(&self.reciprocal[z], groups);
        let origins = extremes::<I>(&self.origin[z], groups);
        // That of every ray is less, and so is what is relative to its t.
        let end = extent.farthest(z, origins) * steepest(main);
        for axis in 0..3 {
            let range = extremes::<I>(&self.reciprocal[axis], groups);
            let origins = extremes::<I>(&self.origin[axis], groups);
            let (mut early, mut late) = (I::F16::splat(0.0), I::F16::splat(0.0));
            if apex == Apex::Target || origins[0] != origins[1] {
                for g in 0..groups {
                    let r = load::<I>(&self.reciprocal[axis], g);
                    let r = if apex == Apex::Target {
                        I::F16::splat(0.0).sub(r)
                    } else {
                        r
                    };
                    // A ray from `p` enters at (b - p) r = (b - apex) r - (p - apex) r.
                    let o = load::<I>(&self.origin[axis], g);
                    let point = match apex {
                        Apex::Origin => o,
                        Apex::Target => {
                            o.add(load::<I>(&direction[axis], g).mul(load::<I>(&self.t_max, g)))
                        }
                    };
                    let aside = point.sub(I::F16::splat(at[axis])).mul(r);
                    early = early.max(aside);
                    late = late.min(aside);
                }
            }
            // Where the rays start off the apex, three more roundings than their own boxes see.
            let backwards = apex == Apex::Target;
            let farthest = origins[0].abs().max(origins[1].abs());
            let off = if backwards {
                farthest + at[axis].abs()
            } else {
                origins[1] - origins[0]
            };
            let wide =
                32.0 * EPS * end + ((4.0 * farthest + 16.0 * off) * EPS + slack) * steepest(range);
            self.fan.apex[axis] = at[axis];
            self.fan.reciprocal[axis] = if backwards {
                [-range[1], -range[0]]
            } else {
                range
            };
            self.fan.near[axis] = early.greatest() + wide;
            self.fan.far[axis] = wide - late.least();
            self.fan.entry[axis] = self.entry[axis] ^ usize::from(backwards);
            self.origins[axis] = origins;
        }
        self.shears = [
            extremes::<I>(&self.shear[0], groups),
            extremes::<I>(&self.shear[1], groups),
        ];
        true
    }

    /// Bit i: ray i, one of `active`, enters the box (rows as of [`Node::bounds`]) at a t that is of interest.
    #[inline(always)]
    pub fn enter<I: Isa>(&self, bounds: impl Fn(usize) -> f32, active: u64) -> u64 {
        let [x, y, z] = self.entry;
        let first = [
            I::F16::splat(bounds(x)),
            I::F16::splat(bounds(y)),
            I::F16::splat(bounds(z)),
        ];
        let last = [
            I::F16::splat(bounds(x ^ 1)),
            I::F16::splat(bounds(y ^ 1)),
            I::F16::splat(bounds(z ^ 1)),
        ];
        let mut entered = 0;
        for g in 0..SIZE / 16 {
            if active >> (16 * g) & 0xffff == 0 {
                continue;
            }
            let (near, far) = (self.near.lanes::<I>(g), self.far.lanes::<I>(g));
            let enter = near.passes(0, first[0]).max(near.passes(1, first[1]));
            let enter = enter.max(near.passes(2, first[2])).max(I::F16::splat(0.0));
            let leave = far.passes(0, last[0]).min(far.passes(1, last[1]));
            let leave = leave
                .min(far.passes(2, last[2]))
                .min(load::<I>(&self.t_max, g));
            entered |= u64::from(<I::F16 as Vector>::bits(enter.le(leave))) << (16 * g);
        }
        entered & active
    }

    /// Where all rays start, if that is one point.
    #[inline(always)]
    pub fn start(&self) -> Option<[f32; 3]> {
        let one = self
            .origins
            .iter()
            .all(|[least, greatest]| least == greatest);
        one.then(|| self.origins.map(|[start, _]| start))
    }

    /// The largest coordinate of their origins.
    #[inline(always)]
    pub fn distance(&self) -> f32 {
        self.origins
            .iter()
            .flatten()
            .fold(0.0, |m, x| if x.abs() > m { x.abs() } else { m })
    }

    /// How far apart the rays start.
    #[inline(always)]
    pub fn spread(&self) -> f32 {
        self.origins.iter().fold(0.0, |m, [least, greatest]| {
            if greatest - least > m {
                greatest - least
            } else {
                m
            }
        })
    }

    /// The values of a group of 16 rays.
    #[inline(always)]
    pub fn lanes<I: Isa>(&self, row: &[f32; SIZE], group: usize) -> I::F16 {
        load::<I>(row, group & 3)
    }

    /// Bit i: ray i is of interest at `t`, and farther.
    #[inline(always)]
    pub fn reaching<I: Isa>(&self, t: f32) -> u64 {
        let t = I::F16::splat(t);
        let mut reaching = 0;
        for group in 0..SIZE / 16 {
            let lanes = bits::<I>(t.le(load::<I>(&self.t_max, group)));
            reaching |= u64::from(lanes) << (16 * group);
        }
        reaching
    }

    /// The largest t that is of interest to any ray.
    #[inline(always)]
    pub fn farthest<I: Isa>(&self) -> f32 {
        let t = &self.t_max;
        load::<I>(t, 0)
            .max(load::<I>(t, 1))
            .max(load::<I>(t, 2).max(load::<I>(t, 3)))
            .greatest()
    }
}

/// The largest of reciprocals of one sign.
#[inline(always)]
fn steepest([least, greatest]: [f32; 2]) -> f32 {
    if least < 0.0 { -least } else { greatest }
}

/// Where an axis is not the main one beside `main`: ties go to the first, as for a single ray.
#[inline(always)]
fn below<I: Isa>(other: I::F16, main: I::F16, other_is_first: bool) -> u32 {
    let less = bits::<I>(other.le(main));
    if other_is_first {
        less & !bits::<I>(other.eq(main))
    } else {
        less
    }
}
