//! A packet through a mesh, from one leaf that its rays enter to the next.

use crate::blas::Bvh;
use crate::node::{LeafNode, NodeBlock, NodeRef, leaf, node};
use crate::simd::Isa;
use crate::traverse::packet::Packet;
use crate::traverse::stack::PacketStack;

/// Once the bounds of all rays have entered more leaves than this that no ray does, what is seen is finer than the rays are
/// apart: from there on nodes are asked for each ray too.
const MAX_FALSE_LEAVES: u32 = 32;

/// What rays are asked for at a leaf.
pub trait LeafVisitor {
    /// Takes the rays `active` through a leaf that they enter; those for which something nearer was found.
    fn visit_leaf<I: Isa>(&mut self, leaf: &LeafNode, active: u64, packet: &mut Packet) -> u64;
}

/// Through all that is below `start`, the nearer first. Rays end where `packet` says that they are of interest no longer.
#[inline(always)]
pub fn traverse_packet<I: Isa, L: LeafVisitor>(
    mesh: &Bvh,
    start: NodeRef,
    packet: &mut Packet,
    mut visitor: L,
) {
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
                    // The bounds of all rays enter many leaves that no ray does: those are not even asked for.
                    entered[lane] =
                        packet.intersect_box::<I>(|row| node.bounds[row][lane], packet.active);
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
            // Until each ray has hit_mask something, one of them is of interest as far as ever.
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

/// Asks for a block that is read soon.
#[inline(always)]
pub fn prefetch_block<I: Isa>(blocks: &[NodeBlock], at: NodeRef) {
    let start = blocks.as_ptr().wrapping_add(at.index()).cast::<u8>();
    for line in 0..4 {
        I::prefetch(start.wrapping_add(64 * line));
    }
}
