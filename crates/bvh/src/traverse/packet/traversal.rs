//! Ordered traversal of a BLAS by a packet of coherent rays. Inner nodes are tested against the frustum only, leaves
//! against each ray.

use crate::blas::Bvh;
use crate::node::{LeafNode, NodeRef, leaf, node};
use crate::simd::Isa;
use crate::traverse::node_test::prefetch_block;
use crate::traverse::packet::Packet;
use crate::traverse::stack::PacketStack;

/// Maximum number of leaves that the frustum enters but no ray enters. After more such leaves, nodes are also tested
/// against each ray, because the geometry is finer than the spacing of the rays.
const MAX_FALSE_LEAVES: u32 = 32;

/// Processes the leaves that a packet visits.
pub trait LeafVisitor {
    /// Intersects the rays `active` with a leaf that they enter; returns the rays whose hit became closer.
    fn visit_leaf<I: Isa>(&mut self, leaf: &LeafNode, active: u64, packet: &mut Packet) -> u64;
}

/// Traverses a subtree, near children first, within the t_max of the packet.
#[inline(always)]
pub fn traverse_packet<I: Isa, L: LeafVisitor>(mesh: &Bvh, start: NodeRef, packet: &mut Packet, mut visitor: L) {
    let blocks = mesh.blocks();
    let mut stack = PacketStack::new();
    let mut t_max = packet.max_t::<I>();
    let (mut at, mut active) = (start, packet.active);
    let (mut hit_mask, mut false_leaves) = (0, 0);
    loop {
        if !at.is_leaf() {
            let node = node(blocks, at);
            let (mut mask, enter) = packet.frustum.intersect_children::<I>(node, t_max);
            let mut entered = [0; 8];
            let mut left = mask;
            while left != 0 {
                let lane = left.trailing_zeros() as usize & 7;
                left &= left - 1;
                let child = node.children[lane];
                if child.is_leaf() || false_leaves > MAX_FALSE_LEAVES {
                    // Most leaves within the frustum are hit by no ray, so they are not prefetched.
                    entered[lane] = packet.intersect_box::<I>(|row| node.bounds[row][lane], packet.active);
                    if entered[lane] == 0 {
                        false_leaves += 1;
                        mask &= !(1 << lane);
                        continue;
                    }
                }
                prefetch_block::<I>(blocks, child);
            }
            if mask != 0 {
                (at, active) = if mask & (mask - 1) == 0 {
                    let lane = mask.trailing_zeros() as usize & 7;
                    (node.children[lane], entered[lane])
                } else {
                    stack.push::<I>(node, enter, mask, &entered)
                };
                continue;
            }
        } else if active != 0 {
            let closer = visitor.visit_leaf::<I>(leaf(blocks, at), active, packet);
            hit_mask |= closer;
            // Until every ray has a hit, the largest t_max does not change.
            if closer != 0 && hit_mask == packet.active {
                t_max = packet.max_t::<I>();
            }
        }
        match stack.pop(t_max) {
            Some((next, rays, enter)) => {
                at = next;
                if at.is_leaf() {
                    active = rays & packet.rays_reaching::<I>(enter);
                }
            }
            None => return,
        }
    }
}
