//! One split of a range of boxes by the binned surface-area heuristic (Wald 2007).

use rayon::prelude::*;

use super::MAX_DEPTH;

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

    #[inline(always)]
    fn lower4(&self) -> [f32; 4] {
        [self.lower[0], self.lower[1], self.lower[2], 0.0]
    }

    #[inline(always)]
    fn upper4(&self) -> [f32; 4] {
        [self.upper[0], self.upper[1], self.upper[2], 0.0]
    }

    /// Twice the centre.
    #[inline(always)]
    fn centre(&self) -> [f32; 4] {
        std::array::from_fn(|a| self.lower4()[a] + self.upper4()[a])
    }
}

/// The box of some items and the box of their (doubled) centres.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    lower: [f32; 4],
    upper: [f32; 4],
    centre_lower: [f32; 4],
    centre_upper: [f32; 4],
}

#[inline(always)]
fn min4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
}

#[inline(always)]
fn max4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
}

/// Half the surface of a box.
#[inline(always)]
pub fn half_area(lower: &[f32; 4], upper: &[f32; 4]) -> f32 {
    let [x, y, z] = std::array::from_fn(|a| upper[a] - lower[a]);
    x * y + y * z + z * x
}

const PARALLEL: usize = 1 << 14;

impl Range {
    /// The range of nothing.
    pub const EMPTY: Range = Range {
        lower: [f32::INFINITY; 4],
        upper: [f32::NEG_INFINITY; 4],
        centre_lower: [f32::INFINITY; 4],
        centre_upper: [f32::NEG_INFINITY; 4],
    };

    /// The range of `items`, in parallel.
    pub fn of(items: &[Item]) -> Range {
        let one = |items: &[Item]| {
            let mut range = Self::EMPTY;
            items.iter().for_each(|item| range.grow(item));
            range
        };
        if items.len() <= PARALLEL {
            return one(items);
        }
        items
            .par_chunks(PARALLEL)
            .map(one)
            .reduce(|| Self::EMPTY, |a, b| a.merged(&b))
    }

    #[inline(always)]
    fn grow(&mut self, item: &Item) {
        let c = item.centre();
        self.lower = min4(self.lower, item.lower4());
        self.upper = max4(self.upper, item.upper4());
        self.centre_lower = min4(self.centre_lower, c);
        self.centre_upper = max4(self.centre_upper, c);
    }

    fn merged(&self, b: &Range) -> Range {
        Range {
            lower: min4(self.lower, b.lower),
            upper: max4(self.upper, b.upper),
            centre_lower: min4(self.centre_lower, b.centre_lower),
            centre_upper: max4(self.centre_upper, b.centre_upper),
        }
    }

    /// The lower corner of the box.
    pub fn lower(&self) -> [f32; 3] {
        [self.lower[0], self.lower[1], self.lower[2]]
    }

    /// The upper corner of the box.
    pub fn upper(&self) -> [f32; 3] {
        [self.upper[0], self.upper[1], self.upper[2]]
    }

    /// Half the surface of the box.
    pub fn half_area(&self) -> f32 {
        half_area(&self.lower, &self.upper)
    }
}

const BINS: usize = 16;

#[derive(Clone, Copy)]
struct Bins {
    lower: [[[f32; 4]; BINS]; 3],
    upper: [[[f32; 4]; BINS]; 3],
    count: [[u32; BINS]; 3],
}

/// Which bin a centre falls into: the same arithmetic wherever it is asked.
#[derive(Clone, Copy)]
struct Binning {
    offset: [f32; 4],
    scale: [f32; 4],
}

impl Binning {
    fn of(range: &Range) -> Binning {
        let offset = range.centre_lower;
        let scale = std::array::from_fn(|a| {
            let extent = range.centre_upper[a] - offset[a];
            // Just below the number of bins, so that the last centre stays in the last bin; 0 for a flat axis.
            let scale = BINS as f32 * 0.999_99 / extent;
            if a < 3 && extent > 0.0 && scale.is_finite() {
                scale
            } else {
                0.0
            }
        });
        Binning { offset, scale }
    }

    #[inline(always)]
    fn bin(&self, item: &Item) -> [usize; 4] {
        let c = item.centre();
        std::array::from_fn(|a| {
            // SAFETY: the value is finite and within 0..BINS, by the choice of `scale`.
            let bin: i32 = unsafe { ((c[a] - self.offset[a]) * self.scale[a]).to_int_unchecked() };
            (bin as usize).min(BINS - 1)
        })
    }
}

impl Bins {
    const EMPTY: Bins = Bins {
        lower: [[[f32::INFINITY; 4]; BINS]; 3],
        upper: [[[f32::NEG_INFINITY; 4]; BINS]; 3],
        count: [[0; BINS]; 3],
    };

    fn of(items: &[Item], binning: &Binning) -> Bins {
        let mut bins = Self::EMPTY;
        for item in items {
            let at = binning.bin(item);
            let (lower, upper) = (item.lower4(), item.upper4());
            for axis in 0..3 {
                let b = at[axis];
                bins.lower[axis][b] = min4(bins.lower[axis][b], lower);
                bins.upper[axis][b] = max4(bins.upper[axis][b], upper);
                bins.count[axis][b] += 1;
            }
        }
        bins
    }

    fn merged(mut self, b: &Bins) -> Bins {
        for axis in 0..3 {
            for i in 0..BINS {
                self.lower[axis][i] = min4(self.lower[axis][i], b.lower[axis][i]);
                self.upper[axis][i] = max4(self.upper[axis][i], b.upper[axis][i]);
                self.count[axis][i] += b.count[axis][i];
            }
        }
        self
    }

    /// The cheapest (cost, axis, first bin of the right side); ties go to the lower axis and bin.
    fn best(&self, binning: &Binning) -> Option<(f32, usize, usize)> {
        let mut best: Option<(f32, usize, usize)> = None;
        for axis in (0..3).filter(|&a| binning.scale[a] > 0.0) {
            let mut right = [(0.0f32, 0u32); BINS];
            let (mut lower, mut upper, mut n) = ([f32::INFINITY; 4], [f32::NEG_INFINITY; 4], 0);
            for i in (1..BINS).rev() {
                lower = min4(lower, self.lower[axis][i]);
                upper = max4(upper, self.upper[axis][i]);
                n += self.count[axis][i];
                right[i] = (
                    if n > 0 {
                        half_area(&lower, &upper) * n as f32
                    } else {
                        0.0
                    },
                    n,
                );
            }
            (lower, upper, n) = ([f32::INFINITY; 4], [f32::NEG_INFINITY; 4], 0);
            for i in 1..BINS {
                lower = min4(lower, self.lower[axis][i - 1]);
                upper = max4(upper, self.upper[axis][i - 1]);
                n += self.count[axis][i - 1];
                if n > 0 && right[i].1 > 0 {
                    let cost = half_area(&lower, &upper) * n as f32 + right[i].0;
                    if best.is_none_or(|b| cost < b.0) {
                        best = Some((cost, axis, i));
                    }
                }
            }
        }
        best
    }
}

/// Splits at least two items in two: reorders them and returns where the right side starts, and both ranges.
pub fn split(
    items: &mut [Item],
    range: &Range,
    depth: usize,
    parallel: bool,
) -> (usize, Range, Range) {
    // Halving takes `needed` levels: once that is all that is left, it is all that happens.
    let needed = items.len().next_power_of_two().trailing_zeros() as usize;
    if depth + needed < MAX_DEPTH {
        let binning = Binning::of(range);
        let bins = if parallel && items.len() > PARALLEL {
            items
                .par_chunks(PARALLEL)
                .map(|chunk| Bins::of(chunk, &binning))
                .reduce(|| Bins::EMPTY, |a, b| a.merged(&b))
        } else {
            Bins::of(items, &binning)
        };
        if let Some((_, axis, first_right)) = bins.best(&binning) {
            return partition(items, |item| binning.bin(item)[axis] < first_right);
        }
    }
    let middle = items.len() / 2;
    (
        middle,
        Range::of(&items[..middle]),
        Range::of(&items[middle..]),
    )
}

/// Items for which `left` holds first.
fn partition(items: &mut [Item], left: impl Fn(&Item) -> bool) -> (usize, Range, Range) {
    let (mut a, mut b) = (Range::EMPTY, Range::EMPTY);
    let (mut i, mut j) = (0, items.len());
    while i < j {
        if left(&items[i]) {
            a.grow(&items[i]);
            i += 1;
        } else {
            b.grow(&items[i]);
            j -= 1;
            items.swap(i, j);
        }
    }
    (i, a, b)
}
