//! Rays that run apart, where many of them do: those that head the same way make packets, though they start anywhere.
//!
//! Boxes are then tested for every ray, and rays go on alone where few are left: that pays near the root of any tree, and in
//! all of a small one.

use crate::ray::Ray;
use crate::simd::Isa;
use crate::traverse::packet::SIZE;
use crate::traverse::stream::backoff::Backoff;
use crate::traverse::stream::packet_groups::{HEADINGS, ODD, headings};

/// The most rays that are sorted at a time.
pub const BLOCK: usize = 2048;

/// How many of a batch are sorted at first, to see whether that pays.
const FIRST: usize = 1024;

/// Rays that head the same way are traced alone where they are fewer.
const ENOUGH: usize = 16;

/// After so many rays it is seen whether packets pay: not if they visit more nodes and leaves than so many for each ray
/// that need not go on alone.
const TRIAL: usize = 4 * SIZE;
const MOST_VISITS: usize = 1;

/// A block of rays in the order of where they head, of which some have been taken.
pub struct Headed<'a> {
    order: Vec<u32>,
    /// Where each heading ends in it.
    ends: [usize; HEADINGS],
    taken: usize,
    /// Those taken last.
    some: Vec<Ray>,
    /// How many of the block were taken to be packets, how often one of these went on alone, and the nodes and leaves that
    /// the packets visited.
    packed: usize,
    alone: usize,
    visits: usize,
    /// Whether packets paid the last time.
    pays: bool,
    skip: &'a Backoff,
}

impl<'a> Headed<'a> {
    /// No block yet.
    #[inline(always)]
    pub fn new(skip: &'a Backoff) -> Self {
        Self {
            order: vec![],
            ends: [0; HEADINGS],
            taken: 0,
            some: vec![],
            packed: 0,
            alone: 0,
            visits: 0,
            pays: false,
            skip,
        }
    }

    /// How many rays the next block should have at most.
    #[inline(always)]
    pub fn most(&self) -> usize {
        if self.pays { BLOCK } else { FIRST }
    }

    /// Takes another block: the rays with these numbers, at most [`BLOCK`]. Nothing is left of the last one. Those that go
    /// on alone are put aside.
    #[inline(always)]
    pub fn set<I: Isa>(&mut self, rays: &[Ray], numbers: &[u32], alone: &mut Vec<u32>) {
        if self.skip.should_skip() {
            alone.extend_from_slice(numbers);
            return;
        }
        self.order.resize(numbers.len(), 0);
        self.taken = 0;
        (self.packed, self.alone, self.visits) = (0, 0, 0);
        let mut ways = [0; BLOCK];
        let ways = &mut ways[..numbers.len()];
        headings::<I>(rays, numbers, ways);
        let mut ends = [0; HEADINGS];
        for way in &*ways {
            ends[usize::from(*way) % HEADINGS] += 1;
        }
        let mut sum = 0;
        for end in &mut ends {
            (*end, sum) = (sum, sum + *end);
        }
        for (way, number) in ways.iter().zip(numbers) {
            let end = &mut ends[usize::from(*way) % HEADINGS];
            self.order[*end] = *number;
            *end += 1;
        }
        self.ends = ends;
    }

    /// Takes up to 64 rays that head the same way; false where there are no more. Those that go on alone are put aside.
    #[inline(always)]
    pub fn advance(&mut self, rays: &[Ray], alone: &mut Vec<u32>) -> bool {
        if self.packed >= TRIAL {
            let answered = self.packed.saturating_sub(self.alone);
            self.pays = self.visits <= MOST_VISITS * answered;
            if !self.pays {
                self.skip.record(false);
                alone.extend_from_slice(&self.order[self.taken..]);
                (self.taken, self.packed) = (self.order.len(), 0);
            }
        }
        while self.taken < self.order.len() {
            let start = self.taken;
            let way = self.ends.iter().take_while(|end| **end <= start).count();
            let end = self.ends[way % HEADINGS];
            if way == usize::from(ODD) || end - start < ENOUGH {
                alone.extend_from_slice(&self.order[start..end]);
                self.taken = end;
                continue;
            }
            self.taken = end.min(start + SIZE);
            let numbers = &self.order[start..self.taken];
            self.packed += numbers.len();
            self.some.clear();
            let some = numbers.iter().map(|number| rays[*number as usize]);
            self.some.extend(some);
            return true;
        }
        if self.packed >= TRIAL {
            self.skip.record(true);
        }
        false
    }

    /// Is told how often one of those taken last went on alone, and what their packets visited.
    #[inline(always)]
    pub fn count(&mut self, alone: usize, visits: usize) {
        self.alone += alone;
        self.visits += visits;
    }

    /// Those taken last, and their numbers.
    #[inline(always)]
    pub fn taken(&self) -> (&[Ray], &[u32]) {
        let numbers = self.taken - self.some.len()..self.taken;
        (&self.some, &self.order[numbers])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;

    /// Rays in all headings, of which each 50th is flat along an axis.
    fn rays(count: usize) -> Vec<Ray> {
        let component = |i: usize, k: usize| match (i + k) % 50 {
            0 if k == 0 => 0.0,
            _ => ((i * 7 + k * 3) as f32).sin(),
        };
        let ray = |i| Ray {
            origin: [0.0; 3],
            direction: [0, 1, 2].map(|k| component(i, k)),
            t_max: i as f32,
        };
        (0..count).map(ray).collect()
    }

    #[test]
    fn every_ray_is_taken_or_goes_on_alone_once() {
        let rays = rays(1500);
        let numbers: Vec<u32> = (0..1500).step_by(2).collect();
        let skip = Backoff::default();
        let (mut headed, mut alone) = (Headed::new(&skip), vec![]);
        headed.set::<Portable>(&rays, &numbers, &mut alone);
        let (mut seen, mut packets) = (vec![], 0);
        while headed.advance(&rays, &mut alone) {
            let (some, numbers) = headed.taken();
            assert!((ENOUGH..=SIZE).contains(&some.len()));
            let signs = |ray: &Ray| ray.direction.map(|d| d < 0.0);
            for (ray, number) in some.iter().zip(numbers) {
                assert_eq!(*ray, rays[*number as usize]);
                assert_eq!(signs(ray), signs(&some[0]));
            }
            seen.extend_from_slice(numbers);
            packets += 1;
        }
        let flat = |number: &u32| rays[*number as usize].direction[0] == 0.0;
        assert!(packets > 5 && !seen.iter().any(flat), "{packets}");
        seen.extend(alone);
        seen.sort();
        assert_eq!(seen, numbers);
    }

    #[test]
    fn packets_that_do_not_pay_are_not_made_again_soon() {
        let rays = rays(1000);
        let numbers: Vec<u32> = (0..1000).collect();
        let packets = |headed: &mut Headed, visits| {
            let (mut alone, mut taken, mut packets) = (vec![], 0, 0);
            headed.set::<Portable>(&rays, &numbers, &mut alone);
            while headed.advance(&rays, &mut alone) {
                taken += headed.taken().0.len();
                headed.count(0, visits * headed.taken().0.len());
                packets += 1;
            }
            assert_eq!(taken + alone.len(), rays.len());
            packets
        };
        let skip = Backoff::default();
        let mut headed = Headed::new(&skip);
        let all = packets(&mut headed, MOST_VISITS);
        assert!(all > 10 && headed.most() == BLOCK, "{all}");
        assert_eq!(packets(&mut headed, MOST_VISITS), all);
        let few = packets(&mut headed, MOST_VISITS + 1);
        assert!(few < all / 2 && headed.most() == FIRST, "{few}");
        assert_eq!(packets(&mut headed, MOST_VISITS), 0);
        assert_eq!(packets(&mut headed, MOST_VISITS), all);
        // Nor in the next batch.
        packets(&mut headed, MOST_VISITS + 1);
        assert_eq!(packets(&mut Headed::new(&skip), MOST_VISITS), 0);
    }
}
