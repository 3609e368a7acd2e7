//! Rows of a packet: one value of each ray, sixteen at a time.

use crate::simd::{Isa, Vector};
use crate::traverse::packet::SIZE;

#[inline(always)]
pub fn load<I: Isa>(row: &[f32; SIZE], group: usize) -> I::F16 {
    debug_assert!(group < SIZE / 16);
    // SAFETY: a group is below 4, and 4 groups of 16 fill the row.
    unsafe { I::F16::load(row.as_ptr().add(16 * group)) }
}

#[inline(always)]
pub fn store<I: Isa>(row: &mut [f32; SIZE], group: usize, values: I::F16) {
    debug_assert!(group < SIZE / 16);
    // SAFETY: as in `load`.
    unsafe { values.store(row.as_mut_ptr().add(16 * group)) }
}

/// The values of a group of [`Isa::RAYS`] rays.
#[inline(always)]
pub fn rays<I: Isa>(row: &[f32; SIZE], group: usize) -> I::Rays {
    // SAFETY: a group is taken modulo how many there are, which fill the row.
    unsafe { I::Rays::load(row.as_ptr().add(I::RAYS * (group % (SIZE / I::RAYS)))) }
}

/// Stores the lanes of a mask in such a group.
#[inline(always)]
pub fn keep<I: Isa>(
    row: &mut [f32; SIZE],
    group: usize,
    lanes: <I::Rays as Vector>::Mask,
    values: I::Rays,
) {
    let values = I::Rays::select(lanes, values, rays::<I>(row, group));
    // SAFETY: as in `rays`.
    unsafe { values.store(row.as_mut_ptr().add(I::RAYS * (group % (SIZE / I::RAYS)))) }
}

#[inline(always)]
pub fn load3<I: Isa>(rows: &[[f32; SIZE]; 3], group: usize) -> [I::F16; 3] {
    [
        load::<I>(&rows[0], group),
        load::<I>(&rows[1], group),
        load::<I>(&rows[2], group),
    ]
}

/// Where the rays of a packet pass planes: [`crate::traverse::trav_ray::Side`], ray by ray.
#[repr(C, align(64))]
pub struct Sides {
    pub reciprocal: [[f32; SIZE]; 3],
    pub offset: [[f32; SIZE]; 3],
}

impl Sides {
    pub const NONE: Sides = Sides {
        reciprocal: [[0.0; SIZE]; 3],
        offset: [[0.0; SIZE]; 3],
    };

    /// The t at which ray `i` passes a plane across an axis.
    #[inline(always)]
    pub fn passes(&self, axis: usize, i: usize, plane: f32) -> f32 {
        plane.mul_add(self.reciprocal[axis][i], -self.offset[axis][i])
    }

    /// The t at which each ray of a group, as of [`rays`], passes a plane of its own across an axis.
    #[inline(always)]
    pub fn each_passes<I: Isa>(&self, axis: usize, group: usize, planes: I::Rays) -> I::Rays {
        let reciprocal = rays::<I>(&self.reciprocal[axis], group);
        planes.mul_sub(reciprocal, rays::<I>(&self.offset[axis], group))
    }

    #[inline(always)]
    pub fn lanes<I: Isa>(&self, group: usize) -> SideLanes<I::F16> {
        SideLanes {
            reciprocal: load3::<I>(&self.reciprocal, group),
            offset: load3::<I>(&self.offset, group),
        }
    }
}

/// Sixteen of [`Sides`].
pub struct SideLanes<V> {
    reciprocal: [V; 3],
    offset: [V; 3],
}

impl<V: Vector> SideLanes<V> {
    /// The t at which each ray passes a plane across an axis.
    #[inline(always)]
    pub fn passes(&self, axis: usize, plane: V) -> V {
        plane.mul_sub(self.reciprocal[axis], self.offset[axis])
    }
}

#[inline(always)]
pub fn bits<I: Isa>(mask: <I::F16 as Vector>::Mask) -> u32 {
    <I::F16 as Vector>::bits(mask)
}

/// The least and the greatest value of some groups.
#[inline(always)]
pub fn extremes<I: Isa>(row: &[f32; SIZE], groups: usize) -> [f32; 2] {
    let (mut least, mut greatest) = (load::<I>(row, 0), load::<I>(row, 0));
    for g in 1..groups {
        least = least.min(load::<I>(row, g));
        greatest = greatest.max(load::<I>(row, g));
    }
    [least.least(), greatest.greatest()]
}
