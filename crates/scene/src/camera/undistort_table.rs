//! Initial guesses for the inverse of a lens: a table over the image, accurate enough for a single step of Newton's
//! method. The table is computed when the first ray is requested, and a guess depends only on its pixel.

use std::sync::{Arc, OnceLock};

use glam::{DMat3, DVec2};

use crate::camera::lens::Lens;

/// Pixels per cell, and the maximum number of cells per side.
const CELL_PIXELS: u32 = 5;
const MAX_CELLS: u32 = 128;
/// Number of cells added on each side of the image: one for pixels just outside the image, and one for the polynomials
/// at the border.
const BORDER_CELLS: u32 = 2;

/// Table of one camera, shared by its copies; comparisons of cameras ignore the table.
#[derive(Clone, Debug, Default)]
pub struct UndistortTable(Arc<OnceLock<Box<[DVec2]>>>);

impl PartialEq for UndistortTable {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl UndistortTable {
    /// Approximate point of the lens's undistorted plane for a pixel; `None` outside the image, and NaN near and
    /// beyond the edge of the lens's valid region.
    pub fn initial_guess(&self, pixel: DVec2, k: DMat3, size: [u32; 2], lens: &Lens) -> Option<DVec2> {
        let (cells, cell) = grid(size);
        let at = (pixel + 0.5) / cell + f64::from(BORDER_CELLS);
        let whole = at.floor();
        let inside = |v: f64, cells: u32| v >= 1.0 && v < f64::from(cells + 2 * BORDER_CELLS - 1);
        if !(inside(whole.x, cells[0]) && inside(whole.y, cells[1])) {
            return None;
        }
        let nodes = self.0.get_or_init(|| build_table(k, size, lens));
        let (left, top) = (whole.x as usize - 1, whole.y as usize - 1);
        let (x, y) = (lagrange_weights(at.x - whole.x), lagrange_weights(at.y - whole.y));
        let mut sum = DVec2::ZERO;
        for (row, y) in y.into_iter().enumerate() {
            let first = (top + row) * grid_nodes(cells[0]) + left;
            let line = &nodes[first..first + 4];
            sum += y * (x[0] * line[0] + x[1] * line[1] + x[2] * line[2] + x[3] * line[3]);
        }
        Some(sum)
    }
}

/// Number of columns and rows of cells, and the size of a cell in pixels.
fn grid(size: [u32; 2]) -> ([u32; 2], DVec2) {
    let cells = size.map(|side| side.div_ceil(CELL_PIXELS).min(MAX_CELLS));
    let across = DVec2::from(size.map(f64::from)) / DVec2::from(cells.map(f64::from));
    (cells, across)
}

/// Number of nodes along a side with this number of cells.
fn grid_nodes(cells: u32) -> usize {
    (cells + 2 * BORDER_CELLS + 1) as usize
}

/// Weights of the nodes -1, 0, 1 and 2 at 0 <= t < 1: the cubic polynomial through all four (Lagrange).
fn lagrange_weights(t: f64) -> [f64; 4] {
    let (a, b, c) = (t + 1.0, t - 1.0, t - 2.0);
    [t * b * c / -6.0, a * b * c / 2.0, a * t * c / -2.0, a * t * b / 6.0]
}

fn build_table(k: DMat3, size: [u32; 2], lens: &Lens) -> Box<[DVec2]> {
    let ((cells, cell), inverse) = (grid(size), k.inverse());
    let [columns, rows] = cells.map(grid_nodes);
    let mut nodes = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let node = DVec2::new(column as f64, row as f64) - f64::from(BORDER_CELLS);
            let pixel = node * cell - 0.5;
            let image = (inverse * pixel.extend(1.0)).truncate();
            // The previous node's value is the initial guess for this node.
            let near = if column > 0 { nodes.last().copied() } else { None };
            nodes.push(lens.undistort_plane(image, near).unwrap_or(DVec2::NAN));
        }
    }
    nodes.into()
}
