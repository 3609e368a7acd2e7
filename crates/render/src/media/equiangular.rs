//! Equiangular sampling: distances along a ray whose directions to a light are uniform in angle.
//!
//! C. Kulla and M. Fajardo, "Importance Sampling Techniques for Path Tracing in Participating Media", EGSR 2012.

use glam::DVec3;

/// Distribution of distances along a part of a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equiangular {
    /// Distance along the ray to the point that is closest to the light (the foot), and distance of the light from this
    /// point.
    foot: f64,
    height: f64,
    /// Angles from the foot to both ends of the part, as seen from the light.
    begin: f64,
    end: f64,
}

/// Minimum distance of the light from the ray, as a fraction of the light's distance from the ray's origin; keeps the
/// density finite.
const MIN_HEIGHT: f64 = 1e-9;

impl Equiangular {
    /// Creates the distribution for a light at `center`, relative to the start of the ray, and the ray's first `length`
    /// metres along a unit direction. The length may be infinite.
    pub fn new(center: DVec3, direction: DVec3, length: f64) -> Self {
        let foot = center.dot(direction);
        let height = (center - foot * direction).length().max(MIN_HEIGHT * center.length()).max(f64::MIN_POSITIVE);
        Self { foot, height, begin: (-foot / height).atan(), end: ((length - foot) / height).atan() }
    }

    /// Returns the distance from the start that a random number selects.
    pub fn sample(&self, random: f32) -> f64 {
        let angle = self.begin + (self.end - self.begin) * f64::from(random);
        (self.foot + self.height * angle.tan()).max(0.0)
    }

    /// Density of a distance, per metre.
    pub fn density(&self, distance: f64) -> f64 {
        let from_foot = distance - self.foot;
        self.height / ((self.end - self.begin) * (self.height * self.height + from_foot * from_foot))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equiangular_density_is_the_derivative_of_the_samples() {
        let rays = [(DVec3::new(1.0, 2.0, 0.0), 3.0), (DVec3::new(-4.0, 0.5, 1.0), f64::INFINITY)];
        for (center, length) in rays {
            let angles = Equiangular::new(center, DVec3::X, length);
            for random in [0.1f32, 0.4, 0.7] {
                let [low, high] = [random - 1e-3, random + 1e-3].map(|random| angles.sample(random));
                let density = f64::from((random + 1e-3) - (random - 1e-3)) / (high - low);
                let ratio = angles.density(angles.sample(random)) / density;
                assert!((ratio - 1.0).abs() < 1e-2, "{random}: {ratio}");
                assert!((0.0..=length).contains(&low));
            }
        }
    }
}
