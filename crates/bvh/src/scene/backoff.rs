//! What is not tried again soon where it did not pay.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// One block of rays goes without after one in which it did not pay, twice as many each time that it does not again, and at
/// most so many.
const MAX_SKIPS: u32 = 64;

/// How many blocks of rays go without: in the scene that they run through, as a batch is often shorter than it takes to find
/// out. Threads may count past each other: answers do not depend on it.
#[derive(Debug, Default)]
pub struct Backoff {
    remaining: AtomicU32,
    /// How many there were the last time.
    period: AtomicU32,
}

impl Backoff {
    /// Whether the next block goes without.
    #[inline(always)]
    pub fn should_skip(&self) -> bool {
        let left = self.remaining.load(Relaxed);
        if left > 0 {
            self.remaining.store(left - 1, Relaxed);
        }
        left > 0
    }

    /// Is told whether it paid.
    #[inline(always)]
    pub fn record(&self, pays: bool) {
        let more = match pays {
            true => 0,
            false => (2 * self.period.load(Relaxed)).clamp(1, MAX_SKIPS),
        };
        self.period.store(more, Relaxed);
        self.remaining.store(more, Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_pay_is_tried_less_and_less() {
        let skip = Backoff::default();
        for skipped in [1, 2, 4, 8, 16, 32, 64, 64] {
            assert!(!skip.should_skip());
            skip.record(false);
            for _ in 0..skipped {
                assert!(skip.should_skip());
            }
        }
        assert!(!skip.should_skip());
        skip.record(true);
        assert!(!skip.should_skip());
        skip.record(false);
        assert!(skip.should_skip() && !skip.should_skip());
    }
}
