//! Deterministic random numbers, without functions of the platform's mathematics library.

use glam::DVec3;
use rapier3d_f64::math::Rotation;

/// Stream of numbers that depends only on its seed. Source: SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) struct Stream(u64);

impl Stream {
    /// Creates the stream for a seed, a name and an attempt.
    pub(crate) fn new(seed: u64, name: &str, attempt: u64) -> Self {
        // The object's name is hashed (FNV-1a), so that an object's random numbers do not depend on the other objects.
        let hash = name
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
        let mut stream = Self(seed ^ hash.rotate_left(17) ^ attempt.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        stream.next();
        stream
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a random number in 0..1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Returns a random number between two limits.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns a random, uniformly distributed rotation. Source: Marsaglia 1972, points of the unit sphere in four
    /// dimensions.
    pub(crate) fn rotation(&mut self) -> Rotation {
        let (a, b, s) = self.disk();
        let (c, d, t) = self.disk();
        let scale = ((1.0 - s) / t).sqrt();
        Rotation::from_xyzw(a, b, c * scale, d * scale).normalize()
    }

    /// Returns a random point of the unit disk other than its centre, and its squared radius.
    fn disk(&mut self) -> (f64, f64, f64) {
        loop {
            let (x, y) = (self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            let s = x * x + y * y;
            if s > 1e-6 && s < 1.0 {
                return (x, y, s);
            }
        }
    }

    /// Returns a random point in a box.
    pub(crate) fn point(&mut self, low: DVec3, high: DVec3) -> DVec3 {
        DVec3::new(self.between(low.x, high.x), self.between(low.y, high.y), self.between(low.z, high.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_rotations_are_uniform() {
        let mut stream = Stream::new(1, "mug", 0);
        let axes: Vec<_> = (0..20_000).map(|_| stream.rotation() * rapier3d_f64::math::Vector::Z).collect();
        for k in 0..3 {
            let mean = axes.iter().map(|axis| axis[k]).sum::<f64>() / 20_000.0;
            let square = axes.iter().map(|axis| axis[k] * axis[k]).sum::<f64>() / 20_000.0;
            assert!(mean.abs() < 0.02, "{mean}");
            assert!((square - 1.0 / 3.0).abs() < 0.01, "{square}");
        }
    }

    #[test]
    fn random_numbers_depend_on_seed_name_and_attempt() {
        let first = |seed, name, attempt| Stream::new(seed, name, attempt).unit();
        assert_eq!(first(1, "mug", 0), first(1, "mug", 0));
        let all = [first(1, "mug", 0), first(2, "mug", 0), first(1, "can", 0), first(1, "mug", 1)];
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a != b));
        }
    }
}
