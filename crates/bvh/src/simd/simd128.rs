//! WebAssembly's SIMD: registers hold 4 floats; a vector of 8 is a pair of registers, a vector of 16 a pair of such
//! pairs.

use std::arch::wasm32::*;

use super::{Isa, Vector, lanes8, permute8, sort_descending};
use crate::simd::double_width::DoubleWidth;
use crate::simd::portable::fused;

/// wasm32 with SIMD128.
#[derive(Clone, Copy)]
pub struct Simd128;

/// Four floats in a register.
#[derive(Clone, Copy)]
pub struct WasmVec4(pub v128);

/// Moves the upper two floats to the lower two.
#[inline(always)]
fn upper(v: v128) -> v128 {
    i64x2_shuffle::<1, 0>(v, v)
}

impl Vector for WasmVec4 {
    type Mask = v128;

    inlined! {
        fn splat(x: f32) -> Self = Self(f32x4_splat(x));
        fn add(self, b: Self) -> Self = Self(f32x4_add(self.0, b.0));
        fn sub(self, b: Self) -> Self = Self(f32x4_sub(self.0, b.0));
        fn mul(self, b: Self) -> Self = Self(f32x4_mul(self.0, b.0));
        fn div(self, b: Self) -> Self = Self(f32x4_div(self.0, b.0));
        fn min(self, b: Self) -> Self = Self(f32x4_pmin(b.0, self.0));
        fn max(self, b: Self) -> Self = Self(f32x4_pmax(b.0, self.0));
        fn abs(self) -> Self = Self(f32x4_abs(self.0));
        fn le(self, b: Self) -> v128 = f32x4_le(self.0, b.0);
        fn eq(self, b: Self) -> v128 = f32x4_eq(self.0, b.0);
        fn and(a: v128, b: v128) -> v128 = v128_and(a, b);
        fn or(a: v128, b: v128) -> v128 = v128_or(a, b);
        fn to_bitmask(mask: v128) -> u32 = u32::from(i32x4_bitmask(mask));
        fn select(mask: v128, a: Self, b: Self) -> Self = Self(v128_bitselect(a.0, b.0, mask));
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller guarantees 4 readable floats.
        Self(unsafe { v128_load(from.cast()) })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller guarantees 4 writable floats.
        unsafe { v128_store(to.cast(), self.0) }
    }
    /// Rounds to float64 and then to float32, which equals a single rounding unless the float64 value is midway between
    /// two float32 values; these rare cases are handled lane by lane.
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        let [low, high] = [(self.0, b.0, c.0), (upper(self.0), upper(b.0), upper(c.0))].map(|(a, b, c)| {
            let product = f64x2_mul(f64x2_promote_low_f32x4(a), f64x2_promote_low_f32x4(b));
            f64x2_sub(product, f64x2_promote_low_f32x4(c))
        });
        let midway = |sum| {
            let below = v128_and(sum, i64x2_splat((1 << 29) - 1));
            let small = f64x2_lt(f64x2_abs(sum), f64x2_splat(f64::from(f32::MIN_POSITIVE)));
            v128_or(i64x2_eq(below, i64x2_splat(1 << 28)), small)
        };
        if v128_any_true(v128_or(midway(low), midway(high))) {
            return self.mul_sub_one_by_one(b, c);
        }
        let [low, high] = [low, high].map(|sum| f32x4_demote_f64x2_zero(sum));
        Self(i64x2_shuffle::<0, 2>(low, high))
    }
    #[inline(always)]
    fn reduce_min(self) -> f32 {
        let two = self.min(Self(upper(self.0)));
        f32x4_extract_lane::<0>(two.min(Self(i32x4_shuffle::<1, 0, 3, 2>(two.0, two.0))).0)
    }
    #[inline(always)]
    fn reduce_max(self) -> f32 {
        let two = self.max(Self(upper(self.0)));
        f32x4_extract_lane::<0>(two.max(Self(i32x4_shuffle::<1, 0, 3, 2>(two.0, two.0))).0)
    }
    #[inline(always)]
    fn from_bitmask(bits: u32) -> v128 {
        let lanes = u32x4(1, 2, 4, 8);
        i32x4_eq(v128_and(u32x4_splat(bits), lanes), lanes)
    }
}

impl WasmVec4 {
    #[cold]
    #[inline(never)]
    fn mul_sub_one_by_one(self, b: Self, c: Self) -> Self {
        let lanes = |v: Self| {
            let mut out = [0.0; 4];
            // SAFETY: the array contains 4 floats.
            unsafe { v.store(out.as_mut_ptr()) };
            out
        };
        let (a, b, c) = (lanes(self), lanes(b), lanes(c));
        let done: [f32; 4] = std::array::from_fn(|i| fused(a[i], b[i], c[i]));
        // SAFETY: as above.
        unsafe { Self::load(done.as_ptr()) }
    }
}

type WasmVec8 = DoubleWidth<WasmVec4, 4>;

impl Isa for Simd128 {
    const HAS_FMA: bool = false;

    type F32x8 = WasmVec8;
    type F32x16 = DoubleWidth<WasmVec8, 8>;
    type RayVec = Self::F32x16;
    type LaneIndices = [v128; 4];
    type Permutation = [u8; 8];

    #[inline(always)]
    fn unpack_indices(packed: u64) -> Self::LaneIndices {
        let DoubleWidth(DoubleWidth(a, b), DoubleWidth(c, d)) = Self::expand_bits(packed);
        [a, b, c, d].map(byte_indices)
    }
    #[inline(always)]
    fn permute(table: Self::F32x16, index: Self::LaneIndices) -> Self::F32x16 {
        let DoubleWidth(DoubleWidth(t0, t1), DoubleWidth(t2, t3)) = table;
        // A byte index outside the register gives 0, so the four results can be combined by a bitwise or.
        let [a, b, c, d] = index.map(|i| {
            let from = |t: WasmVec4, first| u8x16_swizzle(t.0, u8x16_sub(i, u8x16_splat(first)));
            WasmVec4(v128_or(v128_or(from(t0, 0), from(t1, 16)), v128_or(from(t2, 32), from(t3, 48))))
        });
        DoubleWidth(DoubleWidth(a, b), DoubleWidth(c, d))
    }
    #[inline(always)]
    fn gather_lanes(
        table: Self::F32x16,
        DoubleWidth(DoubleWidth(a, b), DoubleWidth(c, d)): Self::F32x16,
    ) -> Self::F32x16 {
        Self::permute(table, [a, b, c, d].map(byte_indices))
    }
    #[inline(always)]
    fn expand_bits(packed: u64) -> Self::F32x16 {
        // The indices of four lanes: 4 bits of word 0 and of word 1 for the first two lanes, and the next 4 bits of
        // both words for the other two lanes.
        let words = u64x2_splat(packed);
        let quarter = |i: u32| {
            let (first, second) = (u32x4_shr(words, 8 * i), u32x4_shr(words, 8 * i + 4));
            WasmVec4(v128_and(i64x2_shuffle::<0, 3>(first, second), u32x4_splat(15)))
        };
        DoubleWidth(DoubleWidth(quarter(0), quarter(1)), DoubleWidth(quarter(2), quarter(3)))
    }
    #[inline(always)]
    fn add_u32_bits(DoubleWidth(DoubleWidth(a, b), DoubleWidth(c, d)): Self::F32x16, by: u32) -> Self::F32x16 {
        let [a, b, c, d] = [a, b, c, d].map(|v| WasmVec4(u32x4_add(v.0, u32x4_splat(by))));
        DoubleWidth(DoubleWidth(a, b), DoubleWidth(c, d))
    }
    inlined! {
        fn sort_descending(v: WasmVec8, mask: u32) -> [u8; 8] = sort_descending(&lanes8(v), mask);
        fn permute8(v: WasmVec8, order: [u8; 8]) -> WasmVec8 = permute8(v, order);
    }
}

/// Byte indices of the four bytes of each lane: four times the lane index, plus 0 to 3. The lane index, below 16, is in
/// the low bits of the lane.
#[inline(always)]
fn byte_indices(lanes: WasmVec4) -> v128 {
    let index = v128_and(lanes.0, u32x4_splat(15));
    u32x4_add(u32x4_mul(index, u32x4_splat(0x0404_0404)), u32x4_splat(0x0302_0100))
}
