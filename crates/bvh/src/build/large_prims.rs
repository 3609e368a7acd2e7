//! Primitives almost as large as the whole mesh, such as a floor. No plane through centroids separates large primitives
//! from small primitives, and every node above a large primitive would be as large as the primitive. Large primitives
//! are therefore split off first.

use crate::build::binned_sah::has_depth_budget;
use crate::build::prim_ref::{PrimInfo, PrimRef, half_area};
use crate::simd::{Isa, Portable, Vector};

/// Minimum surface area of a large primitive, as a fraction of the whole mesh's area. A wall of a cubic room, whose
/// fraction is a third, counts as large.
const LARGE_AREA_RATIO: f32 = 0.25;

/// A filter that selects large primitives.
#[derive(Clone, Copy)]
pub struct LargePrimFilter {
    /// Minimum half surface area of a large primitive.
    min_half_area: f32,
}

impl LargePrimFilter {
    /// Creates the filter for primitives with these bounds.
    #[inline(always)]
    pub fn from_info<I: Isa>(range: &PrimInfo) -> LargePrimFilter {
        // SAFETY: packed bounds consist of eight floats.
        let bounds = unsafe { I::F32x8::load(range.bounds.as_ptr()) };
        LargePrimFilter { min_half_area: LARGE_AREA_RATIO * half_area::<I>(bounds) }
    }

    /// Removes large primitives from a sample. If all primitives are large, all are kept.
    pub fn remove_from_sample(sample: &mut Vec<PrimRef>, range: &PrimInfo) -> LargePrimFilter {
        let large = LargePrimFilter::from_info::<Portable>(range);
        if sample.iter().all(|prim| large.matches::<Portable>(prim)) {
            return LargePrimFilter { min_half_area: f32::INFINITY };
        }
        sample.retain(|prim| !large.matches::<Portable>(prim));
        large
    }

    /// True for a large primitive. Areas that overflow are never large.
    #[inline(always)]
    pub fn matches<I: Isa>(self, prim: &PrimRef) -> bool {
        let area = half_area::<I>(prim.load::<I>());
        area >= self.min_half_area && area < f32::INFINITY
    }
}

/// Moves large primitives to the front; returns the index of the first other primitive and the bounds of both sides, or
/// `None` if one side is empty.
#[inline(always)]
pub fn split_large<I: Isa>(
    prims: &mut [PrimRef],
    range: &PrimInfo,
    depth: usize,
) -> Option<(usize, PrimInfo, PrimInfo)> {
    let large = LargePrimFilter::from_info::<I>(range);
    let mut count = 0;
    for i in 0..prims.len() {
        if large.matches::<I>(&prims[i]) {
            prims.swap(count, i);
            count += 1;
        }
    }
    if count == 0 || count == prims.len() || !has_depth_budget(prims, depth) {
        return None;
    }
    let (left, right) = prims.split_at(count);
    Some((count, PrimInfo::from_prims::<I>(left), PrimInfo::from_prims::<I>(right)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::MAX_DEPTH;

    /// Creates one or several floors under small boxes along a line.
    fn prims(floors: usize, small: usize) -> Vec<PrimRef> {
        let floor = |id| PrimRef::new([0.0; 3], [10.0, 10.0, 0.0], id);
        let at = |i: usize| i as f32 / small as f32;
        let mut prims: Vec<_> = (0..small)
            .map(|i| PrimRef::new([9.0 * at(i), 4.0, 1.0], [9.0 * at(i) + 0.5, 5.0, 2.0], i as u32))
            .collect();
        for i in 0..floors {
            prims.insert(i * small / floors.max(1), floor((small + i) as u32));
        }
        prims
    }

    #[test]
    fn floors_are_split_from_objects_on_them() {
        for floors in [1, 2, 5] {
            let mut prims = prims(floors, 100);
            let range = PrimInfo::from_prims::<Portable>(&prims);
            let (middle, left, right) = split_large::<Portable>(&mut prims, &range, 0).unwrap();
            assert_eq!(middle, floors);
            assert!(prims[..middle].iter().all(|prim| prim.id >= 100));
            assert!(prims[middle..].iter().all(|prim| prim.id < 100));
            // The floor's box is flat, and the box of the other primitives does not reach down to the floor.
            assert_eq!((left.bounds[2], left.bounds[6]), (0.0, 0.0));
            assert_eq!((right.bounds[2], right.bounds[6]), (1.0, -2.0));
        }
    }

    #[test]
    fn equal_primitives_are_not_split() {
        for (floors, small) in [(3, 0), (0, 50)] {
            let mut prims = prims(floors, small);
            let range = PrimInfo::from_prims::<Portable>(&prims);
            assert!(split_large::<Portable>(&mut prims, &range, 0).is_none());
        }
        let mut points = vec![PrimRef::new([1.0; 3], [1.0; 3], 0); 9];
        let range = PrimInfo::from_prims::<Portable>(&points);
        assert!(split_large::<Portable>(&mut points, &range, 0).is_none());
    }

    #[test]
    fn prims_are_split_only_if_enough_tree_levels_are_left() {
        let mut prims = prims(1, 100);
        let range = PrimInfo::from_prims::<Portable>(&prims);
        assert!(split_large::<Portable>(&mut prims, &range, MAX_DEPTH - 7).is_none());
        assert!(split_large::<Portable>(&mut prims, &range, MAX_DEPTH - 8).is_some());
    }
}
