//! AVX2 with FMA: a vector of 8 lanes is a register, a vector of 16 lanes a pair of registers.

use std::arch::x86_64::*;

use super::{COMPRESS, F32x4, Isa, Vector};
use crate::simd::double_width::DoubleWidth;
use crate::simd::unaligned::Unaligned;

/// x86-64 with AVX2 and FMA.
#[derive(Clone, Copy)]
pub struct Avx2;

/// Eight floats in a ymm register.
#[derive(Clone, Copy)]
pub struct Ymm(pub __m256);

/// Calls an AVX2 intrinsic; see [`crate::simd`] for the safety argument.
macro_rules! on_avx2 {
    ($e:expr) => {{
        // SAFETY: kernels over `Avx2` or `Avx512` run only where the machine has AVX2 and FMA (see `simd`).
        unsafe { $e }
    }};
}

impl Vector for Ymm {
    type Mask = __m256;

    inlined! {
        fn splat(x: f32) -> Self = on_avx2!(Self(_mm256_set1_ps(x)));
        fn add(self, b: Self) -> Self = on_avx2!(Self(_mm256_add_ps(self.0, b.0)));
        fn sub(self, b: Self) -> Self = on_avx2!(Self(_mm256_sub_ps(self.0, b.0)));
        fn mul(self, b: Self) -> Self = on_avx2!(Self(_mm256_mul_ps(self.0, b.0)));
        fn div(self, b: Self) -> Self = on_avx2!(Self(_mm256_div_ps(self.0, b.0)));
        fn min(self, b: Self) -> Self = on_avx2!(Self(_mm256_min_ps(self.0, b.0)));
        fn max(self, b: Self) -> Self = on_avx2!(Self(_mm256_max_ps(self.0, b.0)));
        fn mul_sub(self, b: Self, c: Self) -> Self = on_avx2!(Self(_mm256_fmsub_ps(self.0, b.0, c.0)));
        fn abs(self) -> Self = on_avx2!(Self(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)));
        fn le(self, b: Self) -> __m256 = on_avx2!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0));
        fn eq(self, b: Self) -> __m256 = on_avx2!(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, b.0));
        fn and(a: __m256, b: __m256) -> __m256 = on_avx2!(_mm256_and_ps(a, b));
        fn or(a: __m256, b: __m256) -> __m256 = on_avx2!(_mm256_or_ps(a, b));
        fn to_bitmask(mask: __m256) -> u32 = on_avx2!(_mm256_movemask_ps(mask) as u32);
        fn select(mask: __m256, a: Self, b: Self) -> Self = on_avx2!(Self(_mm256_blendv_ps(b.0, a.0, mask)));
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        on_avx2!(Self(Unaligned::read(from.cast())))
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        on_avx2!(Unaligned::write(to.cast(), self.0))
    }
    #[inline(always)]
    fn reduce_min(self) -> f32 {
        on_avx2!({
            let v = _mm_min_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let v = _mm_min_ps(v, _mm_movehl_ps(v, v));
            _mm_cvtss_f32(_mm_min_ss(v, _mm_movehdup_ps(v)))
        })
    }
    #[inline(always)]
    fn reduce_max(self) -> f32 {
        on_avx2!({
            let v = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let v = _mm_max_ps(v, _mm_movehl_ps(v, v));
            _mm_cvtss_f32(_mm_max_ss(v, _mm_movehdup_ps(v)))
        })
    }
    #[inline(always)]
    fn from_bitmask(bits: u32) -> __m256 {
        on_avx2!({
            let lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let named = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lanes);
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(named, lanes))
        })
    }
}

impl Isa for Avx2 {
    const WIDE: bool = true;
    type F32x8 = Ymm;
    type F32x16 = DoubleWidth<Ymm, 8>;
    type RayVec = Ymm;
    const RAY_LANES: usize = 8;
    type LaneIndices = (__m256i, __m256i);
    type Permutation = __m256i;

    inlined! {
        fn split_f32x4(v: Ymm) -> [F32x4; 2] =
            on_avx2!([F32x4(_mm256_castps256_ps128(v.0)), F32x4(_mm256_extractf128_ps::<1>(v.0)),]);
        fn permute(table: Self::F32x16, (lower, upper): Self::LaneIndices) -> Self::F32x16 =
            DoubleWidth(permute_impl(table, lower), permute_impl(table, upper));
        fn gather_lanes(table: Self::F32x16, index: Ymm) -> Ymm =
            permute_impl(table, on_avx2!(_mm256_castps_si256(index.0)));
        fn add_u32_bits(bits: Ymm, by: u32) -> Ymm =
            on_avx2!(Ymm(_mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(bits.0), _mm256_set1_epi32(by as i32)))));
        fn permute8(v: Ymm, order: __m256i) -> Ymm = on_avx2!(Ymm(_mm256_permutevar8x32_ps(v.0, order)));
        fn argmin(v: Ymm, mask: __m256) -> usize = argmin(v, mask);
    }
    #[inline(always)]
    fn unpack_indices(packed: u64) -> Self::LaneIndices {
        on_avx2!({
            let words = _mm256_set1_epi64x(packed as i64);
            (
                _mm256_srlv_epi32(words, _mm256_setr_epi32(0, 0, 4, 4, 8, 8, 12, 12)),
                _mm256_srlv_epi32(words, _mm256_setr_epi32(16, 16, 20, 20, 24, 24, 28, 28)),
            )
        })
    }
    #[inline(always)]
    fn permute_half<const HALF: usize>(table: Self::F32x16, packed: u64) -> Ymm {
        on_avx2!({
            let words = _mm256_set1_epi64x((packed >> (16 * HALF)) as i64);
            let index = _mm256_srlv_epi32(words, _mm256_setr_epi32(0, 0, 4, 4, 8, 8, 12, 12));
            permute_impl(table, index)
        })
    }
    #[inline(always)]
    fn expand_bits(packed: u64) -> Self::F32x16 {
        let (lower, upper) = Self::unpack_indices(packed);
        on_avx2!(DoubleWidth(Ymm(_mm256_castsi256_ps(lower)), Ymm(_mm256_castsi256_ps(upper))))
    }
    #[inline(always)]
    fn compress(v: Ymm, mask: u32) -> Ymm {
        on_avx2!({
            let lanes = _mm_loadl_epi64(COMPRESS[mask as usize & 255].as_ptr().cast());
            Ymm(_mm256_permutevar8x32_ps(v.0, _mm256_cvtepu8_epi32(lanes)))
        })
    }
    #[inline(always)]
    fn sort_descending(v: Ymm, mask: u32) -> __m256i {
        on_avx2!({
            let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let bit = _mm256_sllv_epi32(_mm256_set1_epi32(1), lanes);
            let named = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bit), bit);
            sort_network(_mm256_or_si256(sort_keys_descending(v), _mm256_andnot_si256(named, _mm256_set1_epi32(-1))))
        })
    }
    #[inline(always)]
    unsafe fn load_transposed(rows: [*const f32; 16]) -> [Self::F32x16; 4] {
        let [a, b, c, d, e, f, g, h, rest @ ..] = rows;
        // SAFETY: guaranteed by the caller.
        let (lower, upper) = unsafe { (transpose8([a, b, c, d, e, f, g, h]), transpose8(rest)) };
        [
            DoubleWidth(lower[0], upper[0]),
            DoubleWidth(lower[1], upper[1]),
            DoubleWidth(lower[2], upper[2]),
            DoubleWidth(lower[3], upper[3]),
        ]
    }
    #[inline(always)]
    fn prefetch(at: *const u8) {
        on_avx2!(_mm_prefetch::<_MM_HINT_T0>(at.cast()))
    }
}

/// Looks up eight values in a table of sixteen lanes; the indices are in the low four bits of each lane of `index`.
#[inline(always)]
fn permute_impl(table: DoubleWidth<Ymm, 8>, index: __m256i) -> Ymm {
    on_avx2!({
        // The permutation instruction reads the low three bits of an index; bit 3, moved to the sign bit, selects the
        // lower or the upper register.
        let a = _mm256_permutevar8x32_ps(table.0.0, index);
        let b = _mm256_permutevar8x32_ps(table.1.0, index);
        let upper = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(index));
        Ymm(_mm256_blendv_ps(a, b, upper))
    })
}

/// [`Isa::load_transposed`] for eight rows.
///
/// # Safety
///
/// As for [`Isa::load_transposed`].
#[inline(always)]
unsafe fn transpose8(rows: [*const f32; 8]) -> [Ymm; 4] {
    // This code uses no closures, because rustc does not inline a closure that is called twice.
    on_avx2!({
        let (a, b) = (transpose2(rows[0], rows[4]), transpose2(rows[1], rows[5]));
        let (c, d) = (transpose2(rows[2], rows[6]), transpose2(rows[3], rows[7]));
        let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
        let (ef, gh) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
        [
            Ymm(_mm256_shuffle_ps::<0b01_00_01_00>(ab, cd)),
            Ymm(_mm256_shuffle_ps::<0b11_10_11_10>(ab, cd)),
            Ymm(_mm256_shuffle_ps::<0b01_00_01_00>(ef, gh)),
            Ymm(_mm256_shuffle_ps::<0b11_10_11_10>(ef, gh)),
        ]
    })
}

/// Loads four floats into each half of a register.
///
/// # Safety
/// Four floats must be readable at each pointer.
#[inline(always)]
unsafe fn transpose2(lower: *const f32, upper: *const f32) -> __m256 {
    on_avx2!(_mm256_insertf128_ps::<1>(
        _mm256_castps128_ps256(Unaligned::read(lower.cast())),
        Unaligned::read(upper.cast())
    ))
}

/// Unsigned keys that decrease as the lane's value increases; the low three bits of a key are the lane's number. No key
/// is the largest integer.
#[inline(always)]
pub fn sort_keys_descending(v: Ymm) -> __m256i {
    on_avx2!({
        let falling = _mm256_sub_epi32(_mm256_set1_epi32(i32::MIN), _mm256_castps_si256(v.0));
        let high = _mm256_andnot_si256(_mm256_set1_epi32(7), falling);
        _mm256_or_si256(high, _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7))
    })
}

/// Sorts eight unsigned integers by a bitonic network.
#[inline(always)]
pub fn sort_network(v: __m256i) -> __m256i {
    on_avx2!({
        macro_rules! exchange {
            ($v:expr, $other:expr, $upper:literal) => {{
                let (v, other) = ($v, $other);
                _mm256_blend_epi32::<$upper>(_mm256_min_epu32(v, other), _mm256_max_epu32(v, other))
            }};
        }
        let v = exchange!(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v), 0b10101010);
        let v = exchange!(v, _mm256_shuffle_epi32::<0b00_01_10_11>(v), 0b11001100);
        let v = exchange!(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v), 0b10101010);
        let mirror = _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0);
        let v = exchange!(v, _mm256_permutevar8x32_epi32(v, mirror), 0b11110000);
        let v = exchange!(v, _mm256_shuffle_epi32::<0b01_00_11_10>(v), 0b11001100);
        exchange!(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v), 0b10101010)
    })
}

/// Unsigned keys that increase with the lane's value, which must not be negative; the low three bits of a key are the
/// lane's number.
#[inline(always)]
fn sort_keys(v: Ymm) -> __m256i {
    on_avx2!({
        let high = _mm256_andnot_si256(_mm256_set1_epi32(7), _mm256_castps_si256(v.0));
        _mm256_or_si256(high, _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7))
    })
}

/// Implements [`Isa::argmin`].
#[inline(always)]
pub fn argmin(v: Ymm, mask: __m256) -> usize {
    on_avx2!({
        // The vector mask is used directly, because conversion to a bit mask and back would double the time.
        let others = _mm256_andnot_si256(_mm256_castps_si256(mask), _mm256_set1_epi32(-1));
        let keys = _mm256_or_si256(sort_keys(v), others);
        let v = _mm_min_epu32(_mm256_castsi256_si128(keys), _mm256_extracti128_si256::<1>(keys));
        let v = _mm_min_epu32(v, _mm_shuffle_epi32::<0b01_00_11_10>(v));
        let v = _mm_min_epu32(v, _mm_shuffle_epi32::<0b10_11_00_01>(v));
        _mm_cvtsi128_si32(v) as usize & 7
    })
}
