//! Parallel loops, with results that do not depend on the number of threads.

use std::panic;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// The results of `each` for all items, in their order.
///
/// The threads live as long as the call: a file is read once, and a pool that outlives it would not survive a fork.
pub(crate) fn par_map<T: Sync, R: Send>(items: &[T], each: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads = match items.len() {
        // `available_parallelism` opens files.
        0 | 1 => 1,
        count => thread::available_parallelism().map_or(1, |cores| cores.get().min(count)),
    };
    if threads < 2 {
        return items.iter().map(each).collect();
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            match items.get(at) {
                Some(item) => done.push((at, each(item))),
                None => return done,
            }
        }
    };
    let mut done = thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut done = work();
        for other in others {
            done.extend(other.join().unwrap_or_else(|e| panic::resume_unwind(e)));
        }
        done
    });
    done.sort_unstable_by_key(|&(at, _)| at);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Fills the blocks of `size` values by `make`, which gets the index of the first value of a block.
///
/// Fresh zero pages are first touched by the thread that fills them.
///
/// # Errors
/// The error of the first block that has one.
pub(crate) fn fill_blocks<T: Send, E: Send>(
    values: &mut [T],
    size: usize,
    make: impl Fn(usize, &mut [T]) -> Result<(), E> + Sync,
) -> Result<(), E> {
    let count = values.len().div_ceil(size);
    let threads = match count {
        0 | 1 => 1,
        count => thread::available_parallelism().map_or(1, |cores| cores.get().min(count)),
    };
    let blocks = Mutex::new(values.chunks_mut(size).enumerate());
    // Blocks are assigned in order, so that all blocks before one with an error are assigned too.
    let next = || blocks.lock().unwrap_or_else(PoisonError::into_inner).next();
    let failed = AtomicUsize::new(usize::MAX);
    let work = || {
        while let Some((number, block)) = next() {
            if failed.load(Ordering::Relaxed) < number {
                break;
            }
            if let Err(error) = make(number * size, block) {
                failed.fetch_min(number, Ordering::Relaxed);
                return Some((number, error));
            }
        }
        None
    };
    let errors = thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut errors: Vec<_> = work().into_iter().collect();
        for other in others {
            errors.extend(other.join().unwrap_or_else(|e| panic::resume_unwind(e)));
        }
        errors
    });
    let first = errors.into_iter().min_by_key(|&(number, _)| number);
    first.map_or(Ok(()), |(_, error)| Err(error))
}

/// The minimum and the maximum; `u32::MAX` and 0 of no numbers.
pub(crate) fn min_max(numbers: &[u32]) -> (u32, u32) {
    let both = |(low, high): (u32, u32), (l, h): (u32, u32)| (low.min(l), high.max(h));
    let none = (u32::MAX, 0);
    let blocks: Vec<_> = numbers.chunks(1 << 17).collect();
    let of_block = |block: &&[u32]| block.iter().fold(none, |all, &n| both(all, (n, n)));
    par_map(&blocks, of_block).into_iter().fold(none, both)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_the_items() {
        for count in [0, 1, 2, 1000] {
            let items: Vec<usize> = (0..count).collect();
            let squares = par_map(&items, |&i| i * i);
            assert_eq!(squares, items.iter().map(|i| i * i).collect::<Vec<_>>());
        }
    }

    #[test]
    fn blocks_are_made_in_their_places() {
        for count in [0, 1, 99, 100, 101, 1000] {
            let mut values = vec![0; count];
            let fill = |first: usize, block: &mut [usize]| {
                block.iter_mut().zip(first..).for_each(|(v, i)| *v = i + 7);
                Ok::<(), ()>(())
            };
            fill_blocks(&mut values, 100, fill).unwrap();
            assert!(values.iter().enumerate().all(|(i, &v)| v == i + 7));
        }
    }

    #[test]
    fn min_max_are_of_all_blocks() {
        assert_eq!(min_max(&[]), (u32::MAX, 0));
        let mut numbers: Vec<u32> = (1000..500_000).rev().collect();
        assert_eq!(min_max(&numbers), (1000, 499_999));
        numbers[300_000] = 7;
        *numbers.last_mut().unwrap() = u32::MAX;
        assert_eq!(min_max(&numbers), (7, u32::MAX));
    }

    #[test]
    fn the_first_error_counts() {
        for _ in 0..50 {
            let fail = |first: usize, _: &mut [u8]| if first < 300 { Ok(()) } else { Err(first) };
            assert_eq!(fill_blocks(&mut [0; 1000], 10, fail), Err(300));
        }
    }

    #[test]
    fn a_panic_comes_through() {
        let run = || par_map(&[1, 2, 3, 4], |&i| assert!(i < 4));
        assert!(panic::catch_unwind(run).is_err());
    }
}
