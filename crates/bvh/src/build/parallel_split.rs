//! Splits of many items, by all threads.

use rayon::prelude::*;

use crate::build::binned_sah::{Binning, Bins, Plane, may_choose};
use crate::build::large_prims::split_off;
use crate::build::prim_ref::{Item, Range};
use crate::build::top_plan::Top;
use crate::build::treelet::Part;
use crate::build::{Leaves, PARALLEL, Shared, TREELET, partition};
use crate::platform::dispatch::{Machine, kernel};
use crate::simd::{Isa, Portable};

kernel! { fn range_of(items: &[Item], range: &mut Range) = few }

#[inline(always)]
fn few<I: Isa>(items: &[Item], range: &mut Range) {
    *range = Range::of::<I>(items);
}

kernel! { fn bin64(items: &[Item], binning: &Binning, bins: &mut Bins<64>) = bin_few64 }
kernel! { fn bin256(items: &[Item], binning: &Binning, bins: &mut Bins<256>) = bin_few256 }

#[inline(always)]
fn bin_few64<I: Isa>(items: &[Item], binning: &Binning, bins: &mut Bins<64>) {
    bins.add::<I>(items, binning);
}

#[inline(always)]
fn bin_few256<I: Isa>(items: &[Item], binning: &Binning, bins: &mut Bins<256>) {
    bins.add::<I>(items, binning);
}

/// Where the right side starts, and both ranges.
pub type Halves = (usize, Range, Range);

kernel! { fn partition_few(items: &mut [Item], plane: (&Binning, &Plane), halves: &mut Halves) = partition_of }

#[inline(always)]
fn partition_of<I: Isa>(items: &mut [Item], plane: (&Binning, &Plane), halves: &mut Halves) {
    *halves = partition::partition(items, plane.0, plane.1);
}

/// Splits items down to what becomes a treelet; those of each stand together, in the order of the tree.
pub fn divide<L: Leaves>(
    items: &mut [Item],
    range: Range,
    depth: usize,
    shared: &Shared<L>,
) -> Top {
    if items.len() <= TREELET {
        return Top::Part(Part {
            bounds: range.bounds,
            count: items.len(),
            depth,
        });
    }
    let bins = shared.leaves.bins(items.len());
    // Below the root they are gone.
    let large = match depth {
        0 => split_off::<Portable>(items, &range, depth),
        _ => None,
    };
    let (middle, left, right) =
        large.unwrap_or_else(|| split(shared.machine, items, &range, depth, bins));
    let (a, b) = items.split_at_mut(middle);
    let (a, b) = rayon::join(
        || divide(a, left, depth + 1, shared),
        || divide(b, right, depth + 1, shared),
    );
    Top::Split(range.bounds, Box::new([a, b]))
}

/// The range of `items`.
pub fn range(machine: Machine, items: &[Item]) -> Range {
    let chunks = items.par_chunks(PARALLEL).map(|items| {
        let mut range = Range::empty();
        range_of(machine, items, &mut range);
        range
    });
    chunks.reduce(Range::empty, |a, b| a.merged(&b))
}

/// Splits at least two items in two: reorders them.
fn split(machine: Machine, items: &mut [Item], whole: &Range, depth: usize, bins: usize) -> Halves {
    if may_choose(items, depth)
        && let Some((binning, plane)) = plane(machine, items, whole, bins)
    {
        return partition(machine, items, &binning, &plane);
    }
    let middle = items.len() / 2;
    let (left, right) = items.split_at(middle);
    (middle, range(machine, left), range(machine, right))
}

/// The cheapest plane between 64 or 256 bins, if there is one.
pub fn plane(
    machine: Machine,
    items: &[Item],
    whole: &Range,
    bins: usize,
) -> Option<(Binning, Plane)> {
    let binning = Binning::of(whole, bins);
    let best = match bins {
        64 => best::<64>(items, &binning, |items, bins| {
            bin64(machine, items, &binning, bins)
        }),
        _ => best::<256>(items, &binning, |items, bins| {
            bin256(machine, items, &binning, bins)
        }),
    };
    best.map(|plane| (binning, plane))
}

fn best<const N: usize>(
    items: &[Item],
    binning: &Binning,
    bin: impl Fn(&[Item], &mut Bins<N>) + Sync,
) -> Option<Plane> {
    let chunks = items.par_chunks(PARALLEL);
    let folded = chunks.fold(
        || Box::new(Bins::empty()),
        |mut bins, items| {
            bin(items, &mut bins);
            bins
        },
    );
    let bins = folded.reduce_with(|mut a, b| {
        a.add_all(&b);
        a
    });
    // So many items fill so many leaves that it does not matter how many one holds.
    bins?.best::<Portable>(binning, 1)
}

/// Items that are worth being sorted into two sides by another thread.
const SIDES: usize = 1 << 17;

/// Items on the left of a plane first. Each half of the items by itself; then what is on the wrong side of the middle
/// changes places.
pub fn partition(machine: Machine, items: &mut [Item], binning: &Binning, plane: &Plane) -> Halves {
    if items.len() <= SIDES {
        let mut halves = (0, Range::empty(), Range::empty());
        partition_few(machine, items, (binning, plane), &mut halves);
        return halves;
    }
    let half = items.len() / 2;
    let (front, back) = items.split_at_mut(half);
    let (a, b) = rayon::join(
        || partition(machine, front, binning, plane),
        || partition(machine, back, binning, plane),
    );
    let (wrong_front, wrong_back) = (&mut front[a.0..], &mut back[..b.0]);
    let swaps = wrong_front.len().min(wrong_back.len());
    // As many from the end of the front as from the start of the back, or all of the one from the end of the other.
    let from = wrong_front.len() - swaps;
    if from > 0 {
        wrong_front[..swaps].swap_with_slice(&mut wrong_back[..swaps]);
    } else {
        let from = wrong_back.len() - swaps;
        wrong_front.swap_with_slice(&mut wrong_back[from..]);
    }
    (a.0 + b.0, a.1.merged(&b.1), a.2.merged(&b.2))
}
