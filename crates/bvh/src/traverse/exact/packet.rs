//! Float64 hits of coherent rays: packets in float32 find the candidates, with the same padding as for a single float64
//! ray.

use crate::blas::Bvh;
use crate::limits::MACHINE_EPSILON;
use crate::node::{LeafNode, NodeRef};
use crate::ray::{ExactHit, ExactRay, Ray};
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{ExactTriangles, InstanceRecord, Scene};
use crate::simd::Isa;
use crate::traverse::exact::clipped_ray::{coordinate_error, to_mesh_space};
use crate::traverse::exact::lane_hits::{LaneDecisions, LaneHits};
use crate::traverse::exact::leaf::{LeafCandidates, classify_triangles, t_range};
use crate::traverse::exact::ray_state::{Decision, ExactRayState};
use crate::traverse::exact::rays::{OriginClass, RaySoa64, origin_error};
use crate::traverse::exact::single::{HitSearch, trace_alone};
use crate::traverse::exact::ties::MarkedHits;
use crate::traverse::exact::triangle::max_f64;
use crate::traverse::packet::Packet;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::packet_ray::PacketRay;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::packet::traversal::{LeafVisitor, traverse_packet};
use crate::traverse::single::interleaved::{RaySource, traverse_interleaved};
use crate::traverse::stream::packet_groups::{RayBatch, RayIndices, ray_index, ray_mask};
use crate::traverse::stream::tlas::{PacketQuery, PacketScratch};

/// Rays within this multiple of the scene's size start at their given origin, so that a common origin is kept.
const MAX_ORIGIN_DISTANCE: f64 = 8.0;

/// Minimum number of rays for packets, because their memory is cleared for each batch.
const MIN_RAYS: usize = 8;

/// Maximum number of chunks that are traced individually before packets are tried again.
const MAX_SKIPPED_CHUNKS: usize = 16;

/// Minimum number of rays per candidate triangle for testing each triangle of a leaf against all rays at once.
const TRANSPOSE_THRESHOLD: u32 = 2;

#[inline(always)]
pub fn closest_exact_batch<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    any_hit: bool,
    answers: MarkedHits,
) {
    if rays.len() < MIN_RAYS {
        return trace_alone::<I>(scene, (rays, 0..rays.len()), triangles, None, any_hit, answers);
    }
    let MarkedHits { hits, marked } = answers;
    let (mut packets, mut near) = (PacketScratch::EMPTY, RayBatch::EMPTY);
    let (mut exact, mut alone) = (RaySoa64::EMPTY, vec![]);
    exact.any_hit = any_hit;
    // `skipped`: number of chunks that are still traced ray by ray. `next_skipped`: that number after the next
    // incoherent chunk.
    let (mut skipped, mut next_skipped) = (0, 1);
    for (chunk, (part, hits)) in rays.chunks(PACKET_SIZE).zip(hits.chunks_mut(PACKET_SIZE)).enumerate() {
        if skipped > 0 {
            skipped -= 1;
            alone.extend((0..part.len()).map(|i| chunk * PACKET_SIZE + i));
            continue;
        }
        let room = (&mut packets, &mut near, &mut exact);
        let left = closest_exact_chunk::<I>(scene, part, triangles, hits, room);
        (skipped, next_skipped) = match left.count_ones() as usize * 4 > part.len() * 3 {
            true => (next_skipped, (2 * next_skipped).min(MAX_SKIPPED_CHUNKS)),
            false => (0, 1),
        };
        let numbers = (0..part.len()).filter(|i| left >> i & 1 != 0);
        alone.extend(numbers.map(|i| chunk * PACKET_SIZE + i));
        if exact.contested != 0 {
            let contested = (0..part.len()).filter(|i| exact.contested >> i & 1 != 0);
            marked.extend(contested.map(|i| (chunk * PACKET_SIZE + i) as u32));
        }
    }
    if !alone.is_empty() {
        trace_alone::<I>(scene, (rays, alone.into_iter()), triangles, None, any_hit, MarkedHits { hits, marked });
    }
}

/// Finds the closest hits of at most 64 rays. Bit i of the result: ray i must be traced individually.
#[inline(always)]
fn closest_exact_chunk<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    hits: &mut [ExactHit],
    (packets, near, exact): (&mut PacketScratch, &mut RayBatch, &mut RaySoa64),
) -> u64 {
    hits.fill(ExactHit::MISS);
    if scene.root == NodeRef::EMPTY {
        return 0;
    }
    exact.load(scene, rays, MAX_ORIGIN_DISTANCE * f64::from(scene.max_abs_coord));
    near.clear();
    let (mut farthest, mut alone) = (0.0f64, 0u64);
    for i in 0..rays.len() {
        match exact.origin_class(i) {
            OriginClass::Misses => {}
            OriginClass::Near => {
                let (ray, largest) = exact.local_ray_f32(i);
                near.push(ray, i);
                farthest = max_f64(farthest, largest);
            }
            OriginClass::Far => alone |= 1 << i,
        }
    }
    if near.len == 0 {
        return alone;
    }
    let (some, indices) = near.all();
    // No indices are needed if every ray is in the lane with its index.
    let indices = indices.filter(|_| some.len() < rays.len());
    let (distance, origin_error) = (farthest as f32, origin_error(scene, farthest));
    let mut query = ExactQuery { scene, triangles, rays: exact, hits, origin_error, distance, alone };
    packets.trace::<I, _>(&mut query, scene, some, indices);
    let alone = query.alone;
    for i in 0..rays.len() {
        if exact.origin_class(i) == OriginClass::Near {
            exact.to_hit(i, &mut hits[i]);
        }
    }
    alone
}

/// The query for the closest hits of the rays of a chunk that start near the scene.
struct ExactQuery<'a> {
    scene: &'a Scene,
    triangles: &'a dyn ExactTriangles,
    rays: &'a mut RaySoa64,
    /// The closest hits so far, by ray index; their t is written at the end.
    hits: &'a mut [ExactHit],
    /// The largest error of an origin, in scaled scene coordinates.
    origin_error: f64,
    distance: f32,
    /// Bit i: ray i must be traced individually through the whole scene.
    alone: u64,
}

impl PacketQuery for ExactQuery<'_> {
    /// Boxes are padded by a fraction of the sum of the rays' distance and the tree's size, so the padding is at least
    /// this fraction of the tree's size.
    #[inline(always)]
    fn make_packet<I: Isa>(&self, rays: &[Ray], record: Option<&InstanceRecord>, packet: &mut Packet) -> bool {
        let (bounds, pad) = match record {
            Some(record) => {
                let off = coordinate_error(self.scene, record, self.distance, self.origin_error);
                (record.bvh.bounds(), off / record.bvh.max_abs_coord())
            }
            None => {
                let bounds = &self.scene.bounds;
                let slack = self.scene.box_padding(self.distance) + self.origin_error as f32;
                (bounds, 2.0 * slack / bounds.max_abs_coord())
            }
        };
        pad.is_finite() && packet.setup::<I>(rays, bounds, pad, Apex::Origin)
    }

    #[inline(always)]
    fn to_instance_space(&self, _: &Ray, number: usize, record: &InstanceRecord) -> Ray {
        let line = self.rays.local_ray_f64(self.scene, number);
        let (origin, direction) = to_mesh_space(self.scene, record, line);
        Ray { origin, direction, t_max: self.rays.t_max_f32(number).next_up() }
    }

    #[inline(always)]
    fn t_max(&self, number: usize, _: f32, _: f32) -> f32 {
        self.rays.t_max_f32(number).next_up()
    }

    #[inline(always)]
    fn trace_single<I: Isa>(&mut self, lanes: u64, subtree: Option<&SubtreeRef>, indices: RayIndices) {
        match subtree {
            Some(subtree) if !self.scene.is_single_mesh => {
                let (scene, triangles) = (self.scene, self.triangles);
                let mut source = SubtreeSource { query: self, subtree, lanes, indices };
                traverse_interleaved::<I, _>(scene, || ExactRayState::idle(triangles), &mut source);
            }
            _ => self.alone |= ray_mask(lanes, indices),
        }
    }

    #[inline(always)]
    fn intersect_subtree<I: Isa>(&mut self, subtree: &SubtreeRef, packet: &mut Packet, indices: RayIndices) {
        let record = &self.scene.instances[subtree.instance as usize];
        let mesh = &*record.bvh;
        let off = coordinate_error(self.scene, record, self.distance, self.origin_error)
            + 8.0 * MACHINE_EPSILON * (packet.max_abs_origin().max(mesh.max_abs_coord()) + mesh.max_abs_coord());
        let mut lanes = LaneHits::new(self.rays.ties(), self.rays.any_hit);
        match indices {
            None => lanes.t = self.rays.t_range,
            Some(indices) => {
                for (i, number) in indices.iter().enumerate() {
                    let number = usize::from(*number) & (PACKET_SIZE - 1);
                    lanes.t[0][i] = self.rays.t_range[0][number];
                    lanes.t[1][i] = self.rays.t_range[1][number];
                }
            }
        }
        let instance = subtree.instance;
        let visitor = ExactLeafVisitor { query: self, mesh, instance, off, indices, lanes: &mut lanes };
        traverse_packet::<I, _>(mesh, subtree.node, packet, visitor);
        let mut left = lanes.pending;
        while left != 0 {
            let lane = left.trailing_zeros();
            left &= left - 1;
            self.commit(mesh, instance, &lanes, lane, indices);
        }
    }
}

/// Source of the rays of a packet that continue alone in a subtree, and sink of their hits.
struct SubtreeSource<'a, 'b, 'c> {
    query: &'a mut ExactQuery<'b>,
    subtree: &'c SubtreeRef,
    lanes: u64,
    indices: RayIndices<'c>,
}

impl<'b, 'd> RaySource<ExactRayState<'b, HitSearch<'d>>> for SubtreeSource<'_, 'b, '_> {
    #[inline(always)]
    fn start(&mut self, state: &mut ExactRayState<'b, HitSearch<'d>>) -> bool {
        while self.lanes != 0 {
            let number = ray_index(self.lanes.trailing_zeros(), self.indices);
            self.lanes &= self.lanes - 1;
            self.query.rays.resolve(number, &mut self.query.hits[number], self.query.triangles);
            let ray = self.query.rays.to_single(self.query.scene, number, &self.query.hits[number]);
            let search = HitSearch::new(ray, number, None);
            if state.begin(self.query.scene, number, search, Some(self.subtree)) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn finish(&mut self, state: &mut ExactRayState<'b, HitSearch<'d>>) {
        if let Some(search) = &mut state.search {
            search.finish(self.query.triangles);
            self.query.rays.commit(state.ray_id, &search.ray, &mut self.query.hits[state.ray_id]);
        }
    }
}

/// Visitor that finds the closest hits of a packet in the leaves of a mesh.
struct ExactLeafVisitor<'a, 'b> {
    query: &'a mut ExactQuery<'b>,
    mesh: &'a Bvh,
    instance: u32,
    /// The error bound of float32 coordinates in the mesh.
    off: f32,
    indices: RayIndices<'a>,
    lanes: &'a mut LaneHits,
}

impl LeafVisitor for ExactLeafVisitor<'_, '_> {
    #[inline(always)]
    fn visit_leaf<I: Isa>(&mut self, leaf: &LeafNode, active: u64, packet: &mut Packet) -> u64 {
        let mut candidates = packet.candidate_triangles_within::<I>(leaf, 4.0 * self.off);
        let mut closer = 0;
        // Large triangles are tested against all rays, because many rays hit each of them. Small triangles are tested
        // only against the rays that may hit them.
        if candidates.count_ones() * TRANSPOSE_THRESHOLD <= active.count_ones() {
            while candidates != 0 {
                let k = candidates.trailing_zeros();
                candidates &= candidates - 1;
                let LaneDecisions { accepted, unknown } =
                    self.lanes.test_triangle::<I>(leaf, k, active, self.off, packet);
                closer |= accepted;
                if unknown != 0 {
                    closer |= self.decide_exactly(leaf.first_prim + k, unknown, packet);
                }
            }
        } else {
            let mut left = active;
            while left != 0 {
                let lane = left.trailing_zeros();
                left &= left - 1;
                closer |= self.visit_ray::<I>(leaf, lane, packet);
            }
        }
        if closer != 0 {
            self.mesh.prefetch_prim_id::<I>(leaf.first_prim);
        }
        closer
    }
}

impl ExactLeafVisitor<'_, '_> {
    /// Tests the triangles of a leaf against one ray; returns the ray's bit if its hit became closer.
    #[inline(always)]
    fn visit_ray<I: Isa>(&mut self, leaf: &LeafNode, lane: u32, packet: &mut Packet) -> u64 {
        let (i, mut closer) = (lane as usize & (PACKET_SIZE - 1), 0);
        let LeafCandidates { near, sure, .. } = classify_triangles::<I>(leaf, PacketRay(packet, i), self.off);
        let mut left = near;
        while left != 0 {
            let k = left.trailing_zeros();
            left &= left - 1;
            let is_sure = sure >> k & 1 != 0;
            let t = t_range(leaf, k as usize, PacketRay(packet, i), self.off, is_sure);
            match self.lanes.decide(i, t, is_sure) {
                Decision::Rejected => {}
                Decision::Accepted => {
                    self.lanes.accept(i, leaf.first_prim + k, t, packet);
                    closer |= 1 << i;
                }
                Decision::Unknown => closer |= self.decide_exactly(leaf.first_prim + k, 1 << i, packet),
            }
        }
        closer
    }

    /// Intersects rays with a triangle in float64; `prim` is its position in the primitive ids. Returns the rays whose
    /// hit became closer.
    #[inline(never)]
    fn decide_exactly(&mut self, prim: u32, mut rays: u64, packet: &mut Packet) -> u64 {
        let Self { ref mut query, mesh, instance, indices, ref mut lanes, .. } = *self;
        let triangle = (instance, mesh.prim_id(prim));
        let corners = query.triangles.corners(instance, triangle.1);
        let mut closer = 0;
        while rays != 0 {
            let lane = rays.trailing_zeros();
            rays &= rays - 1;
            let (i, number) = (lane as usize & (PACKET_SIZE - 1), ray_index(lane, indices));
            if lanes.pending >> i & 1 != 0 {
                query.commit(mesh, instance, lanes, lane, indices);
                lanes.pending &= !(1 << i);
            }
            query.rays.intersect_one(number, corners, triangle, query.hits, query.triangles);
            lanes.t[0][i] = query.rays.t_range[0][number];
            lanes.t[1][i] = query.rays.t_range[1][number];
            closer |= query.clip(lane, packet, indices);
        }
        closer
    }
}

impl ExactQuery<'_> {
    /// Copies the pending hit of a lane to its ray.
    #[inline(always)]
    fn commit(&mut self, mesh: &Bvh, instance: u32, lanes: &LaneHits, lane: u32, indices: RayIndices) {
        let (i, number) = (lane as usize & (PACKET_SIZE - 1), ray_index(lane, indices));
        let triangle = (instance, mesh.prim_id(lanes.prim_index(i)));
        self.rays.set_pending(number, [lanes.t[0][i], lanes.t[1][i]], triangle, &mut self.hits[number]);
    }

    /// Ends a ray of a packet at its closest hit; returns the ray's bit if the ray became shorter.
    #[inline(always)]
    fn clip(&self, lane: u32, packet: &mut Packet, indices: RayIndices) -> u64 {
        let t_max = &mut packet.t_max[lane as usize & (PACKET_SIZE - 1)];
        let limit = self.rays.t_max_f32(ray_index(lane, indices)).next_up();
        let sooner = limit < *t_max;
        *t_max = limit;
        u64::from(sooner) << lane
    }
}
