//! Sixty-four rays that run alike: boxes are tested once for all.
//!
//! The rays of a packet share their signs and their main axis. Around an apex (the common origin, the light all of them
//! run to, or just the first origin) the t at which any of them may enter a box lies in an interval that follows from
//! the extremes of their reciprocal directions: one test serves 64 rays, and is as sharp as their fan is narrow.

pub(crate) mod frustum;
pub(crate) mod incoherent;
pub(crate) mod setup;
pub(crate) mod soa;
pub(crate) mod tlas;
pub(crate) mod traversal;

use crate::simd::{Isa, Vector};
use crate::traverse::packet::frustum::Fan;
use crate::traverse::packet::soa::{Sides, bits, load};

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
