//! Distribution of points on a triangle in proportion to the brightness of its emission texture.

use glam::Vec3;

/// Distribution over the cells of a triangle, in weights (u, v) of its second and third vertex.
///
/// The unit square of (u, v) has `size` x `size` cells; the triangle u + v < 1 contains `size - 1 - row` whole cells of
/// each row and half of the following cell. A row is chosen by the marginal distribution, then a cell by the row's
/// conditional distribution, both by inversion (M. Pharr, W. Jakob and G. Humphreys, "Physically Based Rendering", 4th
/// edition, section A.5.6). Within a whole cell, the density is bilinear between the brightness of the corners (section
/// 2.4.2); within half a cell, and on an image without interpolation, it is constant.
#[derive(Debug)]
pub(crate) struct EmissionTable {
    size: usize,
    /// Cumulative distribution over the rows: running sums from 0 to 1.
    marginal: Vec<f32>,
    /// Running sums over the cells of each row, from 0 to 1, row after row; each row is one cell shorter than the
    /// previous row.
    conditional: Vec<f32>,
    /// Brightness at the corners of the cells, in the same order; empty if each cell is constant.
    corners: Vec<f32>,
}

/// Relation between the cells of a table and the texels of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CellContent {
    /// The radiance is constant within a cell.
    Constant,
    /// The radiance is bilinear within a cell.
    Bilinear,
    /// Cells are not aligned with texels.
    Mixed,
}

impl EmissionTable {
    /// Upper bound on the number of values in a table with `size` cells along an edge.
    pub fn len_of(size: usize) -> usize {
        (size + 1) * (size + 4)
    }

    /// Measures the radiance at points (u, v) of a triangle with `size` cells along each edge: in the middle of each
    /// cell if the radiance is constant within a cell, otherwise at the cells' corners. Returns the mean radiance, and
    /// the distribution unless it is uniform or black.
    pub fn measure(size: usize, content: CellContent, radiance: impl Fn([f32; 2]) -> Vec3) -> (Vec3, Option<Self>) {
        let is_continuous = content != CellContent::Constant;
        let at = |column: f32, row: f32| radiance([column / size as f32, row / size as f32]);
        let corner = |column: usize, row: usize| {
            let (x, y) = (column as f32, row as f32);
            if content != CellContent::Mixed {
                return at(x, y);
            }
            // Each corner gets a weighted mean over its surroundings, so that no bright part of a cell has the density
            // 0.
            let offsets = [(-0.5, 0.25), (0.0, 0.5), (0.5, 0.25)];
            let means =
                offsets.map(|(dy, of_row)| offsets.map(|(dx, of_column)| at(x + dx, y + dy) * of_row * of_column));
            means.as_flattened().iter().sum::<Vec3>()
        };
        let corner_row = |row: usize| (0..=size - row).map(|column| corner(column, row)).collect::<Vec<Vec3>>();
        let (mut conditional, mut corners, mut sums) = (vec![], vec![], Vec::with_capacity(size));
        let (mut total, mut lowest, mut highest) = (Vec3::ZERO, f32::INFINITY, 0.0f32);
        let mut below = if is_continuous { corner_row(0) } else { vec![] };
        for row in 0..size {
            let above = if is_continuous { corner_row(row + 1) } else { vec![] };
            let mut weights = Vec::with_capacity(size - row);
            for column in 0..size - row {
                let is_half = column + row == size - 1;
                let area = if is_half { 0.5 } else { 1.0 };
                let (sum, count) = match (is_continuous, is_half) {
                    (true, true) => (below[column] + below[column + 1] + above[column], 3.0),
                    (true, false) => (below[column] + below[column + 1] + above[column] + above[column + 1], 4.0),
                    (false, _) => {
                        let middle = if is_half { 1.0 / 3.0 } else { 0.5 };
                        (at(column as f32 + middle, row as f32 + middle), 1.0)
                    }
                };
                let light = sum * (area / count);
                total += light;
                let brightness = light.element_sum() / area;
                (lowest, highest) = (lowest.min(brightness), highest.max(brightness));
                weights.push(f64::from(light.element_sum()));
            }
            sums.push(push_running_sums(&weights, &mut conditional));
            corners.extend(below.iter().map(|light| light.element_sum()));
            below = above;
        }
        corners.extend(below.iter().map(|light| light.element_sum()));
        let mut marginal = Vec::with_capacity(size + 1);
        push_running_sums(&sums, &mut marginal);
        let mean = total * (2.0 / (size * size) as f32);
        let is_useful = lowest < highest && highest.is_finite();
        (mean, is_useful.then_some(Self { size, marginal, conditional, corners }))
    }

    /// Samples a point (u, v). Returns the point with its density relative to the uniform distribution.
    pub fn sample(&self, [x, y]: [f32; 2]) -> ([f32; 2], f64) {
        let (row, mut v) = invert(&self.marginal, y);
        let (column, mut u) = invert(self.row(row), x);
        if let Some([below, above]) = self.cell_corners(column, row) {
            v = sample_linear(v, below[0] + below[1], above[0] + above[1]);
            let mix = |i: usize| below[i] + (above[i] - below[i]) * v;
            u = sample_linear(u, mix(0), mix(1));
        } else if column + row == self.size - 1 && u + v > 1.0 {
            // A half cell is sampled as a square that is folded along its diagonal.
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let point = [column as f32 + u, row as f32 + v].map(|x| x / self.size as f32);
        (point, self.density((column, u), (row, v)))
    }

    /// Density at a point (u, v) relative to the uniform distribution.
    pub fn pdf(&self, [u, v]: [f32; 2]) -> f64 {
        let cell = |x: f32, count: usize| {
            let cell = ((x * self.size as f32) as usize).min(count - 1);
            (cell, (x * self.size as f32 - cell as f32).clamp(0.0, 1.0))
        };
        let row = cell(v, self.size);
        self.density(cell(u, self.size - row.0), row)
    }

    /// Density at a position in a cell. The cell is given by column and row, the position by numbers from 0 to 1.
    fn density(&self, (column, u): (usize, f32), (row, v): (usize, f32)) -> f64 {
        let step = |sums: &[f32], i: usize| f64::from(sums[i + 1]) - f64::from(sums[i]);
        // A whole cell covers 2 / size^2 of the triangle.
        let cells = (self.size * self.size) as f64 * if column + row == self.size - 1 { 1.0 } else { 0.5 };
        let within = self.cell_corners(column, row).map_or(1.0, |[below, above]| {
            let mix = |[a, b]: [f32; 2]| a + (b - a) * u;
            let sum = below[0] + below[1] + above[0] + above[1];
            let here = mix(below) + (mix(above) - mix(below)) * v;
            if sum > 0.0 { f64::from(4.0 * here / sum) } else { 1.0 }
        });
        step(&self.marginal, row) * step(self.row(row), column) * cells * within
    }

    /// Brightness at the corners of a whole cell of a continuous image, by row.
    fn cell_corners(&self, column: usize, row: usize) -> Option<[[f32; 2]; 2]> {
        if self.corners.is_empty() || column + row == self.size - 1 {
            return None;
        }
        let pair = |row: usize| {
            let first = self.first_of_row(row) + column;
            [self.corners[first], self.corners[first + 1]]
        };
        Some([pair(row), pair(row + 1)])
    }

    /// Cumulative distribution over the cells of a row.
    fn row(&self, row: usize) -> &[f32] {
        &self.conditional[self.first_of_row(row)..][..self.size - row + 1]
    }

    /// Index of a row's first running sum; a row has one more running sum than cells.
    fn first_of_row(&self, row: usize) -> usize {
        row * (self.size + 1) - row * row.saturating_sub(1) / 2
    }
}

/// Appends the running sums of `values`, normalised to 1; returns the total. The distribution is uniform if the total
/// is 0.
fn push_running_sums(values: &[f64], into: &mut Vec<f32>) -> f64 {
    let total: f64 = values.iter().sum();
    let mut sum = 0.0;
    into.push(0.0);
    into.extend(values.iter().enumerate().map(|(i, value)| {
        sum += value;
        let share = if total > 0.0 { sum / total } else { (i + 1) as f64 / values.len() as f64 };
        if i + 1 == values.len() { 1.0 } else { share as f32 }
    }));
    total
}

/// Returns the cell that a random number selects from the running sums, and the position that the number selects in
/// this cell, from 0 to 1.
fn invert(sums: &[f32], x: f32) -> (usize, f32) {
    let cells = sums.len() - 1;
    let cell = (sums.partition_point(|&sum| sum <= x).max(1) - 1).min(cells - 1);
    let (from, to) = (sums[cell], sums[cell + 1]);
    (cell, if to > from { ((x - from) / (to - from)).clamp(0.0, 1.0) } else { 0.5 })
}

/// A sample from 0 to 1 with a density that is linear between `a` and `b`.
fn sample_linear(x: f32, a: f32, b: f32) -> f32 {
    let root = (a * a + (b * b - a * a) * x).max(0.0).sqrt();
    if a + root > 0.0 { (x * (a + b) / (a + root)).min(1.0) } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Brightness on a triangle with one bright texel and a gradient.
    fn brightness([u, v]: [f32; 2]) -> f32 {
        let is_spot = (0.25..0.375).contains(&u) && (0.5..0.625).contains(&v);
        0.1 + u + if is_spot { 50.0 } else { 0.0 }
    }

    /// Brightness on a triangle with a peak, bilinear between corners that are 1/8 apart.
    fn peak([u, v]: [f32; 2]) -> f32 {
        let tent = |x: f32, at: f32| (1.0 - 8.0 * (x - at).abs()).max(0.0);
        80.0 * tent(u, 0.375) * tent(v, 0.25)
    }

    /// Estimates the mean brightness by sampling a table; returns the mean and the largest weight of a sample.
    fn estimate(table: &EmissionTable, light: impl Fn([f32; 2]) -> f32) -> (f64, f64) {
        let count = 1 << 10;
        let (mut sum, mut largest, mut inside) = (0.0, 0.0f64, 0);
        for i in 0..count * count {
            let random = [i % count, i / count].map(|x| (x as f32 + 0.5) / count as f32);
            let (point, density) = table.sample(random);
            assert!(point[0] + point[1] < 1.0 + 1e-5 && density > 0.0);
            // Rounding may move a point on the border of a cell.
            inside += usize::from((table.pdf(point) - density).abs() < 1e-3 * density);
            let weight = f64::from(light(point)) / density;
            sum += weight;
            largest = largest.max(weight);
        }
        let samples = (count * count) as f64;
        assert!(inside as f64 > 0.99 * samples, "{inside}");
        (sum / samples, largest)
    }

    #[test]
    fn tables_sample_texels_in_proportion_to_brightness() {
        let (mean, table) = EmissionTable::measure(8, CellContent::Constant, |point| Vec3::splat(brightness(point)));
        // The expected mean: the mean of 0.1 + u over the triangle, plus the contribution of a texel of brightness 50
        // that covers 1 / 32 of the triangle.
        let expected = f64::from(0.1 + 1.0 / 3.0 + 50.0 / 32.0f32);
        assert!((f64::from(mean.x) - expected).abs() < 1e-2 * expected, "{mean}");
        let (found, largest) = estimate(&table.unwrap(), brightness);
        assert!((found - expected).abs() < 2e-3 * expected && largest < 2.0 * expected, "{found} {largest}");
    }

    #[test]
    fn bilinear_images_have_samples_of_equal_weight() {
        let (mean, table) = EmissionTable::measure(8, CellContent::Bilinear, |point| Vec3::splat(peak(point)));
        // The expected mean: the volume of the peak, 80 / 64, divided by the triangle's area, 1 / 2.
        let expected = 80.0 / 64.0 * 2.0;
        assert!((f64::from(mean.x) - expected).abs() < 1e-5 * expected, "{mean}");
        let (found, largest) = estimate(&table.unwrap(), peak);
        assert!((found - expected).abs() < 1e-4 * expected && largest < 1.001 * expected, "{found} {largest}");
    }

    #[test]
    fn cells_that_are_not_aligned_with_texels_have_samples_of_bounded_weight() {
        let light = |[u, v]: [f32; 2]| peak([u + v, v]);
        let (mean, table) = EmissionTable::measure(8, CellContent::Mixed, |point| Vec3::splat(light(point)));
        let (found, largest) = estimate(&table.unwrap(), light);
        assert!((f64::from(mean.x) - found).abs() < 0.1 * found && largest < 4.0 * found, "{mean} {found} {largest}");
    }

    #[test]
    fn uniform_and_black_triangles_have_no_table() {
        for light in [0.0, 3.0] {
            let (mean, table) = EmissionTable::measure(5, CellContent::Mixed, |_| Vec3::splat(light));
            assert!((mean.x - light).abs() < 1e-5 && table.is_none());
        }
    }
}
