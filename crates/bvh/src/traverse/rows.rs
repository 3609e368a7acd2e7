//! Rows of a packet: one value of each ray, sixteen at a time.

use super::packet::SIZE;
use crate::simd::{Isa, Vector};

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

#[inline(always)]
pub fn load3<I: Isa>(rows: &[[f32; SIZE]; 3], group: usize) -> [I::F16; 3] {
    [
        load::<I>(&rows[0], group),
        load::<I>(&rows[1], group),
        load::<I>(&rows[2], group),
    ]
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
