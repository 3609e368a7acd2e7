//! Free flight: the distance that a path goes through a medium before it is scattered or absorbed.
//!
//! A colour is drawn in proportion to the path's throughput, and a distance by that colour's extinction. The density of
//! a distance is the mean over the colours, weighted by their probabilities: hero wavelength sampling (A. Wilkie et
//! al., "Hero Wavelength Spectral Sampling", EGSR 2014). Weights therefore stay below the sum of the throughput.

use glam::Vec3;

/// Distribution of distances in a medium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeFlight {
    /// Probability of drawing each colour.
    probabilities: Vec3,
    /// Extinction of each colour, per metre.
    extinction: Vec3,
}

impl FreeFlight {
    pub fn new(throughput: Vec3, extinction: Vec3) -> Self {
        let total = throughput.element_sum();
        let is_valid = total > 0.0 && total.is_finite();
        let probabilities = if is_valid { throughput / total } else { Vec3::splat(1.0 / 3.0) };
        Self { probabilities, extinction }
    }

    /// Samples a distance; infinite if the drawn colour is not extinguished. `random` selects the colour and the
    /// distance.
    pub fn sample(&self, [choice, random]: [f32; 2]) -> f64 {
        let Vec3 { x, y, .. } = self.probabilities;
        let color = if choice < x {
            0
        } else if choice < x + y {
            1
        } else {
            2
        };
        let extinction = f64::from(self.extinction[color]);
        if extinction == 0.0 { f64::INFINITY } else { -(-f64::from(random)).ln_1p() / extinction }
    }

    /// Density of a distance, per metre.
    pub fn density(&self, distance: f64) -> f64 {
        (0..3).map(|i| self.each(i, distance) * f64::from(self.extinction[i])).sum()
    }

    /// Probability that a flight is longer than a distance.
    pub fn passing(&self, distance: f64) -> f64 {
        (0..3).map(|i| self.each(i, distance)).sum()
    }

    fn each(&self, color: usize, distance: f64) -> f64 {
        let extinction = f64::from(self.extinction[color]);
        let passed = if extinction == 0.0 { 1.0 } else { (-extinction * distance).exp() };
        f64::from(self.probabilities[color]) * passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_flight_probabilities_sum_to_one_and_match_the_samples() {
        let flight = FreeFlight::new(Vec3::new(1.0, 0.5, 0.1), Vec3::new(0.3, 2.0, 0.0));
        let steps = 200_000;
        let end = 7.0;
        let step = end / f64::from(steps);
        let inside: f64 = (0..steps).map(|i| flight.density((f64::from(i) + 0.5) * step) * step).sum();
        assert!((inside + flight.passing(end) - 1.0).abs() < 1e-6, "{inside}");
        let count = 400;
        let unit = |i: i32| (i as f32 + 0.5) / count as f32;
        let pairs = (0..count).flat_map(|i| (0..count).map(move |j| [unit(i), unit(j)]));
        let nearer = pairs.filter(|&pair| flight.sample(pair) < 1.5).count() as f64 / f64::from(count * count);
        assert!((1.0 - nearer - flight.passing(1.5)).abs() < 3e-3, "{nearer}");
    }
}
