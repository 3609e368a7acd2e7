//! SoA rows of a packet: each row contains one value for every ray, and sixteen values are loaded at a time.

use crate::simd::{Isa, Vector};

/// The largest number of rays in a packet.
pub const PACKET_SIZE: usize = 64;

#[inline(always)]
pub fn load<I: Isa>(row: &[f32; PACKET_SIZE], group: usize) -> I::F32x16 {
    debug_assert!(group < PACKET_SIZE / 16);
    // SAFETY: a group is below 4, and 4 groups of 16 fill the row.
    unsafe { I::F32x16::load(row.as_ptr().add(16 * group)) }
}

#[inline(always)]
pub fn store<I: Isa>(row: &mut [f32; PACKET_SIZE], group: usize, values: I::F32x16) {
    debug_assert!(group < PACKET_SIZE / 16);
    // SAFETY: as in `load`.
    unsafe { values.store(row.as_mut_ptr().add(16 * group)) }
}

/// Loads the values of a group of [`Isa::RAY_LANES`] rays from a row.
#[inline(always)]
pub fn load_rays<I: Isa>(row: &[f32; PACKET_SIZE], group: usize) -> I::RayVec {
    // SAFETY: the group index is reduced modulo the number of groups, and the groups fill the row.
    unsafe { I::RayVec::load(row.as_ptr().add(I::RAY_LANES * (group % (PACKET_SIZE / I::RAY_LANES)))) }
}

/// Stores the values of the lanes in a mask, for a group of [`Isa::RAY_LANES`] rays.
#[inline(always)]
pub fn store_masked<I: Isa>(
    row: &mut [f32; PACKET_SIZE],
    group: usize,
    lanes: <I::RayVec as Vector>::Mask,
    values: I::RayVec,
) {
    let values = I::RayVec::select(lanes, values, load_rays::<I>(row, group));
    // SAFETY: as in `load_rays`.
    unsafe { values.store(row.as_mut_ptr().add(I::RAY_LANES * (group % (PACKET_SIZE / I::RAY_LANES)))) }
}

#[inline(always)]
pub fn load_xyz<I: Isa>(rows: &[[f32; PACKET_SIZE]; 3], group: usize) -> [I::F32x16; 3] {
    [load::<I>(&rows[0], group), load::<I>(&rows[1], group), load::<I>(&rows[2], group)]
}

/// [`crate::traverse::trav_ray::SlabPlanes`] of the rays of a packet.
#[repr(C, align(64))]
pub struct SlabPlanesSoa {
    pub reciprocal: [[f32; PACKET_SIZE]; 3],
    pub offset: [[f32; PACKET_SIZE]; 3],
}

impl SlabPlanesSoa {
    pub const EMPTY: SlabPlanesSoa =
        SlabPlanesSoa { reciprocal: [[0.0; PACKET_SIZE]; 3], offset: [[0.0; PACKET_SIZE]; 3] };

    /// The t at which ray `i` crosses a plane across an axis.
    #[inline(always)]
    pub fn t_at(&self, axis: usize, i: usize, plane: f32) -> f32 {
        plane.mul_add(self.reciprocal[axis][i], -self.offset[axis][i])
    }

    /// The t at which each ray of a group crosses its own plane across an axis; groups as in [`load_rays`].
    #[inline(always)]
    pub fn t_at_lanes<I: Isa>(&self, axis: usize, group: usize, planes: I::RayVec) -> I::RayVec {
        let reciprocal = load_rays::<I>(&self.reciprocal[axis], group);
        planes.mul_sub(reciprocal, load_rays::<I>(&self.offset[axis], group))
    }

    #[inline(always)]
    pub fn lanes<I: Isa>(&self, group: usize) -> SlabPlanesX16<I::F32x16> {
        SlabPlanesX16 { reciprocal: load_xyz::<I>(&self.reciprocal, group), offset: load_xyz::<I>(&self.offset, group) }
    }
}

/// Sixteen lanes of [`SlabPlanesSoa`].
pub struct SlabPlanesX16<V> {
    reciprocal: [V; 3],
    offset: [V; 3],
}

impl<V: Vector> SlabPlanesX16<V> {
    /// The t at which each ray crosses a plane across an axis.
    #[inline(always)]
    pub fn t_at(&self, axis: usize, plane: V) -> V {
        plane.mul_sub(self.reciprocal[axis], self.offset[axis])
    }
}

#[inline(always)]
pub fn to_bitmask<I: Isa>(mask: <I::F32x16 as Vector>::Mask) -> u32 {
    <I::F32x16 as Vector>::to_bitmask(mask)
}

/// The minimum and the maximum of a row's first `groups` groups.
#[inline(always)]
pub fn min_max<I: Isa>(row: &[f32; PACKET_SIZE], groups: usize) -> [f32; 2] {
    let (mut least, mut greatest) = (load::<I>(row, 0), load::<I>(row, 0));
    for g in 1..groups {
        least = least.min(load::<I>(row, g));
        greatest = greatest.max(load::<I>(row, g));
    }
    [least.reduce_min(), greatest.reduce_max()]
}
