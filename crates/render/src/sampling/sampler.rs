//! Random numbers: Owen-scrambled Sobol points, shuffled by hashing, with blue-noise error across pixels.
//!
//! B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; the hash is N. Vegdahl's improvement of the
//! Laine-Karras permutation ("Building a Better LK Hash", 2021). Each pair of dimensions is a two-dimensional Sobol
//! sequence in a shuffled order. A number is a pure function of (seed, frame, pixel, sample, dimension).
//!
//! The pixels of a block share scrambled sequences and take complementary points of them, so that the errors
//! of neighbouring pixels cancel: A. Ahmed and P. Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo
//! Sampling Error via Hierarchical Ordering of Pixels", ACM TOG 39(6), 2020. In that method, each pixel owns
//! a contiguous range of one sequence, whose length must be known in advance. Here the pixel's bits are
//! combined with the index of the point by exclusive or ([`MORTON_XOR`]), which works for any number of
//! samples.
//!
//! The dimensions of a path's first vertices share one order of points with different sequences (see
//! [`crate::sampling::dimension`]), so that two pairs together are also stratified in four dimensions. All other
//! dimensions are shuffled independently.

use raycam_bvh::{WithSimd, dispatch_simd};

pub(crate) use crate::sampling::dimension::Dimension;
use crate::sampling::dimension::{DimensionGroup, MIXING_BITS};

/// Random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sampler {
    /// Hash of seed, frame and block of pixels.
    block: [u32; 2],
    /// Hash of seed, frame and square of two by two pixels.
    quad: u32,
    /// Morton index of the pixel in its block, bit-reversed.
    morton_bits: u32,
    /// Sample index, bit-reversed.
    sample: u32,
}

/// Bits of a coordinate within a block of pixels.
const BLOCK_BITS: u32 = 4;

/// Index offsets of a pixel: one word per bit of the pixel's Morton index, lowest bit first, combined by exclusive or.
const MORTON_XOR: [u32; 2 * BLOCK_BITS as usize] =
    [0x2d90_0b6d, 0x43a8_86db, 0x8b78_3cf3, 0xdf03_2f3c, 0x58ab_d213, 0x3cfd_f321, 0xba1a_e440, 0xed0e_3de3];

impl Sampler {
    #[cfg(test)]
    pub fn new(seed: u64, frame: u32, pixel: [u32; 2], sample: u32) -> Self {
        Self::for_pixel(seed, frame, pixel).with_sample(sample)
    }

    /// Returns the sampler of a pixel's first sample.
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
            // The complement makes the hash of the 2 x 2 square independent of the block's hash.
            quad: splitmix64(!of_square(1)) as u32,
            morton_bits: (spread_bits(within(x)) | spread_bits(within(y)) << 1).reverse_bits(),
            sample: 0,
        }
    }

    /// Returns the sampler of another sample of the same pixel.
    pub fn with_sample(self, sample: u32) -> Self {
        Self { sample: sample.reverse_bits(), ..self }
    }

    /// Returns the sampler of another sample of the same pixel, distributed over independent replications: sample s
    /// is sample s / n of replication s % n.
    pub fn with_replication(self, sample: u32, sequences: u32) -> Self {
        let key = splitmix64(u64::from(sample % sequences) + 1);
        let [low, high] = [key as u32, (key >> 32) as u32];
        let Self { block: [a, b], quad, .. } = self;
        Self { block: [a ^ low, b ^ high], quad: quad ^ low, ..self.with_sample(sample / sequences) }
    }

    /// Returns two numbers in [0, 1).
    #[inline]
    pub fn get_2d(&self, pair: Dimension) -> [f32; 2] {
        let group = pair.group();
        self.point(self.shuffled_index(group.key), pair.index(), group)
    }

    /// Returns a pseudo-random number in [0, 1) without stratification: faster, for decisions that stratification does
    /// not improve.
    #[inline]
    pub fn get_1d_random(&self, number: u32) -> f32 {
        let pixel = splitmix64(u64::from(self.block[0]) << 32 | u64::from(self.morton_bits ^ number));
        (splitmix64(pixel ^ u64::from(self.sample)) >> 40) as f32 * (1.0 / (1 << 24) as f32)
    }

    /// Writes two numbers per selected sampler for each of several dimensions of one group.
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

    /// Permutes the pixels of a block level by level, so that neighbours differ between dimensions.
    #[inline(always)]
    fn permute_pixels(&self, exchange: u32, own: u32) -> u32 {
        permute_base4_digit(owen_scramble(self.morton_bits, !exchange), own)
    }

    /// Index of the sample's point in the sequences of a group.
    #[inline(always)]
    fn shuffled_index(&self, key: u32) -> u32 {
        let [shuffle, ..] = self.block_key(key);
        // Within each range from 2^k to 2^(k + 1), every pixel has its own order of points.
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
        DimensionGroup { mixing_row: mixed, low_bits: low, .. }: DimensionGroup,
    ) -> [f32; 2] {
        let above = (shuffled >> MIXING_BITS) ^ golden_ratio_sequence(number);
        let mut index = shuffled ^ lowbias32(above) & low;
        for (bit, mixed) in mixed.iter().enumerate() {
            index ^= mixed & ((shuffled << (30 - bit)) as i32 >> 31) as u32;
        }
        let [exchange, first, second] = self.block_key(number);
        let place = self.permute_pixels(exchange, self.quad_key(number));
        for (bit, apart) in MORTON_XOR.iter().enumerate() {
            // The shift produces a word of ones if the bit is set, otherwise zero; the bits of `place` are in reversed
            // order.
            index ^= apart & ((place << bit) as i32 >> 31) as u32;
        }
        let x = reverse_bits(owen_scramble(index, first));
        let y = reverse_bits(owen_scramble(sobol_dim2(index), second));
        // Only 24 bits are used, so that float32 values stay below 1. Every instruction set can convert signed
        // integers.
        [x, y].map(|bits| (bits >> 8) as i32 as f32 * (1.0 / (1 << 24) as f32))
    }
}

/// Loop over lanes that computes [`Sampler::get_2d_many`].
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
        // The loop fills four registers at a time: each number is a chain of about forty multiplications, and
        // independent chains overlap.
        const LANES: usize = 64;
        let Self { samplers, mut which, key, pairs, mut out } = self;
        out.iter_mut().for_each(|out| out.clear());
        loop {
            // One array for each field of the lanes (structure of arrays).
            let mut fields = [[0; LANES]; 5];
            let mut count = 0;
            while count < LANES
                && let Some(at) = which.next()
            {
                let Sampler { block: [a, b], quad, morton_bits: place, sample } = samplers[at];
                for (field, value) in fields.iter_mut().zip([a, b, quad, place, sample]) {
                    field[count] = value;
                }
                count += 1;
            }
            let sampler = |i: usize| {
                let [a, b, quad, place, sample] = [0, 1, 2, 3, 4].map(|k: usize| fields[k][i]);
                Sampler { block: [a, b], quad, morton_bits: place, sample }
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

/// Three hashes of three numbers (M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020).
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

/// Reverses the bits in steps that vectorise.
#[inline(always)]
pub(crate) fn reverse_bits(mut x: u32) -> u32 {
    x = (x & 0x5555_5555) << 1 | (x >> 1) & 0x5555_5555;
    x = (x & 0x3333_3333) << 2 | (x >> 2) & 0x3333_3333;
    x = (x & 0x0f0f_0f0f) << 4 | (x >> 4) & 0x0f0f_0f0f;
    x.swap_bytes()
}

/// Second dimension of the Sobol sequence, primitive polynomial x + 1, bit-reversed. Its generator matrix is Pascal's
/// triangle modulo 2, the Kronecker power of [[1, 1], [0, 1]]: one step per factor. The bit-reversed first dimension
/// is the index itself.
#[inline(always)]
pub(crate) fn sobol_dim2(mut index: u32) -> u32 {
    index ^= (index & 0xffff_0000) >> 16;
    index ^= (index & 0xff00_ff00) >> 8;
    index ^= (index & 0xf0f0_f0f0) >> 4;
    index ^= (index & 0xcccc_cccc) >> 2;
    index ^= (index & 0xaaaa_aaaa) >> 1;
    index
}

/// Owen's nested uniform scrambling of a bit-reversed number: each bit is flipped depending on the bits before it.
#[inline(always)]
fn owen_scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Nested scrambling that keeps 0 and the lowest set bit. In terms of the reversed bits, it permutes the numbers from
/// 2^k to 2^(k + 1) among themselves, for each k.
#[inline(always)]
fn nested_shuffle(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_mul(seed | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Multiplies the lowest base-4 digit in GF(4) by one of its three non-zero elements. Together with [`owen_scramble`]
/// this yields every order of four pixels. The bits are reversed.
#[inline(always)]
fn permute_base4_digit(place: u32, random: u32) -> u32 {
    // The two bits of the digit, and the same bits exchanged.
    let (here, there) = (place & 0xc000_0000, place << 1 & 0x8000_0000 | place >> 1 & 0x4000_0000);
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

/// Inserts a zero bit after each of the lowest four bits.
#[inline]
fn spread_bits(mut x: u32) -> u32 {
    x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

/// Low-discrepancy sequence of integers: multiples of 2^32 over the golden ratio.
#[inline(always)]
fn golden_ratio_sequence(number: u32) -> u32 {
    number.wrapping_mul(0x9e37_79b9)
}

/// 32-bit hash (C. Wellons, "Prospecting for Hash Functions", 2018).
#[inline(always)]
fn lowbias32(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Finaliser of SplitMix64 (Steele, Lea and Flood, 2014).
#[inline]
pub(crate) fn splitmix64(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
