//! Octant sort: a counting sort of incoherent rays by direction class. The rays of a packet may start anywhere.
//!
//! Every ray is tested against every box, and small groups continue as single rays. Such packets are faster than single
//! rays near the root of a tree and, if the tree is small, in the whole tree.

use crate::ray::Ray;
use crate::scene::backoff::Backoff;
use crate::simd::Isa;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::stream::packet_groups::{DIRECTION_CLASSES, UNGROUPED, direction_classes};

/// The maximum number of rays sorted at a time.
pub const MAX_BLOCK: usize = 2048;

/// The number of rays sorted in the first block, as a trial.
const FIRST_BLOCK: usize = 1024;

/// Minimum number of rays of a class for a packet; smaller classes are traced as single rays.
const MIN_PACKET_RAYS: usize = 16;

/// Number of rays traced in packets before their speed is first evaluated. Packets are faster than single rays if they
/// visit at most `MAX_VISITS_PER_RAY` nodes and leaves for each ray that they complete.
const TRIAL_RAYS: usize = 4 * PACKET_SIZE;
const MAX_VISITS_PER_RAY: usize = 1;

/// A block of rays in the order of their direction classes.
pub struct OctantSorter<'a> {
    order: Vec<u32>,
    /// The end of each class in `order`.
    class_ends: [usize; DIRECTION_CLASSES],
    cursor: usize,
    /// The rays of the current packet.
    packet: Vec<Ray>,
    /// Statistics of a block: the number of rays in packets, the number of times that a ray left a packet and became a
    /// single ray, and the number of visited nodes and leaves.
    packet_rays: usize,
    single_count: usize,
    visits: usize,
    /// True if packets were faster in the last trial.
    is_profitable: bool,
    backoff: &'a Backoff,
}

impl<'a> OctantSorter<'a> {
    /// A sorter without rays.
    #[inline(always)]
    pub fn new(backoff: &'a Backoff) -> Self {
        Self {
            order: vec![],
            class_ends: [0; DIRECTION_CLASSES],
            cursor: 0,
            packet: vec![],
            packet_rays: 0,
            single_count: 0,
            visits: 0,
            is_profitable: false,
            backoff,
        }
    }

    /// The maximum size of the next block.
    #[inline(always)]
    pub fn block_size(&self) -> usize {
        if self.is_profitable { MAX_BLOCK } else { FIRST_BLOCK }
    }

    /// Sorts the next block of at most [`MAX_BLOCK`] rays, or queues these rays as single rays during the back-off.
    #[inline(always)]
    pub fn sort_block<I: Isa>(&mut self, rays: &[Ray], ray_ids: &[u32], singles: &mut Vec<u32>) {
        if self.backoff.should_skip() {
            singles.extend_from_slice(ray_ids);
            return;
        }
        self.order.resize(ray_ids.len(), 0);
        self.cursor = 0;
        (self.packet_rays, self.single_count, self.visits) = (0, 0, 0);
        let mut classes = [0; MAX_BLOCK];
        let classes = &mut classes[..ray_ids.len()];
        direction_classes::<I>(rays, ray_ids, classes);
        let mut ends = [0; DIRECTION_CLASSES];
        for class in &*classes {
            ends[usize::from(*class) % DIRECTION_CLASSES] += 1;
        }
        let mut sum = 0;
        for end in &mut ends {
            (*end, sum) = (sum, sum + *end);
        }
        for (class, ray_id) in classes.iter().zip(ray_ids) {
            let end = &mut ends[usize::from(*class) % DIRECTION_CLASSES];
            self.order[*end] = *ray_id;
            *end += 1;
        }
        self.class_ends = ends;
    }

    /// Advances to the next rays of one class, at most 64; returns false at the end. Small classes are queued as single
    /// rays.
    #[inline(always)]
    pub fn next_packet(&mut self, rays: &[Ray], singles: &mut Vec<u32>) -> bool {
        if self.packet_rays >= TRIAL_RAYS {
            let answered = self.packet_rays.saturating_sub(self.single_count);
            self.is_profitable = self.visits <= MAX_VISITS_PER_RAY * answered;
            if !self.is_profitable {
                self.backoff.record(false);
                singles.extend_from_slice(&self.order[self.cursor..]);
                (self.cursor, self.packet_rays) = (self.order.len(), 0);
            }
        }
        while self.cursor < self.order.len() {
            let start = self.cursor;
            let class = self.class_ends.iter().take_while(|end| **end <= start).count();
            let end = self.class_ends[class % DIRECTION_CLASSES];
            if class == usize::from(UNGROUPED) || end - start < MIN_PACKET_RAYS {
                singles.extend_from_slice(&self.order[start..end]);
                self.cursor = end;
                continue;
            }
            self.cursor = end.min(start + PACKET_SIZE);
            let ray_ids = &self.order[start..self.cursor];
            self.packet_rays += ray_ids.len();
            self.packet.clear();
            let some = ray_ids.iter().map(|ray_id| rays[*ray_id as usize]);
            self.packet.extend(some);
            return true;
        }
        if self.packet_rays >= TRIAL_RAYS {
            self.backoff.record(true);
        }
        false
    }

    /// Records the cost of the current packet: the number of its rays that became single rays, and of visited nodes and
    /// leaves.
    #[inline(always)]
    pub fn report_cost(&mut self, singles: usize, visits: usize) {
        self.single_count += singles;
        self.visits += visits;
    }

    /// The rays of the current packet, and their indices in the batch.
    #[inline(always)]
    pub fn current_packet(&self) -> (&[Ray], &[u32]) {
        let ray_ids = self.cursor - self.packet.len()..self.cursor;
        (&self.packet, &self.order[ray_ids])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;

    /// Rays in all direction classes; a few of them are parallel or nearly parallel to a coordinate plane.
    fn rays(count: usize) -> Vec<Ray> {
        let component = |i: usize, k: usize| match (i + k) % 50 {
            0 if k == 0 => 0.0,
            _ => ((i * 7 + k * 3) as f32).sin(),
        };
        let ray = |i| Ray { origin: [0.0; 3], direction: [0, 1, 2].map(|k| component(i, k)), t_max: i as f32 };
        (0..count).map(ray).collect()
    }

    #[test]
    fn rays_are_traced_exactly_once_in_a_packet_or_singly() {
        let rays = rays(1500);
        let ray_ids: Vec<u32> = (0..1500).step_by(2).collect();
        let skip = Backoff::default();
        let (mut sorter, mut singles) = (OctantSorter::new(&skip), vec![]);
        sorter.sort_block::<Portable>(&rays, &ray_ids, &mut singles);
        let (mut seen, mut packets) = (vec![], 0);
        while sorter.next_packet(&rays, &mut singles) {
            let (some, ray_ids) = sorter.current_packet();
            assert!((MIN_PACKET_RAYS..=PACKET_SIZE).contains(&some.len()));
            let signs = |ray: &Ray| ray.direction.map(|d| d < 0.0);
            for (ray, ray_id) in some.iter().zip(ray_ids) {
                assert_eq!(*ray, rays[*ray_id as usize]);
                assert_eq!(signs(ray), signs(&some[0]));
            }
            seen.extend_from_slice(ray_ids);
            packets += 1;
        }
        let flat = |ray_id: &u32| rays[*ray_id as usize].direction[0] == 0.0;
        assert!(packets > 5 && !seen.iter().any(flat), "{packets}");
        seen.extend(singles);
        seen.sort();
        assert_eq!(seen, ray_ids);
    }

    #[test]
    fn unsuccessful_packets_are_not_retried_immediately() {
        let rays = rays(1000);
        let ray_ids: Vec<u32> = (0..1000).collect();
        let packets = |sorter: &mut OctantSorter, visits| {
            let (mut singles, mut taken, mut packets) = (vec![], 0, 0);
            sorter.sort_block::<Portable>(&rays, &ray_ids, &mut singles);
            while sorter.next_packet(&rays, &mut singles) {
                taken += sorter.current_packet().0.len();
                sorter.report_cost(0, visits * sorter.current_packet().0.len());
                packets += 1;
            }
            assert_eq!(taken + singles.len(), rays.len());
            packets
        };
        let skip = Backoff::default();
        let mut sorter = OctantSorter::new(&skip);
        let all = packets(&mut sorter, MAX_VISITS_PER_RAY);
        assert!(all > 10 && sorter.block_size() == MAX_BLOCK, "{all}");
        assert_eq!(packets(&mut sorter, MAX_VISITS_PER_RAY), all);
        let few = packets(&mut sorter, MAX_VISITS_PER_RAY + 1);
        assert!(few < all / 2 && sorter.block_size() == FIRST_BLOCK, "{few}");
        assert_eq!(packets(&mut sorter, MAX_VISITS_PER_RAY), 0);
        assert_eq!(packets(&mut sorter, MAX_VISITS_PER_RAY), all);
        // The next batch, which has a new sorter, skips packets too.
        packets(&mut sorter, MAX_VISITS_PER_RAY + 1);
        assert_eq!(packets(&mut OctantSorter::new(&skip), MAX_VISITS_PER_RAY), 0);
    }
}
