//! AVX2 with FMA: vectors of 8, and pairs of them for 16.

use std::arch::x86_64::*;

use super::pair::Pair;
use super::{Isa, Vector};

/// x86-64 with AVX2 and FMA.
#[derive(Clone, Copy)]
pub struct Avx2;

/// Eight floats in a ymm register.
#[derive(Clone, Copy)]
pub struct Ymm(pub __m256);

/// An intrinsic, which needs the instruction set; see the module for why it is there.
macro_rules! on_avx2 {
    ($e:expr) => {{
        // SAFETY: kernels over `Avx2` or `Avx512` run only where the machine has AVX2 and FMA (see `simd`).
        unsafe { $e }
    }};
}

impl Vector for Ymm {
    type Mask = __m256;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        on_avx2!(Self(_mm256_set1_ps(x)))
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        on_avx2!(Self(_mm256_loadu_ps(from)))
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        on_avx2!(_mm256_storeu_ps(to, self.0))
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        on_avx2!(Self(_mm256_add_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        on_avx2!(Self(_mm256_sub_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        on_avx2!(Self(_mm256_mul_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        on_avx2!(Self(_mm256_div_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        on_avx2!(Self(_mm256_min_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        on_avx2!(Self(_mm256_max_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn mul_sub_loose(self, b: Self, c: Self) -> Self {
        on_avx2!(Self(_mm256_fmsub_ps(self.0, b.0, c.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        on_avx2!(Self(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)))
    }
    #[inline(always)]
    fn le(self, b: Self) -> __m256 {
        on_avx2!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0))
    }
    #[inline(always)]
    fn eq(self, b: Self) -> __m256 {
        on_avx2!(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, b.0))
    }
    #[inline(always)]
    fn and(a: __m256, b: __m256) -> __m256 {
        on_avx2!(_mm256_and_ps(a, b))
    }
    #[inline(always)]
    fn or(a: __m256, b: __m256) -> __m256 {
        on_avx2!(_mm256_or_ps(a, b))
    }
    #[inline(always)]
    fn bits(mask: __m256) -> u32 {
        on_avx2!(_mm256_movemask_ps(mask) as u32)
    }
}

impl Isa for Avx2 {
    type F8 = Ymm;
    type F16 = Pair<Ymm, 8>;
    type Index = (__m256i, __m256i);

    #[inline(always)]
    fn index(packed: u64) -> Self::Index {
        on_avx2!({
            let words = _mm256_set1_epi64x(packed as i64);
            (
                _mm256_srlv_epi32(words, _mm256_setr_epi32(0, 0, 4, 4, 8, 8, 12, 12)),
                _mm256_srlv_epi32(words, _mm256_setr_epi32(16, 16, 20, 20, 24, 24, 28, 28)),
            )
        })
    }
    #[inline(always)]
    fn lookup(table: Self::F16, (lower, upper): Self::Index) -> Self::F16 {
        let half = |index| {
            on_avx2!({
                // The permutation reads the low three bits; bit 3, moved to the sign, chooses the register.
                let a = _mm256_permutevar8x32_ps(table.0.0, index);
                let b = _mm256_permutevar8x32_ps(table.1.0, index);
                Ymm(_mm256_blendv_ps(
                    a,
                    b,
                    _mm256_castsi256_ps(_mm256_slli_epi32::<28>(index)),
                ))
            })
        };
        Pair(half(lower), half(upper))
    }
}
