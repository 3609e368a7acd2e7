//! SIMD vectors of 8 and 16 floats behind one trait, so that every kernel is written once.
//!
//! A kernel is generic over [`Isa`] and `#[inline(always)]`; [`crate::platform::dispatch`] instantiates it inside a
//! function that enables the instruction set, after run-time detection. The vector types never leave the crate, so no
//! code uses an instruction set that the machine does not support. This is the safety argument of every intrinsic in
//! this folder. WebAssembly has no detection, but a module with unsupported instructions is rejected before it runs.
//!
//! Only `+ - * /`, [`Vector::mul_sub`], comparisons and selects contribute to a hit. All are correctly rounded, so the
//! bits of hits do not depend on the instruction set.

/// Defines methods that consist of a single expression, inlined into the function that enables the instruction set.
/// Each row of the macro's input is a method.
macro_rules! inlined {
    ($($(#[$doc:meta])* $vis:vis fn $name:ident($($argument:tt)*) -> $out:ty = $body:expr;)*) => {$(
        $(#[$doc])*
        #[inline(always)]
        $vis fn $name($($argument)*) -> $out {
            $body
        }
    )*};
}

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
pub(crate) mod double_width;
pub(crate) mod f32x4;
#[cfg(target_arch = "aarch64")]
mod neon;
pub(crate) mod portable;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;
#[cfg(target_arch = "x86_64")]
mod unaligned;

pub use crate::simd::f32x4::{F32x4, prefetch};
pub use crate::simd::portable::Portable;
#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub use avx512::Avx512;
#[cfg(target_arch = "aarch64")]
pub use neon::Neon;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
pub use simd128::Simd128;

/// A SIMD vector of floats.
pub trait Vector: Copy {
    /// A mask with one truth value per lane.
    type Mask: Copy;

    fn splat(x: f32) -> Self;
    /// Reads as many floats as there are lanes.
    ///
    /// # Safety
    /// `from` must be readable for all lanes; no alignment is needed.
    unsafe fn load(from: *const f32) -> Self;
    /// Writes as many floats as there are lanes.
    ///
    /// # Safety
    /// `to` must be writable for all lanes; no alignment is needed.
    unsafe fn store(self, to: *mut f32);
    fn add(self, b: Self) -> Self;
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    fn div(self, b: Self) -> Self;
    /// `if self < b { self } else { b }`.
    fn min(self, b: Self) -> Self;
    /// `if self > b { self } else { b }`.
    fn max(self, b: Self) -> Self;
    /// `self * b - c`, rounded once.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    fn abs(self) -> Self;
    fn le(self, b: Self) -> Self::Mask;
    fn eq(self, b: Self) -> Self::Mask;
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// The minimum of all lanes.
    fn reduce_min(self) -> f32;
    /// The maximum of all lanes.
    fn reduce_max(self) -> f32;
    /// Converts a mask to an integer in which bit i is lane i.
    fn to_bitmask(mask: Self::Mask) -> u32;
    /// Converts an integer to a mask in which lane i is bit i.
    fn from_bitmask(bits: u32) -> Self::Mask;
    /// `if mask { a } else { b }`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
}

/// An instruction set with its vector types.
pub trait Isa: Copy + 'static {
    /// True if an operation on sixteen floats takes only slightly longer than on one.
    const WIDE: bool = false;
    /// True if `mul_sub` is one instruction; emulation of its single rounding is slow.
    const HAS_FMA: bool = true;

    type F32x8: Vector;
    type F32x16: Vector;
    /// Vector for testing several rays at once, each against its own triangle: [`Isa::F32x8`] if sixteen lanes would
    /// exceed the registers, otherwise [`Isa::F32x16`].
    type RayVec: Vector;
    /// Number of lanes of [`Isa::RayVec`].
    const RAY_LANES: usize = 16;
    /// Sixteen indices of lanes in a vector of sixteen.
    type LaneIndices: Copy;
    /// Eight indices of lanes in a vector of eight.
    type Permutation: Copy;

    /// Unpacks sixteen packed 4-bit indices: the index of lane i is in bits `4 * (i / 2)` of 32-bit word `i % 2`.
    fn unpack_indices(packed: u64) -> Self::LaneIndices;
    /// `table[index]`, lane by lane.
    fn permute(table: Self::F32x16, index: Self::LaneIndices) -> Self::F32x16;
    /// `table[index]` for the eight lanes from `8 * HALF` on; `packed` contains all sixteen indices.
    #[inline(always)]
    fn permute_half<const HALF: usize>(table: Self::F32x16, packed: u64) -> Self::F32x8 {
        let mut lanes = [0.0; 16];
        // SAFETY: the array contains 16 floats, of which 8 are read.
        unsafe {
            table.store(lanes.as_mut_ptr());
            let at = |i: usize| lanes[usize::from(packed_index(packed, 8 * HALF + i))];
            Self::F32x8::load(std::array::from_fn::<f32, 8, _>(at).as_ptr())
        }
    }
    /// `table[index]`, lane by lane; an index is in the low four bits of its lane.
    fn gather_lanes(table: Self::F32x16, index: Self::RayVec) -> Self::RayVec;
    /// Unpacks sixteen packed indices into the low four bits of each lane; the lanes are not valid numbers for
    /// arithmetic.
    fn expand_bits(packed: u64) -> Self::F32x16;
    /// Adds an integer to the bits of every lane.
    fn add_u32_bits(bits: Self::RayVec, by: u32) -> Self::RayVec;
    /// Moves the lanes of `mask`, in order, to the first lanes; all other lanes are unspecified.
    #[inline(always)]
    fn compress(v: Self::F32x8, mask: u32) -> Self::F32x8 {
        permute8(v, COMPRESS[mask as usize & 255])
    }
    /// Permutation that sorts the lanes of `mask` from the greatest value to the smallest; values that differ by at
    /// most 7 ulp may be exchanged. All other entries are unspecified. Values must not be negative.
    fn sort_descending(v: Self::F32x8, mask: u32) -> Self::Permutation;
    /// `v[order]`, lane by lane.
    fn permute8(v: Self::F32x8, order: Self::Permutation) -> Self::F32x8;
    /// Lane of the smallest value among the lanes of `mask`, or of a value at most 7 ulp larger; unspecified for an
    /// empty mask. Values must not be negative.
    #[inline(always)]
    fn argmin(v: Self::F32x8, mask: <Self::F32x8 as Vector>::Mask) -> usize {
        argmin(&lanes8(v), Self::F32x8::to_bitmask(mask))
    }
    /// Splits a vector into its first four lanes and its last four lanes.
    #[inline(always)]
    fn split_f32x4(v: Self::F32x8) -> [F32x4; 2] {
        let [a, b, c, d, e, f, g, h] = lanes8(v);
        [F32x4::new([a, b, c, d]), F32x4::new([e, f, g, h])]
    }
    /// Transposes sixteen rows of four floats into four vectors.
    ///
    /// # Safety
    ///
    /// Four floats must be readable at each of `rows`; no alignment is needed.
    #[inline(always)]
    unsafe fn load_transposed(rows: [*const f32; 16]) -> [Self::F32x16; 4] {
        let mut columns = [[0.0; 16]; 4];
        for (i, row) in rows.into_iter().enumerate() {
            for (k, column) in columns.iter_mut().enumerate() {
                // SAFETY: guaranteed by the caller.
                column[i] = unsafe { row.add(k).read() };
            }
        }
        // SAFETY: each array contains 16 floats.
        columns.map(|column| unsafe { Self::F32x16::load(column.as_ptr()) })
    }
    /// Prefetches a cache line, if the instruction set supports prefetching.
    #[inline(always)]
    fn prefetch(_at: *const u8) {}
}

/// The permutation that [`Isa::compress`] applies, for every mask of eight lanes.
pub static COMPRESS: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut n) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 != 0 {
                table[mask][n] = lane as u8;
                n += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// The eight lanes of a vector as an array, for scalar code.
#[inline(always)]
pub fn lanes8<V: Vector>(v: V) -> [f32; 8] {
    let mut lanes = [0.0; 8];
    // SAFETY: the array contains 8 floats.
    unsafe { v.store(lanes.as_mut_ptr()) };
    lanes
}

/// [`Isa::permute8`] in scalar code.
#[inline(always)]
pub fn permute8<V: Vector>(v: V, order: [u8; 8]) -> V {
    let lanes = lanes8(v);
    // SAFETY: the array contains 8 floats.
    unsafe { V::load(order.map(|lane| lanes[lane as usize & 7]).as_ptr()) }
}

/// [`Isa::sort_descending`] in scalar code.
pub fn sort_descending(v: &[f32; 8], mask: u32) -> [u8; 8] {
    let mut order = COMPRESS[mask as usize & 255];
    order[..mask.count_ones() as usize].sort_by(|&a, &b| v[b as usize & 7].total_cmp(&v[a as usize & 7]));
    order
}

/// [`Isa::argmin`] in scalar code.
pub fn argmin(v: &[f32; 8], mask: u32) -> usize {
    let mut least = mask.trailing_zeros() as usize & 7;
    for (lane, value) in v.iter().enumerate() {
        if mask >> lane & 1 != 0 && *value < v[least] {
            least = lane;
        }
    }
    least
}

/// Packs sixteen indices below 16 for [`Isa::unpack_indices`].
pub fn pack_indices(lanes: &[u8; 16]) -> u64 {
    (0..16).fold(0, |word, i| word | u64::from(lanes[i]) << (32 * (i % 2) + 4 * (i / 2)))
}

/// The index for `lane` in indices packed by [`pack_indices`].
#[inline(always)]
pub fn packed_index(packed: u64, lane: usize) -> u8 {
    (packed >> (32 * (lane % 2) + 4 * (lane / 2 % 8))) as u8 & 15
}
