//! Directions as an equirectangular picture of the sphere has them, and how to draw them by its brightness.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};
use raycam_scene::Up;

/// Which way a panorama is turned.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Rows: where its middle is, left of that, up.
    panorama_from_world: DMat3,
}

impl Frame {
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
        }
    }

    /// Where a direction lies in the picture: 0..1 to the right, 0..1 down.
    pub fn place(&self, direction: DVec3) -> [f64; 2] {
        let d = self.panorama_from_world * direction;
        let u = 0.5 - d.y.atan2(d.x) / TAU;
        let v = d.truncate().length().atan2(d.z) / PI;
        [u, v]
    }

    /// The direction of a place in the picture, of unit length; `down` is the cosine of the angle to the zenith.
    fn direction(&self, u: f64, down: f64) -> DVec3 {
        let (sin, cos) = (TAU * (0.5 - u)).sin_cos();
        let radius = (1.0 - down * down).max(0.0).sqrt();
        self.world(DVec3::new(cos * radius, sin * radius, down))
    }

    /// A direction in the world of one whose axes are middle, left and up.
    pub fn world(&self, local: DVec3) -> DVec3 {
        self.panorama_from_world.transpose() * local
    }
}

/// Draws directions in proportion to a brightness given cell by cell: first a row, then a column of it, both by the
/// inverse of their distribution, which keeps what is even about the random numbers (M. Pharr, W. Jakob and G. Humphreys,
/// "Physically Based Rendering", 4th edition, section 12.5.2). Inside a cell all directions are alike.
#[derive(Debug)]
pub(crate) struct Table {
    columns: usize,
    rows: usize,
    /// For every row, one more than there are columns, from 0 to 1.
    across: Vec<f32>,
    /// From 0 to 1.
    down: Vec<f32>,
}

impl Table {
    /// `None` where all is dark.
    pub fn new(
        [columns, rows]: [usize; 2],
        brightness: impl Fn(usize, usize) -> f64,
    ) -> Option<Self> {
        let mut across = Vec::with_capacity((columns + 1) * rows);
        let mut sums = Vec::with_capacity(rows);
        for row in 0..rows {
            let sum = accumulate(
                (0..columns).map(|column| brightness(column, row)),
                &mut across,
            );
            sums.push(sum * (cosine(row, rows) - cosine(row + 1, rows)));
        }
        let mut down = Vec::with_capacity(rows + 1);
        let total = accumulate(sums.into_iter(), &mut down);
        (total > 0.0 && total.is_finite()).then_some(Self {
            columns,
            rows,
            across,
            down,
        })
    }

    /// A direction.
    pub fn sample(&self, frame: &Frame, [x, y]: [f32; 2]) -> DVec3 {
        let (row, inside) = find(&self.down, y);
        let (top, bottom) = (cosine(row, self.rows), cosine(row + 1, self.rows));
        let (column, along) = find(self.row(row), x);
        let u = (column as f64 + along) / self.columns as f64;
        frame.direction(u, top + (bottom - top) * inside)
    }

    /// The density of a direction by solid angle.
    pub fn pdf(&self, frame: &Frame, direction: DVec3) -> f64 {
        let [u, v] = frame.place(direction);
        let cell = |x: f64, count: usize| ((x * count as f64) as usize).min(count - 1);
        let (column, row) = (cell(u, self.columns), cell(v, self.rows));
        let width = |list: &[f32], i: usize| f64::from(list[i + 1]) - f64::from(list[i]);
        let solid =
            TAU / self.columns as f64 * (cosine(row, self.rows) - cosine(row + 1, self.rows));
        width(&self.down, row) * width(self.row(row), column) / solid
    }

    fn row(&self, row: usize) -> &[f32] {
        &self.across[row * (self.columns + 1)..(row + 1) * (self.columns + 1)]
    }
}

/// The cosine of the angle to the zenith at the upper edge of a row.
fn cosine(row: usize, rows: usize) -> f64 {
    (PI * row as f64 / rows as f64).cos()
}

/// Appends the running sums of `values` from 0 to 1, and gives the sum before it became 1. An even distribution where
/// it is 0: it is never asked for.
fn accumulate(values: impl ExactSizeIterator<Item = f64>, into: &mut Vec<f32>) -> f64 {
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

/// The cell of a running sum that holds `x`, and how far along it is.
fn find(sums: &[f32], x: f32) -> (usize, f64) {
    // The last edge not beyond x that has something after it.
    let after = sums.partition_point(|&sum| sum <= x);
    let cell = after.clamp(1, sums.len() - 1) - 1;
    let (low, high) = (f64::from(sums[cell]), f64::from(sums[cell + 1]));
    let inside = if high > low {
        (f64::from(x) - low) / (high - low)
    } else {
        0.5
    };
    (cell, inside.clamp(0.0, 1.0))
}
