//! Reads and writes of registers at any address.
//!
//! With debug assertions, the standard library's loads and stores check their pointers, and rustc no longer inlines
//! them into kernels. A place expression is always inlined, and compiles to a single move.

/// A value without alignment.
#[derive(Clone, Copy)]
#[repr(C, packed)]
pub(crate) struct Unaligned<T>(T);

impl<T: Copy> Unaligned<T> {
    /// Reads the value at an address.
    ///
    /// # Safety
    /// The address must be readable for the size of a `T`.
    #[inline(always)]
    pub unsafe fn read(from: *const Self) -> T {
        // SAFETY: as stated above; a packed type needs no alignment.
        unsafe { (*from).0 }
    }

    /// Writes a value to an address.
    ///
    /// # Safety
    /// The address must be writable for the size of a `T`.
    #[inline(always)]
    pub unsafe fn write(to: *mut Self, value: T) {
        // SAFETY: as stated above; a packed type needs no alignment.
        unsafe { (*to).0 = value }
    }
}
