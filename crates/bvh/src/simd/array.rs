//! Plain arrays: any machine, and the yardstick of the others.

use super::{COMPRESS, Isa, Vector, descending, least_lane};

/// No instruction set in particular.
#[derive(Clone, Copy)]
pub struct Portable;

/// Floats in an array.
#[derive(Clone, Copy)]
pub struct Array<const N: usize>([f32; N]);

impl<const N: usize> Array<N> {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }

    #[inline(always)]
    fn test(self, b: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(f(self.0[i], b.0[i])) << i)
    }
}

impl<const N: usize> Vector for Array<N> {
    type Mask = u32;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; N])
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller vouches for N readable floats.
        Self(unsafe { from.cast::<[f32; N]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller vouches for N writable floats.
        unsafe { to.cast::<[f32; N]>().write_unaligned(self.0) }
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self.zip(b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self.zip(b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        self.zip(b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn mul_sub_loose(self, b: Self, c: Self) -> Self {
        self.mul(b).sub(c)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.test(b, |a, b| a <= b)
    }
    #[inline(always)]
    fn eq(self, b: Self) -> u32 {
        self.test(b, |a, b| a == b)
    }
    #[inline(always)]
    fn and(a: u32, b: u32) -> u32 {
        a & b
    }
    #[inline(always)]
    fn or(a: u32, b: u32) -> u32 {
        a | b
    }
    #[inline(always)]
    fn least(self) -> f32 {
        self.0
            .into_iter()
            .fold(f32::INFINITY, |a, b| if b < a { b } else { a })
    }
    #[inline(always)]
    fn greatest(self) -> f32 {
        self.0
            .into_iter()
            .fold(f32::NEG_INFINITY, |a, b| if b > a { b } else { a })
    }
    #[inline(always)]
    fn bits(mask: u32) -> u32 {
        mask
    }
}

impl Isa for Portable {
    type F8 = Array<8>;
    type F16 = Array<16>;
    type Index = [u8; 16];
    type Order = [u8; 8];

    #[inline(always)]
    fn index(packed: u64) -> [u8; 16] {
        std::array::from_fn(|i| (packed >> (32 * (i % 2) + 4 * (i / 2))) as u8 & 15)
    }
    #[inline(always)]
    fn lookup(table: Array<16>, index: [u8; 16]) -> Array<16> {
        Array(std::array::from_fn(|i| table.0[(index[i] & 15) as usize]))
    }
    #[inline(always)]
    fn compress(v: Array<8>, mask: u32) -> Array<8> {
        Array(COMPRESS[mask as usize & 255].map(|lane| v.0[lane as usize & 7]))
    }
    #[inline(always)]
    fn descending(v: Array<8>, mask: u32) -> [u8; 8] {
        descending(&v.0, mask)
    }
    #[inline(always)]
    fn reorder(v: Array<8>, order: [u8; 8]) -> Array<8> {
        Array(order.map(|lane| v.0[lane as usize & 7]))
    }
    #[inline(always)]
    fn least_lane(v: Array<8>, mask: u32) -> usize {
        least_lane(&v.0, mask)
    }
    #[inline(always)]
    fn prefetch(_at: *const u8) {}
}
