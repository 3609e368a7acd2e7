//! Splits of many primitives by all threads.

use rayon::prelude::*;

use crate::build::binned_sah::{BinMapping, SahBins, SahSplit, has_depth_budget};
use crate::build::large_prims::split_large;
use crate::build::partition;
use crate::build::prim_ref::{PrimInfo, PrimRef};
use crate::build::top_plan::TopNode;
use crate::build::traits::{BuildContext, LeafBuilder, PARALLEL_THRESHOLD, TREELET_SIZE};
use crate::build::treelet::TreeletDesc;
use crate::platform::dispatch::{Dispatch, kernel};
use crate::simd::{Isa, Portable};

kernel! { fn prim_info_of(prims: &[PrimRef], range: &mut PrimInfo) = prim_info_chunk }

#[inline(always)]
fn prim_info_chunk<I: Isa>(prims: &[PrimRef], range: &mut PrimInfo) {
    *range = PrimInfo::from_prims::<I>(prims);
}

kernel! { fn bin64(prims: &[PrimRef], mapping: &BinMapping, bins: &mut SahBins<64>) = bin_few64 }
kernel! { fn bin256(prims: &[PrimRef], mapping: &BinMapping, bins: &mut SahBins<256>) = bin_few256 }

#[inline(always)]
fn bin_few64<I: Isa>(prims: &[PrimRef], mapping: &BinMapping, bins: &mut SahBins<64>) {
    bins.add::<I>(prims, mapping);
}

#[inline(always)]
fn bin_few256<I: Isa>(prims: &[PrimRef], mapping: &BinMapping, bins: &mut SahBins<256>) {
    bins.add::<I>(prims, mapping);
}

/// Index of the first primitive on the right side, and the bounds of the left and of the right side.
pub type SplitResult = (usize, PrimInfo, PrimInfo);

kernel! { fn partition_small(prims: &mut [PrimRef], plane: (&BinMapping, &SahSplit), halves: &mut SplitResult) = partition_of }

#[inline(always)]
fn partition_of<I: Isa>(prims: &mut [PrimRef], plane: (&BinMapping, &SahSplit), halves: &mut SplitResult) {
    *halves = partition::partition(prims, plane.0, plane.1);
}

/// Splits primitives down to treelets, which are contiguous and in tree order.
pub fn split_to_treelets<L: LeafBuilder>(
    prims: &mut [PrimRef],
    range: PrimInfo,
    depth: usize,
    shared: &BuildContext<L>,
) -> TopNode {
    if prims.len() <= TREELET_SIZE {
        return TopNode::Treelet(TreeletDesc { bounds: range.bounds, count: prims.len(), depth });
    }
    let bins = shared.leaves.bin_count(prims.len());
    // Large primitives are split off only at the root.
    let large = match depth {
        0 => split_large::<Portable>(prims, &range, depth),
        _ => None,
    };
    let (middle, left, right) = large.unwrap_or_else(|| split(shared.dispatch, prims, &range, depth, bins));
    let (a, b) = prims.split_at_mut(middle);
    let (a, b) = rayon::join(
        || split_to_treelets(a, left, depth + 1, shared),
        || split_to_treelets(b, right, depth + 1, shared),
    );
    TopNode::Split(range.bounds, Box::new([a, b]))
}

/// Bounds and centroid bounds of many primitives.
pub fn prim_info(dispatch: Dispatch, prims: &[PrimRef]) -> PrimInfo {
    let of_chunk = |prims: &[PrimRef]| {
        let mut range = PrimInfo::empty();
        prim_info_of(dispatch, prims, &mut range);
        range
    };
    if prims.len() <= PARALLEL_THRESHOLD {
        return of_chunk(prims);
    }
    let chunks = prims.par_chunks(PARALLEL_THRESHOLD).map(of_chunk);
    chunks.reduce(PrimInfo::empty, |a, b| a.merged(&b))
}

/// Splits at least two primitives into two groups, in place.
fn split(dispatch: Dispatch, prims: &mut [PrimRef], whole: &PrimInfo, depth: usize, bins: usize) -> SplitResult {
    if has_depth_budget(prims, depth)
        && let Some((mapping, plane)) = best_split(dispatch, prims, whole, bins)
    {
        return partition(dispatch, prims, &mapping, &plane);
    }
    let middle = prims.len() / 2;
    let (left, right) = prims.split_at(middle);
    (middle, prim_info(dispatch, left), prim_info(dispatch, right))
}

/// The plane with the least SAH cost between 64 or 256 bins; `None` if all centroids are in one bin.
pub fn best_split(
    dispatch: Dispatch,
    prims: &[PrimRef],
    whole: &PrimInfo,
    bins: usize,
) -> Option<(BinMapping, SahSplit)> {
    let mapping = BinMapping::new(whole, bins);
    let best = match bins {
        64 => bin_and_split::<64>(prims, &mapping, |prims, bins| bin64(dispatch, prims, &mapping, bins)),
        _ => bin_and_split::<256>(prims, &mapping, |prims, bins| bin256(dispatch, prims, &mapping, bins)),
    };
    best.map(|plane| (mapping, plane))
}

fn bin_and_split<const N: usize>(
    prims: &[PrimRef],
    mapping: &BinMapping,
    bin: impl Fn(&[PrimRef], &mut SahBins<N>) + Sync,
) -> Option<SahSplit> {
    let chunks = prims.par_chunks(PARALLEL_THRESHOLD);
    let folded = chunks.fold(
        || Box::new(SahBins::empty()),
        |mut bins, prims| {
            bin(prims, &mut bins);
            bins
        },
    );
    let bins = folded.reduce_with(|mut a, b| {
        a.merge(&b);
        a
    });
    // With so many leaves, rounding to full leaves hardly changes the cost, so a leaf size of 1 is used.
    bins?.best_split::<Portable>(mapping, 1)
}

/// Maximum number of primitives that one thread partitions; larger ranges are split between threads.
const PARALLEL_PARTITION: usize = 1 << 17;

/// Partitions primitives so that primitives on the left of a plane come first. Both halves are partitioned in parallel;
/// then the primitives on wrong sides are exchanged.
pub fn partition(dispatch: Dispatch, prims: &mut [PrimRef], mapping: &BinMapping, plane: &SahSplit) -> SplitResult {
    if prims.len() <= PARALLEL_PARTITION {
        let mut halves = (0, PrimInfo::empty(), PrimInfo::empty());
        partition_small(dispatch, prims, (mapping, plane), &mut halves);
        return halves;
    }
    let half = prims.len() / 2;
    let (front, back) = prims.split_at_mut(half);
    let (a, b) =
        rayon::join(|| partition(dispatch, front, mapping, plane), || partition(dispatch, back, mapping, plane));
    let (wrong_front, wrong_back) = (&mut front[a.0..], &mut back[..b.0]);
    let swaps = wrong_front.len().min(wrong_back.len());
    // Exchanges equal numbers of primitives. If the front half contains more misplaced primitives than the back half,
    // the first misplaced primitives of the front half are exchanged with all misplaced primitives of the back half.
    // Otherwise, all misplaced primitives of the front half are exchanged with the last misplaced primitives of the
    // back half.
    let from = wrong_front.len() - swaps;
    if from > 0 {
        wrong_front[..swaps].swap_with_slice(&mut wrong_back[..swaps]);
    } else {
        let from = wrong_back.len() - swaps;
        wrong_front.swap_with_slice(&mut wrong_back[from..]);
    }
    (a.0 + b.0, a.1.merged(&b.1), a.2.merged(&b.2))
}
