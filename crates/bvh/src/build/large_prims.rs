//! Items about as large as all together, such as the floor below everything: no plane through centres parts them from
//! what is small, and every node down to where they end would be as large as they are. So they are split off first.

use crate::build::binned_sah::may_choose;
use crate::build::prim_ref::{Item, Range, half_area};
use crate::simd::{Isa, Portable, Vector};

/// What part of the surface of the box of all makes an item a large one: less than a wall of a cubic room has, a third.
const LARGE: f32 = 0.25;

/// What is large beside the box of all.
#[derive(Clone, Copy)]
pub struct Large {
    /// Half the surface of the least.
    least: f32,
}

impl Large {
    /// Among the items of a range.
    #[inline(always)]
    pub fn within<I: Isa>(range: &Range) -> Large {
        // SAFETY: a box has eight floats.
        let whole = unsafe { I::F8::load(range.bounds.as_ptr()) };
        Large {
            least: LARGE * half_area::<I>(whole),
        }
    }

    /// Among the items of a sample, which those leave; nothing is where there are no others.
    pub fn taken(sample: &mut Vec<Item>, range: &Range) -> Large {
        let large = Large::within::<Portable>(range);
        if sample.iter().all(|item| large.is::<Portable>(item)) {
            return Large {
                least: f32::INFINITY,
            };
        }
        sample.retain(|item| !large.is::<Portable>(item));
        large
    }

    /// Whether an item is one. Beside a surface that overflows nothing can be told from anything.
    #[inline(always)]
    pub fn is<I: Isa>(self, item: &Item) -> bool {
        let area = half_area::<I>(item.octet::<I>());
        area >= self.least && area < f32::INFINITY
    }
}

/// Splits those that are large from the others, if there are both: reorders the items and returns where the others start,
/// and both ranges.
#[inline(always)]
pub fn split_off<I: Isa>(
    items: &mut [Item],
    range: &Range,
    depth: usize,
) -> Option<(usize, Range, Range)> {
    let large = Large::within::<I>(range);
    let mut count = 0;
    for i in 0..items.len() {
        if large.is::<I>(&items[i]) {
            items.swap(count, i);
            count += 1;
        }
    }
    if count == 0 || count == items.len() || !may_choose(items, depth) {
        return None;
    }
    let (left, right) = items.split_at(count);
    Some((count, Range::of::<I>(left), Range::of::<I>(right)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::MAX_DEPTH;

    /// A floor, or as many, among small boxes along a line above it.
    fn items(floors: usize, small: usize) -> Vec<Item> {
        let floor = |id| Item::new([0.0; 3], [10.0, 10.0, 0.0], id);
        let at = |i: usize| i as f32 / small as f32;
        let mut items: Vec<_> = (0..small)
            .map(|i| {
                Item::new(
                    [9.0 * at(i), 4.0, 1.0],
                    [9.0 * at(i) + 0.5, 5.0, 2.0],
                    i as u32,
                )
            })
            .collect();
        for i in 0..floors {
            items.insert(i * small / floors.max(1), floor((small + i) as u32));
        }
        items
    }

    #[test]
    fn a_floor_is_split_from_what_stands_on_it() {
        for floors in [1, 2, 5] {
            let mut items = items(floors, 100);
            let range = Range::of::<Portable>(&items);
            let (middle, left, right) = split_off::<Portable>(&mut items, &range, 0).unwrap();
            assert_eq!(middle, floors);
            assert!(items[..middle].iter().all(|item| item.id >= 100));
            assert!(items[middle..].iter().all(|item| item.id < 100));
            // The floor's box is as flat as it is, and the other does not reach down to it.
            assert_eq!((left.bounds[2], left.bounds[6]), (0.0, 0.0));
            assert_eq!((right.bounds[2], right.bounds[6]), (1.0, -2.0));
        }
    }

    #[test]
    fn where_all_are_alike_there_is_no_split() {
        for (floors, small) in [(3, 0), (0, 50)] {
            let mut items = items(floors, small);
            let range = Range::of::<Portable>(&items);
            assert!(split_off::<Portable>(&mut items, &range, 0).is_none());
        }
        let mut points = vec![Item::new([1.0; 3], [1.0; 3], 0); 9];
        let range = Range::of::<Portable>(&points);
        assert!(split_off::<Portable>(&mut points, &range, 0).is_none());
    }

    #[test]
    fn levels_that_are_needed_are_not_taken() {
        let mut items = items(1, 100);
        let range = Range::of::<Portable>(&items);
        assert!(split_off::<Portable>(&mut items, &range, MAX_DEPTH - 7).is_none());
        assert!(split_off::<Portable>(&mut items, &range, MAX_DEPTH - 8).is_some());
    }
}
