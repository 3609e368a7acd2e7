//! Closest-hit queries: packets, and interleaved single rays for the rays outside packets.

use crate::blas::Bvh;
use crate::node::{LeafNode, NodeRef};
use crate::ray::{Coherence, Hit, Ray};
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{InstanceRecord, Scene};
use crate::simd::Isa;
use crate::traverse::near_ties::{t_per_length, widen};
use crate::traverse::packet::Packet;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::hits::{PacketHits, closest_in_leaf};
use crate::traverse::packet::incoherent::intersect_incoherent;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::packet::traversal::{LeafVisitor, traverse_packet};
use crate::traverse::packet::triangle_edges::PotentialHits;
use crate::traverse::single::closest_hit::NO_PRIM;
use crate::traverse::single::interleaved::{RaySource, traverse_interleaved};
use crate::traverse::single::ray_state::{RayState, RayTask};
use crate::traverse::stream::chunker::{RayChunk, RayChunker, SINGLE_FLUSH_THRESHOLD, SingleRayQueue, prefetch_all};
use crate::traverse::stream::packet_groups::{RayBatch, RayIndices, ray_index};
use crate::traverse::stream::tlas::{PacketQuery, PacketScratch};

/// Finds the closest hits of a batch; appends the rays that may have hit coplanar surfaces of two instances to
/// `marked`.
#[inline(always)]
pub fn closest<I: Isa>(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence, marked: &mut Vec<u32>) {
    // The generic function is compiled twice, because the version for coherent rays is faster without the code for
    // incoherent rays.
    match coherence {
        Coherence::Coherent => for_each_chunk::<I, false>(scene, rays, hits, coherence, marked),
        _ => for_each_chunk::<I, true>(scene, rays, hits, coherence, marked),
    }
}

/// Finds the closest hits, chunk by chunk. `MAY_DIVERGE` is true if some rays may be incoherent.
#[inline(always)]
fn for_each_chunk<I: Isa, const MAY_DIVERGE: bool>(
    scene: &Scene,
    rays: &[Ray],
    hits: &mut [Hit],
    coherence: Coherence,
    marked: &mut Vec<u32>,
) {
    if scene.root == NodeRef::EMPTY {
        hits.fill(Hit::MISS);
        return;
    }
    let (mut packets, mut scaled) = (PacketScratch::EMPTY, RayBatch::EMPTY);
    let (mut singles, mut incoherent) = (SingleRayQueue::default(), Vec::new());
    let mut chunks = RayChunker::new(scene, rays, coherence);
    let mut cleared = 0;
    while chunks.advance::<I>(&mut singles, &mut incoherent) {
        // The hits of a chunk are cleared just before they are written, while they are in the cache.
        if MAY_DIVERGE || !scene.is_single_mesh {
            hits[cleared..chunks.consumed()].fill(Hit::MISS);
            cleared = chunks.consumed();
        }
        let chunk = chunks.chunk(scene, &mut singles, &mut incoherent);
        if !MAY_DIVERGE {
            prefetch_all::<I, _>(&hits[chunk.ray_ids[0] as usize..][..chunk.ray_ids.len()]);
        }
        let before = chunk.singles.len();
        let scaled = chunk.scaled(&mut scaled);
        let mut query = ClosestQuery::<MAY_DIVERGE> { chunk, hits, marked };
        packets.trace::<I, _>(&mut query, scene, scaled, None);
        chunks.report_cost(singles.len() - before, std::mem::take(&mut singles.visits));
        if singles.len() >= SINGLE_FLUSH_THRESHOLD {
            let tasks = singles.drain(rays);
            traverse_interleaved::<I, _>(scene, RayState::idle, &mut ClosestSink { scene, tasks, hits, marked });
        }
    }
    if MAY_DIVERGE || !scene.is_single_mesh {
        hits[cleared..].fill(Hit::MISS);
    }
    if singles.len() > 0 {
        let tasks = singles.drain(rays);
        traverse_interleaved::<I, _>(scene, RayState::idle, &mut ClosestSink { scene, tasks, hits, marked });
    }
}

/// The query for the closest hits of one chunk of rays.
struct ClosestQuery<'a, 'b, const MAY_DIVERGE: bool> {
    chunk: RayChunk<'a>,
    /// The hits of the batch.
    hits: &'b mut [Hit],
    /// Rays that may have hit coplanar surfaces of two instances.
    marked: &'b mut Vec<u32>,
}

impl<const MAY_DIVERGE: bool> ClosestQuery<'_, '_, MAY_DIVERGE> {
    /// Converts the index of a ray in the chunk to its index in the batch.
    #[inline(always)]
    fn ray_id(&self, index: usize) -> usize {
        self.chunk.ray_ids[index] as usize
    }
}

impl<const MAY_DIVERGE: bool> PacketQuery for ClosestQuery<'_, '_, MAY_DIVERGE> {
    #[inline(always)]
    fn make_packet<I: Isa>(&self, rays: &[Ray], instance: Option<&InstanceRecord>, packet: &mut Packet) -> bool {
        let scene = self.chunk.scene;
        packet.tie_width = instance.map_or(scene.near_tie_width(), |instance| scene.near_tie_width_in(instance));
        self.chunk.make_packet::<I>(rays, instance, Apex::Origin, packet)
    }

    #[inline(always)]
    fn to_instance_space(&self, ray: &Ray, index: usize, instance: &InstanceRecord) -> Ray {
        let mut ray = *ray;
        let absolute = self.chunk.scene.near_tie_width() * t_per_length(&ray);
        ray.clip_t_max(widen(self.hits[self.ray_id(index)].t, absolute));
        instance.ray_to_mesh(&ray)
    }

    #[inline(always)]
    fn t_max(&self, index: usize, t_max: f32, scale: f32) -> f32 {
        let absolute = self.chunk.scene.near_tie_width() * scale.abs();
        t_max.min(widen(self.hits[self.ray_id(index)].t, absolute))
    }

    #[inline(always)]
    fn trace_single<I: Isa>(&mut self, lanes: u64, subtree: Option<&SubtreeRef>, indices: RayIndices) {
        if !MAY_DIVERGE && self.chunk.scene.is_single_mesh {
            for lane in (0..PACKET_SIZE as u32).filter(|lane| lanes >> lane & 1 != 0) {
                let at = self.ray_id(ray_index(lane, indices));
                self.hits[at] = Hit::MISS;
            }
        }
        self.chunk.queue_singles(lanes, subtree, indices);
    }

    #[inline(always)]
    fn intersect_subtree<I: Isa>(&mut self, subtree: &SubtreeRef, packet: &mut Packet, indices: RayIndices) {
        let scene = self.chunk.scene;
        let mesh = &*scene.instances[subtree.instance as usize].bvh;
        let mut nearest = PacketHits::new(scene.mesh_ranges.as_ref());
        if MAY_DIVERGE && self.chunk.coherence == Coherence::Incoherent {
            let handoff = intersect_incoherent::<I>(mesh, subtree.node, packet, &mut nearest);
            self.chunk.singles.visits += handoff.visits;
            let mut left = handoff.single_mask;
            while left != 0 {
                let lane = left.trailing_zeros() as usize & (PACKET_SIZE - 1);
                left &= left - 1;
                self.chunk.queue_singles_at(1 << lane, subtree.instance, handoff.start_node[lane], indices);
            }
        } else {
            intersect_subtree::<I>(mesh, subtree.node, packet, &mut nearest);
        }
        nearest.normalize_barycentrics::<I>();
        let mut contested = nearest.contested;
        while contested != 0 {
            let id = self.ray_id(ray_index(contested.trailing_zeros(), indices));
            self.marked.push(id as u32);
            contested &= contested - 1;
        }
        let first = self.chunk.ray_ids[0] as usize;
        if !MAY_DIVERGE
            && self.chunk.scene.is_single_mesh
            && indices.is_none()
            && let Ok(hits) = (&mut self.hits[first..][..self.chunk.ray_ids.len()]).try_into()
        {
            nearest.scatter_hits::<I>(mesh, subtree.instance, hits);
            return;
        }
        for lane in 0..packet.active.count_ones() {
            let i = lane as usize & (PACKET_SIZE - 1);
            let prim = nearest.prim_index[i].to_bits();
            let mut hit = Hit::MISS;
            if prim != NO_PRIM {
                hit = Hit {
                    t: nearest.t[i],
                    u: nearest.u[i],
                    v: nearest.v[i],
                    instance: subtree.instance,
                    triangle: mesh.prim_id(prim),
                };
            }
            let at = self.ray_id(ray_index(lane, indices));
            let known = &mut self.hits[at];
            if !MAY_DIVERGE && self.chunk.scene.is_single_mesh {
                *known = hit;
            } else if prim != NO_PRIM {
                let absolute = packet.tie_width * packet.shear[2][i].abs();
                if scene.keep_closer(known, hit, absolute) {
                    self.marked.push(at as u32);
                }
            }
        }
    }
}

impl InstanceRecord {
    /// Transforms a ray of the scene to tree coordinates of the mesh, with the same arithmetic as for single rays.
    #[inline(always)]
    pub fn ray_to_mesh(&self, ray: &Ray) -> Ray {
        let m = &self.mesh_from_scene;
        let rotated = |v: [f32; 3], row: usize| m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2];
        let (o, d) = (ray.origin, ray.direction);
        Ray {
            origin: [rotated(o, 0) + m[0][3], rotated(o, 1) + m[1][3], rotated(o, 2) + m[2][3]],
            direction: [rotated(d, 0), rotated(d, 1), rotated(d, 2)],
            t_max: ray.t_max,
        }
    }
}

#[inline(always)]
fn intersect_subtree<I: Isa>(mesh: &Bvh, start: NodeRef, packet: &mut Packet, nearest: &mut PacketHits) {
    let mut potential = PotentialHits::EMPTY;
    traverse_packet::<I, _>(mesh, start, packet, ClosestLeafVisitor { mesh, nearest, potential: &mut potential });
}

/// Finds the closest hits in the leaves of a mesh.
struct ClosestLeafVisitor<'a, 'r> {
    mesh: &'a Bvh,
    nearest: &'a mut PacketHits<'r>,
    potential: &'a mut PotentialHits,
}

impl LeafVisitor for ClosestLeafVisitor<'_, '_> {
    #[inline(always)]
    fn visit_leaf<I: Isa>(&mut self, leaf: &LeafNode, active: u64, packet: &mut Packet) -> u64 {
        closest_in_leaf::<I, true>(self.mesh, leaf, active, packet, self.nearest, self.potential)
    }
}

/// Source and sink of single rays. A ray may arrive as several tasks, one per subtree; the closest hit of all these
/// tasks counts.
struct ClosestSink<'a, 'b, W> {
    scene: &'a Scene,
    tasks: W,
    hits: &'b mut [Hit],
    marked: &'b mut Vec<u32>,
}

impl<'a, W: Iterator<Item = RayTask>> RaySource<RayState<'a, false>> for ClosestSink<'a, '_, W> {
    #[inline(always)]
    fn start(&mut self, state: &mut RayState<'a, false>) -> bool {
        for mut task in &mut self.tasks {
            let absolute = self.scene.outer_near_tie_width(&task.ray);
            task.ray.clip_t_max(widen(self.hits[task.ray_id].t, absolute));
            if state.begin(self.scene, task) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn finish(&mut self, state: &mut RayState<'a, false>) {
        let absolute = self.scene.outer_near_tie_width(&state.world_ray);
        let is_tied = self.scene.keep_closer(&mut self.hits[state.ray_id], state.hit, absolute);
        if is_tied || state.contested {
            self.marked.push(state.ray_id as u32);
        }
    }
}
