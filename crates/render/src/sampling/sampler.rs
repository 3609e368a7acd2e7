//! Random numbers: Sobol points, Owen-scrambled and shuffled by hashing, with the error of pixels as blue noise.
//!
//! B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; the hash is N. Vegdahl's improvement of the
//! Laine-Karras permutation ("Building a Better LK Hash", 2021). Dimensions come in pairs; each pair is a
//! two-dimensional Sobol sequence in a shuffled order. A number is a function of (seed, frame, pixel,
//! sample, dimension) alone.
//!
//! The pixels of a block share scrambled sequences and take points of them that complement each other, so that what one
//! pixel is too bright its neighbours are too dark: A. Ahmed and P. Wonka, "Screen-Space Blue-Noise Diffusion of Monte
//! Carlo Sampling Error via Hierarchical Ordering of Pixels", ACM TOG 39(6), 2020. There each pixel has a stretch of one
//! sequence, as long as its number of samples, which has to be known. Here the pixel is added to the index of the point
//! bit by bit ([`MORTON_XOR`]), which does the same for every number of samples.
//!
//! Pairs that belong together, as those of a path's first surfaces do, have one order of their points, and each another
//! sequence (`crate::sampling::dimension::MIXING_MATRICES`), so that the numbers of two pairs fill their four dimensions evenly too. All others are shuffled
//! independently of each other.

use raycam_bvh::{WithSimd, dispatch_simd};

pub(crate) use crate::sampling::dimension::Dimension;
use crate::sampling::dimension::{DimensionGroup, MIXING_BITS};

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sampler {
    /// Of the seed, the frame and the block of pixels.
    block: [u32; 2],
    /// Of the same and the square of two by two pixels.
    quad: u32,
    /// Where in the block the pixel is: the bits of its Morton number in reverse.
    morton_bits: u32,
    /// The bits of the sample's number in reverse.
    sample: u32,
}

/// Bits of a coordinate within a block of pixels.
const BLOCK_BITS: u32 = 4;

/// What the bits of a pixel's Morton number, the lowest first, add to the indices of its points, modulo 2. They are found by
/// simulated annealing so that the first 2^k points of all pixels of a square of 2^m by 2^m together are a (0, k + 2 m, 2)-net
/// in base 2 as often as possible: always in squares of 2 by 2 pixels and up to 1024 samples, of 4 by 4 and 8 by 8 and up to
/// 256, of 16 by 16 nearly.
const MORTON_XOR: [u32; 2 * BLOCK_BITS as usize] = [
    0x2d90_0b6d,
    0x43a8_86db,
    0x8b78_3cf3,
    0xdf03_2f3c,
    0x58ab_d213,
    0x3cfd_f321,
    0xba1a_e440,
    0xed0e_3de3,
];

impl Sampler {
    #[cfg(test)]
    pub fn new(seed: u64, frame: u32, pixel: [u32; 2], sample: u32) -> Self {
        Self::for_pixel(seed, frame, pixel).with_sample(sample)
    }

    /// The first sample of a pixel.
    pub fn for_pixel(seed: u64, frame: u32, [x, y]: [u32; 2]) -> Self {
        let picture = splitmix64(seed ^ (u64::from(frame) << 32));
        let of_square = |bits: u32| {
            let [x, y] = [x, y].map(|v| u64::from(v >> bits));
            splitmix64(picture ^ (y << 32 | x))
        };
        let block = of_square(BLOCK_BITS);
        let within = |v: u32| v & ((1 << BLOCK_BITS) - 1);
        Self {
            block: [block as u32, (block >> 32) as u32],
            // Another hash than the block's.
            quad: splitmix64(!of_square(1)) as u32,
            morton_bits: (spread_bits(within(x)) | spread_bits(within(y)) << 1).reverse_bits(),
            sample: 0,
        }
    }

    /// Another sample of the same pixel.
    pub fn with_sample(self, sample: u32) -> Self {
        Self {
            sample: sample.reverse_bits(),
            ..self
        }
    }

    /// Another sample of the same pixel, of one of several sequences that are independent of each other: sample s is number
    /// s / n of sequence s % n.
    pub fn with_replication(self, sample: u32, sequences: u32) -> Self {
        let key = splitmix64(u64::from(sample % sequences) + 1);
        let [low, high] = [key as u32, (key >> 32) as u32];
        let Self {
            block: [a, b],
            quad,
            ..
        } = self;
        Self {
            block: [a ^ low, b ^ high],
            quad: quad ^ low,
            ..self.with_sample(sample / sequences)
        }
    }

    /// Two numbers in [0, 1).
    #[inline]
    pub fn get_2d(&self, pair: Dimension) -> [f32; 2] {
        let group = pair.group();
        self.point(self.shuffled_index(group.key), pair.index(), group)
    }

    /// A number in [0, 1) that is spread by chance alone: where evenness brings nothing, for a part of the time.
    #[inline]
    pub fn get_1d_random(&self, number: u32) -> f32 {
        let pixel =
            splitmix64(u64::from(self.block[0]) << 32 | u64::from(self.morton_bits ^ number));
        (splitmix64(pixel ^ u64::from(self.sample)) >> 40) as f32 * (1.0 / (1 << 24) as f32)
    }

    /// Pairs of one group, each in a list of its own, of some samples of a batch, in the order of `which`.
    pub fn get_2d_many<const K: usize>(
        samplers: &[Self],
        which: impl Iterator<Item = usize>,
        pairs: [Dimension; K],
        out: [&mut Vec<[f32; 2]>; K],
    ) {
        let key = pairs.first().map_or(0, |pair| pair.group().key);
        debug_assert!(pairs.iter().all(|pair| pair.group().key == key));
        dispatch_simd(GeneratePoints2D {
            samplers,
            which,
            key,
            pairs: pairs.map(|pair| (pair.index(), pair.group())),
            out,
        });
    }

    /// The pixels of a block change places, level by level: it is by chance who is beside whom in other pairs.
    #[inline(always)]
    fn permute_pixels(&self, exchange: u32, own: u32) -> u32 {
        permute_base4_digit(owen_scramble(self.morton_bits, !exchange), own)
    }

    /// Which point of a sequence the sample has, in a group with this key.
    #[inline(always)]
    fn shuffled_index(&self, key: u32) -> u32 {
        let [shuffle, ..] = self.block_key(key);
        // The order of a pixel's points is its own as far as its first 2^k points stay the first 2^k.
        let own = self.quad_key(key);
        let order = own.rotate_left(8 * (self.permute_pixels(shuffle, own) >> 30));
        reverse_bits(owen_scramble(nested_shuffle(self.sample, order), shuffle))
    }

    #[inline(always)]
    fn block_key(&self, number: u32) -> [u32; 3] {
        pcg3d([self.block[0], self.block[1], number])
    }

    #[inline(always)]
    fn quad_key(&self, number: u32) -> u32 {
        lowbias32(self.quad.wrapping_add(golden_ratio_sequence(number)))
    }

    #[inline(always)]
    fn point(
        &self,
        shuffled: u32,
        number: u32,
        DimensionGroup {
            mixing_row: mixed,
            low_bits: low,
            ..
        }: DimensionGroup,
    ) -> [f32; 2] {
        let above = (shuffled >> MIXING_BITS) ^ golden_ratio_sequence(number);
        let mut index = shuffled ^ lowbias32(above) & low;
        for (bit, mixed) in mixed.iter().enumerate() {
            index ^= mixed & ((shuffled << (30 - bit)) as i32 >> 31) as u32;
        }
        let [exchange, first, second] = self.block_key(number);
        let place = self.permute_pixels(exchange, self.quad_key(number));
        for (bit, apart) in MORTON_XOR.iter().enumerate() {
            // All ones where the bit is set; the bits are in reverse.
            index ^= apart & ((place << bit) as i32 >> 31) as u32;
        }
        let x = reverse_bits(owen_scramble(index, first));
        let y = reverse_bits(owen_scramble(sobol_dim2(index), second));
        // 24 bits: the float32 values stay below 1. As whole numbers with a sign they convert everywhere.
        [x, y].map(|bits| (bits >> 8) as i32 as f32 * (1.0 / (1 << 24) as f32))
    }
}

/// [`Sampler::get_2d_many`] at work.
struct GeneratePoints2D<'a, W, const K: usize> {
    samplers: &'a [Sampler],
    which: W,
    key: u32,
    pairs: [(u32, DimensionGroup); K],
    out: [&'a mut Vec<[f32; 2]>; K],
}

impl<W: Iterator<Item = usize>, const K: usize> WithSimd for GeneratePoints2D<'_, W, K> {
    #[inline(always)]
    fn run(self) {
        // Four registers: each number is a chain of some forty multiplications, and one chain goes on while another waits.
        const LANES: usize = 64;
        let Self {
            samplers,
            mut which,
            key,
            pairs,
            mut out,
        } = self;
        out.iter_mut().for_each(|out| out.clear());
        loop {
            // Field by field, as registers hold them.
            let mut fields = [[0; LANES]; 5];
            let mut count = 0;
            while count < LANES
                && let Some(at) = which.next()
            {
                let Sampler {
                    block: [a, b],
                    quad,
                    morton_bits: place,
                    sample,
                } = samplers[at];
                for (field, value) in fields.iter_mut().zip([a, b, quad, place, sample]) {
                    field[count] = value;
                }
                count += 1;
            }
            let sampler = |i: usize| {
                let [a, b, quad, place, sample] = [0, 1, 2, 3, 4].map(|k: usize| fields[k][i]);
                Sampler {
                    block: [a, b],
                    quad,
                    morton_bits: place,
                    sample,
                }
            };
            let mut shuffled = [0; LANES];
            for (i, shuffled) in shuffled.iter_mut().enumerate() {
                *shuffled = sampler(i).shuffled_index(key);
            }
            for (out, (number, group)) in out.iter_mut().zip(pairs) {
                let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
                for i in 0..LANES {
                    [x[i], y[i]] = sampler(i).point(shuffled[i], number, group);
                }
                out.extend((0..count).map(|i| [x[i], y[i]]));
            }
            if count < LANES {
                return;
            }
        }
    }
}

/// Three hashes of three numbers (M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020: pcg3d).
#[inline(always)]
fn pcg3d(v: [u32; 3]) -> [u32; 3] {
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
pub(crate) fn reverse_bits(mut x: u32) -> u32 {
    x = (x & 0x5555_5555) << 1 | (x >> 1) & 0x5555_5555;
    x = (x & 0x3333_3333) << 2 | (x >> 2) & 0x3333_3333;
    x = (x & 0x0f0f_0f0f) << 4 | (x >> 4) & 0x0f0f_0f0f;
    x.swap_bytes()
}

/// The second dimension of the Sobol sequence, primitive polynomial x + 1, its bits in reverse. Its matrix is Pascal's
/// triangle modulo 2, the Kronecker power of [[1, 1], [0, 1]]: one step per factor. The first dimension's, in reverse, is
/// the index itself.
#[inline(always)]
pub(crate) fn sobol_dim2(mut index: u32) -> u32 {
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
fn owen_scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// A permutation of the same kind that keeps 0 and the lowest bit that is set: of numbers whose bits come in reverse, it
/// permutes those from 2^k to 2^(k + 1) among themselves, for each k.
#[inline(always)]
fn nested_shuffle(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_mul(seed | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The lowest digit in base 4 multiplied in GF(4) by one of its three elements that are not 0: together with what
/// [`owen_scramble`] does to it, any order of the four pixels of a square. The bits are in reverse.
#[inline(always)]
fn permute_base4_digit(place: u32, random: u32) -> u32 {
    // The digit's bits where they are and each in the other's place.
    let (here, there) = (
        place & 0xc000_0000,
        place << 1 & 0x8000_0000 | place >> 1 & 0x4000_0000,
    );
    let (low, high) = (0x8000_0000, 0x4000_0000);
    let once = there ^ here & high;
    let twice = there ^ here & low;
    let digit = match ((random & 0xffff) * 3) >> 16 {
        0 => here,
        1 => once,
        _ => twice,
    };
    place & 0x3fff_ffff | digit
}

/// A bit of zero after each of the lowest four.
#[inline]
fn spread_bits(mut x: u32) -> u32 {
    x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

/// Numbers that follow each other, far apart: multiples of 2^32 over the golden ratio.
#[inline(always)]
fn golden_ratio_sequence(number: u32) -> u32 {
    number.wrapping_mul(0x9e37_79b9)
}

/// A hash of 32 bits (C. Wellons, "Prospecting for Hash Functions", 2018: lowbias32).
#[inline(always)]
fn lowbias32(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood, 2014).
#[inline]
pub(crate) fn splitmix64(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
