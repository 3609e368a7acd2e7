//! Traversal of the TLAS by packets. Up to 64 rays become packets of coherent rays; they are regrouped in every
//! instance, because its transform changes their directions.

use crate::node::{NodeRef, node};
use crate::ray::Ray;
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{InstanceRecord, Scene};
use crate::simd::Isa;
use crate::traverse::packet::Packet;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::stack::Stack;
use crate::traverse::stream::packet_groups::{OctantGroups, RayBatch, RayIndices, ray_index};

/// A query that traverses packets. Rays are identified by their index in the chunk; `indices` contains the index of the
/// ray in each lane.
pub trait PacketQuery {
    /// Builds a packet in scaled scene or instance coordinates; returns false if tracing single rays is faster.
    fn make_packet<I: Isa>(&self, rays: &[Ray], instance: Option<&InstanceRecord>, packet: &mut Packet) -> bool;

    /// Transforms a ray to instance coordinates, and clips it at its closest hit.
    fn to_instance_space(&self, ray: &Ray, index: usize, instance: &InstanceRecord) -> Ray;

    /// Maximum valid t of a ray, given its value at the start of the TLAS traversal; negative if the ray is done.
    /// `scale` is the amount of t per unit of length along the ray's major axis.
    fn t_max(&self, index: usize, t_max: f32, scale: f32) -> f32;

    /// Traverses a subtree of an instance by a packet.
    fn intersect_subtree<I: Isa>(&mut self, subtree: &SubtreeRef, packet: &mut Packet, indices: RayIndices);

    /// Hands each ray of a mask to single-ray traversal of a subtree or, without one, of the scene.
    fn trace_single<I: Isa>(&mut self, lanes: u64, subtree: Option<&SubtreeRef>, indices: RayIndices);
}

/// Scratch memory for the packets of a chunk.
pub struct PacketScratch {
    /// A group of rays in scaled scene coordinates.
    scene_rays: RayBatch,
    scene_packet: Packet,
    instance: InstanceScratch,
}

/// Scratch memory in instance coordinates: all rays that enter an instance, and one group of these rays.
struct InstanceScratch {
    local: RayBatch,
    inner: RayBatch,
    packet: Packet,
}

impl PacketScratch {
    pub const EMPTY: PacketScratch = PacketScratch {
        scene_rays: RayBatch::EMPTY,
        scene_packet: Packet::EMPTY,
        instance: InstanceScratch { local: RayBatch::EMPTY, inner: RayBatch::EMPTY, packet: Packet::EMPTY },
    };

    /// Traces rays in scaled scene coordinates; the scene is not empty.
    #[inline(always)]
    pub fn trace<I: Isa, Q: PacketQuery>(&mut self, query: &mut Q, scene: &Scene, rays: &[Ray], indices: RayIndices) {
        let mut groups = OctantGroups::new(rays);
        while let Some((group, pays)) = groups.next() {
            let (some, some_indices) = self.scene_rays.subset(rays, indices, group, groups.is_whole);
            // A single mesh has no TLAS.
            if scene.is_single_mesh || pays && query.make_packet::<I>(some, None, &mut self.scene_packet) {
                let packet = &mut self.scene_packet;
                intersect_tlas::<I, Q>(query, scene, some, some_indices, packet, &mut self.instance);
            } else if groups.is_whole {
                groups.sort(rays);
            } else {
                query.trace_single::<I>(group, None, indices);
            }
        }
    }
}

/// Traverses the TLAS by a packet.
#[inline(always)]
fn intersect_tlas<I: Isa, Q: PacketQuery>(
    query: &mut Q,
    scene: &Scene,
    rays: &[Ray],
    indices: RayIndices,
    packet: &mut Packet,
    instance: &mut InstanceScratch,
) {
    let InstanceScratch { local, inner, packet: mesh_packet } = instance;
    let mut stack = Stack::new();
    let (mut at, mut t_max) = match scene.is_single_mesh {
        true => (NodeRef::leaf(0), 0.0),
        false => (scene.root, packet.max_t::<I>()),
    };
    loop {
        if !at.is_leaf() {
            let node = node(scene.blocks(), at);
            let (mask, enter) = packet.frustum.intersect_children::<I>(node, t_max);
            if mask != 0 {
                at = stack.push::<I>(node, enter, mask);
                continue;
            }
        } else {
            let subtree = &scene.subtree_refs[at.index()];
            let instance = &scene.instances[subtree.instance as usize];
            let mut entered = 0;
            if !scene.is_single_mesh {
                entered = packet.intersect_box::<I>(|row| subtree.bounds.plane(row), packet.active);
                local.gather(rays, indices, entered);
                for (ray, index) in local.rays[..local.len].iter_mut().zip(&local.indices) {
                    *ray = query.to_instance_space(ray, usize::from(*index), instance);
                }
            }
            if scene.is_single_mesh || entered != 0 {
                let (some, some_indices) = match scene.is_single_mesh {
                    true => (rays, indices),
                    false => local.all(),
                };
                intersect_subtree::<I, Q>(query, instance, subtree, some, some_indices, inner, mesh_packet);
            }
            if entered != 0 {
                while entered != 0 {
                    let lane = entered.trailing_zeros();
                    entered &= entered - 1;
                    let i = lane as usize & (PACKET_SIZE - 1);
                    let (t_max, scale) = (packet.t_max[i], packet.shear[2][i]);
                    packet.t_max[i] = query.t_max(ray_index(lane, indices), t_max, scale);
                }
                t_max = packet.max_t::<I>();
            }
        }
        match stack.pop(0, t_max) {
            Some(next) => at = next,
            None => return,
        }
    }
}

/// Traverses a subtree of an instance: one packet, or one per direction class.
#[inline(always)]
fn intersect_subtree<I: Isa, Q: PacketQuery>(
    query: &mut Q,
    instance: &InstanceRecord,
    subtree: &SubtreeRef,
    rays: &[Ray],
    indices: RayIndices,
    inner: &mut RayBatch,
    packet: &mut Packet,
) {
    let mut groups = OctantGroups::new(rays);
    while let Some((lanes, pays)) = groups.next() {
        let (some, some_indices) = inner.subset(rays, indices, lanes, groups.is_whole);
        if pays && query.make_packet::<I>(some, Some(instance), packet) {
            query.intersect_subtree::<I>(subtree, packet, some_indices);
        } else if groups.is_whole {
            groups.sort(rays);
        } else {
            query.trace_single::<I>(lanes, Some(subtree), indices);
        }
    }
}
