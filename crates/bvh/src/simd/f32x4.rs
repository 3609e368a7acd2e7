//! Four floats with the baseline instructions of the target, for the builder, which therefore requires no dispatch.

#[cfg(target_arch = "x86_64")]
mod imp {
    use std::arch::x86_64::*;

    use crate::simd::unaligned::Unaligned;

    /// Prefetches the cache line of any address.
    #[inline(always)]
    pub fn prefetch<T>(at: *const T) {
        // SAFETY: SSE is part of x86-64, and any address may be prefetched.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(at.cast()) };
    }

    /// Four floats.
    #[derive(Clone, Copy, Debug)]
    pub struct F32x4(pub __m128);

    macro_rules! on_sse2 {
        ($e:expr) => {{
            // SAFETY: SSE2 is part of x86-64, and pointers refer to arrays of the size that is written.
            unsafe { $e }
        }};
    }

    impl F32x4 {
        inlined! {
            pub fn splat(x: f32) -> Self = on_sse2!(Self(_mm_set1_ps(x)));
            pub fn new(v: [f32; 4]) -> Self = on_sse2!(Self(_mm_setr_ps(v[0], v[1], v[2], v[3])));
            pub fn add(self, b: Self) -> Self = on_sse2!(Self(_mm_add_ps(self.0, b.0)));
            pub fn sub(self, b: Self) -> Self = on_sse2!(Self(_mm_sub_ps(self.0, b.0)));
            pub fn mul(self, b: Self) -> Self = on_sse2!(Self(_mm_mul_ps(self.0, b.0)));
            pub fn min(self, b: Self) -> Self = on_sse2!(Self(_mm_min_ps(self.0, b.0)));
            pub fn max(self, b: Self) -> Self = on_sse2!(Self(_mm_max_ps(self.0, b.0)));
            /// The vector with its last lane set to 0.
            pub fn zero_w(self) -> Self =
                on_sse2!(Self(_mm_and_ps(self.0, _mm_castsi128_ps(_mm_setr_epi32(-1, -1, -1, 0)))));
            /// `if self < b { NaN } else { 0.0 }`, by lane; the NaN has either sign. A bitwise or with this value
            /// replaces a number by NaN.
            pub fn cmp_lt(self, b: Self) -> Self = on_sse2!(Self(_mm_cmplt_ps(self.0, b.0)));
            /// `if self < b { 0.0 } else { NaN }`, by lane: the complement of [`F32x4::cmp_lt`].
            pub fn cmp_nlt(self, b: Self) -> Self = on_sse2!(Self(_mm_cmpnlt_ps(self.0, b.0)));
            /// Bitwise or of two vectors.
            pub fn or(self, b: Self) -> Self = on_sse2!(Self(_mm_or_ps(self.0, b.0)));
            /// True if the sign bit of the first lane is set.
            pub fn sign(self) -> bool = on_sse2!(_mm_movemask_ps(self.0)) & 1 != 0;
        }
        #[inline(always)]
        pub fn array(self) -> [f32; 4] {
            let mut out = [0.0; 4];
            on_sse2!(Unaligned::write(out.as_mut_ptr().cast(), self.0));
            out
        }
        /// The vector whose lanes all equal lane `LANE`.
        #[inline(always)]
        pub fn broadcast_lane<const LANE: usize>(self) -> Self {
            on_sse2!(Self(match LANE {
                0 => _mm_shuffle_ps::<0b00_00_00_00>(self.0, self.0),
                1 => _mm_shuffle_ps::<0b01_01_01_01>(self.0, self.0),
                2 => _mm_shuffle_ps::<0b10_10_10_10>(self.0, self.0),
                _ => _mm_shuffle_ps::<0b11_11_11_11>(self.0, self.0),
            }))
        }
        /// The lanes, truncated to integers; the values must be within the range of `i32`.
        #[inline(always)]
        pub fn to_i32_trunc(self) -> [i32; 4] {
            let mut out = [0; 4];
            on_sse2!(Unaligned::write(out.as_mut_ptr().cast(), _mm_cvttps_epi32(self.0)));
            out
        }
        /// The transposed 4 x 4 matrix.
        #[inline(always)]
        pub fn transpose(rows: [Self; 4]) -> [Self; 4] {
            let [mut a, mut b, mut c, mut d] = rows.map(|row| row.0);
            on_sse2!(_MM_TRANSPOSE4_PS(&mut a, &mut b, &mut c, &mut d));
            [Self(a), Self(b), Self(c), Self(d)]
        }
        /// x y + y z + z x: half the surface area of a box with this diagonal.
        #[inline(always)]
        pub fn half_area(self) -> f32 {
            on_sse2!({
                let turned = _mm_shuffle_ps::<0b11_00_10_01>(self.0, self.0);
                let p = _mm_mul_ps(self.0, turned);
                let q = _mm_add_ss(p, _mm_shuffle_ps::<0b01_01_01_01>(p, p));
                _mm_cvtss_f32(_mm_add_ss(q, _mm_movehl_ps(p, p)))
            })
        }
    }
}

#[cfg(not(target_arch = "x86_64"))]
mod imp {
    /// Prefetches the cache line of an address; a no-op on this target.
    #[inline(always)]
    pub fn prefetch<T>(_at: *const T) {}

    /// Four floats.
    #[derive(Clone, Copy, Debug)]
    pub struct F32x4([f32; 4]);

    impl F32x4 {
        inlined! {
            fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self =
                Self(std::array::from_fn(|i| f(self.0[i], b.0[i])));
            pub fn splat(x: f32) -> Self = Self([x; 4]);
            pub fn new(v: [f32; 4]) -> Self = Self(v);
            pub fn array(self) -> [f32; 4] = self.0;
            pub fn add(self, b: Self) -> Self = self.zip(b, |a, b| a + b);
            pub fn sub(self, b: Self) -> Self = self.zip(b, |a, b| a - b);
            pub fn mul(self, b: Self) -> Self = self.zip(b, |a, b| a * b);
            pub fn min(self, b: Self) -> Self = self.zip(b, |a, b| if a < b { a } else { b });
            pub fn max(self, b: Self) -> Self = self.zip(b, |a, b| if a > b { a } else { b });
            /// The vector with its last lane set to 0.
            pub fn zero_w(self) -> Self = Self([self.0[0], self.0[1], self.0[2], 0.0]);
            /// `if self < b { NaN } else { 0.0 }`, by lane; the NaN has either sign. A bitwise or with this value
            /// replaces a number by NaN.
            pub fn cmp_lt(self, b: Self) -> Self = self.zip(b, |a, b| f32::from_bits(if a < b { u32::MAX } else { 0 }));
            /// `if self < b { 0.0 } else { NaN }`, by lane: the complement of [`F32x4::cmp_lt`].
            pub fn cmp_nlt(self, b: Self) -> Self =
                self.zip(b, |a, b| f32::from_bits(if a < b { 0 } else { u32::MAX }));
            /// Bitwise or of two vectors.
            pub fn or(self, b: Self) -> Self = self.zip(b, |a, b| f32::from_bits(a.to_bits() | b.to_bits()));
            /// True if the sign bit of the first lane is set.
            pub fn sign(self) -> bool = self.0[0].to_bits() >> 31 != 0;
            /// The lanes, truncated to integers; the values must be within the range of `i32`.
            pub fn to_i32_trunc(self) -> [i32; 4] = self.0.map(|x| x as i32);
            /// The transposed 4 x 4 matrix.
            pub fn transpose(rows: [Self; 4]) -> [Self; 4] = std::array::from_fn(|i| Self(rows.map(|row| row.0[i])));
        }
        /// The vector whose lanes all equal lane `LANE`.
        #[inline(always)]
        pub fn broadcast_lane<const LANE: usize>(self) -> Self {
            Self([self.0[LANE]; 4])
        }
        /// x y + y z + z x: half the surface area of a box with this diagonal.
        #[inline(always)]
        pub fn half_area(self) -> f32 {
            let [x, y, z, _] = self.0;
            x * y + y * z + z * x
        }
    }
}

pub use imp::{F32x4, prefetch};
