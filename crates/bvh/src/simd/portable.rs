//! Vectors as plain arrays: the fallback for any machine, and the reference for the other instruction sets.

use crate::simd::{Isa, Vector, permute8, sort_descending};

/// Plain Rust without special instructions, for any machine.
#[derive(Clone, Copy)]
pub struct Portable;

/// A vector of floats, stored as an array.
#[derive(Clone, Copy)]
pub struct PortableVec<const N: usize>([f32; N]);

impl<const N: usize> PortableVec<N> {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }

    #[inline(always)]
    fn test(self, b: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(f(self.0[i], b.0[i])) << i)
    }
}

impl<const N: usize> Vector for PortableVec<N> {
    type Mask = u32;

    inlined! {
        fn splat(x: f32) -> Self = Self([x; N]);
        fn add(self, b: Self) -> Self = self.zip(b, |a, b| a + b);
        fn sub(self, b: Self) -> Self = self.zip(b, |a, b| a - b);
        fn mul(self, b: Self) -> Self = self.zip(b, |a, b| a * b);
        fn div(self, b: Self) -> Self = self.zip(b, |a, b| a / b);
        fn min(self, b: Self) -> Self = self.zip(b, |a, b| if a < b { a } else { b });
        fn max(self, b: Self) -> Self = self.zip(b, |a, b| if a > b { a } else { b });
        fn mul_sub(self, b: Self, c: Self) -> Self = Self(std::array::from_fn(|i| fused(self.0[i], b.0[i], c.0[i])));
        fn abs(self) -> Self = Self(self.0.map(f32::abs));
        fn le(self, b: Self) -> u32 = self.test(b, |a, b| a <= b);
        fn eq(self, b: Self) -> u32 = self.test(b, |a, b| a == b);
        fn and(a: u32, b: u32) -> u32 = a & b;
        fn or(a: u32, b: u32) -> u32 = a | b;
        fn reduce_min(self) -> f32 = self.0.into_iter().fold(f32::INFINITY, |a, b| if b < a { b } else { a });
        fn reduce_max(self) -> f32 = self.0.into_iter().fold(f32::NEG_INFINITY, |a, b| if b > a { b } else { a });
        fn to_bitmask(mask: u32) -> u32 = mask;
        fn from_bitmask(bits: u32) -> u32 = bits;
        fn select(mask: u32, a: Self, b: Self) -> Self =
            Self(std::array::from_fn(|i| if mask >> i & 1 != 0 { a.0[i] } else { b.0[i] }));
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller guarantees N readable floats.
        Self(unsafe { from.cast::<[f32; N]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller guarantees N writable floats.
        unsafe { to.cast::<[f32; N]>().write_unaligned(self.0) }
    }
}

impl Isa for Portable {
    const HAS_FMA: bool = false;

    type F32x8 = PortableVec<8>;
    type F32x16 = PortableVec<16>;
    type RayVec = Self::F32x16;
    type LaneIndices = [u8; 16];
    type Permutation = [u8; 8];

    inlined! {
        fn unpack_indices(packed: u64) -> [u8; 16] =
            std::array::from_fn(|i| (packed >> (32 * (i % 2) + 4 * (i / 2))) as u8 & 15);
        fn permute(table: PortableVec<16>, index: [u8; 16]) -> PortableVec<16> =
            PortableVec(std::array::from_fn(|i| table.0[(index[i] & 15) as usize]));
        fn gather_lanes(table: PortableVec<16>, index: PortableVec<16>) -> PortableVec<16> =
            Self::permute(table, index.0.map(|lane| lane.to_bits() as u8 & 15));
        fn expand_bits(packed: u64) -> PortableVec<16> =
            PortableVec(Self::unpack_indices(packed).map(|lane| f32::from_bits(u32::from(lane))));
        fn add_u32_bits(bits: PortableVec<16>, by: u32) -> PortableVec<16> =
            PortableVec(bits.0.map(|x| f32::from_bits(x.to_bits().wrapping_add(by))));
        fn sort_descending(v: PortableVec<8>, mask: u32) -> [u8; 8] = sort_descending(&v.0, mask);
        fn permute8(v: PortableVec<8>, order: [u8; 8]) -> PortableVec<8> = permute8(v, order);
    }
}

/// `a * b - c`, rounded once, without an FMA instruction: the product is exact in float64. The difference is rounded to
/// odd in float64, so that rounding it again to float32 gives the correctly rounded result (Boldo and Melquiond 2008).
#[inline(always)]
pub fn fused(a: f32, b: f32, c: f32) -> f32 {
    let (product, c) = (f64::from(a) * f64::from(b), f64::from(c));
    let sum = product - c;
    // `rest` is the rounding error of the sum (Knuth's TwoSum).
    let part = sum - product;
    let rest = (product - (sum - part)) - (c + part);
    // This is false for infinities, because their rounding error is NaN.
    let inexact = rest.abs() > 0.0;
    let away = (rest > 0.0) == (sum > 0.0);
    let bits = sum.to_bits();
    let odd = if inexact && bits & 1 == 0 { if away { bits + 1 } else { bits - 1 } } else { bits };
    f64::from_bits(odd) as f32
}

#[cfg(test)]
mod tests {
    use super::fused;

    #[test]
    fn mul_sub_is_rounded_once() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 32) as u32
        };
        let mut twice = 0;
        for _ in 0..1_000_000 {
            let [a, b] = [0, 1].map(|_| f32::from_bits(next() % (30 << 23) + (112 << 23)));
            // In half of the cases, `c` is so close to the product that the difference is small.
            let c = if next() & 1 == 0 {
                f32::from_bits((a * b).to_bits().wrapping_add(next() % 9).wrapping_sub(4))
            } else {
                f32::from_bits(next() % (60 << 23) + (90 << 23))
            };
            let c = if next() & 1 == 0 { c } else { -c };
            assert_eq!(fused(a, b, c), a.mul_add(b, -c), "{a} * {b} - {c}");
            twice += usize::from(fused(a, b, c) != a * b - c);
        }
        assert!(twice > 10_000, "nothing was tried");
        assert_eq!(fused(f32::INFINITY, -2.0, 1.0), f32::NEG_INFINITY);
        assert!(fused(f32::INFINITY, 1.0, f32::INFINITY).is_nan());
    }
}
