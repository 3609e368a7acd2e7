//! Brings the items on one side of a plane before those on the other, without a branch per item: which side one is on
//! is what no processor can guess.

use crate::build::binned_sah::{Binning, Plane};
use crate::build::prim_ref::{Item, Range};
use crate::simd::Quad;

/// Items that are read at a time. Few under Miri, which is slow.
const BLOCK: usize = if cfg!(miri) { 8 } else { 64 };

/// What is known of a plane's sides while items are sorted into them.
struct Sides<'a> {
    binning: &'a Binning,
    threshold: Quad,
    left: [Quad; 2],
    right: [Quad; 2],
}

impl Sides<'_> {
    /// Whether an item is on the left; its side grows.
    #[inline(always)]
    fn take<const AXIS: usize>(&mut self, item: &Item) -> bool {
        let centre = item.centre();
        let place = self.binning.place(centre).lane::<AXIS>();
        let on_left = place.below(self.threshold);
        let on_right = place.not_below(self.threshold);
        // What is not a number does not count: `min` and `max` give their second argument then.
        let (left, right) = (centre.or(on_right), centre.or(on_left));
        self.left = [left.min(self.left[0]), left.max(self.left[1])];
        self.right = [right.min(self.right[0]), right.max(self.right[1])];
        on_left.sign()
    }
}

/// Items on the left of a plane first; how many there are, and the ranges of both sides.
#[inline(always)]
pub fn partition(items: &mut [Item], binning: &Binning, plane: &Plane) -> (usize, Range, Range) {
    let nothing = [Quad::splat(f32::INFINITY), Quad::splat(f32::NEG_INFINITY)];
    let mut sides = Sides {
        binning,
        threshold: plane.threshold(),
        left: nothing,
        right: nothing,
    };
    let middle = match plane.axis {
        0 => along::<0>(items, &mut sides),
        1 => along::<1>(items, &mut sides),
        _ => along::<2>(items, &mut sides),
    };
    let range = |k: usize, centres: [Quad; 2]| Range {
        bounds: plane.bounds[k],
        centre_lower: centres[0],
        centre_upper: centres[1],
    };
    (middle, range(0, sides.left), range(1, sides.right))
}

/// Where items are read and written. Every item is written to both ends of the free room, and one end moves.
struct Ends {
    /// Items below are written.
    low: usize,
    /// Items from here on are written.
    high: usize,
}

impl Ends {
    #[inline(always)]
    fn put<const AXIS: usize>(&mut self, items: &mut [Item], item: Item, sides: &mut Sides) {
        let left = sides.take::<AXIS>(&item);
        debug_assert!(self.low < self.high && self.high <= items.len());
        // SAFETY: there is at least one free place between `low` and `high`, both of which are within the items:
        // as many items have been read as written, and this one besides.
        unsafe {
            *items.get_unchecked_mut(self.low) = item;
            *items.get_unchecked_mut(self.high - 1) = item;
        }
        self.low += usize::from(left);
        self.high -= usize::from(!left);
    }
}

#[inline(always)]
fn along<const AXIS: usize>(items: &mut [Item], sides: &mut Sides) -> usize {
    let n = items.len();
    let mut ends = Ends { low: 0, high: n };
    // Items that are kept aside, so that there is always room for a block on both ends.
    let mut aside = [std::mem::MaybeUninit::<Item>::uninit(); 3 * BLOCK];
    let mut kept = 0;
    let mut keep = |from: &[Item]| {
        for (to, item) in aside[kept..].iter_mut().zip(from) {
            to.write(*item);
        }
        kept += from.len();
    };
    if n <= 3 * BLOCK {
        keep(items);
    } else {
        keep(&items[..BLOCK]);
        keep(&items[n - BLOCK..]);
        // What is between these is still to be read.
        let (mut first, mut last) = (BLOCK, n - BLOCK);
        while last - first >= BLOCK {
            // From the end with less room, so that both have room for a block.
            if first - ends.low <= ends.high - last {
                for _ in 0..BLOCK {
                    let item = items[first];
                    first += 1;
                    ends.put::<AXIS>(items, item, sides);
                }
            } else {
                for _ in 0..BLOCK {
                    last -= 1;
                    let item = items[last];
                    ends.put::<AXIS>(items, item, sides);
                }
            }
        }
        keep(&items[first..last]);
    }
    for item in &aside[..kept] {
        // SAFETY: the first `kept` are written.
        ends.put::<AXIS>(items, unsafe { item.assume_init() }, sides);
    }
    debug_assert_eq!(ends.low, ends.high);
    ends.low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::binned_sah::Bins;
    use crate::simd::Portable;

    /// Boxes whose centres lie at `xs`.
    fn items(xs: &[f32]) -> Vec<Item> {
        xs.iter()
            .zip(0..)
            .map(|(&x, id)| Item::new([x, -1.0, 0.0], [x, 1.0, 0.5], id))
            .collect()
    }

    /// Partitions by the best plane; each item must still be there once, on the side of its bin.
    fn check(xs: &[f32]) {
        let mut items = items(xs);
        let range = Range::of::<Portable>(&items);
        let binning = Binning::of(&range, 8);
        let mut bins = Bins::<8>::empty();
        bins.add::<Portable>(&items, &binning);
        let Some(plane) = bins.best::<Portable>(&binning, 1) else {
            return;
        };
        let on_left = |item: &Item| {
            let place = binning.place(item.centre()).lane::<0>();
            place.below(plane.threshold()).sign()
        };
        let expected = items.iter().filter(|item| on_left(item)).count();
        let (middle, left, right) = partition(&mut items, &binning, &plane);
        assert_eq!(middle, expected, "{} items", xs.len());
        assert!(items[..middle].iter().all(on_left));
        assert!(!items[middle..].iter().any(on_left));
        for (range, part) in [(left, &items[..middle]), (right, &items[middle..])] {
            let of_part = Range::of::<Portable>(part);
            assert_eq!(range.bounds[0], of_part.bounds[0]);
            assert_eq!(range.centres(), of_part.centres());
        }
        let mut seen = vec![false; xs.len()];
        for item in &items {
            assert!(!std::mem::replace(&mut seen[item.id as usize], true));
            assert_eq!(item.lower()[0], xs[item.id as usize]);
        }
    }

    /// Every way in which the two ends can meet: few and many items, all of them on one side but one, sides in turn, in
    /// runs as long as a block and around it.
    #[test]
    fn no_item_is_lost_whatever_the_order() {
        let mut lengths = vec![2, 3, 3 * BLOCK, 3 * BLOCK + 1, 5 * BLOCK + 1];
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
            for run in [1, 2, BLOCK - 1, BLOCK, BLOCK + 1] {
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
}
