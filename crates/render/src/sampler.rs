//! Random numbers: Sobol points, Owen-scrambled and shuffled by hashing.
//!
//! B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; the hash is N. Vegdahl's improvement of the
//! Laine-Karras permutation ("Building a Better LK Hash", 2021). Dimensions come in pairs; each pair is a
//! two-dimensional Sobol sequence with a shuffled order of its own. A number is a function of (seed, frame, pixel,
//! sample, dimension) alone.

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sampler {
    pixel: u64,
    /// The bits of the sample's number in reverse.
    sample: u32,
}

/// What a pair of dimensions is for. Another purpose needs a number of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Pair {
    /// Where in the pixel the sample lies.
    Filter,
    /// The direction of the ambient occlusion ray.
    Ambient,
    /// Which colour a path carries after dispersion.
    Spectrum,
    /// Where in the aperture.
    Aperture,
    /// When in the exposure.
    Exposure,
    /// At the surfaces of a path, which count from 0: which part of the material scatters, and which light shines.
    Which(u32),
    /// Where the surface scatters to.
    Scatter(u32),
    /// Whether the surface is there, and whether the path goes on.
    Fate(u32),
    /// Where on each of the lights that are sampled there.
    Light(u32, usize),
}

/// More than all pairs of one surface.
const PER_BOUNCE: u64 = 128;

impl Sampler {
    pub fn new(seed: u64, frame: u32, [x, y]: [u32; 2], sample: u32) -> Self {
        let pixel = mix(mix(seed ^ (u64::from(frame) << 32)) ^ (u64::from(y) << 32 | u64::from(x)));
        Self {
            pixel,
            sample: sample.reverse_bits(),
        }
    }

    /// A sample of one of several sequences that are independent of each other: sample s is number s / n of sequence
    /// s % n.
    pub fn of_sequences(
        seed: u64,
        frame: u32,
        pixel: [u32; 2],
        sample: u32,
        sequences: u32,
    ) -> Self {
        let number = u64::from(sample % sequences) + 1;
        let first = Self::new(seed, frame, pixel, sample / sequences);
        Self {
            pixel: mix(first.pixel ^ mix(number)),
            ..first
        }
    }

    /// Two numbers in [0, 1).
    pub fn pair(&self, pair: Pair) -> [f32; 2] {
        let number = match pair {
            Pair::Filter => 0,
            Pair::Ambient => 1,
            Pair::Spectrum => 2,
            Pair::Aperture => 3,
            Pair::Exposure => 4,
            Pair::Which(bounce) => PER_BOUNCE * (1 + u64::from(bounce)),
            Pair::Scatter(bounce) => PER_BOUNCE * (1 + u64::from(bounce)) + 1,
            Pair::Fate(bounce) => PER_BOUNCE * (1 + u64::from(bounce)) + 2,
            Pair::Light(bounce, i) => PER_BOUNCE * (1 + u64::from(bounce)) + 3 + i as u64,
        };
        let seed = mix(self
            .pixel
            .wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        let index = permute(self.sample, seed as u32).reverse_bits();
        let first = permute(index, (seed >> 32) as u32).reverse_bits();
        let second = permute(pascal(index), mix(seed) as u32).reverse_bits();
        // 24 bits: the float32 values stay below 1.
        [first, second].map(|bits| (bits >> 8) as f32 / (1 << 24) as f32)
    }
}

/// The second dimension of the Sobol sequence, primitive polynomial x + 1, its bits in reverse. Its matrix is Pascal's
/// triangle modulo 2, the Kronecker power of [[1, 1], [0, 1]]: one step per factor. The first dimension's, in reverse, is
/// the index itself.
#[inline]
fn pascal(mut index: u32) -> u32 {
    index ^= (index & 0xffff_0000) >> 16;
    index ^= (index & 0xff00_ff00) >> 8;
    index ^= (index & 0xf0f0_f0f0) >> 4;
    index ^= (index & 0xcccc_cccc) >> 2;
    index ^= (index & 0xaaaa_aaaa) >> 1;
    index
}

/// Owen's nested uniform scrambling of a number whose bits come in reverse: every bit is flipped or not, depending on
/// those before it.
#[inline]
fn permute(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood, 2014).
#[inline]
fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_elementary_interval_holds_one_point() {
        // The defining property of a (0, 2)-sequence in base 2, which scrambling and shuffling keep.
        for pixel in 0..50 {
            for columns in [1, 2, 4, 8, 16, 32, 64] {
                let mut cells = vec![0; 64];
                for sample in 0..64 {
                    let [x, y] = Sampler::new(3, 1, [pixel, 7], sample).pair(Pair::Light(2, 1));
                    let rows = 64 / columns;
                    let column = (x * columns as f32) as usize;
                    cells[(y * rows as f32) as usize * columns + column] += 1;
                }
                assert_eq!(cells, vec![1; 64], "{columns} columns");
            }
        }
    }

    #[test]
    fn the_second_dimension_is_sobols() {
        let sobol_second = |index| pascal(index).reverse_bits();
        // Row by row: direction numbers m are 1, 3, 5, 15, ..., each 2 m ^ m of the one before.
        let mut m: u64 = 1;
        for bit in 0..32 {
            assert_eq!(u64::from(sobol_second(1 << bit)), m << (31 - bit));
            m ^= 2 * m;
        }
        assert_eq!(sobol_second(0b101), sobol_second(1) ^ sobol_second(0b100));
    }

    #[test]
    fn pixels_pairs_frames_and_seeds_are_independent() {
        let base = (5, 2, [10, 20], 3, Pair::Filter);
        let of = |(seed, frame, pixel, sample, pair)| {
            Sampler::new(seed, frame, pixel, sample).pair(pair)
        };
        let others = [
            (6, 2, [10, 20], 3, Pair::Filter),
            (5, 3, [10, 20], 3, Pair::Filter),
            (5, 2, [11, 20], 3, Pair::Filter),
            (5, 2, [10, 21], 3, Pair::Filter),
            (5, 2, [10, 20], 4, Pair::Filter),
            (5, 2, [10, 20], 3, Pair::Ambient),
            (5, 2, [10, 20], 3, Pair::Light(0, 0)),
        ];
        for other in others {
            assert_ne!(of(base), of(other), "{other:?}");
        }
        let n = 20_000;
        let product = |i: u32| {
            let at = |x| Sampler::new(0, 0, [x, 0], 0).pair(Pair::Filter)[0] - 0.5;
            f64::from(at(i) * at(i + 1))
        };
        let covariance = (0..n).map(product).sum::<f64>() / f64::from(n);
        assert!(
            covariance.abs() < 4.0 / 12.0 / f64::from(n).sqrt(),
            "{covariance}"
        );
    }
}
