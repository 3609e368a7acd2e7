//! Random numbers: Sobol points, Owen-scrambled and shuffled by hashing.
//!
//! B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; the hash is N. Vegdahl's improvement of the
//! Laine-Karras permutation ("Building a Better LK Hash", 2021). Dimensions come in pairs; each pair is a
//! two-dimensional Sobol sequence with a shuffled order of its own. A number is a function of (seed, frame, pixel,
//! sample, dimension) alone.

use raycam_bvh::{Loops, vectorized};

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sampler {
    /// Of the seed, the frame and the pixel.
    key: [u32; 2],
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
const PER_BOUNCE: u32 = 128;

impl Pair {
    /// No two pairs of a path share it, until after 2^25 surfaces.
    #[inline(always)]
    fn number(self) -> u32 {
        let at = |bounce: u32, pair: u32| {
            PER_BOUNCE
                .wrapping_mul(bounce.wrapping_add(1))
                .wrapping_add(pair)
        };
        match self {
            Pair::Filter => 0,
            Pair::Ambient => 1,
            Pair::Spectrum => 2,
            Pair::Aperture => 3,
            Pair::Exposure => 4,
            Pair::Which(bounce) => at(bounce, 0),
            Pair::Scatter(bounce) => at(bounce, 1),
            Pair::Fate(bounce) => at(bounce, 2),
            Pair::Light(bounce, i) => at(bounce, 3 + i as u32),
        }
    }
}

impl Sampler {
    pub fn new(seed: u64, frame: u32, [x, y]: [u32; 2], sample: u32) -> Self {
        let pixel = mix(mix(seed ^ (u64::from(frame) << 32)) ^ (u64::from(y) << 32 | u64::from(x)));
        Self::of_key(pixel, sample)
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
        let Self { key: [a, b], .. } = Self::new(seed, frame, pixel, 0);
        let pixel = u64::from(b) << 32 | u64::from(a);
        Self::of_key(mix(pixel ^ mix(number)), sample / sequences)
    }

    fn of_key(key: u64, sample: u32) -> Self {
        Self {
            key: [key as u32, (key >> 32) as u32],
            sample: sample.reverse_bits(),
        }
    }

    /// Two numbers in [0, 1).
    #[inline]
    pub fn pair(&self, pair: Pair) -> [f32; 2] {
        self.numbers(pair.number())
    }

    /// The same pair of some samples of a batch, in the order of `which`.
    pub fn pairs(
        samplers: &[Self],
        which: impl Iterator<Item = usize>,
        pair: Pair,
        out: &mut Vec<[f32; 2]>,
    ) {
        vectorized(Pairs {
            samplers,
            which,
            number: pair.number(),
            out,
        });
    }

    #[inline(always)]
    fn numbers(&self, number: u32) -> [f32; 2] {
        let [shuffle, first, second] = spread([self.key[0], self.key[1], number]);
        let index = reverse(permute(self.sample, shuffle));
        let x = reverse(permute(index, first));
        let y = reverse(permute(pascal(index), second));
        // 24 bits: the float32 values stay below 1. As whole numbers with a sign they convert everywhere.
        [x, y].map(|bits| (bits >> 8) as i32 as f32 * (1.0 / (1 << 24) as f32))
    }
}

/// [`Sampler::pairs`] at work.
struct Pairs<'a, W> {
    samplers: &'a [Sampler],
    which: W,
    number: u32,
    out: &'a mut Vec<[f32; 2]>,
}

impl<W: Iterator<Item = usize>> Loops for Pairs<'_, W> {
    #[inline(always)]
    fn run(self) {
        const LANES: usize = 16;
        let Self {
            samplers,
            mut which,
            number,
            out,
        } = self;
        out.clear();
        loop {
            let (mut a, mut b, mut sample) = ([0; LANES], [0; LANES], [0; LANES]);
            let mut count = 0;
            while count < LANES
                && let Some(at) = which.next()
            {
                let Sampler { key, sample: bits } = samplers[at];
                (a[count], b[count], sample[count]) = (key[0], key[1], bits);
                count += 1;
            }
            let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
            for i in 0..LANES {
                let sampler = Sampler {
                    key: [a[i], b[i]],
                    sample: sample[i],
                };
                [x[i], y[i]] = sampler.numbers(number);
            }
            out.extend((0..count).map(|i| [x[i], y[i]]));
            if count < LANES {
                return;
            }
        }
    }
}

/// Three hashes of three numbers (M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020: pcg3d).
#[inline(always)]
fn spread(v: [u32; 3]) -> [u32; 3] {
    let [mut x, mut y, mut z] = v.map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let round = |x: &mut u32, y: &mut u32, z: &mut u32| {
        *x = x.wrapping_add(y.wrapping_mul(*z));
        *y = y.wrapping_add(z.wrapping_mul(*x));
        *z = z.wrapping_add(x.wrapping_mul(*y));
    };
    round(&mut x, &mut y, &mut z);
    [x, y, z] = [x, y, z].map(|v| v ^ (v >> 16));
    round(&mut x, &mut y, &mut z);
    [x, y, z]
}

/// The bits in reverse, by steps that vectorise.
#[inline(always)]
fn reverse(mut x: u32) -> u32 {
    x = (x & 0x5555_5555) << 1 | (x >> 1) & 0x5555_5555;
    x = (x & 0x3333_3333) << 2 | (x >> 2) & 0x3333_3333;
    x = (x & 0x0f0f_0f0f) << 4 | (x >> 4) & 0x0f0f_0f0f;
    x.swap_bytes()
}

/// The second dimension of the Sobol sequence, primitive polynomial x + 1, its bits in reverse. Its matrix is Pascal's
/// triangle modulo 2, the Kronecker power of [[1, 1], [0, 1]]: one step per factor. The first dimension's, in reverse, is
/// the index itself.
#[inline(always)]
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
#[inline(always)]
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
    fn a_batch_has_the_numbers_of_its_samples() {
        let samplers: Vec<_> = (0..50).map(|x| Sampler::new(4, 0, [x, 2], x / 3)).collect();
        let which = || (0..50).filter(|i| i % 7 != 3);
        let mut out = vec![[2.0; 2]];
        for pair in [Pair::Filter, Pair::Scatter(3), Pair::Light(0, 63)] {
            Sampler::pairs(&samplers, which(), pair, &mut out);
            let alone: Vec<_> = which().map(|i| samplers[i].pair(pair)).collect();
            assert_eq!(out, alone);
        }
        assert!((0..1000).all(|i| reverse(mix(i) as u32) == (mix(i) as u32).reverse_bits()));
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
