//! Pixel filters, sampled by importance.
//!
//! Sample positions follow the filter (Ernst, Stamminger and Greiner, "Filter Importance Sampling", 2006). Every
//! sample therefore has weight 1 and contributes to one pixel.

use raycam_scene::render_options::Filter;

/// Width of the Blackman-Harris window, in pixels.
const WINDOW_WIDTH: f64 = 3.0;
/// Number of intervals of the tabulated cumulative distribution.
const TABLE_INTERVALS: usize = 512;

/// Sampler of a sample's offset from the pixel centre, according to a pixel filter.
pub(crate) enum FilterSampler {
    Box,
    /// Cumulative distribution of one coordinate, from 0 to 1 over the window's width.
    Tabulated(Vec<f32>),
}

impl FilterSampler {
    pub fn new(filter: Filter) -> Self {
        match filter {
            Filter::Box => Self::Box,
            Filter::BlackmanHarris => Self::Tabulated(
                (0..=TABLE_INTERVALS).map(|i| blackman_harris_cdf(i as f64 / TABLE_INTERVALS as f64) as f32).collect(),
            ),
        }
    }

    /// Returns the offset from the pixel centre, in pixels, for two random numbers.
    pub fn sample(&self, random: [f32; 2]) -> [f64; 2] {
        random.map(|x| match self {
            Self::Box => f64::from(x) - 0.5,
            Self::Tabulated(table) => {
                let next = table.partition_point(|&c| c <= x).clamp(1, TABLE_INTERVALS);
                let (below, above) = (f64::from(table[next - 1]), f64::from(table[next]));
                let fraction = ((f64::from(x) - below) / (above - below)).clamp(0.0, 1.0);
                ((next as f64 - 1.0 + fraction) / TABLE_INTERVALS as f64 - 0.5) * WINDOW_WIDTH
            }
        })
    }
}

/// Integral of the normalised window from 0 to x (F. J. Harris, "On the use of windows for harmonic analysis with the
/// discrete Fourier transform", 1978: the minimum four-term window, -92 dB).
fn blackman_harris_cdf(x: f64) -> f64 {
    const A: [f64; 4] = [0.35875, 0.48829, 0.14128, 0.01168];
    let turn = std::f64::consts::TAU;
    let term = |k: f64| (turn * k * x).sin() / (turn * k);
    (A[0] * x - A[1] * term(1.0) + A[2] * term(2.0) - A[3] * term(3.0)) / A[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and variance of the offsets for evenly spaced random numbers.
    fn moments(filter: Filter) -> (f64, f64) {
        let prepared = FilterSampler::new(filter);
        let n = 1 << 16;
        let offsets: Vec<f64> = (0..n).map(|i| prepared.sample([(i as f32 + 0.5) / n as f32; 2])[0]).collect();
        let mean = offsets.iter().sum::<f64>() / f64::from(n);
        (mean, offsets.iter().map(|x| x * x).sum::<f64>() / f64::from(n))
    }

    #[test]
    fn filter_offsets_are_distributed_like_the_filter() {
        let (mean, variance) = moments(Filter::Box);
        assert!(mean.abs() < 1e-6 && (variance - 1.0 / 12.0).abs() < 1e-6);
        // The expected variance is computed by quadrature of the window's definition.
        let window = |x: f64| {
            let turn = std::f64::consts::TAU * (x / WINDOW_WIDTH + 0.5);
            0.35875 - 0.48829 * turn.cos() + 0.14128 * (2.0 * turn).cos() - 0.01168 * (3.0 * turn).cos()
        };
        let (mut sum, mut square) = (0.0, 0.0);
        for i in 0..10_000 {
            let x = ((f64::from(i) + 0.5) / 10_000.0 - 0.5) * WINDOW_WIDTH;
            sum += window(x);
            square += x * x * window(x);
        }
        let (mean, variance) = moments(Filter::BlackmanHarris);
        assert!(mean.abs() < 1e-4, "{mean}");
        assert!((variance / (square / sum) - 1.0).abs() < 1e-3, "{variance}");
        for random in [0.0, 1.0 - f32::EPSILON / 2.0] {
            let [x, y] = FilterSampler::new(Filter::BlackmanHarris).sample([random; 2]);
            assert!(x.abs() <= WINDOW_WIDTH / 2.0 && x == y);
        }
    }
}
