//! AVX-512: vectors of 16 lanes; vectors of 8 lanes use AVX2.

use std::arch::x86_64::*;

use super::avx2::{Ymm, argmin, sort_keys_descending, sort_network};
use super::unaligned::Unaligned;
use super::{F32x4, Isa, Vector};

/// x86-64 with AVX-512 F, VL, DQ and BW.
#[derive(Clone, Copy)]
pub struct Avx512;

/// Sixteen floats in a zmm register.
#[derive(Clone, Copy)]
pub struct Zmm(pub __m512);

/// Calls an AVX-512 intrinsic; see [`crate::simd`] for the safety argument.
macro_rules! on_avx512 {
    ($e:expr) => {{
        // SAFETY: kernels over `Avx512` run only where the machine has AVX-512 F, VL, DQ and BW (see `simd`).
        unsafe { $e }
    }};
}

impl Vector for Zmm {
    type Mask = u16;

    inlined! {
        fn splat(x: f32) -> Self = on_avx512!(Self(_mm512_set1_ps(x)));
        fn add(self, b: Self) -> Self = on_avx512!(Self(_mm512_add_ps(self.0, b.0)));
        fn sub(self, b: Self) -> Self = on_avx512!(Self(_mm512_sub_ps(self.0, b.0)));
        fn mul(self, b: Self) -> Self = on_avx512!(Self(_mm512_mul_ps(self.0, b.0)));
        fn div(self, b: Self) -> Self = on_avx512!(Self(_mm512_div_ps(self.0, b.0)));
        fn min(self, b: Self) -> Self = on_avx512!(Self(_mm512_min_ps(self.0, b.0)));
        fn max(self, b: Self) -> Self = on_avx512!(Self(_mm512_max_ps(self.0, b.0)));
        fn mul_sub(self, b: Self, c: Self) -> Self = on_avx512!(Self(_mm512_fmsub_ps(self.0, b.0, c.0)));
        fn abs(self) -> Self = on_avx512!(Self(_mm512_abs_ps(self.0)));
        fn le(self, b: Self) -> u16 = on_avx512!(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, b.0));
        fn eq(self, b: Self) -> u16 = on_avx512!(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, b.0));
        fn and(a: u16, b: u16) -> u16 = a & b;
        fn or(a: u16, b: u16) -> u16 = a | b;
        fn reduce_min(self) -> f32 = on_avx512!(_mm512_reduce_min_ps(self.0));
        fn reduce_max(self) -> f32 = on_avx512!(_mm512_reduce_max_ps(self.0));
        fn to_bitmask(mask: u16) -> u32 = u32::from(mask);
        fn from_bitmask(bits: u32) -> u16 = bits as u16;
        fn select(mask: u16, a: Self, b: Self) -> Self = on_avx512!(Self(_mm512_mask_blend_ps(mask, b.0, a.0)));
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        on_avx512!(Self(Unaligned::read(from.cast())))
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        on_avx512!(Unaligned::write(to.cast(), self.0))
    }
}

impl Isa for Avx512 {
    const WIDE: bool = true;
    type F32x8 = Ymm;
    type F32x16 = Zmm;
    type RayVec = Self::F32x16;
    type LaneIndices = __m512i;
    type Permutation = __m256i;

    inlined! {
        fn split_f32x4(v: Ymm) -> [F32x4; 2] =
            on_avx512!([F32x4(_mm256_castps256_ps128(v.0)), F32x4(_mm256_extractf128_ps::<1>(v.0)),]);
        fn gather_lanes(table: Zmm, index: Zmm) -> Zmm = Self::permute(table, on_avx512!(_mm512_castps_si512(index.0)));
        fn expand_bits(packed: u64) -> Zmm = on_avx512!(Zmm(_mm512_castsi512_ps(Self::unpack_indices(packed))));
        fn compress(v: Ymm, mask: u32) -> Ymm = on_avx512!(Ymm(_mm256_maskz_compress_ps(mask as u8, v.0)));
        fn sort_descending(v: Ymm, mask: u32) -> __m256i =
            on_avx512!(sort_network(_mm256_mask_mov_epi32(_mm256_set1_epi32(-1), mask as u8, sort_keys_descending(v))));
        fn permute8(v: Ymm, order: __m256i) -> Ymm = on_avx512!(Ymm(_mm256_permutevar8x32_ps(v.0, order)));
        fn argmin(v: Ymm, mask: __m256) -> usize = argmin(v, mask);
    }
    #[inline(always)]
    fn unpack_indices(packed: u64) -> __m512i {
        on_avx512!({
            let shifts = _mm512_setr_epi32(0, 0, 4, 4, 8, 8, 12, 12, 16, 16, 20, 20, 24, 24, 28, 28);
            _mm512_srlv_epi32(_mm512_set1_epi64(packed as i64), shifts)
        })
    }
    #[inline(always)]
    fn permute(table: Zmm, index: __m512i) -> Zmm {
        // The permutation reads the low four bits of each index.
        on_avx512!(Zmm(_mm512_permutexvar_ps(index, table.0)))
    }
    #[inline(always)]
    fn add_u32_bits(bits: Zmm, by: u32) -> Zmm {
        on_avx512!(Zmm(_mm512_castsi512_ps(_mm512_add_epi32(
            _mm512_castps_si512(bits.0),
            _mm512_set1_epi32(by as i32)
        ))))
    }
    #[inline(always)]
    unsafe fn load_transposed(rows: [*const f32; 16]) -> [Zmm; 4] {
        // SAFETY: guaranteed by the caller.
        unsafe {
            let a = join4([rows[0], rows[4], rows[8], rows[12]]);
            let b = join4([rows[1], rows[5], rows[9], rows[13]]);
            let c = join4([rows[2], rows[6], rows[10], rows[14]]);
            let d = join4([rows[3], rows[7], rows[11], rows[15]]);
            let (ab, cd) = (_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d));
            let (ef, gh) = (_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
            [
                Zmm(_mm512_shuffle_ps::<0b01_00_01_00>(ab, cd)),
                Zmm(_mm512_shuffle_ps::<0b11_10_11_10>(ab, cd)),
                Zmm(_mm512_shuffle_ps::<0b01_00_01_00>(ef, gh)),
                Zmm(_mm512_shuffle_ps::<0b11_10_11_10>(ef, gh)),
            ]
        }
    }
    #[inline(always)]
    fn prefetch(at: *const u8) {
        on_avx512!(_mm_prefetch::<_MM_HINT_T0>(at.cast()))
    }
}

/// Loads four floats into each quarter of a register.
///
/// # Safety
///
/// As for [`Isa::load_transposed`].
#[inline(always)]
unsafe fn join4([a, b, c, d]: [*const f32; 4]) -> __m512 {
    // This code uses no closures, because rustc does not inline a closure that is called more than once, nor the
    // intrinsics in it.
    on_avx512!({
        let v = _mm512_castps128_ps512(Unaligned::read(a.cast()));
        let v = _mm512_insertf32x4::<1>(v, Unaligned::read(b.cast()));
        let v = _mm512_insertf32x4::<2>(v, Unaligned::read(c.cast()));
        _mm512_insertf32x4::<3>(v, Unaligned::read(d.cast()))
    })
}
