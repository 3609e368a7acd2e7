//! Piecewise constant distribution over the sphere, on an equirectangular grid.

use std::f64::consts::{PI, TAU};

use raycam_bvh::prefetch;

/// Samples directions in proportion to a brightness per cell: first a row by the marginal distribution, then a column
/// by the conditional distribution, both by inversion, which keeps stratification (M. Pharr, W. Jakob and G. Humphreys,
/// "Physically Based Rendering", 4th edition, section 12.5.2). The density is uniform within a cell.
#[derive(Debug)]
pub(crate) struct PiecewiseConstant2D {
    columns: usize,
    rows: usize,
    /// Cumulative conditional distribution of each row: columns + 1 values from 0 to 1.
    conditional_cdf: Vec<f32>,
    /// Cumulative marginal distribution of the rows: rows + 1 values from 0 to 1.
    marginal_cdf: Vec<f32>,
    /// Guide tables of the conditional distributions, row by row, and of the marginal distribution.
    conditional_guide: Vec<u16>,
    marginal_guide: Vec<u16>,
    /// Cosines of the zenith angles of the rows' borders.
    row_edges: Vec<f64>,
    /// For each row: the density by solid angle if all columns were equally likely, times the number of columns.
    density: Vec<f32>,
}

impl PiecewiseConstant2D {
    /// Builds the distribution, with at most 2^16 columns and rows; `None` if every cell is black.
    pub fn new([columns, rows]: [usize; 2], brightness: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let edges: Vec<f64> = (0..=rows).map(|row| (PI * row as f64 / rows as f64).cos()).collect();
        let mut across = Vec::with_capacity((columns + 1) * rows);
        let mut across_hints = Vec::with_capacity(columns.div_ceil(CELLS_PER_BUCKET) * rows);
        let mut sums = Vec::with_capacity(rows);
        for row in 0..rows {
            let sum = running_sum((0..columns).map(|column| brightness(column, row)), &mut across);
            build_guide_table(&across[row * (columns + 1)..], &mut across_hints);
            sums.push(sum * (edges[row] - edges[row + 1]));
        }
        let mut down = Vec::with_capacity(rows + 1);
        let total = running_sum(sums.into_iter(), &mut down);
        let mut down_hints = vec![];
        build_guide_table(&down, &mut down_hints);
        let density = (0..rows).map(|row| {
            let share = f64::from(down[row + 1]) - f64::from(down[row]);
            (share * columns as f64 / (TAU * (edges[row] - edges[row + 1]))) as f32
        });
        let density = density.collect();
        (total > 0.0 && total.is_finite()).then_some(Self {
            columns,
            rows,
            conditional_cdf: across,
            marginal_cdf: down,
            conditional_guide: across_hints,
            marginal_guide: down_hints,
            row_edges: edges,
            density,
        })
    }

    /// Samples points by random numbers, of which there may be fewer than lanes: sets the column coordinates `u`, from
    /// 0 to 1, and the cosines of the zenith angle. The function runs stage by stage over all lanes, so that each stage
    /// prefetches the data that the next stage reads.
    #[inline(always)]
    pub fn sample_many<const N: usize>(&self, random: &[[f32; 2]], u: &mut [f64; N], cos_theta: &mut [f64; N]) {
        let (mut rows, mut cells) = ([0; N], [0; N]);
        for (lane, &[x, y]) in random.iter().enumerate().take(N) {
            let first = guide_index(&self.marginal_guide, y);
            let (row, inside) = find_interval(&self.marginal_cdf, first, y);
            let [top, bottom] = [self.row_edges[row], self.row_edges[row + 1]];
            (rows[lane], cos_theta[lane]) = (row, top + (bottom - top) * inside);
            if N > 1 {
                let guide = self.row_guide(row);
                prefetch(&raw const guide[bucket(guide, x)]);
            }
        }
        for (lane, &[x, _]) in random.iter().enumerate().take(N) {
            let row = rows[lane];
            cells[lane] = guide_index(self.row_guide(row), x);
            if N > 1 {
                prefetch(&raw const self.row(row)[cells[lane]]);
            }
        }
        for (lane, &[x, _]) in random.iter().enumerate().take(N) {
            let (column, along) = find_interval(self.row(rows[lane]), cells[lane], x);
            u[lane] = (column as f64 + along) / self.columns as f64;
        }
    }

    /// Density by solid angle at image coordinates.
    pub fn pdf(&self, place: [f32; 2]) -> f32 {
        let [column, row] = self.cell(place);
        let sums = self.row(row);
        (sums[column + 1] - sums[column]) * self.density[row]
    }

    /// Prefetches the data that [`PiecewiseConstant2D::pdf`] reads.
    pub fn prefetch(&self, [u, v]: [f32; 2]) {
        let [column, row] = self.cell([u, v]);
        prefetch(&raw const self.row(row)[column]);
    }

    fn cell(&self, [u, v]: [f32; 2]) -> [usize; 2] {
        let cell = |x: f32, count: usize| ((x * count as f32) as usize).min(count - 1);
        [cell(u, self.columns), cell(v, self.rows)]
    }

    #[inline(always)]
    fn row_guide(&self, row: usize) -> &[u16] {
        let hints = self.columns.div_ceil(CELLS_PER_BUCKET);
        &self.conditional_guide[row * hints..][..hints]
    }

    #[inline(always)]
    fn row(&self, row: usize) -> &[f32] {
        &self.conditional_cdf[row * (self.columns + 1)..(row + 1) * (self.columns + 1)]
    }
}

/// Appends the running sums of `values`, normalised to 1; returns the total. The distribution is uniform if the total
/// is 0.
fn running_sum(values: impl ExactSizeIterator<Item = f64>, into: &mut Vec<f32>) -> f64 {
    let count = values.len();
    let mut sums = Vec::with_capacity(count + 1);
    sums.push(0.0);
    let mut sum = 0.0;
    for value in values {
        sum += value;
        sums.push(sum);
    }
    into.extend(sums.iter().enumerate().map(|(i, &part)| {
        let share = if sum > 0.0 { part / sum } else { i as f64 / count as f64 };
        share as f32
    }));
    sum
}

/// Mean number of cells per bucket of a guide table.
const CELLS_PER_BUCKET: usize = 8;

/// Appends, for equal buckets of 0..1, the last cell that begins at or before every number of the bucket (H. C. Chen
/// and Y. Asau, "On Generating Random Variates from an Empirical Distribution", 1974).
fn build_guide_table(sums: &[f32], into: &mut Vec<u16>) {
    let cells = sums.len() - 1;
    let parts = cells.div_ceil(CELLS_PER_BUCKET);
    let mut cell = 0;
    for part in 0..parts {
        // A number just below the bucket may be rounded into it.
        let x = part as f32 / parts as f32 * (1.0 - 4.0 * f32::EPSILON);
        while cell + 1 < cells && sums[cell + 1] <= x {
            cell += 1;
        }
        into.push(cell as u16);
    }
}

/// Index of the bucket that contains `x`.
#[inline(always)]
fn bucket(hints: &[u16], x: f32) -> usize {
    let parts = hints.len();
    ((x * parts as f32) as usize).min(parts - 1)
}

/// First cell to be searched for `x`: a cell at or before the cell that contains `x`.
#[inline(always)]
fn guide_index(hints: &[u16], x: f32) -> usize {
    usize::from(hints[bucket(hints, x)])
}

/// Cell that contains `x` (the last cell that begins at or before `x`), and the relative position of `x` in it; `first`
/// is any cell at or before this cell.
#[inline(always)]
fn find_interval(sums: &[f32], first: usize, x: f32) -> (usize, f64) {
    let cells = sums.len() - 1;
    let mut cell = first;
    // Several cells are compared at a time, because a loop over a varying number of cells would mispredict a branch.
    loop {
        let next = &sums[cell + 1..];
        let next = &next[..next.len().min(CELLS_PER_BUCKET)];
        let before: usize = next.iter().map(|sum| usize::from(*sum <= x)).sum();
        cell = (cell + before).min(cells - 1);
        if before < CELLS_PER_BUCKET || cell == cells - 1 {
            break;
        }
    }
    let (low, high) = (f64::from(sums[cell]), f64::from(sums[cell + 1]));
    let inside = if high > low { (f64::from(x) - low) / (high - low) } else { 0.5 };
    (cell, inside.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lookup_finds_the_last_cell_starting_before_a_number() {
        for cells in [1, 2, 7, 8, 9, 300] {
            // Most cells are black, a few are bright, and long runs are 0.
            let bright = |i: usize| match ((i * 2_654_435_761) >> 3) & 15 {
                0 => 1000.0,
                1..=6 => 0.0,
                n => n as f64,
            };
            let (mut sums, mut hinted) = (vec![], vec![]);
            let values = (0..cells).map(|i| bright(i) + if i < cells / 2 { 0.0 } else { 1e-3 });
            running_sum(values.collect::<Vec<_>>().into_iter(), &mut sums);
            build_guide_table(&sums, &mut hinted);
            let edges = sums.iter().flat_map(|&x| [x.next_down(), x, x.next_up()]);
            let spread = (0..1000).map(|i| i as f32 / 999.0);
            for x in edges.chain(spread).filter(|x| (0.0..=1.0).contains(x)) {
                let after = sums.partition_point(|&sum| sum <= x);
                let (cell, along) = find_interval(&sums, guide_index(&hinted, x), x);
                assert_eq!(cell, after.clamp(1, cells) - 1, "{x} of {cells}");
                assert!((0.0..=1.0).contains(&along));
            }
        }
    }
}
