//! Chunks of 64 rays of a batch, and the queues of rays that leave their packet.

use crate::node::NodeRef;
use crate::ray::{Coherence, Ray};
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{InstanceRecord, Scene};
use crate::simd::Isa;
use crate::traverse::packet::Packet;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::single::ray_state::RayTask;
use crate::traverse::stream::octant_sort::{MAX_BLOCK, OctantSorter};
use crate::traverse::stream::packet_groups::{RayBatch, RayIndices, ray_index};
use crate::traverse::stream::root_cull::{RootCull, TRIAL_RAYS};

/// Number of queued single rays above which the queue is traced.
pub const SINGLE_FLUSH_THRESHOLD: usize = 2048;

/// Rays queued for single-ray traversal.
#[derive(Default)]
pub struct SingleRayQueue {
    subtree_rays: Vec<RayTask>,
    /// Rays that traverse the whole scene, by index in the batch.
    pub full_rays: Vec<u32>,
    /// Number of nodes and leaves that packets have visited.
    pub visits: usize,
}

impl SingleRayQueue {
    /// The number of queued tasks.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.subtree_rays.len() + self.full_rays.len()
    }

    /// Removes all queued tasks.
    #[inline(always)]
    pub fn drain(&mut self, rays: &[Ray]) -> impl Iterator<Item = RayTask> {
        let whole = self.full_rays.drain(..).map(|ray_id| RayTask {
            ray: rays[ray_id as usize],
            ray_id: ray_id as usize,
            instance: 0,
            start_node: NodeRef::EMPTY,
        });
        self.subtree_rays.drain(..).chain(whole)
    }
}

/// A chunk of at most 64 rays, and the queues for rays that leave it.
pub struct RayChunk<'a> {
    pub scene: &'a Scene,
    pub coherence: Coherence,
    pub rays: &'a [Ray],
    /// The rays' indices in the batch.
    pub ray_ids: &'a [u32],
    pub singles: &'a mut SingleRayQueue,
    /// Rays that are incoherent with the chunk, by index in the batch.
    pub incoherent: &'a mut Vec<u32>,
}

impl<'a> RayChunk<'a> {
    /// Queues rays for a subtree or, without one, for the whole scene.
    #[inline(always)]
    pub fn queue_singles(&mut self, lanes: u64, subtree: Option<&SubtreeRef>, indices: RayIndices) {
        match subtree {
            Some(subtree) if !self.scene.is_single_mesh => {
                self.queue_singles_at(lanes, subtree.instance, subtree.node, indices);
            }
            _ => self.defer_incoherent(lanes, indices),
        }
    }

    /// Queues rays for a subtree of an instance.
    #[inline(always)]
    pub fn queue_singles_at(&mut self, mut lanes: u64, instance: u32, start_node: NodeRef, indices: RayIndices) {
        while lanes != 0 {
            let i = ray_index(lanes.trailing_zeros(), indices);
            lanes &= lanes - 1;
            self.singles.subtree_rays.push(RayTask {
                ray: self.rays[i],
                ray_id: self.ray_ids[i] as usize,
                instance,
                start_node,
            });
        }
    }

    /// Queues rays that have not hit anything yet: for the octant sort if the coherence is unknown, otherwise as single
    /// rays.
    #[inline(always)]
    fn defer_incoherent(&mut self, mut lanes: u64, indices: RayIndices) {
        let incoherent = match self.coherence {
            Coherence::Unknown => &mut *self.incoherent,
            Coherence::Coherent | Coherence::Incoherent => &mut self.singles.full_rays,
        };
        while lanes != 0 {
            let i = ray_index(lanes.trailing_zeros(), indices);
            lanes &= lanes - 1;
            incoherent.push(self.ray_ids[i]);
        }
    }

    /// Returns the rays of the chunk in scaled scene coordinates.
    #[inline(always)]
    pub fn scaled<'b>(&self, room: &'b mut RayBatch) -> &'b [Ray]
    where
        'a: 'b,
    {
        if self.scene.scale == 1.0 {
            return self.rays;
        }
        let scale = self.scene.scale as f32;
        room.clear();
        for (i, ray) in self.rays.iter().enumerate() {
            let scaled =
                Ray { origin: ray.origin.map(|x| x * scale), direction: ray.direction.map(|x| x * scale), ..*ray };
            room.push(scaled, i);
        }
        room.all().0
    }

    /// Builds a packet; returns false if tracing single rays is faster. Parallel rays with distant origins, for
    /// example, share their octant but enter different boxes.
    #[inline(always)]
    pub fn make_packet<I: Isa>(
        &self,
        rays: &[Ray],
        instance: Option<&InstanceRecord>,
        apex: Apex,
        packet: &mut Packet,
    ) -> bool {
        let (bounds, pad) = match instance {
            Some(instance) => (instance.bvh.bounds(), 0.0),
            None => {
                let within = |ray: &Ray| self.scene.is_within_reach(ray.origin);
                let (bounds, reach) = (&self.scene.bounds, self.scene.max_abs_coord);
                let pad = self.scene.relative_padding(rays.iter().all(within));
                // The padding of packets is a fraction of the size of `bounds`; the bounds of the meshes may be larger.
                (bounds, pad * (reach / bounds.max_abs_coord()).max(1.0))
            }
        };
        pad.is_finite()
            && packet.setup::<I>(rays, bounds, pad, apex)
            && !(self.coherence == Coherence::Unknown
                && apex == Apex::Origin
                && packet.origin_extent() > bounds.max_abs_coord() / 16.0)
    }
}

/// Splits a batch into chunks: 64 consecutive rays or, in between, packets of the octant sort.
pub struct RayChunker<'a> {
    rays: &'a [Ray],
    coherence: Coherence,
    consumed: usize,
    /// The rays of the current chunk, by index in the batch.
    ray_ids: [u32; PACKET_SIZE],
    len: usize,
    root_cull: RootCull<'a>,
    sorter: OctantSorter<'a>,
    /// True if the current chunk comes from the sorter.
    from_sorter: bool,
}

impl<'a> RayChunker<'a> {
    #[inline(always)]
    pub fn new(scene: &'a Scene, rays: &'a [Ray], coherence: Coherence) -> RayChunker<'a> {
        debug_assert!(u32::try_from(rays.len()).is_ok());
        RayChunker {
            rays,
            coherence,
            consumed: 0,
            ray_ids: [0; PACKET_SIZE],
            len: 0,
            root_cull: RootCull::new(scene),
            sorter: OctantSorter::new(&scene.packet_backoff),
            from_sorter: false,
        }
    }

    /// Advances to the next chunk; returns false at the end. May queue single rays, and appends rays to `incoherent`
    /// for the octant sort.
    #[inline(always)]
    pub fn advance<I: Isa>(&mut self, singles: &mut SingleRayQueue, incoherent: &mut Vec<u32>) -> bool {
        loop {
            self.from_sorter = self.sorter.next_packet(self.rays, &mut singles.full_rays);
            if self.from_sorter {
                return true;
            }
            let left = self.rays.len() - self.consumed;
            if self.coherence == Coherence::Incoherent {
                let most = self.sorter.block_size();
                while self.consumed < self.rays.len() && incoherent.len() + TRIAL_RAYS <= most {
                    let end = self.rays.len().min(self.consumed + TRIAL_RAYS);
                    let from = incoherent.len();
                    incoherent.extend(self.consumed as u32..end as u32);
                    self.root_cull.cull::<I>(self.rays, incoherent, from);
                    self.consumed = end;
                }
            } else if left > 0 && incoherent.len() <= MAX_BLOCK - PACKET_SIZE {
                self.len = left.min(PACKET_SIZE);
                for (i, ray_id) in self.ray_ids[..self.len].iter_mut().enumerate() {
                    *ray_id = (self.consumed + i) as u32;
                }
                self.consumed += self.len;
                self.prefetch::<I>();
                return true;
            }
            if incoherent.is_empty() {
                return false;
            }
            if self.coherence == Coherence::Unknown {
                self.root_cull.cull::<I>(self.rays, incoherent, 0);
            }
            if I::WIDE {
                self.sorter.sort_block::<I>(self.rays, incoherent, &mut singles.full_rays);
            } else {
                singles.full_rays.extend_from_slice(incoherent);
            }
            incoherent.clear();
        }
    }

    /// The number of rays of the batch consumed so far.
    #[inline(always)]
    pub fn consumed(&self) -> usize {
        self.consumed
    }

    /// Prefetches the rays of the next chunk.
    #[inline(always)]
    fn prefetch<I: Isa>(&self) {
        let rays = &self.rays[self.consumed..];
        prefetch_all::<I, _>(&rays[..rays.len().min(PACKET_SIZE)]);
    }

    /// Records the cost of the current chunk: the number of its rays that became single rays, and of visited nodes and
    /// leaves.
    #[inline(always)]
    pub fn report_cost(&mut self, alone: usize, visits: usize) {
        if self.from_sorter {
            self.sorter.report_cost(alone, visits);
        }
    }

    /// Returns the current chunk, with queues for the rays that leave it.
    #[inline(always)]
    pub fn chunk<'b>(
        &'b self,
        scene: &'b Scene,
        singles: &'b mut SingleRayQueue,
        incoherent: &'b mut Vec<u32>,
    ) -> RayChunk<'b> {
        let (rays, ray_ids, coherence) = if self.from_sorter {
            let (rays, ray_ids) = self.sorter.current_packet();
            (rays, ray_ids, Coherence::Incoherent)
        } else {
            let rays = &self.rays[self.consumed - self.len..self.consumed];
            (rays, &self.ray_ids[..self.len], self.coherence)
        };
        RayChunk { scene, coherence, rays, ray_ids, singles, incoherent }
    }
}

/// Prefetches all cache lines of a slice.
#[inline(always)]
pub fn prefetch_all<I: Isa, T>(values: &[T]) {
    for line in 0..size_of_val(values).div_ceil(64) {
        I::prefetch(values.as_ptr().cast::<u8>().wrapping_add(64 * line));
    }
}
