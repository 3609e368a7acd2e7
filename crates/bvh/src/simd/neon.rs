//! NEON: vectors of 4, in pairs of pairs.

use std::arch::aarch64::*;

use super::{COMPRESS, Isa, Vector, descending, least_lane};
use crate::simd::double_width::Pair;

/// aarch64 with NEON.
#[derive(Clone, Copy)]
pub struct Neon;

/// Four floats in a register.
#[derive(Clone, Copy)]
pub struct Quad(pub float32x4_t);

/// An intrinsic, which needs the instruction set; see the module for why it is there.
macro_rules! on_neon {
    ($e:expr) => {{
        // SAFETY: kernels over `Neon` run only where the machine has NEON (see `simd`).
        #[allow(unused_unsafe)]
        unsafe {
            $e
        }
    }};
}

impl Vector for Quad {
    type Mask = uint32x4_t;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        on_neon!(Self(vdupq_n_f32(x)))
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
    fn add(self, b: Self) -> Self {
        on_neon!(Self(vaddq_f32(self.0, b.0)))
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        on_neon!(Self(vsubq_f32(self.0, b.0)))
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        on_neon!(Self(vmulq_f32(self.0, b.0)))
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        on_neon!(Self(vdivq_f32(self.0, b.0)))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        on_neon!(Self(vbslq_f32(vcltq_f32(self.0, b.0), self.0, b.0)))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        on_neon!(Self(vbslq_f32(vcgtq_f32(self.0, b.0), self.0, b.0)))
    }
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        on_neon!(Self(vfmaq_f32(vnegq_f32(c.0), self.0, b.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        on_neon!(Self(vabsq_f32(self.0)))
    }
    #[inline(always)]
    fn le(self, b: Self) -> uint32x4_t {
        on_neon!(vcleq_f32(self.0, b.0))
    }
    #[inline(always)]
    fn eq(self, b: Self) -> uint32x4_t {
        on_neon!(vceqq_f32(self.0, b.0))
    }
    #[inline(always)]
    fn and(a: uint32x4_t, b: uint32x4_t) -> uint32x4_t {
        on_neon!(vandq_u32(a, b))
    }
    #[inline(always)]
    fn or(a: uint32x4_t, b: uint32x4_t) -> uint32x4_t {
        on_neon!(vorrq_u32(a, b))
    }
    #[inline(always)]
    fn least(self) -> f32 {
        on_neon!(vminvq_f32(self.0))
    }
    #[inline(always)]
    fn greatest(self) -> f32 {
        on_neon!(vmaxvq_f32(self.0))
    }
    #[inline(always)]
    fn bits(mask: uint32x4_t) -> u32 {
        const PLACES: [u32; 4] = [1, 2, 4, 8];
        on_neon!(vaddvq_u32(vandq_u32(mask, vld1q_u32(PLACES.as_ptr()))))
    }
    #[inline(always)]
    fn mask(bits: u32) -> uint32x4_t {
        const PLACES: [u32; 4] = [1, 2, 4, 8];
        on_neon!(vtstq_u32(vdupq_n_u32(bits), vld1q_u32(PLACES.as_ptr())))
    }
    #[inline(always)]
    fn select(mask: uint32x4_t, a: Self, b: Self) -> Self {
        on_neon!(Self(vbslq_f32(mask, a.0, b.0)))
    }
}

type Eight = Pair<Quad, 4>;

impl Isa for Neon {
    type F8 = Eight;
    type F16 = Pair<Eight, 8>;
    type Rays = Self::F16;
    type Index = [uint8x16_t; 4];
    type Order = [u8; 8];

    #[inline(always)]
    fn index(packed: u64) -> Self::Index {
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
    fn lookup(table: Self::F16, index: Self::Index) -> Self::F16 {
        on_neon!({
            let bytes = uint8x16x4_t(
                vreinterpretq_u8_f32(table.0.0.0),
                vreinterpretq_u8_f32(table.0.1.0),
                vreinterpretq_u8_f32(table.1.0.0),
                vreinterpretq_u8_f32(table.1.1.0),
            );
            let [a, b, c, d] = index.map(|i| Quad(vreinterpretq_f32_u8(vqtbl4q_u8(bytes, i))));
            Pair(Pair(a, b), Pair(c, d))
        })
    }
    #[inline(always)]
    fn find(table: Self::F16, Pair(Pair(a, b), Pair(c, d)): Self::F16) -> Self::F16 {
        // Four bytes of each lane: four times the index, and 0 to 3 more.
        let index = [a, b, c, d].map(|v| {
            on_neon!({
                let lane = vandq_u32(vreinterpretq_u32_f32(v.0), vdupq_n_u32(15));
                vreinterpretq_u8_u32(vmlaq_n_u32(vdupq_n_u32(0x0302_0100), lane, 0x0404_0404))
            })
        });
        Self::lookup(table, index)
    }
    #[inline(always)]
    fn spread(packed: u64) -> Self::F16 {
        let lane = |i: usize| f32::from_bits((packed >> (32 * (i % 2) + 4 * (i / 2))) as u32 & 15);
        let lanes: [f32; 16] = std::array::from_fn(lane);
        // SAFETY: the array holds 16 floats.
        unsafe { Self::F16::load(lanes.as_ptr()) }
    }
    #[inline(always)]
    fn plus(Pair(Pair(a, b), Pair(c, d)): Self::F16, by: u32) -> Self::F16 {
        let plus = |v: Quad| {
            on_neon!(Quad(vreinterpretq_f32_u32(vaddq_u32(
                vreinterpretq_u32_f32(v.0),
                vdupq_n_u32(by)
            ))))
        };
        Pair(Pair(plus(a), plus(b)), Pair(plus(c), plus(d)))
    }
    #[inline(always)]
    fn compress(v: Eight, mask: u32) -> Eight {
        let mut values = [0.0; 8];
        // SAFETY: both arrays hold 8 floats.
        unsafe {
            v.store(values.as_mut_ptr());
            Eight::load(
                COMPRESS[mask as usize & 255]
                    .map(|lane| values[lane as usize & 7])
                    .as_ptr(),
            )
        }
    }
    #[inline(always)]
    fn descending(v: Eight, mask: u32) -> [u8; 8] {
        let mut values = [0.0f32; 8];
        // SAFETY: the array holds 8 floats.
        unsafe { v.store(values.as_mut_ptr()) };
        descending(&values, mask)
    }
    #[inline(always)]
    fn reorder(v: Eight, order: [u8; 8]) -> Eight {
        let mut values = [0.0; 8];
        // SAFETY: both arrays hold 8 floats.
        unsafe {
            v.store(values.as_mut_ptr());
            Eight::load(order.map(|lane| values[lane as usize & 7]).as_ptr())
        }
    }
    #[inline(always)]
    fn least_lane(v: Eight, mask: <Eight as Vector>::Mask) -> usize {
        let mut values = [0.0f32; 8];
        // SAFETY: the array holds 8 floats.
        unsafe { v.store(values.as_mut_ptr()) };
        least_lane(&values, Eight::bits(mask))
    }
    #[inline(always)]
    fn prefetch(_at: *const u8) {}
}
