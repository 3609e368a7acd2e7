//! One split of a range of boxes by the binned surface-area heuristic (Wald 2007).

use rayon::prelude::*;

use super::MAX_DEPTH;
use super::morton::Curve;
use crate::simd::Quad;

/// A box to be placed in the tree; 32 bytes.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// The lower corner.
    pub lower: [f32; 3],
    /// What the box belongs to.
    pub id: u32,
    /// The upper corner.
    pub upper: [f32; 3],
    pad: f32,
}

impl Item {
    /// A box with its id.
    pub fn new(lower: [f32; 3], upper: [f32; 3], id: u32) -> Self {
        Self {
            lower,
            id,
            upper,
            pad: 0.0,
        }
    }

    /// Lower and upper corner, and 0.
    #[inline(always)]
    fn corners(&self) -> (Quad, Quad) {
        // An id read as a float is a tiny number, and arithmetic on those is slow: it goes.
        let lower = Quad::new([
            self.lower[0],
            self.lower[1],
            self.lower[2],
            f32::from_bits(self.id),
        ])
        .three();
        (
            lower,
            Quad::new([self.upper[0], self.upper[1], self.upper[2], self.pad]),
        )
    }
}

/// The box of some items and the box of their (doubled) centres.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    lower: Quad,
    upper: Quad,
    centre_lower: Quad,
    centre_upper: Quad,
}

/// Items that are worth another thread.
const PARALLEL: usize = 1 << 14;

impl Range {
    /// The range of nothing.
    pub fn empty() -> Range {
        let (lower, upper) = (Quad::splat(f32::INFINITY), Quad::splat(f32::NEG_INFINITY));
        Range {
            lower,
            upper,
            centre_lower: lower,
            centre_upper: upper,
        }
    }

    /// The range of `items`, in parallel.
    pub fn of(items: &[Item]) -> Range {
        if items.len() <= PARALLEL {
            return Self::of_few(items);
        }
        items
            .par_chunks(PARALLEL)
            .map(Self::of_few)
            .reduce(Self::empty, |a, b| a.merged(&b))
    }

    fn of_few(items: &[Item]) -> Range {
        let mut range = Self::empty();
        items.iter().for_each(|item| range.grow(item));
        range
    }

    #[inline(always)]
    fn grow(&mut self, item: &Item) {
        let (lower, upper) = item.corners();
        let centre = lower.add(upper);
        self.lower = self.lower.min(lower);
        self.upper = self.upper.max(upper);
        self.centre_lower = self.centre_lower.min(centre);
        self.centre_upper = self.centre_upper.max(centre);
    }

    fn merged(&self, b: &Range) -> Range {
        Range {
            lower: self.lower.min(b.lower),
            upper: self.upper.max(b.upper),
            centre_lower: self.centre_lower.min(b.centre_lower),
            centre_upper: self.centre_upper.max(b.centre_upper),
        }
    }

    /// The lower corner of the box.
    pub fn lower(&self) -> [f32; 3] {
        let [x, y, z, _] = self.lower.array();
        [x, y, z]
    }

    /// The upper corner of the box.
    pub fn upper(&self) -> [f32; 3] {
        let [x, y, z, _] = self.upper.array();
        [x, y, z]
    }

    /// The lower and the upper corner of the box of the (doubled) centres.
    pub fn centres(&self) -> ([f32; 3], [f32; 3]) {
        let three = |corner: Quad| {
            let [x, y, z, _] = corner.array();
            [x, y, z]
        };
        (three(self.centre_lower), three(self.centre_upper))
    }

    /// Half the surface of the box.
    pub fn half_area(&self) -> f32 {
        self.upper.sub(self.lower).pair_products()
    }
}

/// Corners and counts by axis and bin.
struct Bins<const N: usize> {
    corners: [[[Quad; 2]; N]; 3],
    count: [[u32; N]; 3],
}

/// Which bin a centre falls into: the same arithmetic wherever it is asked.
#[derive(Clone, Copy)]
struct Binning {
    offset: Quad,
    scale: Quad,
}

impl Binning {
    fn of(range: &Range, bins: usize) -> Binning {
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

    #[inline(always)]
    fn bin(&self, item: &Item) -> [i32; 4] {
        let (lower, upper) = item.corners();
        lower
            .add(upper)
            .sub(self.offset)
            .mul(self.scale)
            .truncated()
    }
}

impl<const N: usize> Bins<N> {
    fn empty() -> Self {
        let nothing = [Quad::splat(f32::INFINITY), Quad::splat(f32::NEG_INFINITY)];
        Bins {
            corners: [[nothing; N]; 3],
            count: [[0; N]; 3],
        }
    }

    #[inline(always)]
    fn of(items: &[Item], binning: &Binning) -> Self {
        let mut bins = Self::empty();
        for item in items {
            let at = binning.bin(item);
            let (lower, upper) = item.corners();
            for axis in 0..3 {
                // The value is within 0..N by the choice of `scale`; the mask says so to the compiler.
                let b = at[axis] as usize & (N - 1);
                let corners = &mut bins.corners[axis][b];
                *corners = [corners[0].min(lower), corners[1].max(upper)];
                bins.count[axis][b] += 1;
            }
        }
        bins
    }

    fn merged(mut self, b: &Self) -> Self {
        for axis in 0..3 {
            for i in 0..N {
                let (to, from) = (&mut self.corners[axis][i], &b.corners[axis][i]);
                *to = [to[0].min(from[0]), to[1].max(from[1])];
                self.count[axis][i] += b.count[axis][i];
            }
        }
        self
    }

    /// The cheapest axis and first bin of the right side; ties go to the lower axis and bin.
    #[inline(always)]
    fn best(&self, binning: &Binning) -> Option<(usize, usize)> {
        let mut best: Option<(f32, usize, usize)> = None;
        let scale = binning.scale.array();
        let nothing = [Quad::splat(f32::INFINITY), Quad::splat(f32::NEG_INFINITY)];
        for axis in (0..3).filter(|&a| scale[a] > 0.0) {
            let (corners, count) = (&self.corners[axis], &self.count[axis]);
            // Cost of the right side; infinite while it is empty.
            let mut right = [f32::INFINITY; N];
            let ([mut lower, mut upper], mut n) = (nothing, 0);
            for i in (1..N).rev() {
                lower = lower.min(corners[i][0]);
                upper = upper.max(corners[i][1]);
                n += count[i];
                if n > 0 {
                    right[i] = upper.sub(lower).pair_products() * n as f32;
                }
            }
            ([lower, upper], n) = (nothing, 0);
            for i in 1..N {
                lower = lower.min(corners[i - 1][0]);
                upper = upper.max(corners[i - 1][1]);
                n += count[i - 1];
                if n > 0 && right[i] < f32::INFINITY {
                    let cost = upper.sub(lower).pair_products() * n as f32 + right[i];
                    if best.is_none_or(|b| cost < b.0) {
                        best = Some((cost, axis, i));
                    }
                }
            }
        }
        best.map(|(_, axis, first_right)| (axis, first_right))
    }
}

/// Splits at least two items in two: reorders them and returns where the right side starts, and both ranges.
pub fn split(
    items: &mut [Item],
    range: &Range,
    depth: usize,
    method: Method,
) -> (usize, Range, Range) {
    let mut middle = items.len() / 2;
    // Halving takes `needed` levels: once that is all that is left, it is all that happens.
    let needed = items.len().next_power_of_two().trailing_zeros() as usize;
    if depth + needed < MAX_DEPTH {
        let bins = match method {
            Method::Bins(bins) => bins,
            Method::Curve(curve) => {
                middle = curve.split(items).unwrap_or(middle);
                return halves(items, middle);
            }
        };
        let binning = Binning::of(range, bins);
        let best = match bins {
            8 => best::<8>(items, &binning),
            16 => best::<16>(items, &binning),
            _ => best::<32>(items, &binning),
        };
        if let Some((axis, first_right)) = best {
            return partition(items, |item| {
                (binning.bin(item)[axis] as usize) < first_right
            });
        }
    }
    halves(items, middle)
}

/// How a split is found.
#[derive(Clone, Copy)]
pub enum Method<'a> {
    /// The cheapest of those between 8, 16 or 32 bins along each axis.
    Bins(usize),
    /// Along a curve, in whose order the items are.
    Curve(&'a Curve),
}

/// The items before `middle` and the others.
fn halves(items: &[Item], middle: usize) -> (usize, Range, Range) {
    (
        middle,
        Range::of(&items[..middle]),
        Range::of(&items[middle..]),
    )
}

/// The cheapest axis and first bin of the right side, in parallel.
fn best<const N: usize>(items: &[Item], binning: &Binning) -> Option<(usize, usize)> {
    if items.len() <= PARALLEL {
        return Bins::<N>::of(items, binning).best(binning);
    }
    let chunks = items
        .par_chunks(PARALLEL)
        .map(|chunk| Bins::<N>::of(chunk, binning));
    chunks
        .reduce(Bins::empty, |a, b| a.merged(&b))
        .best(binning)
}

/// Items for which `left` holds first.
#[inline(always)]
fn partition(items: &mut [Item], left: impl Fn(&Item) -> bool) -> (usize, Range, Range) {
    let (mut a, mut b) = (Range::empty(), Range::empty());
    let (mut i, mut j) = (0, items.len());
    loop {
        while i < j && left(&items[i]) {
            a.grow(&items[i]);
            i += 1;
        }
        while i < j && !left(&items[j - 1]) {
            b.grow(&items[j - 1]);
            j -= 1;
        }
        if i >= j {
            return (i, a, b);
        }
        items.swap(i, j - 1);
    }
}
