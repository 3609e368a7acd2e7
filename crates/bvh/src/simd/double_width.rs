//! A vector that consists of two narrower vectors.

use crate::simd::Vector;

/// The lower N lanes and the upper N lanes.
#[derive(Clone, Copy)]
pub struct DoubleWidth<V, const N: usize>(pub V, pub V);

impl<V: Vector, const N: usize> Vector for DoubleWidth<V, N> {
    type Mask = (V::Mask, V::Mask);

    inlined! {
        fn splat(x: f32) -> Self = Self(V::splat(x), V::splat(x));
        fn add(self, b: Self) -> Self = Self(self.0.add(b.0), self.1.add(b.1));
        fn sub(self, b: Self) -> Self = Self(self.0.sub(b.0), self.1.sub(b.1));
        fn mul(self, b: Self) -> Self = Self(self.0.mul(b.0), self.1.mul(b.1));
        fn div(self, b: Self) -> Self = Self(self.0.div(b.0), self.1.div(b.1));
        fn min(self, b: Self) -> Self = Self(self.0.min(b.0), self.1.min(b.1));
        fn max(self, b: Self) -> Self = Self(self.0.max(b.0), self.1.max(b.1));
        fn mul_sub(self, b: Self, c: Self) -> Self = Self(self.0.mul_sub(b.0, c.0), self.1.mul_sub(b.1, c.1));
        fn abs(self) -> Self = Self(self.0.abs(), self.1.abs());
        fn le(self, b: Self) -> Self::Mask = (self.0.le(b.0), self.1.le(b.1));
        fn eq(self, b: Self) -> Self::Mask = (self.0.eq(b.0), self.1.eq(b.1));
        fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask = (V::and(a.0, b.0), V::and(a.1, b.1));
        fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask = (V::or(a.0, b.0), V::or(a.1, b.1));
        fn reduce_min(self) -> f32 = self.0.min(self.1).reduce_min();
        fn reduce_max(self) -> f32 = self.0.max(self.1).reduce_max();
        fn to_bitmask(mask: Self::Mask) -> u32 = V::to_bitmask(mask.0) | V::to_bitmask(mask.1) << N;
        fn from_bitmask(bits: u32) -> Self::Mask = (V::from_bitmask(bits & ((1 << N) - 1)), V::from_bitmask(bits >> N));
        fn select(mask: Self::Mask, a: Self, b: Self) -> Self =
            Self(V::select(mask.0, a.0, b.0), V::select(mask.1, a.1, b.1));
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller guarantees 2 N readable floats.
        unsafe { Self(V::load(from), V::load(from.add(N))) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller guarantees 2 N writable floats.
        unsafe {
            self.0.store(to);
            self.1.store(to.add(N));
        }
    }
}
