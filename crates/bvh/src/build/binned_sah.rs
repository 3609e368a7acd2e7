//! One split of a range of boxes by the binned surface-area heuristic (Wald 2007).

use crate::build::prim_ref::{EMPTY_BOUNDS, PackedBounds, PrimInfo, PrimRef, diagonal, half_areas};
use crate::limits::MAX_DEPTH;
use crate::simd::{F32x4, Isa, Vector};

/// Boxes and counts by axis and bin.
#[repr(align(32))]
pub struct SahBins<const N: usize> {
    bounds: [[PackedBounds; N]; 3],
    count: [[u32; N]; 3],
}

/// Which bin a centroid falls into: the same arithmetic wherever it is asked.
#[derive(Clone, Copy)]
pub struct BinMapping {
    offset: F32x4,
    scale: F32x4,
}

/// A plane between two bins, and the boxes on both sides.
#[derive(Clone, Copy)]
pub struct SahSplit {
    /// Across which it lies.
    pub axis: usize,
    /// SahBins below this one are on the left side.
    first_right_bin: usize,
    /// The boxes of the prims on the left and on the right.
    pub bounds: [PackedBounds; 2],
}

impl BinMapping {
    /// As many bins along each axis.
    pub fn new(range: &PrimInfo, bins: usize) -> BinMapping {
        let extent = range.centroid_upper.sub(range.centroid_lower).array();
        let scale = std::array::from_fn(|a| {
            // Just below the number of bins, so that the last centroid stays in the last bin; 0 for a flat axis.
            let scale = bins as f32 * 0.999_99 / extent[a];
            if a < 3 && extent[a] > 0.0 && scale.is_finite() {
                scale
            } else {
                0.0
            }
        });
        BinMapping {
            offset: range.centroid_lower,
            scale: F32x4::new(scale),
        }
    }

    /// The bins of a centroid, and what is left over.
    #[inline(always)]
    pub fn bin_coords(&self, centroid: F32x4) -> F32x4 {
        centroid.sub(self.offset).mul(self.scale)
    }
}

impl SahSplit {
    /// What [`BinMapping::bin_coords`] is below on the left side.
    pub fn split_threshold(&self) -> F32x4 {
        F32x4::splat(self.first_right_bin as f32)
    }

    /// Where it lies, up to rounding, along its axis.
    pub fn position(&self, mapping: &BinMapping) -> f32 {
        let (offset, scale) = (mapping.offset.array(), mapping.scale.array());
        offset[self.axis] + self.first_right_bin as f32 / scale[self.axis]
    }
}

impl<const N: usize> SahBins<N> {
    /// No boxes.
    pub fn empty() -> Self {
        SahBins {
            bounds: [[EMPTY_BOUNDS; N]; 3],
            count: [[0; N]; 3],
        }
    }

    /// Adds prims.
    #[inline(always)]
    pub fn add<I: Isa>(&mut self, prims: &[PrimRef], mapping: &BinMapping) {
        for prim in prims {
            let at = mapping.bin_coords(prim.centroid()).to_i32_trunc();
            let packed = prim.load::<I>();
            for axis in 0..3 {
                // The value is within 0..N by the choice of `scale`; the mask says so to the compiler.
                let b = at[axis] as usize & (N - 1);
                let bounds = self.bounds[axis][b].as_mut_ptr();
                // SAFETY: a box has eight floats.
                unsafe { I::F32x8::load(bounds).min(packed).store(bounds) };
                self.count[axis][b] += 1;
            }
        }
    }

    /// Adds what another has.
    pub fn merge(&mut self, b: &Self) {
        for axis in 0..3 {
            for i in 0..N {
                let (to, from) = (&mut self.bounds[axis][i], &b.bounds[axis][i]);
                *to = std::array::from_fn(|k| to[k].min(from[k]));
                self.count[axis][i] += b.count[axis][i];
            }
        }
    }

    /// The cheapest plane, where leaves hold `leaf_size` prims, a power of two; ties go to the lower axis and bin.
    #[inline(always)]
    pub fn best_split<I: Isa>(&self, mapping: &BinMapping, leaf_size: u32) -> Option<SahSplit> {
        let mut best: Option<(f32, usize, usize)> = None;
        let scale = mapping.scale.array();
        // What a side costs goes by the leaves it fills; one without prims is out of the question.
        let weight = |n: u32| match n {
            0 => f32::INFINITY,
            _ => ((n + (leaf_size - 1)) & !(leaf_size - 1)) as f32,
        };
        for axis in (0..3).filter(|&a| scale[a] > 0.0) {
            let (bounds, count) = (&self.bounds[axis], &self.count[axis]);
            // SAFETY: a box has eight floats.
            let bin = |i: usize| unsafe { I::F32x8::load(bounds[i].as_ptr()) };
            // What the bins from each on cost, four at a time.
            let mut right = [F32x4::splat(f32::INFINITY); N];
            let (mut whole, mut n) = (I::F32x8::splat(f32::INFINITY), 0);
            for four in (0..N / 4).rev() {
                let (mut extents, mut weights) = ([F32x4::splat(0.0); 4], [0.0; 4]);
                for k in (0..4).rev() {
                    whole = whole.min(bin(4 * four + k));
                    n += count[4 * four + k];
                    (extents[k], weights[k]) = (diagonal::<I>(whole), weight(n));
                }
                right[four] = half_areas(extents).mul(F32x4::new(weights));
            }
            // And those up to each, beside those that follow.
            (whole, n) = (I::F32x8::splat(f32::INFINITY), 0);
            for four in 0..N / 4 {
                let (mut extents, mut weights) = ([F32x4::splat(0.0); 4], [0.0; 4]);
                for k in 0..4 {
                    // Nothing is before the first.
                    (extents[k], weights[k]) = (diagonal::<I>(whole), weight(n));
                    whole = whole.min(bin(4 * four + k));
                    n += count[4 * four + k];
                }
                let left = half_areas(extents).mul(F32x4::new(weights));
                let cost = left.add(right[four]).array();
                for k in 0..4 {
                    if cost[k] < best.map_or(f32::INFINITY, |best| best.0) {
                        best = Some((cost[k], axis, 4 * four + k));
                    }
                }
            }
        }
        let (_, axis, first_right_bin) = best?;
        let mut sides = [EMPTY_BOUNDS; 2];
        for (i, bin) in self.bounds[axis].iter().enumerate() {
            let side = &mut sides[usize::from(i >= first_right_bin)];
            *side = std::array::from_fn(|k| side[k].min(bin[k]));
        }
        Some(SahSplit {
            axis,
            first_right_bin,
            bounds: sides,
        })
    }
}

/// Whether there are levels to spare for a split that is not in the middle. Halving takes as many as the bits of the
/// number of prims: once that is all that is left, it is all that happens.
pub fn has_depth_budget(prims: &[PrimRef], depth: usize) -> bool {
    depth + (prims.len().next_power_of_two().trailing_zeros() as usize) < MAX_DEPTH
}
