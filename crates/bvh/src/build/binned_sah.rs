//! A binned SAH split of primitives (I. Wald, "On Fast Construction of SAH-based Bounding Volume Hierarchies", 2007).

use crate::build::prim_ref::{EMPTY_BOUNDS, PackedBounds, PrimInfo, PrimRef, diagonal, half_areas};
use crate::limits::MAX_DEPTH;
use crate::simd::{F32x4, Isa, Vector};

/// Bounds and number of the primitives in each bin along each axis.
#[repr(align(32))]
pub struct SahBins<const N: usize> {
    bounds: [[PackedBounds; N]; 3],
    count: [[u32; N]; 3],
}

/// The affine map from a centroid to its bins; binning and partition use the same arithmetic.
#[derive(Clone, Copy)]
pub struct BinMapping {
    offset: F32x4,
    scale: F32x4,
}

/// A plane between two bins, and the bounds of both sides.
#[derive(Clone, Copy)]
pub struct SahSplit {
    /// The axis that the plane crosses.
    pub axis: usize,
    /// Bins below this index are on the left side.
    first_right_bin: usize,
    /// The bounds of the primitives on the left and on the right.
    pub bounds: [PackedBounds; 2],
}

impl BinMapping {
    /// Creates the map to `bins` bins along each axis.
    pub fn new(range: &PrimInfo, bins: usize) -> BinMapping {
        let extent = range.centroid_upper.sub(range.centroid_lower).array();
        let scale = std::array::from_fn(|a| {
            // The factor is slightly below the number of bins, so that the last centroid stays in the last bin; the
            // scale is 0 for an axis along which all centroids are equal.
            let scale = bins as f32 * 0.999_99 / extent[a];
            if a < 3 && extent[a] > 0.0 && scale.is_finite() { scale } else { 0.0 }
        });
        BinMapping { offset: range.centroid_lower, scale: F32x4::new(scale) }
    }

    /// The centroid's position along each axis in units of bins; the integer part is the bin.
    #[inline(always)]
    pub fn bin_coords(&self, centroid: F32x4) -> F32x4 {
        centroid.sub(self.offset).mul(self.scale)
    }
}

impl SahSplit {
    /// Value of [`BinMapping::bin_coords`] below which a centroid is on the left side.
    pub fn split_threshold(&self) -> F32x4 {
        F32x4::splat(self.first_right_bin as f32)
    }

    /// The coordinate of the plane along its axis, up to rounding.
    pub fn position(&self, mapping: &BinMapping) -> f32 {
        let (offset, scale) = (mapping.offset.array(), mapping.scale.array());
        offset[self.axis] + self.first_right_bin as f32 / scale[self.axis]
    }
}

impl<const N: usize> SahBins<N> {
    /// Creates bins without primitives.
    pub fn empty() -> Self {
        SahBins { bounds: [[EMPTY_BOUNDS; N]; 3], count: [[0; N]; 3] }
    }

    /// Adds primitives to their bins.
    #[inline(always)]
    pub fn add<I: Isa>(&mut self, prims: &[PrimRef], mapping: &BinMapping) {
        for prim in prims {
            let at = mapping.bin_coords(prim.centroid()).to_i32_trunc();
            let packed = prim.load::<I>();
            for axis in 0..3 {
                // The bin is in 0..N, because `scale` is chosen accordingly; the mask removes the bounds check.
                let b = at[axis] as usize & (N - 1);
                let bounds = self.bounds[axis][b].as_mut_ptr();
                // SAFETY: packed bounds consist of eight floats.
                unsafe { I::F32x8::load(bounds).min(packed).store(bounds) };
                self.count[axis][b] += 1;
            }
        }
    }

    /// Adds the primitives of another set of bins.
    pub fn merge(&mut self, b: &Self) {
        for axis in 0..3 {
            for i in 0..N {
                let (to, from) = (&mut self.bounds[axis][i], &b.bounds[axis][i]);
                *to = std::array::from_fn(|k| to[k].min(from[k]));
                self.count[axis][i] += b.count[axis][i];
            }
        }
    }

    /// Plane with the least SAH cost for leaves of `leaf_size` primitives, a power of two. Ties go to the lower axis
    /// and bin.
    #[inline(always)]
    pub fn best_split<I: Isa>(&self, mapping: &BinMapping, leaf_size: u32) -> Option<SahSplit> {
        let mut best: Option<(f32, usize, usize)> = None;
        let scale = mapping.scale.array();
        // The number of primitives is rounded up to full leaves; a split with an empty side has infinite cost.
        let weight = |n: u32| match n {
            0 => f32::INFINITY,
            _ => ((n + (leaf_size - 1)) & !(leaf_size - 1)) as f32,
        };
        for axis in (0..3).filter(|&a| scale[a] > 0.0) {
            let (bounds, count) = (&self.bounds[axis], &self.count[axis]);
            // SAFETY: packed bounds consist of eight floats.
            let bin = |i: usize| unsafe { I::F32x8::load(bounds[i].as_ptr()) };
            // `right` contains, for each bin, the cost of this bin and all following bins; the loop processes four bins
            // at a time.
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
            // For each plane between bins, the cost of all preceding bins is added to the cost of all following bins.
            (whole, n) = (I::F32x8::splat(f32::INFINITY), 0);
            for four in 0..N / 4 {
                let (mut extents, mut weights) = ([F32x4::splat(0.0); 4], [0.0; 4]);
                for k in 0..4 {
                    // The first plane has no bins on its left.
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
        Some(SahSplit { axis, first_right_bin, bounds: sides })
    }
}

/// True if the depth limit leaves room for a SAH split. Halving requires as many levels as the count has bits. If only
/// these levels are left, every split halves the range.
pub fn has_depth_budget(prims: &[PrimRef], depth: usize) -> bool {
    depth + (prims.len().next_power_of_two().trailing_zeros() as usize) < MAX_DEPTH
}
