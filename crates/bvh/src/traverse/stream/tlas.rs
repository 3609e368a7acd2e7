//! From up to 64 rays to packets of those that run groups: through the tree over instances, and in each instance anew,
//! because there they run elsewhere. What is asked for is a [`PacketQuery`].

use crate::node::{NodeRef, node};
use crate::ray::Ray;
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{InstanceRecord, Scene};
use crate::simd::Isa;
use crate::traverse::packet::Packet;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::stack::Stack;
use crate::traverse::stream::packet_groups::{OctantGroups, RayBatch, RayIndices, ray_index};

/// What rays are asked for. They are known by their number in the chunk; `indices` says which numbers those at hand have.
pub trait PacketQuery {
    /// Makes rays a packet, in scaled scene coordinates or in those of a placed mesh; false where it may not pay.
    fn make_packet<I: Isa>(
        &self,
        rays: &[Ray],
        placed: Option<&InstanceRecord>,
        packet: &mut Packet,
    ) -> bool;

    /// A ray in the coordinates of a placed mesh, no longer than it is of interest by now.
    fn to_instance_space(&self, ray: &Ray, number: usize, placed: &InstanceRecord) -> Ray;

    /// The t up to which a ray that was of interest up to `t_max` still is; below 0 for none.
    fn t_max(&self, number: usize, t_max: f32) -> f32;

    /// Takes a packet through a part of a mesh.
    fn intersect_subtree<I: Isa>(
        &mut self,
        subtree: &SubtreeRef,
        packet: &mut Packet,
        indices: RayIndices,
    );

    /// Takes each ray of a mask by itself through a part or, without one, through everything.
    fn trace_single<I: Isa>(
        &mut self,
        lanes: u64,
        subtree: Option<&SubtreeRef>,
        indices: RayIndices,
    );
}

/// Room for the packets of a chunk.
pub struct PacketScratch {
    /// In scaled scene coordinates: those that run groups.
    scene_rays: RayBatch,
    scene_packet: Packet,
    instance: InstanceScratch,
}

/// The same in the coordinates of a mesh: all that enter an instance, and those of them that run groups.
struct InstanceScratch {
    local: RayBatch,
    inner: RayBatch,
    packet: Packet,
}

impl PacketScratch {
    pub const EMPTY: PacketScratch = PacketScratch {
        scene_rays: RayBatch::EMPTY,
        scene_packet: Packet::EMPTY,
        instance: InstanceScratch {
            local: RayBatch::EMPTY,
            inner: RayBatch::EMPTY,
            packet: Packet::EMPTY,
        },
    };

    /// Asks for rays in scaled scene coordinates; the scene is not empty.
    #[inline(always)]
    pub fn trace<I: Isa, Q: PacketQuery>(
        &mut self,
        query: &mut Q,
        scene: &Scene,
        rays: &[Ray],
        indices: RayIndices,
    ) {
        let mut groups = OctantGroups::new(rays);
        while let Some((group, pays)) = groups.next() {
            let (some, some_indices) =
                self.scene_rays
                    .subset(rays, indices, group, groups.is_whole);
            // Nothing is above the only mesh.
            if scene.is_single_mesh
                || pays && query.make_packet::<I>(some, None, &mut self.scene_packet)
            {
                let packet = &mut self.scene_packet;
                intersect_tlas::<I, Q>(
                    query,
                    scene,
                    some,
                    some_indices,
                    packet,
                    &mut self.instance,
                );
            } else if groups.is_whole {
                groups.sort(rays);
            } else {
                query.trace_single::<I>(group, None, indices);
            }
        }
    }
}

/// Through the tree over instances.
#[inline(always)]
fn intersect_tlas<I: Isa, Q: PacketQuery>(
    query: &mut Q,
    scene: &Scene,
    rays: &[Ray],
    indices: RayIndices,
    packet: &mut Packet,
    instance: &mut InstanceScratch,
) {
    let InstanceScratch {
        local,
        inner,
        packet: mesh_packet,
    } = instance;
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
            let placed = &scene.instances[subtree.instance as usize];
            let mut entered = 0;
            if !scene.is_single_mesh {
                entered = packet.intersect_box::<I>(|row| subtree.bounds.plane(row), packet.active);
                local.gather(rays, indices, entered);
                for (ray, number) in local.rays[..local.len].iter_mut().zip(&local.indices) {
                    *ray = query.to_instance_space(ray, usize::from(*number), placed);
                }
            }
            if scene.is_single_mesh || entered != 0 {
                let (some, some_indices) = match scene.is_single_mesh {
                    true => (rays, indices),
                    false => local.all(),
                };
                intersect_subtree::<I, Q>(
                    query,
                    placed,
                    subtree,
                    some,
                    some_indices,
                    inner,
                    mesh_packet,
                );
            }
            if entered != 0 {
                while entered != 0 {
                    let lane = entered.trailing_zeros();
                    entered &= entered - 1;
                    let t_max = &mut packet.t_max[lane as usize & (PACKET_SIZE - 1)];
                    *t_max = query.t_max(ray_index(lane, indices), *t_max);
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

/// Through a part of a mesh, for rays in its coordinates: as one packet, or one for each heading.
#[inline(always)]
fn intersect_subtree<I: Isa, Q: PacketQuery>(
    query: &mut Q,
    placed: &InstanceRecord,
    subtree: &SubtreeRef,
    rays: &[Ray],
    indices: RayIndices,
    inner: &mut RayBatch,
    packet: &mut Packet,
) {
    let mut groups = OctantGroups::new(rays);
    while let Some((lanes, pays)) = groups.next() {
        let (some, some_indices) = inner.subset(rays, indices, lanes, groups.is_whole);
        if pays && query.make_packet::<I>(some, Some(placed), packet) {
            query.intersect_subtree::<I>(subtree, packet, some_indices);
        } else if groups.is_whole {
            groups.sort(rays);
        } else {
            query.trace_single::<I>(lanes, Some(subtree), indices);
        }
    }
}
