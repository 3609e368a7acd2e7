//! NEON: registers hold 4 floats; a vector of 8 is a pair of registers, a vector of 16 a pair of such pairs.

use std::arch::aarch64::*;

use super::{Isa, Vector, lanes8, permute8, sort_descending};
use crate::simd::double_width::DoubleWidth;

/// aarch64 with NEON.
#[derive(Clone, Copy)]
pub struct Neon;

/// Four floats in a register.
#[derive(Clone, Copy)]
pub struct NeonVec4(pub float32x4_t);

/// Calls a NEON intrinsic; see [`crate::simd`] for the safety argument.
macro_rules! on_neon {
    ($e:expr) => {{
        // SAFETY: kernels over `Neon` run only where the machine has NEON (see `simd`).
        #[allow(unused_unsafe)]
        unsafe {
            $e
        }
    }};
}

impl Vector for NeonVec4 {
    type Mask = uint32x4_t;

    inlined! {
        fn splat(x: f32) -> Self = on_neon!(Self(vdupq_n_f32(x)));
        fn add(self, b: Self) -> Self = on_neon!(Self(vaddq_f32(self.0, b.0)));
        fn sub(self, b: Self) -> Self = on_neon!(Self(vsubq_f32(self.0, b.0)));
        fn mul(self, b: Self) -> Self = on_neon!(Self(vmulq_f32(self.0, b.0)));
        fn div(self, b: Self) -> Self = on_neon!(Self(vdivq_f32(self.0, b.0)));
        fn min(self, b: Self) -> Self = on_neon!(Self(vbslq_f32(vcltq_f32(self.0, b.0), self.0, b.0)));
        fn max(self, b: Self) -> Self = on_neon!(Self(vbslq_f32(vcgtq_f32(self.0, b.0), self.0, b.0)));
        fn mul_sub(self, b: Self, c: Self) -> Self = on_neon!(Self(vfmaq_f32(vnegq_f32(c.0), self.0, b.0)));
        fn abs(self) -> Self = on_neon!(Self(vabsq_f32(self.0)));
        fn le(self, b: Self) -> uint32x4_t = on_neon!(vcleq_f32(self.0, b.0));
        fn eq(self, b: Self) -> uint32x4_t = on_neon!(vceqq_f32(self.0, b.0));
        fn and(a: uint32x4_t, b: uint32x4_t) -> uint32x4_t = on_neon!(vandq_u32(a, b));
        fn or(a: uint32x4_t, b: uint32x4_t) -> uint32x4_t = on_neon!(vorrq_u32(a, b));
        fn reduce_min(self) -> f32 = on_neon!(vminvq_f32(self.0));
        fn reduce_max(self) -> f32 = on_neon!(vmaxvq_f32(self.0));
        fn select(mask: uint32x4_t, a: Self, b: Self) -> Self = on_neon!(Self(vbslq_f32(mask, a.0, b.0)));
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        on_neon!(Self(vld1q_f32(from)))
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        on_neon!(vst1q_f32(to, self.0))
    }
    #[inline(always)]
    fn to_bitmask(mask: uint32x4_t) -> u32 {
        const LANE_IDS: [u32; 4] = [1, 2, 4, 8];
        on_neon!(vaddvq_u32(vandq_u32(mask, vld1q_u32(LANE_IDS.as_ptr()))))
    }
    #[inline(always)]
    fn from_bitmask(bits: u32) -> uint32x4_t {
        const LANE_IDS: [u32; 4] = [1, 2, 4, 8];
        on_neon!(vtstq_u32(vdupq_n_u32(bits), vld1q_u32(LANE_IDS.as_ptr())))
    }
}

type NeonVec8 = DoubleWidth<NeonVec4, 4>;

impl Isa for Neon {
    type F32x8 = NeonVec8;
    type F32x16 = DoubleWidth<NeonVec8, 8>;
    type RayVec = Self::F32x16;
    type LaneIndices = [uint8x16_t; 4];
    type Permutation = [u8; 8];

    #[inline(always)]
    fn unpack_indices(packed: u64) -> Self::LaneIndices {
        std::array::from_fn(|quarter| {
            let mut bytes = [0; 16];
            for (i, byte) in bytes.iter_mut().enumerate() {
                let lane = 4 * quarter + i / 4;
                let k = (packed >> (32 * (lane % 2) + 4 * (lane / 2))) as u8 & 15;
                *byte = 4 * k + (i % 4) as u8;
            }
            on_neon!(vld1q_u8(bytes.as_ptr()))
        })
    }
    #[inline(always)]
    fn permute(table: Self::F32x16, index: Self::LaneIndices) -> Self::F32x16 {
        on_neon!({
            let bytes = uint8x16x4_t(
                vreinterpretq_u8_f32(table.0.0.0),
                vreinterpretq_u8_f32(table.0.1.0),
                vreinterpretq_u8_f32(table.1.0.0),
                vreinterpretq_u8_f32(table.1.1.0),
            );
            let [a, b, c, d] = index.map(|i| NeonVec4(vreinterpretq_f32_u8(vqtbl4q_u8(bytes, i))));
            DoubleWidth(DoubleWidth(a, b), DoubleWidth(c, d))
        })
    }
    #[inline(always)]
    fn gather_lanes(
        table: Self::F32x16,
        DoubleWidth(DoubleWidth(a, b), DoubleWidth(c, d)): Self::F32x16,
    ) -> Self::F32x16 {
        // Byte indices of the four bytes of each lane: four times the lane index, plus 0 to 3.
        let index = [a, b, c, d].map(|v| {
            on_neon!({
                let lane = vandq_u32(vreinterpretq_u32_f32(v.0), vdupq_n_u32(15));
                vreinterpretq_u8_u32(vmlaq_n_u32(vdupq_n_u32(0x0302_0100), lane, 0x0404_0404))
            })
        });
        Self::permute(table, index)
    }
    #[inline(always)]
    fn expand_bits(packed: u64) -> Self::F32x16 {
        let lane = |i: usize| f32::from_bits((packed >> (32 * (i % 2) + 4 * (i / 2))) as u32 & 15);
        let lanes: [f32; 16] = std::array::from_fn(lane);
        // SAFETY: the array contains 16 floats.
        unsafe { Self::F32x16::load(lanes.as_ptr()) }
    }
    #[inline(always)]
    fn add_u32_bits(DoubleWidth(DoubleWidth(a, b), DoubleWidth(c, d)): Self::F32x16, by: u32) -> Self::F32x16 {
        let plus = |v: NeonVec4| {
            on_neon!(NeonVec4(vreinterpretq_f32_u32(vaddq_u32(vreinterpretq_u32_f32(v.0), vdupq_n_u32(by)))))
        };
        DoubleWidth(DoubleWidth(plus(a), plus(b)), DoubleWidth(plus(c), plus(d)))
    }
    inlined! {
        fn sort_descending(v: NeonVec8, mask: u32) -> [u8; 8] = sort_descending(&lanes8(v), mask);
        fn permute8(v: NeonVec8, order: [u8; 8]) -> NeonVec8 = permute8(v, order);
    }
}
