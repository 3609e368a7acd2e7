//! Large arrays on large pages.

use std::alloc::{Layout, alloc, dealloc, handle_alloc_error};
use std::mem::MaybeUninit;
use std::ops::{Deref, DerefMut};
use std::ptr::NonNull;

use rayon::prelude::*;

/// The size of a large page.
const PAGE: usize = 2 << 20;

/// Plain values in a row, their number fixed when they are allocated. Where the system has large pages to give, they
/// lie on those: a tree is visited all over, and would otherwise miss the translation buffer at nearly every step.
pub struct Pages<T: Copy> {
    start: NonNull<T>,
    len: usize,
    capacity: usize,
}

// SAFETY: a `Pages` owns its values, as a `Vec` does.
unsafe impl<T: Copy + Send> Send for Pages<T> {}
// SAFETY: as above.
unsafe impl<T: Copy + Sync> Sync for Pages<T> {}

impl<T: Copy> Pages<T> {
    /// Room for `capacity` values; none are there yet.
    pub fn with_capacity(capacity: usize) -> Self {
        let layout = Self::layout(capacity);
        if layout.size() == 0 {
            return Self {
                start: NonNull::dangling(),
                len: 0,
                capacity: 0,
            };
        }
        // SAFETY: the layout is not empty.
        let start = unsafe { alloc(layout) };
        let Some(start) = NonNull::new(start.cast::<T>()) else {
            handle_alloc_error(layout)
        };
        if layout.align() == PAGE {
            advise_large_pages(start.as_ptr().cast(), layout.size());
        }
        Self {
            start,
            len: 0,
            capacity,
        }
    }

    fn layout(capacity: usize) -> Layout {
        let size = capacity.saturating_mul(size_of::<T>());
        // Less than a few pages are not worth the alignment.
        let align = if size >= 4 * PAGE {
            PAGE
        } else {
            align_of::<T>().max(64)
        };
        // No allocation is larger than this, so one that asks for more fails as one that asks for this does.
        let limit = isize::MAX as usize - PAGE;
        let Ok(layout) = Layout::from_size_align(size.min(limit), align) else {
            unreachable!("a valid layout")
        };
        layout
    }

    /// How many values there is room for.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// The values of all `parts`, `capacity` in number, one after the other: copied in parallel, each part dropped once
    /// it is.
    pub fn collect<P: AsRef<[T]> + Send>(capacity: usize, parts: Vec<P>) -> Self
    where
        T: Send + Sync,
    {
        let mut pages = Self::with_capacity(capacity);
        // SAFETY: there is room for that many values, none of which is taken to be written.
        let mut room = unsafe {
            std::slice::from_raw_parts_mut(
                pages.start.as_ptr().cast::<MaybeUninit<T>>(),
                pages.capacity,
            )
        };
        let mut at = 0;
        let mut placed = Vec::with_capacity(parts.len());
        for part in parts {
            let length = part.as_ref().len();
            let (here, rest) = room.split_at_mut(length);
            placed.push((part, here));
            (at, room) = (at + length, rest);
        }
        assert!(at == capacity, "{at} values, expected {capacity}");
        placed.into_par_iter().for_each(|(part, here)| {
            let from = part.as_ref();
            assert!(from.len() == here.len(), "a part has changed its length");
            // SAFETY: as long as each other, and one of them was just allocated.
            unsafe {
                let to = here.as_mut_ptr().cast::<T>();
                std::ptr::copy_nonoverlapping(from.as_ptr(), to, from.len());
            }
        });
        pages.len = capacity;
        pages
    }
}

impl<T: Copy + Send + Sync> Clone for Pages<T> {
    fn clone(&self) -> Self {
        let parts = self.chunks(1 << 14).collect();
        Self::collect(self.len, parts)
    }
}

impl<T: Copy> Drop for Pages<T> {
    fn drop(&mut self) {
        let layout = Self::layout(self.capacity);
        if layout.size() != 0 {
            // SAFETY: allocated with this layout.
            unsafe { dealloc(self.start.as_ptr().cast(), layout) };
        }
    }
}

impl<T: Copy> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: the first `len` values are written.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl<T: Copy> DerefMut for Pages<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: the first `len` values are written.
        unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr(), self.len) }
    }
}

/// Asks for large pages; it does not matter if there are none.
#[cfg(all(target_os = "linux", not(miri)))]
fn advise_large_pages(start: *mut u8, size: usize) {
    unsafe extern "C" {
        fn madvise(
            start: *mut std::ffi::c_void,
            size: usize,
            advice: std::ffi::c_int,
        ) -> std::ffi::c_int;
    }
    const MADV_HUGEPAGE: std::ffi::c_int = 14;
    // SAFETY: the range was just allocated, starts at a page and is only given an advice, which changes no value.
    unsafe { madvise(start.cast(), size, MADV_HUGEPAGE) };
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn advise_large_pages(_start: *mut u8, _size: usize) {}
