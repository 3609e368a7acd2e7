//! Parallel loops, with results that do not depend on the number of threads.

use std::convert::Infallible;
use std::panic;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

/// Runs `work` on one thread per core, but on at most `count` threads.
///
/// The threads exist only during the call: a file is read once, and a longer-lived pool would not survive a fork.
fn run_on_threads(count: usize, work: &(dyn Fn() + Sync)) {
    let threads = match count {
        // A single task does not call `available_parallelism`, which opens files.
        0 | 1 => 1,
        count => thread::available_parallelism().map_or(1, |cores| cores.get().min(count)),
    };
    thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        work();
        for other in others {
            other.join().unwrap_or_else(|e| panic::resume_unwind(e));
        }
    });
}

/// Results of `each` for all items, in order.
pub(crate) fn par_map<T: Sync, R: Send>(items: &[T], each: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let mut results: Vec<Option<R>> = items.iter().map(|_| None).collect();
    let Ok(()) = fill_blocks(&mut results, 1, |at, result| {
        result[0] = Some(each(&items[at]));
        Ok::<(), Infallible>(())
    });
    results.into_iter().flatten().collect()
}

/// Fills the blocks of `size` values by `make`, which receives the index of a block's first value.
///
/// New zero pages are first accessed by the thread that fills them.
///
/// # Errors
/// The error of the first block that has one.
pub(crate) fn fill_blocks<T: Send, E: Send>(
    values: &mut [T],
    size: usize,
    make: impl Fn(usize, &mut [T]) -> Result<(), E> + Sync,
) -> Result<(), E> {
    let count = values.len().div_ceil(size);
    let blocks = Mutex::new(values.chunks_mut(size).enumerate());
    let first_error: Mutex<Option<(usize, E)>> = Mutex::new(None);
    run_on_threads(count, &|| {
        loop {
            // Blocks are assigned in order, so that all blocks before a block with an error have been assigned too.
            let Some((number, block)) = lock(&blocks).next() else { break };
            if lock(&first_error).as_ref().is_some_and(|&(failed, _)| failed < number) {
                break;
            }
            if let Err(error) = make(number * size, block) {
                let mut first = lock(&first_error);
                if first.as_ref().is_none_or(|&(failed, _)| number < failed) {
                    *first = Some((number, error));
                }
            }
        }
    });
    let first = first_error.into_inner().unwrap_or_else(PoisonError::into_inner);
    first.map_or(Ok(()), |(_, error)| Err(error))
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Minimum and maximum; `u32::MAX` and 0 if there are no numbers.
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
    fn blocks_are_written_at_their_positions() {
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
    fn min_and_max_cover_all_blocks() {
        assert_eq!(min_max(&[]), (u32::MAX, 0));
        let mut numbers: Vec<u32> = (1000..500_000).rev().collect();
        assert_eq!(min_max(&numbers), (1000, 499_999));
        numbers[300_000] = 7;
        *numbers.last_mut().unwrap() = u32::MAX;
        assert_eq!(min_max(&numbers), (7, u32::MAX));
    }

    #[test]
    fn the_error_of_the_first_block_is_returned() {
        for _ in 0..50 {
            let fail = |first: usize, _: &mut [u8]| if first < 300 { Ok(()) } else { Err(first) };
            assert_eq!(fill_blocks(&mut [0; 1000], 10, fail), Err(300));
        }
    }

    #[test]
    fn panics_are_propagated_to_the_caller() {
        let run = || par_map(&[1, 2, 3, 4], |&i| assert!(i < 4));
        assert!(panic::catch_unwind(run).is_err());
    }
}
