//! Non-temporal stores for values that are not read soon: they bypass the cache, which would load every line before it
//! is written and evict others.

use std::marker::PhantomData;

/// Numbers without invalid bit patterns.
pub trait Pod: Copy + Default + sealed::Sealed {}
impl Pod for f32 {}
impl Pod for f64 {}
impl Pod for i32 {}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
    impl Sealed for i32 {}
}

/// Writes with non-temporal stores. The written memory stays borrowed for `'a`, beyond the end of
/// [`with_streaming_stores`].
pub struct StreamingWriter<'a>(PhantomData<&'a mut &'a ()>);

/// Runs work that uses non-temporal stores, then a store fence: every thread sees the writes.
pub fn with_streaming_stores<'a, R>(work: impl FnOnce(&mut StreamingWriter<'a>) -> R) -> R {
    // The fence also runs on a panic.
    let _fence = SfenceOnDrop;
    work(&mut StreamingWriter(PhantomData))
}

struct SfenceOnDrop;

impl Drop for SfenceOnDrop {
    fn drop(&mut self) {
        #[cfg(all(target_arch = "x86_64", not(miri)))]
        // SAFETY: every x86-64 has it.
        unsafe {
            std::arch::x86_64::_mm_sfence();
        }
    }
}

/// Bytes per cache line.
#[cfg(all(target_arch = "x86_64", not(miri)))]
const CACHE_LINE: usize = 64;

impl<'a> StreamingWriter<'a> {
    /// Copies values. Only whole cache lines are streamed, so long slices gain most.
    #[inline]
    pub fn copy<T: Pod>(&mut self, to: &'a mut [T], from: &[T]) {
        assert!(to.len() == from.len(), "room for another number of values");
        #[cfg(all(target_arch = "x86_64", not(miri)))]
        {
            use std::arch::x86_64::{__m128i, _mm_loadu_si128, _mm_stream_si128};
            let bytes = size_of_val(from);
            let (start, source) = (to.as_mut_ptr().cast::<u8>(), from.as_ptr().cast::<u8>());
            let before = start.align_offset(CACHE_LINE).min(bytes);
            let lines = (bytes - before) / CACHE_LINE;
            let after = before + lines * CACHE_LINE;
            // SAFETY: both have so many bytes, of numbers of which any bits are one, and what can be written to is not what
            // is read. Lines begin at multiples of their size. Every x86-64 has these instructions, and until the fence
            // nobody else may look at what they write.
            unsafe {
                if before > 0 {
                    std::ptr::copy_nonoverlapping(source, start, before);
                }
                for line in 0..lines {
                    let at = before + line * CACHE_LINE;
                    let (to, from) = (start.add(at).cast::<__m128i>(), source.add(at));
                    let from = from.cast::<__m128i>();
                    for k in 0..CACHE_LINE / size_of::<__m128i>() {
                        _mm_stream_si128(to.add(k), _mm_loadu_si128(from.add(k)));
                    }
                }
                if after < bytes {
                    let (to, from) = (start.add(after), source.add(after));
                    std::ptr::copy_nonoverlapping(from, to, bytes - after);
                }
            }
        }
        #[cfg(not(all(target_arch = "x86_64", not(miri))))]
        to.copy_from_slice(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_arrives_wherever_lines_begin_and_nothing_beside_it() {
        let from: Vec<f32> = (0..200).map(|i| i as f32 + 0.5).collect();
        for start in 0..20 {
            for length in [0, 1, 15, 16, 17, 31, 33, 64, 150] {
                let mut to = vec![-1.0f32; 200];
                with_streaming_stores(|writer| writer.copy(&mut to[start..start + length], &from[..length]));
                assert!(to[..start].iter().all(|&value| value == -1.0));
                assert_eq!(to[start..start + length], from[..length]);
                assert!(to[start + length..].iter().all(|&value| value == -1.0));
            }
        }
        let (numbers, mut to) = ([1i32, -2, 3], [0; 3]);
        with_streaming_stores(|writer| writer.copy(&mut to, &numbers));
        assert_eq!(to, numbers);
    }

    #[test]
    fn other_threads_see_what_was_written() {
        let from: Vec<f64> = (0..1 << 12).map(f64::from).collect();
        let mut to = vec![0.0; from.len()];
        for turn in 0..200 {
            let from: Vec<f64> = from.iter().map(|value| value + f64::from(turn)).collect();
            std::thread::scope(|threads| {
                let (send, receive) = std::sync::mpsc::channel();
                let to = &mut to;
                threads.spawn(move || {
                    let (a, b) = to.split_at_mut(1000);
                    with_streaming_stores(|writer| {
                        writer.copy(a, &from[..1000]);
                        writer.copy(b, &from[1000..]);
                    });
                    send.send((to, from)).unwrap();
                });
                let (to, from) = receive.recv().unwrap();
                assert!(*to == from);
            });
        }
    }
}
