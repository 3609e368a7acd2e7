//! In-place partition of primitives without a branch per primitive, because the side is unpredictable: every primitive
//! is written to both ends of the free range, and one cursor advances.

use crate::build::binned_sah::{BinMapping, SahBins, SahSplit, has_depth_budget};
use crate::build::prim_ref::{PrimInfo, PrimRef};
use crate::simd::{F32x4, Isa};

/// Number of primitives read at a time. The number is small under Miri, which is slow.
const PARTITION_BLOCK: usize = if cfg!(miri) { 8 } else { 64 };

/// The split plane, and the centroid bounds of the primitives assigned to each side so far.
struct PartitionState<'a> {
    mapping: &'a BinMapping,
    threshold: F32x4,
    left: [F32x4; 2],
    right: [F32x4; 2],
}

impl PartitionState<'_> {
    /// Adds a primitive to the centroid bounds of its side; returns true for the left side.
    #[inline(always)]
    fn add_to_side<const AXIS: usize>(&mut self, prim: &PrimRef) -> bool {
        let centroid = prim.centroid();
        let place = self.mapping.bin_coords(centroid).broadcast_lane::<AXIS>();
        let on_left = place.cmp_lt(self.threshold);
        let on_right = place.cmp_nlt(self.threshold);
        // NaN is ignored, because `min` and `max` then return their second argument.
        let (left, right) = (centroid.or(on_right), centroid.or(on_left));
        self.left = [left.min(self.left[0]), left.max(self.left[1])];
        self.right = [right.min(self.right[0]), right.max(self.right[1])];
        on_left.sign()
    }
}

/// Partitions primitives so that primitives on the left of a plane come first; returns the number of primitives on the
/// left and the bounds of both sides.
#[inline(always)]
pub fn partition(prims: &mut [PrimRef], mapping: &BinMapping, plane: &SahSplit) -> (usize, PrimInfo, PrimInfo) {
    let nothing = [F32x4::splat(f32::INFINITY), F32x4::splat(f32::NEG_INFINITY)];
    let mut sides = PartitionState { mapping, threshold: plane.split_threshold(), left: nothing, right: nothing };
    let middle = match plane.axis {
        0 => partition_axis::<0>(prims, &mut sides),
        1 => partition_axis::<1>(prims, &mut sides),
        _ => partition_axis::<2>(prims, &mut sides),
    };
    let range = |k: usize, centroids: [F32x4; 2]| PrimInfo {
        bounds: plane.bounds[k],
        centroid_lower: centroids[0],
        centroid_upper: centroids[1],
    };
    (middle, range(0, sides.left), range(1, sides.right))
}

/// The ends of the range of slots that have not been written yet.
struct WriteCursors {
    /// Slots before this index have been written.
    low: usize,
    /// Slots from this index on have been written.
    high: usize,
}

impl WriteCursors {
    #[inline(always)]
    fn write_prim<const AXIS: usize>(&mut self, prims: &mut [PrimRef], prim: PrimRef, sides: &mut PartitionState) {
        let left = sides.add_to_side::<AXIS>(&prim);
        debug_assert!(self.low < self.high && self.high <= prims.len());
        // SAFETY: at least one slot between `low` and `high` is free, because one more primitive has been read than
        // written. Both ends of this range are therefore within `prims`.
        unsafe {
            *prims.get_unchecked_mut(self.low) = prim;
            *prims.get_unchecked_mut(self.high - 1) = prim;
        }
        self.low += usize::from(left);
        self.high -= usize::from(!left);
    }
}

#[inline(always)]
fn partition_axis<const AXIS: usize>(prims: &mut [PrimRef], sides: &mut PartitionState) -> usize {
    let n = prims.len();
    let mut cursors = WriteCursors { low: 0, high: n };
    // The first and the last block, and the rest of the primitives after all whole blocks, are copied to
    // `aside`, so that both cursors always have room for a block.
    let mut aside = [std::mem::MaybeUninit::<PrimRef>::uninit(); 3 * PARTITION_BLOCK];
    let mut kept = 0;
    let mut keep = |from: &[PrimRef]| {
        for (to, prim) in aside[kept..].iter_mut().zip(from) {
            to.write(*prim);
        }
        kept += from.len();
    };
    if n <= 3 * PARTITION_BLOCK {
        keep(prims);
    } else {
        keep(&prims[..PARTITION_BLOCK]);
        keep(&prims[n - PARTITION_BLOCK..]);
        // `first..last` is the range that has not been read yet.
        let (mut first, mut last) = (PARTITION_BLOCK, n - PARTITION_BLOCK);
        while last - first >= PARTITION_BLOCK {
            // The next block is read from the end that has fewer free slots, so that both ends keep room for a block.
            if first - cursors.low <= cursors.high - last {
                for _ in 0..PARTITION_BLOCK {
                    let prim = prims[first];
                    first += 1;
                    cursors.write_prim::<AXIS>(prims, prim, sides);
                }
            } else {
                for _ in 0..PARTITION_BLOCK {
                    last -= 1;
                    let prim = prims[last];
                    cursors.write_prim::<AXIS>(prims, prim, sides);
                }
            }
        }
        keep(&prims[first..last]);
    }
    for prim in &aside[..kept] {
        // SAFETY: the first `kept` primitives have been written.
        cursors.write_prim::<AXIS>(prims, unsafe { prim.assume_init() }, sides);
    }
    debug_assert_eq!(cursors.low, cursors.high);
    cursors.low
}

/// Splits at least two primitives by the plane with the least SAH cost between 8 or 16 bins along each axis, for leaves
/// of `leaf_size` primitives. Reorders the primitives; returns the index of the first primitive on the right side, and
/// the bounds of both sides.
#[inline(always)]
pub fn split<I: Isa>(
    prims: &mut [PrimRef],
    range: &PrimInfo,
    depth: usize,
    bins: usize,
    leaf_size: u32,
) -> (usize, PrimInfo, PrimInfo) {
    if has_depth_budget(prims, depth) {
        let best = match bins {
            8 => find_split::<I, 8>(prims, range, leaf_size),
            _ => find_split::<I, 16>(prims, range, leaf_size),
        };
        if let Some((mapping, plane)) = best {
            return partition(prims, &mapping, &plane);
        }
    }
    let middle = prims.len() / 2;
    let (left, right) = prims.split_at(middle);
    (middle, PrimInfo::from_prims::<I>(left), PrimInfo::from_prims::<I>(right))
}

#[inline(always)]
fn find_split<I: Isa, const N: usize>(
    prims: &[PrimRef],
    range: &PrimInfo,
    leaf_size: u32,
) -> Option<(BinMapping, SahSplit)> {
    let mapping = BinMapping::new(range, N);
    let mut bins = SahBins::<N>::empty();
    bins.add::<I>(prims, &mapping);
    Some((mapping, bins.best_split::<I>(&mapping, leaf_size)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;

    /// Boxes whose centroids lie at `xs`.
    fn prims(xs: &[f32]) -> Vec<PrimRef> {
        xs.iter().zip(0..).map(|(&x, id)| PrimRef::new([x, -1.0, 0.0], [x, 1.0, 0.5], id)).collect()
    }

    /// Partitions by the best plane; each primitive must occur exactly once, on the side of its bin.
    fn check(xs: &[f32]) {
        let mut prims = prims(xs);
        let range = PrimInfo::from_prims::<Portable>(&prims);
        let mapping = BinMapping::new(&range, 8);
        let mut bins = SahBins::<8>::empty();
        bins.add::<Portable>(&prims, &mapping);
        let Some(plane) = bins.best_split::<Portable>(&mapping, 1) else { return };
        let on_left = |prim: &PrimRef| {
            let place = mapping.bin_coords(prim.centroid()).broadcast_lane::<0>();
            place.cmp_lt(plane.split_threshold()).sign()
        };
        let expected = prims.iter().filter(|prim| on_left(prim)).count();
        let (middle, left, right) = partition(&mut prims, &mapping, &plane);
        assert_eq!(middle, expected, "{} prims", xs.len());
        assert!(prims[..middle].iter().all(on_left));
        assert!(!prims[middle..].iter().any(on_left));
        for (range, part) in [(left, &prims[..middle]), (right, &prims[middle..])] {
            let of_part = PrimInfo::from_prims::<Portable>(part);
            assert_eq!(range.bounds[0], of_part.bounds[0]);
            assert_eq!(range.centroid_bounds(), of_part.centroid_bounds());
        }
        let mut seen = vec![false; xs.len()];
        for prim in &prims {
            assert!(!std::mem::replace(&mut seen[prim.id as usize], true));
            assert_eq!(prim.lower()[0], xs[prim.id as usize]);
        }
    }

    /// Cases for all ways in which the two cursors can meet: few and many primitives; all primitives except one on one
    /// side; alternating sides; runs of about a block's length.
    #[test]
    fn partitions_keep_every_item() {
        let mut lengths = vec![2, 3, 3 * PARTITION_BLOCK, 3 * PARTITION_BLOCK + 1, 5 * PARTITION_BLOCK + 1];
        if !cfg!(miri) {
            lengths.extend(4..600);
        }
        for n in lengths {
            let of = |side: &dyn Fn(usize) -> bool| {
                let xs: Vec<_> = (0..n).map(|i| f32::from(u8::from(side(i)))).collect();
                check(&xs);
            };
            for one in [0, n / 2, n - 1] {
                of(&|i| i == one);
                of(&|i| i != one);
            }
            for run in [1, 2, PARTITION_BLOCK - 1, PARTITION_BLOCK, PARTITION_BLOCK + 1] {
                of(&|i| i / run % 2 == 0);
                of(&|i| i / run % 2 == 1);
            }
            of(&|i| i < n / 2);
            of(&|i| i >= n / 3);
            of(&|i| (i as u32).wrapping_mul(2_654_435_761) >> 31 == 0);
            let spread = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) >> 8) as f32;
            check(&(0..n).map(spread).collect::<Vec<_>>());
        }
    }

    #[test]
    fn bounds_of_both_sides_contain_exactly_their_items() {
        let place = |i: u32, k: u32| {
            let word = u64::from(i * 3 + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let word = (word ^ word >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (word >> 40) as f32
        };
        for bins in [8, 16] {
            let lower = |i| [0, 1, 2].map(|k| place(i, k));
            let prim = |i| PrimRef::new(lower(i), lower(i).map(|x| x + 9e3), i);
            let mut prims: Vec<_> = (0..5000).map(prim).collect();
            let range = PrimInfo::from_prims::<Portable>(&prims);
            let (middle, left, right) = split::<Portable>(&mut prims, &range, 0, bins, 4);
            let (of_left, of_right) = prims.split_at(middle);
            assert!(!of_left.is_empty() && !of_right.is_empty());
            for (side, prims) in [(left, of_left), (right, of_right)] {
                let box_of = |range: &PrimInfo| [0, 1, 2, 4, 5, 6].map(|k| range.bounds[k]);
                let expected = box_of(&PrimInfo::from_prims::<Portable>(prims));
                assert_eq!(box_of(&side), expected, "{bins} bins");
            }
        }
    }
}
