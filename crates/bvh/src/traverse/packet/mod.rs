//! Packets: up to 64 coherent rays in SoA, traversed together.
//!
//! The rays share their signs and their major axis (the direction class). The apex of a packet is the common origin,
//! the common light, or the first origin. The t, measured from the apex, at which any ray may enter a box lies in an
//! interval. The extremes of the rays' reciprocal directions determine this interval. One frustum test applies to 64
//! rays; its precision depends on their divergence.
//!
//! `soa`, `frustum` and `setup` create a packet; `traversal` and `incoherent` traverse a BLAS; `cull`,
//! `triangle_edges`, `triangle` and `hits` test leaves.

pub(crate) mod cull;
pub(crate) mod frustum;
pub(crate) mod hits;
pub(crate) mod incoherent;
pub(crate) mod packet_ray;
pub(crate) mod setup;
pub(crate) mod soa;
pub(crate) mod traversal;
pub(crate) mod triangle;
pub(crate) mod triangle_edges;

use crate::simd::{Isa, Vector};
use crate::traverse::packet::frustum::Frustum;
use crate::traverse::packet::soa::{PACKET_SIZE, SlabPlanesSoa, load, to_bitmask};

/// Up to 64 rays in the coordinates of one tree, in SoA.
#[repr(C, align(64))]
pub struct Packet {
    pub origin: [[f32; PACKET_SIZE]; 3],
    pub reciprocal: [[f32; PACKET_SIZE]; 3],
    pub near: SlabPlanesSoa,
    pub far: SlabPlanesSoa,
    pub shear: [[f32; PACKET_SIZE]; 3],
    /// The largest valid t of each ray. After a hit, this value also includes the window of
    /// [`crate::traverse::near_ties`].
    pub t_max: [f32; PACKET_SIZE],
    /// Width of this window at t = 0, as a length.
    pub tie_width: f32,
    pub axes: [usize; 3],
    /// For each axis, the row of a node's bounds that contains the planes where rays enter.
    pub near_rows: [usize; 3],
    /// Bit i: the packet contains ray i.
    pub active: u64,
    pub frustum: Frustum,
    /// The range of the rays' origins along each axis, and of their shear in x and y.
    pub origin_range: [[f32; 2]; 3],
    pub shear_range: [[f32; 2]; 2],
}

impl Packet {
    /// A packet without rays.
    pub const EMPTY: Packet = Packet {
        origin: [[0.0; PACKET_SIZE]; 3],
        reciprocal: [[0.0; PACKET_SIZE]; 3],
        near: SlabPlanesSoa::EMPTY,
        far: SlabPlanesSoa::EMPTY,
        shear: [[0.0; PACKET_SIZE]; 3],
        t_max: [0.0; PACKET_SIZE],
        tie_width: 0.0,
        axes: [0; 3],
        near_rows: [0; 3],
        active: 0,
        frustum: Frustum {
            apex: [0.0; 3],
            reciprocal: [[0.0; 2]; 3],
            t_near_pad: [0.0; 3],
            t_far_pad: [0.0; 3],
            near_rows: [0; 3],
        },
        origin_range: [[0.0; 2]; 3],
        shear_range: [[0.0; 2]; 2],
    };

    /// Bit i is set if ray i is in `active` and enters the box within its t_max. `bounds` returns the box's
    /// coordinate for a row of [`crate::node::WideNode::bounds`].
    #[inline(always)]
    pub fn intersect_box<I: Isa>(&self, bounds: impl Fn(usize) -> f32, active: u64) -> u64 {
        let [x, y, z] = self.near_rows;
        let first = [I::F32x16::splat(bounds(x)), I::F32x16::splat(bounds(y)), I::F32x16::splat(bounds(z))];
        let last = [I::F32x16::splat(bounds(x ^ 1)), I::F32x16::splat(bounds(y ^ 1)), I::F32x16::splat(bounds(z ^ 1))];
        let mut entered = 0;
        for g in 0..PACKET_SIZE / 16 {
            if active >> (16 * g) & 0xffff == 0 {
                continue;
            }
            let (near, far) = (self.near.lanes::<I>(g), self.far.lanes::<I>(g));
            let enter = near.t_at(0, first[0]).max(near.t_at(1, first[1]));
            let enter = enter.max(near.t_at(2, first[2])).max(I::F32x16::splat(0.0));
            let leave = far.t_at(0, last[0]).min(far.t_at(1, last[1]));
            let leave = leave.min(far.t_at(2, last[2])).min(load::<I>(&self.t_max, g));
            entered |= u64::from(<I::F32x16 as Vector>::to_bitmask(enter.le(leave))) << (16 * g);
        }
        entered & active
    }

    /// Origin of all rays, if they have a common origin.
    #[inline(always)]
    pub fn common_origin(&self) -> Option<[f32; 3]> {
        let one = self.origin_range.iter().all(|[least, greatest]| least == greatest);
        one.then(|| self.origin_range.map(|[start, _]| start))
    }

    /// The largest absolute coordinate of the origins.
    #[inline(always)]
    pub fn max_abs_origin(&self) -> f32 {
        self.origin_range.iter().flatten().fold(0.0, |m, x| if x.abs() > m { x.abs() } else { m })
    }

    /// The largest extent of the origins along an axis.
    #[inline(always)]
    pub fn origin_extent(&self) -> f32 {
        self.origin_range.iter().fold(
            0.0,
            |m, [least, greatest]| {
                if greatest - least > m { greatest - least } else { m }
            },
        )
    }

    /// Bit i: ray i extends to `t`.
    #[inline(always)]
    pub fn rays_reaching<I: Isa>(&self, t: f32) -> u64 {
        let t = I::F32x16::splat(t);
        let mut reaching = 0;
        for group in 0..PACKET_SIZE / 16 {
            let lanes = to_bitmask::<I>(t.le(load::<I>(&self.t_max, group)));
            reaching |= u64::from(lanes) << (16 * group);
        }
        reaching
    }

    /// The largest t_max of all rays.
    #[inline(always)]
    pub fn max_t<I: Isa>(&self) -> f32 {
        let t = &self.t_max;
        load::<I>(t, 0).max(load::<I>(t, 1)).max(load::<I>(t, 2).max(load::<I>(t, 3))).reduce_max()
    }
}
