//! Sampling of a diffuse base below an interface that is seen from inside a body.
//!
//! The interface reflects all light beyond the critical angle, so the base scatters light mainly into a cone around
//! the normal. With a cosine distribution, most samples would miss this cone, and the others would have weights of up
//! to the squared index of refraction; paths that stay in the body for long would have an infinite variance.

use glam::Vec3;

use crate::lobes::shading_frame::sample_cosine_hemisphere;

/// Number of bins within the critical angle, and of bins beyond it.
const BINS: usize = 6;

/// Distribution of directions whose density, relative to a cosine distribution, is constant in bins of the squared
/// cosine. The bins are narrow near the critical angle, where the transmittance of smooth interfaces changes quickly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BaseDirections {
    /// Squared cosine of the critical angle, which separates the two kinds of bins.
    critical_cos2: f32,
    /// Density relative to a cosine distribution, by ascending cosine.
    densities: [f32; 2 * BINS],
}

impl BaseDirections {
    /// Creates the distribution for a base that light reaches in proportion to `transmittance`, a function of the
    /// squared cosine. Returns `None` if no light reaches the base.
    pub fn new(critical_cos2: f32, transmittance: impl Fn(f32) -> f32) -> Option<Self> {
        let mut this = Self { critical_cos2, densities: [0.0; 2 * BINS] };
        let centers: [f32; 2 * BINS] = std::array::from_fn(|bin| {
            let [start, width] = this.bin(bin);
            transmittance(start + 0.5 * width)
        });
        // Rough interfaces transmit some light just beyond the critical angle, where the centre of a bin may be dark.
        this.densities = std::array::from_fn(|bin| {
            let [before, after] = [centers[bin.saturating_sub(1)], centers[(bin + 1).min(2 * BINS - 1)]];
            0.8 * centers[bin] + 0.1 * (before + after)
        });
        let sum: f32 = (0..2 * BINS).map(|bin| this.probability(bin)).sum();
        this.densities = this.densities.map(|density| density / sum);
        (sum > 0.0).then_some(this)
    }

    /// Start and width of a bin, in squared cosines.
    fn bin(&self, bin: usize) -> [f32; 2] {
        let edge = |edge: usize| {
            let offset = (edge as f32 - BINS as f32) / BINS as f32;
            let side = if edge < BINS { -self.critical_cos2 } else { 1.0 - self.critical_cos2 };
            self.critical_cos2 + side * offset * offset
        };
        let start = edge(bin);
        [start, edge(bin + 1) - start]
    }

    /// Probability of a bin.
    fn probability(&self, bin: usize) -> f32 {
        self.densities[bin] * self.bin(bin)[1]
    }

    /// Density of a direction with this cosine, relative to a cosine distribution.
    pub fn relative_density(&self, cosine: f32) -> f32 {
        let (bins, from_critical) = (BINS as f32, cosine * cosine - self.critical_cos2);
        let bin = if from_critical < 0.0 {
            bins - (bins * (-from_critical / self.critical_cos2).sqrt()).min(bins)
        } else {
            bins + (bins * (from_critical / (1.0 - self.critical_cos2)).sqrt()).min(bins - 1.0)
        };
        self.densities[bin as usize]
    }

    /// Samples a local direction above the surface.
    pub fn sample(&self, [x, y]: [f32; 2]) -> Vec3 {
        let (mut rest, mut bin) = (x, 0);
        while bin + 1 < 2 * BINS && rest >= self.probability(bin) {
            rest -= self.probability(bin);
            bin += 1;
        }
        let [start, width] = self.bin(bin);
        let cos2 = start + width * (rest / self.probability(bin)).min(1.0);
        sample_cosine_hemisphere([1.0 - cos2, y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_directions_follow_their_density() {
        for critical_cos2 in [0.05, 0.5, 0.85] {
            // A smooth interface: dark beyond the critical angle.
            let transmittance = |cos2: f32| if cos2 > critical_cos2 { (cos2 - critical_cos2).sqrt() } else { 0.0 };
            let directions = BaseDirections::new(critical_cos2, transmittance).unwrap();
            const CELLS: usize = 64;
            let (mut found, count) = ([0.0; CELLS], 1 << 16);
            for i in 0..count {
                let wi = directions.sample([(i as f32 + 0.5) / count as f32, 0.3]);
                found[((wi.z * wi.z * CELLS as f32) as usize).min(CELLS - 1)] += CELLS as f64 / f64::from(count);
            }
            for (cell, found) in found.iter().enumerate() {
                let at = |i: usize| f64::from(directions.relative_density((i as f32 / (64 * CELLS) as f32).sqrt()));
                let expected = (0..64).map(|i| at(64 * cell + i)).sum::<f64>() / 64.0;
                assert!((found - expected).abs() < 0.03 * expected + 0.01, "cell {cell}: {found}, expected {expected}");
            }
        }
    }

    #[test]
    fn dark_bases_have_no_directions() {
        assert!(BaseDirections::new(0.5, |_| 0.0).is_none());
    }
}
