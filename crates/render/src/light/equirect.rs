//! Directions as an equirectangular picture of the sphere has them, and how to draw them by its brightness.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3, Mat3, Vec3};
use raycam_bvh::{WithSimd, dispatch_simd, prefetch};
use raycam_scene::Up;

use crate::lobes::shading_frame::{atan2_turns, sincos_turns};
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Which way a panorama is turned.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EquirectFrame {
    /// Rows: where its middle is, left of that, up.
    panorama_from_world: DMat3,
    /// The same in float32, for what is asked of every ray.
    rounded: Mat3,
}

impl EquirectFrame {
    /// `yaw` in degrees, as a camera's.
    pub fn new(up: Up, yaw: f64) -> Self {
        let vertical = up.axis();
        let ahead = match up {
            Up::Z => DVec3::X,
            Up::Y => DVec3::NEG_Z,
        };
        let left = vertical.cross(ahead);
        let (sin, cos) = yaw.to_radians().sin_cos();
        let middle = ahead * cos + left * sin;
        let rows = DMat3::from_cols(middle, vertical.cross(middle), vertical);
        Self {
            panorama_from_world: rows.transpose(),
            rounded: rows.transpose().as_mat3(),
        }
    }

    /// Where a direction lies in the picture: 0..=1 to the right, 0..=1 down.
    #[inline(always)]
    pub fn to_uv(&self, direction: Vec3) -> [f32; 2] {
        let d = self.rounded * direction;
        let around = atan2_turns(d.y, d.x);
        let u = if around <= 0.5 { 0.5 } else { 1.5 } - around;
        [u, 2.0 * atan2_turns(d.truncate().length(), d.z)]
    }

    /// The same of many.
    pub fn to_uv_many<const N: usize>(
        &self,
        directions: &Vec3xN<f32, N>,
        places: &mut [[f32; N]; 2],
    ) {
        dispatch_simd(ComputeUvs {
            frame: self,
            directions,
            places,
        });
    }

    /// The direction of a place in the picture, of unit length; `marginal_cdf` is the cosine of the angle to the zenith.
    #[inline(always)]
    pub fn direction(&self, u: f64, down: f64) -> Vec3 {
        // A half turn from where u begins.
        let (sin, cos) = sincos_turns(u as f32);
        let radius = (1.0 - down * down).max(0.0).sqrt() as f32;
        self.rounded.transpose() * Vec3::new(-cos * radius, sin * radius, down as f32)
    }

    /// A direction in the world of one whose axes are middle, left and up.
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.panorama_from_world.transpose() * local
    }
}

/// Draws directions in proportion to a brightness given cell by cell: first a row, then a column of it, both by the
/// inverse of their distribution, which keeps what is even about the random numbers (M. Pharr, W. Jakob and G. Humphreys,
/// "Physically Based Rendering", 4th edition, section 12.5.2). Inside a cell all directions are alike.
#[derive(Debug)]
pub(crate) struct PiecewiseConstant2D {
    columns: usize,
    rows: usize,
    /// For every row, one more than there are columns, from 0 to 1.
    conditional_cdf: Vec<f32>,
    /// From 0 to 1.
    marginal_cdf: Vec<f32>,
    /// Where to look for a number in `conditional_cdf`, row by row, and in `marginal_cdf`.
    conditional_guide: Vec<u16>,
    marginal_guide: Vec<u16>,
    /// The cosines of the angles to the zenith between rows.
    row_edges: Vec<f64>,
    /// For every row, its density by solid angle where all columns are alike, times their number.
    density: Vec<f32>,
}

impl PiecewiseConstant2D {
    /// `None` where all is dark. There are at most 2^16 columns and as many rows.
    pub fn new(
        [columns, rows]: [usize; 2],
        brightness: impl Fn(usize, usize) -> f64,
    ) -> Option<Self> {
        let edges: Vec<f64> = (0..=rows)
            .map(|row| (PI * row as f64 / rows as f64).cos())
            .collect();
        let mut across = Vec::with_capacity((columns + 1) * rows);
        let mut across_hints = Vec::with_capacity(columns.div_ceil(CELLS_PER_BUCKET) * rows);
        let mut sums = Vec::with_capacity(rows);
        for row in 0..rows {
            let sum = running_sum(
                (0..columns).map(|column| brightness(column, row)),
                &mut across,
            );
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

    /// A direction by random numbers.
    pub fn sample(&self, frame: &EquirectFrame, random: [f32; 2]) -> Vec3 {
        let mut directions = [[0.0]; 3];
        self.sample_many::<1>(frame, &[random], &mut directions);
        get_lane(&directions, 0).into()
    }

    /// The same of many; there may be fewer numbers.
    pub fn sample_many<const N: usize>(
        &self,
        frame: &EquirectFrame,
        random: &[[f32; 2]],
        directions: &mut Vec3xN<f32, N>,
    ) {
        dispatch_simd(SampleMany {
            table: self,
            frame,
            random,
            directions,
        });
    }

    /// The density of directions at a place in the picture, by solid angle.
    pub fn pdf(&self, place: [f32; 2]) -> f32 {
        let [column, row] = self.cell(place);
        let sums = self.row(row);
        (sums[column + 1] - sums[column]) * self.density[row]
    }

    /// Asks for what [`PiecewiseConstant2D::pdf`] reads.
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

/// Finds where directions lie in the picture.
struct ComputeUvs<'a, const N: usize> {
    frame: &'a EquirectFrame,
    directions: &'a Vec3xN<f32, N>,
    places: &'a mut [[f32; N]; 2],
}

impl<const N: usize> WithSimd for ComputeUvs<'_, N> {
    #[inline(always)]
    fn run(self) {
        for lane in 0..N {
            let [u, v] = self.frame.to_uv(get_lane(self.directions, lane).into());
            self.places[0][lane] = u;
            self.places[1][lane] = v;
        }
    }
}

/// Draws directions, step by step over all of them: what one step reads the one before has asked for.
struct SampleMany<'a, const N: usize> {
    table: &'a PiecewiseConstant2D,
    frame: &'a EquirectFrame,
    random: &'a [[f32; 2]],
    directions: &'a mut Vec3xN<f32, N>,
}

impl<const N: usize> WithSimd for SampleMany<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            table,
            frame,
            random,
            directions,
        } = self;
        let (mut rows, mut cells, mut down, mut u) = ([0; N], [0; N], [0.0; N], [0.0; N]);
        for (lane, &[x, y]) in random.iter().enumerate().take(N) {
            let first = guide_index(&table.marginal_guide, y);
            let (row, inside) = find_interval(&table.marginal_cdf, first, y);
            let [top, bottom] = [table.row_edges[row], table.row_edges[row + 1]];
            (rows[lane], down[lane]) = (row, top + (bottom - top) * inside);
            if N > 1 {
                let hints = table.row_guide(row);
                prefetch(&raw const hints[bucket(hints, x)]);
            }
        }
        for (lane, &[x, _]) in random.iter().enumerate().take(N) {
            let row = rows[lane];
            cells[lane] = guide_index(table.row_guide(row), x);
            if N > 1 {
                prefetch(&raw const table.row(row)[cells[lane]]);
            }
        }
        for (lane, &[x, _]) in random.iter().enumerate().take(N) {
            let (column, along) = find_interval(table.row(rows[lane]), cells[lane], x);
            u[lane] = (column as f64 + along) / table.columns as f64;
        }
        for lane in 0..N {
            let direction = frame.direction(u[lane], down[lane]);
            set_lane(directions, lane, direction.to_array());
        }
    }
}

/// Appends the running sums of `values` from 0 to 1, and gives the sum before it became 1. An even distribution where
/// it is 0: it is never asked for.
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
        let share = if sum > 0.0 {
            part / sum
        } else {
            i as f64 / count as f64
        };
        share as f32
    }));
    sum
}

/// How many cells share a hint, in the mean.
const CELLS_PER_BUCKET: usize = 8;

/// Appends, for equal parts of 0..1, a cell of a running sum behind whose beginning every number of the part lies
/// (H. C. Chen and Y. Asau, "On Generating Random Variates from an Empirical Distribution", 1974).
fn build_guide_table(sums: &[f32], into: &mut Vec<u16>) {
    let cells = sums.len() - 1;
    let parts = cells.div_ceil(CELLS_PER_BUCKET);
    let mut cell = 0;
    for part in 0..parts {
        // What is a hair less may be rounded up to the part.
        let x = part as f32 / parts as f32 * (1.0 - 4.0 * f32::EPSILON);
        while cell + 1 < cells && sums[cell + 1] <= x {
            cell += 1;
        }
        into.push(cell as u16);
    }
}

/// The part of 0..1 in which `x` lies.
#[inline(always)]
fn bucket(hints: &[u16], x: f32) -> usize {
    let parts = hints.len();
    ((x * parts as f32) as usize).min(parts - 1)
}

/// A cell behind whose beginning `x` lies.
#[inline(always)]
fn guide_index(hints: &[u16], x: f32) -> usize {
    usize::from(hints[bucket(hints, x)])
}

/// The cell of a running sum that holds `x`, the last one that begins there, and how far along it is; by a cell behind
/// whose beginning it lies.
#[inline(always)]
fn find_interval(sums: &[f32], first: usize, x: f32) -> (usize, f64) {
    let cells = sums.len() - 1;
    let mut cell = first;
    // Several at a time, without a guess how many there are.
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
    let inside = if high > low {
        (f64::from(x) - low) / (high - low)
    } else {
        0.5
    };
    (cell, inside.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_found_in_the_last_cell_that_begins_before_it() {
        for cells in [1, 2, 7, 8, 9, 300] {
            // Most are dark, a few bright, and whole stretches are nothing.
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
