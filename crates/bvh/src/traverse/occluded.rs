//! Any-hit queries: packets of shadow rays, and interleaved single rays for the rays outside packets.

use crate::node::{LeafNode, NodeRef, leaf, node};
use crate::ray::{Coherence, INVALID_ID, Ray};
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{InstanceRecord, Scene};
use crate::simd::Isa;
use crate::traverse::node_test::prefetch_block;
use crate::traverse::packet::Packet;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::triangle::intersect_lanes;
use crate::traverse::packet::triangle_edges::PotentialHits;
use crate::traverse::single::interleaved::{RaySource, traverse_interleaved};
use crate::traverse::single::ray_state::{RayState, RayTask};
use crate::traverse::stack::MaskStack;
use crate::traverse::stream::chunker::{RayChunk, RayChunker, SINGLE_FLUSH_THRESHOLD, SingleRayQueue};
use crate::traverse::stream::packet_groups::{RayBatch, RayIndices, ray_mask};
use crate::traverse::stream::tlas::{PacketQuery, PacketScratch};

/// Maximum number of nodes and leaves per ray that the packets of a chunk may visit to be faster than single rays. A
/// ray that is handed to single-ray traversal counts as `SINGLE_RAY_COST` visits.
const MAX_VISITS_PER_RAY: usize = 4;
const SINGLE_RAY_COST: usize = 4;

/// If at most this number of a packet's rays enter a node, these rays continue as single rays. Leaves are always tested
/// by the packet.
const MAX_SINGLE_RAYS: u32 = 2;

/// Sets `occluded` to true for every ray of a batch that hits anything, and to false for all other rays.
#[inline(always)]
pub fn occluded<I: Isa>(scene: &Scene, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) {
    occluded.fill(false);
    if scene.root == NodeRef::EMPTY {
        return;
    }
    let (mut packets, mut scaled) = (PacketScratch::EMPTY, RayBatch::EMPTY);
    let (mut singles, mut incoherent) = (SingleRayQueue::default(), Vec::new());
    let mut chunks = RayChunker::new(scene, rays, coherence);
    while chunks.advance::<I>(&mut singles, &mut incoherent) {
        let chunk = chunks.chunk(scene, &mut singles, &mut incoherent);
        let (ray_ids, coherence) = (chunk.ray_ids, chunk.coherence);
        let together = coherence != Coherence::Incoherent;
        let most = MAX_VISITS_PER_RAY * ray_ids.len();
        if together && scene.shadow_packet_backoff.should_skip() {
            chunk.singles.full_rays.extend_from_slice(ray_ids);
        } else {
            let before = chunk.singles.len();
            let scaled = chunk.scaled(&mut scaled);
            let mut query = OcclusionQuery { chunk, occluded: 0 };
            packets.trace::<I, _>(&mut query, scene, scaled, None);
            let met = query.occluded;
            if coherence == Coherence::Incoherent {
                for (i, index) in ray_ids.iter().enumerate() {
                    occluded[*index as usize] = met >> i & 1 != 0;
                }
            } else {
                let first = ray_ids[0] as usize;
                for (i, occluded) in occluded[first..first + ray_ids.len()].iter_mut().enumerate() {
                    *occluded = met >> i & 1 != 0;
                }
            }
            let alone = singles.len() - before;
            let visits = std::mem::take(&mut singles.visits);
            chunks.report_cost(alone, visits);
            if together {
                let pays = visits + SINGLE_RAY_COST * alone <= most;
                scene.shadow_packet_backoff.record(pays);
            }
        }
        if singles.len() >= SINGLE_FLUSH_THRESHOLD {
            let tasks = singles.drain(rays);
            traverse_interleaved::<I, _>(scene, RayState::idle, &mut OcclusionSink { scene, tasks, occluded });
        }
    }
    if singles.len() > 0 {
        let tasks = singles.drain(rays);
        traverse_interleaved::<I, _>(scene, RayState::idle, &mut OcclusionSink { scene, tasks, occluded });
    }
}

/// The query for the occlusion of the rays of one chunk.
struct OcclusionQuery<'a> {
    chunk: RayChunk<'a>,
    /// Bit i: a packet has found that ray i of the chunk is occluded.
    occluded: u64,
}

impl PacketQuery for OcclusionQuery<'_> {
    #[inline(always)]
    fn make_packet<I: Isa>(&self, rays: &[Ray], instance: Option<&InstanceRecord>, packet: &mut Packet) -> bool {
        self.chunk.make_packet::<I>(rays, instance, Apex::choose(rays), packet)
    }

    #[inline(always)]
    fn to_instance_space(&self, ray: &Ray, _number: usize, instance: &InstanceRecord) -> Ray {
        instance.ray_to_mesh(ray)
    }

    #[inline(always)]
    fn t_max(&self, index: usize, t_max: f32, _: f32) -> f32 {
        match self.occluded >> index & 1 {
            0 => t_max,
            _ => -1.0,
        }
    }

    #[inline(always)]
    fn trace_single<I: Isa>(&mut self, lanes: u64, subtree: Option<&SubtreeRef>, indices: RayIndices) {
        self.chunk.queue_singles(lanes, subtree, indices);
    }

    #[inline(always)]
    fn intersect_subtree<I: Isa>(&mut self, subtree: &SubtreeRef, packet: &mut Packet, indices: RayIndices) {
        let mesh = &*self.chunk.scene.instances[subtree.instance as usize].bvh;
        let blocks = mesh.blocks();
        let mut stack = MaskStack::new();
        let mut potential = PotentialHits::EMPTY;
        let t_max = packet.max_t::<I>();
        let mut occluded = 0u64;
        stack.push(subtree.node, packet.active);
        while let Some((at, active)) = stack.pop() {
            let active = active & !occluded;
            self.chunk.singles.visits += 1;
            if active == 0 {
                continue;
            }
            if !at.is_leaf() && active.count_ones() <= MAX_SINGLE_RAYS {
                self.chunk.queue_singles_at(active, subtree.instance, at, indices);
            } else if !at.is_leaf() {
                let node = node(blocks, at);
                let (mut mask, _) = packet.frustum.intersect_children::<I>(node, t_max);
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    let entered = packet.intersect_box::<I>(|row| node.bounds[row][lane], active);
                    if entered != 0 {
                        prefetch_block::<I>(blocks, node.children[lane]);
                        stack.push(node.children[lane], entered);
                    }
                }
            } else {
                occluded |= occluded_in_leaf::<I>(leaf(blocks, at), active, packet, &mut potential);
            }
        }
        self.occluded |= ray_mask(occluded, indices);
    }
}

/// The rays of `active` that a triangle of a leaf occludes.
#[inline(always)]
fn occluded_in_leaf<I: Isa>(leaf: &LeafNode, active: u64, packet: &Packet, potential: &mut PotentialHits) -> u64 {
    let mut occluded = 0;
    potential.test_edges::<I, false>(leaf, active, packet);
    while potential.hit_mask != 0 {
        let mut groups = potential.active_groups::<I>();
        while groups != 0 {
            let group = groups.trailing_zeros() as usize;
            groups &= groups - 1;
            let met = intersect_lanes::<I, true>(leaf, packet, group, potential);
            occluded |= u64::from(met.hit) << (I::RAY_LANES * group);
        }
        potential.next_triangle();
    }
    occluded
}

/// Source and sink of single rays. A ray may arrive as several tasks; the ray is occluded if one of the tasks finds a
/// hit.
struct OcclusionSink<'a, 'b, W> {
    scene: &'a Scene,
    tasks: W,
    occluded: &'b mut [bool],
}

impl<'a, W: Iterator<Item = RayTask>> RaySource<RayState<'a, true>> for OcclusionSink<'a, '_, W> {
    #[inline(always)]
    fn start(&mut self, state: &mut RayState<'a, true>) -> bool {
        for task in &mut self.tasks {
            if !self.occluded[task.ray_id] && state.begin(self.scene, task) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn finish(&mut self, state: &mut RayState<'a, true>) {
        self.occluded[state.ray_id] |= state.hit.instance != INVALID_ID;
    }
}
