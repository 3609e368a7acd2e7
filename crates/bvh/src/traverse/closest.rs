//! PacketScratch through the scene: the nearest hits.

use crate::blas::Bvh;
use crate::limits::MAX_TRIANGLES;
use crate::node::{LeafNode, NodeRef};
use crate::ray::{Coherence, Hit, INVALID_ID, Ray};
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{InstanceRecord, Scene};
use crate::simd::{F32x4, Isa, Vector};
use crate::traverse::ClosestSink;
use crate::traverse::node_test::NO_PRIM;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::incoherent::intersect_incoherent;
use crate::traverse::packet::soa::{load, load_rays, store, store_masked};
use crate::traverse::packet::tlas::{PacketQuery, PacketScratch};
use crate::traverse::packet::traversal::{LeafVisitor, traverse_packet};
use crate::traverse::packet::{PACKET_SIZE, Packet};
use crate::traverse::single::interleaved::traverse_interleaved;
use crate::traverse::stream::chunker::{
    RayChunk, RayChunker, SINGLE_FLUSH_THRESHOLD, SingleRayQueue, prefetch_all,
};
use crate::traverse::stream::packet_groups::{RayBatch, RayIndices, ray_index};
use crate::traverse::triangle::packet::{LaneIntersections, intersect_lanes};
use crate::traverse::triangle::packet_edges::PotentialHits;

/// Rays of a packet that are fewer than this at a node go on alone.
pub const MIN_PACKET_RAYS: u32 = 5;

/// What the rays of a packet met in a mesh; t stands in the packet.
pub struct PacketHits {
    /// Words in the bits of floats.
    prim_index: [f32; PACKET_SIZE],
    /// Times `det`, until [`PacketHits::normalize_barycentrics`].
    u: [f32; PACKET_SIZE],
    v: [f32; PACKET_SIZE],
    det: [f32; PACKET_SIZE],
}

impl PacketHits {
    pub const MISS: PacketHits = PacketHits {
        prim_index: [f32::from_bits(NO_PRIM); PACKET_SIZE],
        u: [0.0; PACKET_SIZE],
        v: [0.0; PACKET_SIZE],
        det: [1.0; PACKET_SIZE],
    };
}

/// The nearest hits, for any number of rays.
#[inline(always)]
pub fn closest<I: Isa>(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) {
    // Each is compiled by itself: what camera rays do is done faster without the rest.
    match coherence {
        Coherence::Coherent => for_each_chunk::<I, false>(scene, rays, hits, coherence),
        _ => for_each_chunk::<I, true>(scene, rays, hits, coherence),
    }
}

/// The same; `MAY_DIVERGE` where some may run apart.
#[inline(always)]
fn for_each_chunk<I: Isa, const MAY_DIVERGE: bool>(
    scene: &Scene,
    rays: &[Ray],
    hits: &mut [Hit],
    coherence: Coherence,
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
        // What is written soon is cleared when it is taken, not all of a long batch before.
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
        let mut together = ClosestQuery::<MAY_DIVERGE> { chunk, hits };
        packets.trace::<I, _>(&mut together, scene, scaled, None);
        chunks.report_cost(singles.len() - before, std::mem::take(&mut singles.visits));
        if singles.len() >= SINGLE_FLUSH_THRESHOLD {
            let tasks = singles.drain(rays);
            traverse_interleaved::<I, _, false>(scene, &mut ClosestSink { tasks, hits });
        }
    }
    if MAY_DIVERGE || !scene.is_single_mesh {
        hits[cleared..].fill(Hit::MISS);
    }
    if singles.len() > 0 {
        let tasks = singles.drain(rays);
        traverse_interleaved::<I, _, false>(scene, &mut ClosestSink { tasks, hits });
    }
}

/// The nearest hits of the chunk at hand.
struct ClosestQuery<'a, 'b, const MAY_DIVERGE: bool> {
    chunk: RayChunk<'a>,
    /// Of the whole batch.
    hits: &'b mut [Hit],
}

impl<const MAY_DIVERGE: bool> ClosestQuery<'_, '_, MAY_DIVERGE> {
    /// Where in the batch a ray of the chunk is.
    #[inline(always)]
    fn ray_id(&self, number: usize) -> usize {
        self.chunk.ray_ids[number] as usize
    }
}

impl<const MAY_DIVERGE: bool> PacketQuery for ClosestQuery<'_, '_, MAY_DIVERGE> {
    #[inline(always)]
    fn make_packet<I: Isa>(
        &self,
        rays: &[Ray],
        instance: Option<&InstanceRecord>,
        packet: &mut Packet,
    ) -> bool {
        self.chunk
            .make_packet::<I>(rays, instance, Apex::Origin, packet)
    }

    #[inline(always)]
    fn to_instance_space(&self, ray: &Ray, number: usize, instance: &InstanceRecord) -> Ray {
        let mut ray = *ray;
        ray.clip_t_max(self.hits[self.ray_id(number)].t);
        instance.ray_to_mesh(&ray)
    }

    #[inline(always)]
    fn t_max(&self, number: usize, t_max: f32) -> f32 {
        t_max.min(self.hits[self.ray_id(number)].t)
    }

    #[inline(always)]
    fn trace_single<I: Isa>(
        &mut self,
        lanes: u64,
        subtree: Option<&SubtreeRef>,
        indices: RayIndices,
    ) {
        if !MAY_DIVERGE && self.chunk.scene.is_single_mesh {
            for lane in (0..PACKET_SIZE as u32).filter(|lane| lanes >> lane & 1 != 0) {
                let at = self.ray_id(ray_index(lane, indices));
                self.hits[at] = Hit::MISS;
            }
        }
        self.chunk.queue_singles(lanes, subtree, indices);
    }

    #[inline(always)]
    fn intersect_subtree<I: Isa>(
        &mut self,
        subtree: &SubtreeRef,
        packet: &mut Packet,
        indices: RayIndices,
    ) {
        let mesh = &*self.chunk.scene.instances[subtree.instance as usize].bvh;
        let mut nearest = PacketHits::MISS;
        if MAY_DIVERGE && self.chunk.coherence == Coherence::Incoherent {
            let handoff = intersect_incoherent::<I>(mesh, subtree.node, packet, &mut nearest);
            self.chunk.singles.visits += handoff.visits;
            let mut left = handoff.single_mask;
            while left != 0 {
                let lane = left.trailing_zeros() as usize & (PACKET_SIZE - 1);
                left &= left - 1;
                self.chunk.queue_singles_at(
                    1 << lane,
                    subtree.instance,
                    handoff.start_node[lane],
                    indices,
                );
            }
        } else {
            intersect_subtree::<I>(mesh, subtree.node, packet, &mut nearest);
        }
        nearest.normalize_barycentrics::<I>();
        let first = self.chunk.ray_ids[0] as usize;
        if !MAY_DIVERGE
            && self.chunk.scene.is_single_mesh
            && indices.is_none()
            && let Ok(hits) = (&mut self.hits[first..][..self.chunk.ray_ids.len()]).try_into()
        {
            nearest.scatter_hits::<I>(mesh, subtree.instance, packet, hits);
            return;
        }
        for lane in 0..packet.active.count_ones() {
            let i = lane as usize & (PACKET_SIZE - 1);
            let prim = nearest.prim_index[i].to_bits();
            let mut hit = Hit::MISS;
            if prim != NO_PRIM {
                hit = Hit {
                    t: packet.t_max[i],
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
                known.keep_closer(hit);
            }
        }
    }
}

impl InstanceRecord {
    /// A ray of the scene in the coordinates of the mesh's tree, by the arithmetic that single rays go through.
    #[inline(always)]
    pub fn ray_to_mesh(&self, ray: &Ray) -> Ray {
        let m = &self.mesh_from_scene;
        let rotated =
            |v: [f32; 3], row: usize| m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2];
        let (o, d) = (ray.origin, ray.direction);
        Ray {
            origin: [
                rotated(o, 0) + m[0][3],
                rotated(o, 1) + m[1][3],
                rotated(o, 2) + m[2][3],
            ],
            direction: [rotated(d, 0), rotated(d, 1), rotated(d, 2)],
            t_max: ray.t_max,
        }
    }
}

#[inline(always)]
fn intersect_subtree<I: Isa>(
    mesh: &Bvh,
    start: NodeRef,
    packet: &mut Packet,
    nearest: &mut PacketHits,
) {
    let mut potential = PotentialHits::EMPTY;
    traverse_packet::<I, _>(
        mesh,
        start,
        packet,
        ClosestLeafVisitor {
            mesh,
            nearest,
            potential: &mut potential,
        },
    );
}

/// The nearest hits in the leaves of a mesh.
struct ClosestLeafVisitor<'a> {
    mesh: &'a Bvh,
    nearest: &'a mut PacketHits,
    potential: &'a mut PotentialHits,
}

impl LeafVisitor for ClosestLeafVisitor<'_> {
    #[inline(always)]
    fn visit_leaf<I: Isa>(&mut self, leaf: &LeafNode, active: u64, packet: &mut Packet) -> u64 {
        closest_in_leaf::<I, true>(
            self.mesh,
            leaf,
            active,
            packet,
            self.nearest,
            self.potential,
        )
    }
}

/// The rays for which anything was found. `COMMON_ORIGIN` as in [`PotentialHits::find`].
#[inline(always)]
pub fn closest_in_leaf<I: Isa, const COMMON_ORIGIN: bool>(
    mesh: &Bvh,
    leaf: &LeafNode,
    active: u64,
    packet: &mut Packet,
    nearest: &mut PacketHits,
    potential: &mut PotentialHits,
) -> u64 {
    let mut closer = 0;
    potential.test_edges::<I, COMMON_ORIGIN>(leaf, active, packet);
    while potential.hit_mask != 0 {
        let mut groups = potential.active_groups::<I>();
        while groups != 0 {
            let group = groups.trailing_zeros() as usize;
            groups &= groups - 1;
            let met = intersect_lanes::<I, false>(leaf, packet, group, potential);
            let first = nearest.merge::<I>(mesh, leaf, met, group, packet);
            closer |= u64::from(first) << (I::RAY_LANES * group);
        }
        potential.next_triangle();
    }
    if closer != 0 {
        mesh.prefetch_prim_id::<I>(leaf.first_prim);
    }
    closer
}

const _: () = assert!(MAX_TRIANGLES < f32::INFINITY.to_bits() as usize);

impl PacketHits {
    /// Makes u and v what they are, once all has been met.
    #[inline(always)]
    fn normalize_barycentrics<I: Isa>(&mut self) {
        for group in 0..PACKET_SIZE / 16 {
            let det = load::<I>(&self.det, group);
            let u = load::<I>(&self.u, group).div(det);
            let v = load::<I>(&self.v, group).div(det);
            store::<I>(&mut self.u, group, u);
            store::<I>(&mut self.v, group, v);
        }
    }

    /// Writes the hits of a full packet, each in its lane: four at a time, and without a branch, for where rays miss is
    /// anybody's guess.
    #[inline(always)]
    fn scatter_hits<I: Isa>(
        &self,
        mesh: &Bvh,
        instance: u32,
        packet: &Packet,
        hits: &mut [Hit; PACKET_SIZE],
    ) {
        let (mut t, mut instances) = ([0.0; PACKET_SIZE], [0.0; PACKET_SIZE]);
        let [far, here, nowhere] = [
            f32::INFINITY,
            f32::from_bits(instance),
            f32::from_bits(INVALID_ID),
        ]
        .map(I::F32x16::splat);
        for group in 0..PACKET_SIZE / 16 {
            let prim = load::<I>(&self.prim_index, group);
            // As a float, `NO_PRIM` is NaN, and no other is: there are too few triangles.
            let met = prim.eq(prim);
            let known = load::<I>(&packet.t_max, group);
            store::<I>(&mut t, group, I::F32x16::select(met, known, far));
            store::<I>(&mut instances, group, I::F32x16::select(met, here, nowhere));
        }
        for (four, hits) in hits.chunks_exact_mut(4).enumerate() {
            let columns = [&t, &self.u, &self.v, &instances];
            let columns = columns.map(|row| F32x4::new(std::array::from_fn(|i| row[4 * four + i])));
            let rows = F32x4::transpose(columns);
            for (i, (hit, row)) in hits.iter_mut().zip(rows).enumerate() {
                // SAFETY: a hit begins with t, u, v and the instance, four words.
                unsafe { (&raw mut *hit).cast::<[f32; 4]>().write(row.array()) };
                // All bits of what is nothing are set.
                let prim = self.prim_index[4 * four + i].to_bits();
                let missed = u32::from(prim == NO_PRIM).wrapping_neg();
                hit.triangle = mesh.prim_id(prim & !missed) | missed;
            }
        }
    }

    /// Takes what rays of a group met, where it comes first by (t, id); returns the lanes where it does.
    #[inline(always)]
    fn merge<I: Isa>(
        &mut self,
        mesh: &Bvh,
        leaf: &LeafNode,
        met: LaneIntersections<I::RayVec>,
        group: usize,
        packet: &mut Packet,
    ) -> u32 {
        let LaneIntersections {
            hit, t, u, v, det, ..
        } = met;
        let known = load_rays::<I>(&packet.t_max, group);
        let prim = I::add_u32_bits(met.triangle, leaf.first_prim);
        let ties = <I::RayVec as Vector>::to_bitmask(t.eq(known)) & hit;
        let mut first = hit & !ties;
        if ties != 0 {
            first |= self.resolve_ties::<I>(mesh, prim, group, ties);
        }
        let lanes = <I::RayVec as Vector>::from_bitmask(first);
        store_masked::<I>(&mut packet.t_max, group, lanes, t);
        store_masked::<I>(&mut self.u, group, lanes, u);
        store_masked::<I>(&mut self.v, group, lanes, v);
        store_masked::<I>(&mut self.det, group, lanes, det);
        store_masked::<I>(&mut self.prim_index, group, lanes, prim);
        first
    }

    /// Of lanes whose t is the one that is known those that come first by their id, or because nothing was met there.
    #[cold]
    #[inline(never)]
    fn resolve_ties<I: Isa>(&self, mesh: &Bvh, prim: I::RayVec, group: usize, ties: u32) -> u32 {
        let mut prims = [0u32; 16];
        // SAFETY: the array holds at least as many words, which as floats are only moved.
        unsafe { prim.store(prims.as_mut_ptr().cast()) };
        (0..16)
            .filter(|lane| ties >> lane & 1 != 0)
            .filter(|lane| {
                let known = self.prim_index[I::RAY_LANES * group + lane].to_bits();
                known == NO_PRIM || mesh.prim_id(prims[*lane]) < mesh.prim_id(known)
            })
            .fold(0, |lanes, lane| lanes | 1 << lane)
    }
}
