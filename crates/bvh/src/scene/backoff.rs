//! Exponential back-off of a heuristic after blocks in which it was slower.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// The maximum number of blocks skipped in a row. After an unprofitable block, 1, 2, 4 ... blocks are skipped.
const MAX_SKIPS: u32 = 64;

/// Back-off state of a heuristic. The scene stores this state for all batches, because a batch often ends before the
/// heuristic has been evaluated. Races between threads only affect speed.
#[derive(Debug, Default)]
pub struct Backoff {
    remaining: AtomicU32,
    /// Number of blocks that were skipped after the last unprofitable block.
    period: AtomicU32,
}

impl Backoff {
    /// True if the heuristic is to be skipped for the next block; counts the skipped block.
    #[inline(always)]
    pub fn should_skip(&self) -> bool {
        let left = self.remaining.load(Relaxed);
        if left > 0 {
            self.remaining.store(left - 1, Relaxed);
        }
        left > 0
    }

    /// Records whether the heuristic was profitable in a block.
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
    fn unsuccessful_heuristics_are_tried_less_often() {
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
