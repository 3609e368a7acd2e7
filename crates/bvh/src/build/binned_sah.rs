//! One split of a range of boxes by the binned surface-area heuristic (Wald 2007).

use crate::build::MAX_DEPTH;
use crate::build::partition::partition;
use crate::build::prim_ref::{Item, NOTHING, Octet, Range, extent, half_areas};
use crate::simd::{Isa, Quad, Vector};

/// Boxes and counts by axis and bin.
#[repr(align(32))]
pub struct Bins<const N: usize> {
    bounds: [[Octet; N]; 3],
    count: [[u32; N]; 3],
}

/// Which bin a centre falls into: the same arithmetic wherever it is asked.
#[derive(Clone, Copy)]
pub struct Binning {
    offset: Quad,
    scale: Quad,
}

/// A plane between two bins, and the boxes on both sides.
#[derive(Clone, Copy)]
pub struct Plane {
    /// Across which it lies.
    pub axis: usize,
    /// Bins below this one are on the left side.
    first_right: usize,
    /// The boxes of the items on the left and on the right.
    pub bounds: [Octet; 2],
}

impl Binning {
    /// As many bins along each axis.
    pub fn of(range: &Range, bins: usize) -> Binning {
        let extent = range.centre_upper.sub(range.centre_lower).array();
        let scale = std::array::from_fn(|a| {
            // Just below the number of bins, so that the last centre stays in the last bin; 0 for a flat axis.
            let scale = bins as f32 * 0.999_99 / extent[a];
            if a < 3 && extent[a] > 0.0 && scale.is_finite() {
                scale
            } else {
                0.0
            }
        });
        Binning {
            offset: range.centre_lower,
            scale: Quad::new(scale),
        }
    }

    /// The same along the axis alone along which centres lie farthest apart, and that axis.
    fn along_widest(&self) -> Option<(Binning, usize)> {
        let scale = self.scale.array();
        let along = (0..3).filter(|&axis| scale[axis] > 0.0);
        let axis = along.min_by(|&a, &b| scale[a].total_cmp(&scale[b]))?;
        let mut alone = [0.0; 4];
        alone[axis] = scale[axis];
        let binning = Binning {
            scale: Quad::new(alone),
            ..*self
        };
        Some((binning, axis))
    }

    /// The bins of a centre, and what is left over.
    #[inline(always)]
    pub fn place(&self, centre: Quad) -> Quad {
        centre.sub(self.offset).mul(self.scale)
    }
}

impl Plane {
    /// What [`Binning::place`] is below on the left side.
    pub fn threshold(&self) -> Quad {
        Quad::splat(self.first_right as f32)
    }

    /// Where it lies, up to rounding, along its axis.
    pub fn at(&self, binning: &Binning) -> f32 {
        let (offset, scale) = (binning.offset.array(), binning.scale.array());
        offset[self.axis] + self.first_right as f32 / scale[self.axis]
    }
}

impl<const N: usize> Bins<N> {
    /// No boxes.
    pub fn empty() -> Self {
        Bins {
            bounds: [[NOTHING; N]; 3],
            count: [[0; N]; 3],
        }
    }

    /// Adds items.
    #[inline(always)]
    pub fn add<I: Isa>(&mut self, items: &[Item], binning: &Binning) {
        for item in items {
            let at = binning.place(item.centre()).truncated();
            let octet = item.octet::<I>();
            for axis in 0..3 {
                // The value is within 0..N by the choice of `scale`; the mask says so to the compiler.
                let b = at[axis] as usize & (N - 1);
                let bounds = self.bounds[axis][b].as_mut_ptr();
                // SAFETY: a box has eight floats.
                unsafe { I::F8::load(bounds).min(octet).store(bounds) };
                self.count[axis][b] += 1;
            }
        }
    }

    /// Adds items along one axis.
    #[inline(always)]
    fn add_along<I: Isa>(&mut self, items: &[Item], binning: &Binning, axis: usize) {
        let (bounds, count) = (&mut self.bounds[axis], &mut self.count[axis]);
        for item in items {
            // As in `add`.
            let b = binning.place(item.centre()).truncated()[axis] as usize & (N - 1);
            let bounds = bounds[b].as_mut_ptr();
            // SAFETY: a box has eight floats.
            unsafe { I::F8::load(bounds).min(item.octet::<I>()).store(bounds) };
            count[b] += 1;
        }
    }

    /// Adds what another has.
    pub fn add_all(&mut self, b: &Self) {
        for axis in 0..3 {
            for i in 0..N {
                let (to, from) = (&mut self.bounds[axis][i], &b.bounds[axis][i]);
                *to = std::array::from_fn(|k| to[k].min(from[k]));
                self.count[axis][i] += b.count[axis][i];
            }
        }
    }

    /// The cheapest plane, where leaves hold `unit` items, a power of two; ties go to the lower axis and bin.
    #[inline(always)]
    pub fn best<I: Isa>(&self, binning: &Binning, unit: u32) -> Option<Plane> {
        let mut best: Option<(f32, usize, usize)> = None;
        let scale = binning.scale.array();
        // What a side costs goes by the leaves it fills; one without items is out of the question.
        let weight = |n: u32| match n {
            0 => f32::INFINITY,
            _ => ((n + (unit - 1)) & !(unit - 1)) as f32,
        };
        for axis in (0..3).filter(|&a| scale[a] > 0.0) {
            let (bounds, count) = (&self.bounds[axis], &self.count[axis]);
            // SAFETY: a box has eight floats.
            let bin = |i: usize| unsafe { I::F8::load(bounds[i].as_ptr()) };
            // What the bins from each on cost, four at a time.
            let mut right = [Quad::splat(f32::INFINITY); N];
            let (mut whole, mut n) = (I::F8::splat(f32::INFINITY), 0);
            for four in (0..N / 4).rev() {
                let (mut extents, mut weights) = ([Quad::splat(0.0); 4], [0.0; 4]);
                for k in (0..4).rev() {
                    whole = whole.min(bin(4 * four + k));
                    n += count[4 * four + k];
                    (extents[k], weights[k]) = (extent::<I>(whole), weight(n));
                }
                right[four] = half_areas(extents).mul(Quad::new(weights));
            }
            // And those up to each, beside those that follow.
            (whole, n) = (I::F8::splat(f32::INFINITY), 0);
            for four in 0..N / 4 {
                let (mut extents, mut weights) = ([Quad::splat(0.0); 4], [0.0; 4]);
                for k in 0..4 {
                    // Nothing is before the first.
                    (extents[k], weights[k]) = (extent::<I>(whole), weight(n));
                    whole = whole.min(bin(4 * four + k));
                    n += count[4 * four + k];
                }
                let left = half_areas(extents).mul(Quad::new(weights));
                let cost = left.add(right[four]).array();
                for k in 0..4 {
                    if cost[k] < best.map_or(f32::INFINITY, |best| best.0) {
                        best = Some((cost[k], axis, 4 * four + k));
                    }
                }
            }
        }
        let (_, axis, first_right) = best?;
        let mut sides = [NOTHING; 2];
        for (i, bin) in self.bounds[axis].iter().enumerate() {
            let side = &mut sides[usize::from(i >= first_right)];
            *side = std::array::from_fn(|k| side[k].min(bin[k]));
        }
        Some(Plane {
            axis,
            first_right,
            bounds: sides,
        })
    }
}

/// Whether there are levels to spare for a split that is not in the middle. Halving takes as many as the bits of the
/// number of items: once that is all that is left, it is all that happens.
pub fn may_choose(items: &[Item], depth: usize) -> bool {
    depth + (items.len().next_power_of_two().trailing_zeros() as usize) < MAX_DEPTH
}

/// Splits at least two items in two, by the cheapest plane between 8, 16 or 32 bins along each axis, or between 8 along the
/// widest one alone, where leaves hold `unit` items: reorders them and returns where the right side starts, and both ranges.
#[inline(always)]
pub fn split<I: Isa>(
    items: &mut [Item],
    range: &Range,
    depth: usize,
    (bins, widest, unit): (usize, bool, u32),
) -> (usize, Range, Range) {
    if may_choose(items, depth) {
        let best = match bins {
            _ if widest => best::<I, 8, true>(items, range, unit),
            8 => best::<I, 8, false>(items, range, unit),
            16 => best::<I, 16, false>(items, range, unit),
            _ => best::<I, 32, false>(items, range, unit),
        };
        if let Some((binning, plane)) = best {
            return partition(items, &binning, &plane);
        }
    }
    let middle = items.len() / 2;
    let (left, right) = items.split_at(middle);
    (middle, Range::of::<I>(left), Range::of::<I>(right))
}

#[inline(always)]
fn best<I: Isa, const N: usize, const WIDEST: bool>(
    items: &[Item],
    range: &Range,
    unit: u32,
) -> Option<(Binning, Plane)> {
    let mut binning = Binning::of(range, N);
    let mut bins = Bins::<N>::empty();
    if WIDEST {
        let axis;
        (binning, axis) = binning.along_widest()?;
        bins.add_along::<I>(items, &binning, axis);
    } else {
        bins.add::<I>(items, &binning);
    }
    Some((binning, bins.best::<I>(&binning, unit)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;

    #[test]
    fn the_boxes_of_both_sides_are_those_of_their_items() {
        let place = |i: u32, k: u32| {
            let word = u64::from(i * 3 + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let word = (word ^ word >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (word >> 40) as f32
        };
        // Parts may have more items than are expected of them, for which more bins are asked.
        for bins in [8, 16, 32, 64, 256] {
            for widest in [false, true] {
                let lower = |i| [0, 1, 2].map(|k| place(i, k));
                let item = |i| Item::new(lower(i), lower(i).map(|x| x + 9e3), i);
                let mut items: Vec<_> = (0..5000).map(item).collect();
                let range = Range::of::<Portable>(&items);
                let how = (bins, widest, 4);
                let (middle, left, right) = split::<Portable>(&mut items, &range, 0, how);
                let (of_left, of_right) = items.split_at(middle);
                assert!(!of_left.is_empty() && !of_right.is_empty());
                for (side, items) in [(left, of_left), (right, of_right)] {
                    let box_of = |range: &Range| [0, 1, 2, 4, 5, 6].map(|k| range.bounds[k]);
                    assert_eq!(
                        box_of(&side),
                        box_of(&Range::of::<Portable>(items)),
                        "{bins} bins, widest axis alone: {widest}"
                    );
                }
            }
        }
    }
}
