//! Arrays on huge pages.

use std::alloc::{Layout, alloc, dealloc, handle_alloc_error, realloc};
use std::mem::MaybeUninit;
use std::ops::{Deref, DerefMut};
use std::ptr::NonNull;

use rayon::prelude::*;

/// The size of a huge page on Linux, in bytes.
const HUGE_PAGE: usize = 2 << 20;

/// A vector of plain values on huge pages if available. Traversal visits all parts of a tree, and on small pages it
/// would miss the TLB at almost every step.
pub struct HugePageVec<T: Copy> {
    start: NonNull<T>,
    len: usize,
    capacity: usize,
    /// Number of bytes between the start of the allocation and the first value.
    align_offset: usize,
}

/// The alignment of the first value, in bytes.
const CACHE_LINE: usize = 64;

// SAFETY: a `HugePageVec` owns its values, as a `Vec` does.
unsafe impl<T: Copy + Send> Send for HugePageVec<T> {}
// SAFETY: as above.
unsafe impl<T: Copy + Sync> Sync for HugePageVec<T> {}

impl<T: Copy> HugePageVec<T> {
    /// An empty vector with room for `capacity` values.
    pub fn with_capacity(capacity: usize) -> Self {
        const { assert!(align_of::<T>() <= CACHE_LINE) };
        let layout = Self::layout(capacity);
        if layout.size() == 0 {
            return Self { start: NonNull::dangling(), len: 0, capacity: 0, align_offset: 0 };
        }
        // SAFETY: the size of the layout is not 0.
        let Some(allocated) = NonNull::new(unsafe { alloc(layout) }) else { handle_alloc_error(layout) };
        let skipped = allocated.align_offset(CACHE_LINE);
        // SAFETY: the layout contains one cache line more than the values require.
        let start = unsafe { allocated.add(skipped) }.cast();
        madvise_hugepage(allocated.as_ptr(), layout.size());
        Self { start, len: 0, capacity, align_offset: skipped }
    }

    /// The layout of an allocation: the values and one additional cache line. Because of the low alignment, allocators
    /// can shrink the memory in place.
    fn layout(capacity: usize) -> Layout {
        let size = capacity.saturating_mul(size_of::<T>());
        let size = if size == 0 { 0 } else { size.saturating_add(CACHE_LINE) };
        // The size is limited to the largest size that a layout accepts; an allocation of this size fails like a larger
        // one.
        let limit = isize::MAX as usize - HUGE_PAGE;
        let Ok(layout) = Layout::from_size_align(size.min(limit), 16) else { unreachable!("a valid layout") };
        layout
    }

    /// The memory of all `capacity` values, whether written or not.
    pub fn spare_capacity_mut(&mut self) -> &mut [MaybeUninit<T>] {
        // SAFETY: there is room for this many values, none of which is assumed to be written.
        unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr().cast(), self.capacity) }
    }

    /// Sets the length to `len` and releases the memory after it.
    ///
    /// # Safety
    ///
    /// The first `len` values have been written.
    pub unsafe fn set_len_and_shrink(&mut self, len: usize) {
        assert!(len <= self.capacity, "more values than the capacity");
        if len == 0 {
            *self = Self::with_capacity(0);
        }
        self.len = len;
        if len == self.capacity {
            return;
        }
        let (old, new) = (Self::layout(self.capacity), Self::layout(len));
        // SAFETY: the memory was allocated with the old layout, and the new size is not 0.
        let Some(moved) = NonNull::new(unsafe {
            let allocated = self.start.as_ptr().cast::<u8>().sub(self.align_offset);
            realloc(allocated, old, new.size())
        }) else {
            handle_alloc_error(new)
        };
        let skipped = moved.align_offset(CACHE_LINE);
        // SAFETY: the reallocation keeps the values' offset from the start of the allocation, and both ranges are
        // within the allocation.
        unsafe {
            let values = len * size_of::<T>();
            std::ptr::copy(moved.add(self.align_offset).as_ptr(), moved.add(skipped).as_ptr(), values);
            self.start = moved.add(skipped).cast();
        }
        (self.align_offset, self.capacity) = (skipped, len);
    }

    /// Concatenates `parts`, which contain `capacity` values in total. Many values are copied in parallel; each part is
    /// dropped after its copy.
    pub fn concat_parallel<P: AsRef<[T]> + Send>(capacity: usize, parts: Vec<P>) -> Self
    where
        T: Send + Sync,
    {
        /// Number of values below which the copy runs on the calling thread alone.
        const FEW: usize = 1 << 12;
        let mut pages = Self::with_capacity(capacity);
        let mut room = pages.spare_capacity_mut();
        let mut at = 0;
        let mut placed = Vec::with_capacity(parts.len());
        for part in parts {
            let length = part.as_ref().len();
            let (here, rest) = room.split_at_mut(length);
            placed.push((part, here));
            (at, room) = (at + length, rest);
        }
        assert!(at == capacity, "{at} values; expected {capacity}");
        let copy = |(part, here): (P, _)| copy_to_uninit(here, part.as_ref());
        // Small copies are done by the calling thread, which may not be in a pool.
        if at <= FEW {
            placed.into_iter().for_each(copy);
        } else {
            placed.into_par_iter().for_each(copy);
        }
        pages.len = capacity;
        pages
    }
}

impl<T: Copy + Send + Sync> Clone for HugePageVec<T> {
    fn clone(&self) -> Self {
        let parts = self.chunks(1 << 14).collect();
        Self::concat_parallel(self.len, parts)
    }
}

impl<T: Copy> Drop for HugePageVec<T> {
    fn drop(&mut self) {
        let layout = Self::layout(self.capacity);
        if layout.size() != 0 {
            // SAFETY: the memory was allocated with this layout.
            unsafe { dealloc(self.start.as_ptr().cast::<u8>().sub(self.align_offset), layout) };
        }
    }
}

impl<T: Copy> Deref for HugePageVec<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: the first `len` values have been written.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl<T: Copy> DerefMut for HugePageVec<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: the first `len` values have been written.
        unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr(), self.len) }
    }
}

/// Copies values to uninitialised memory for the same number of values.
pub fn copy_to_uninit<T: Copy>(room: &mut [MaybeUninit<T>], values: &[T]) {
    assert!(room.len() == values.len(), "the lengths of source and destination differ");
    // SAFETY: both slices have the same length, and a mutable slice cannot overlap another slice.
    unsafe {
        let to = room.as_mut_ptr().cast::<T>();
        std::ptr::copy_nonoverlapping(values.as_ptr(), to, values.len());
    }
}

/// Returns a vector of `count` zeros, on huge pages if there are many: the page faults of small pages would take longer
/// than the writes.
pub fn zeroed_huge<T: Copy + Default>(count: usize) -> Vec<T> {
    let mut values = vec![T::default(); count];
    madvise_hugepage(values.as_mut_ptr().cast(), size_of_val(values.as_slice()));
    values
}

/// Advises the Linux kernel to use huge pages; has no effect on other systems.
#[cfg(all(target_os = "linux", not(miri)))]
fn madvise_hugepage(start: *mut u8, size: usize) {
    unsafe extern "C" {
        fn madvise(start: *mut std::ffi::c_void, size: usize, advice: std::ffi::c_int) -> std::ffi::c_int;
    }
    const MADV_HUGEPAGE: std::ffi::c_int = 14;
    // Alignment in bytes: a multiple of the size of a small page on every system.
    const PAGE: usize = 1 << 16;
    let skipped = start.align_offset(PAGE);
    if size < HUGE_PAGE {
        return;
    }
    // SAFETY: the range belongs to the caller and starts at a page, and the advice changes no value.
    unsafe { madvise(start.add(skipped).cast(), size - skipped, MADV_HUGEPAGE) };
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn madvise_hugepage(_start: *mut u8, _size: usize) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeroed_vectors_have_the_requested_length() {
        for count in [0, 1, 1000, 3 << 19, (5 << 20) + 7] {
            // The allocator may reuse memory that contained other values.
            drop(vec![1.5f32; count]);
            let values = zeroed_huge::<f32>(count);
            assert_eq!(values.len(), count);
            assert!(values.iter().all(|value| value.to_bits() == 0));
        }
    }
}
