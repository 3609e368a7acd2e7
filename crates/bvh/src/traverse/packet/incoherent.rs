//! Closest hits of packets of incoherent rays, which share only an octant: every ray is tested against every box.
//! Groups that become small continue as single rays.

use crate::blas::Bvh;
use crate::node::{NodeRef, WideNode, leaf, node};
use crate::simd::{Isa, Vector};
use crate::traverse::packet::Packet;
use crate::traverse::packet::hits::{PacketHits, closest_in_leaf};
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::packet::triangle_edges::PotentialHits;
use crate::traverse::stack::MaskStack;

/// Minimum number of rays in a group at a node; smaller groups continue as single rays.
const MIN_PACKET_RAYS: u32 = 5;

/// The rays that leave a packet for single-ray traversal.
pub struct SingleHandoff {
    pub single_mask: u64,
    /// Rays that would leave the packet at several nodes; as single rays, they restart at the root of the subtree.
    restart_mask: u64,
    pub start_node: [NodeRef; PACKET_SIZE],
    /// Number of nodes and leaves that the packet has visited.
    pub visits: usize,
}

impl SingleHandoff {
    const EMPTY: SingleHandoff =
        SingleHandoff { single_mask: 0, restart_mask: 0, start_node: [NodeRef::EMPTY; PACKET_SIZE], visits: 0 };

    #[inline(always)]
    fn add(&mut self, mut rays: u64, at: NodeRef, root: NodeRef) {
        self.restart_mask |= rays & self.single_mask;
        self.single_mask |= rays;
        while rays != 0 {
            let i = rays.trailing_zeros() as usize & (PACKET_SIZE - 1);
            rays &= rays - 1;
            self.start_node[i] = if self.restart_mask >> i & 1 != 0 { root } else { at };
        }
    }
}

/// Finds closest hits in a subtree, except for rays that are handed off: each of these continues as one single ray from
/// its `start_node`.
#[inline(always)]
pub fn intersect_incoherent<I: Isa>(
    mesh: &Bvh,
    start: NodeRef,
    packet: &mut Packet,
    nearest: &mut PacketHits,
) -> SingleHandoff {
    let blocks = mesh.blocks();
    let mut handoff = SingleHandoff::EMPTY;
    let mut stack = MaskStack::new();
    let mut potential = PotentialHits::EMPTY;
    let t_max = packet.max_t::<I>();
    stack.push(start, packet.active);
    while let Some((at, active)) = stack.pop() {
        let active = active & !handoff.restart_mask;
        handoff.visits += 1;
        if at.is_leaf() {
            let leaf = leaf(blocks, at);
            let active = packet.intersect_box::<I>(|row| leaf.bounds[row], active);
            if active != 0 {
                closest_in_leaf::<I, false>(mesh, leaf, active, packet, nearest, &mut potential);
            }
            continue;
        }
        let node = node(blocks, at);
        let (mask, _) = packet.frustum.intersect_children::<I>(node, t_max);
        let (order, count) = sort_children_far_to_near::<I>(mesh, node, packet, mask);
        let mut entered = [0; 8];
        let mut few = 0;
        for (entered, &lane) in entered.iter_mut().zip(&order[..count]) {
            let lane = lane as usize & 7;
            *entered = packet.intersect_box::<I>(|row| node.bounds[row][lane], active);
            if !node.children[lane].is_leaf() && entered.count_ones() < MIN_PACKET_RAYS {
                few |= *entered;
            }
        }
        handoff.add(few, at, start);
        for (entered, &lane) in entered.iter().zip(&order[..count]) {
            if entered & !few != 0 {
                stack.push(node.children[lane as usize & 7], entered & !few);
            }
        }
    }
    handoff
}

/// The children in a mask, sorted along the major axis with the farthest first, and their number.
#[inline(always)]
fn sort_children_far_to_near<I: Isa>(mesh: &Bvh, node: &WideNode, packet: &Packet, mask: u32) -> ([u32; 8], usize) {
    const LANES: [u32; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
    let main = packet.axes[2];
    let row = packet.near_rows[main];
    // A coordinate along the major axis that is before all origins and all boxes.
    let [least, greatest] = packet.origin_range[main];
    let reach = mesh.bounds().max_abs_coord();
    let from = match row % 2 {
        0 => least - reach,
        _ => greatest + reach,
    };
    let mut order = [0; 8];
    // SAFETY: `row` is one of the six rows. The row and the arrays contain eight values, and the values are moved as
    // floats without arithmetic.
    unsafe {
        let bounds = I::F32x8::load(node.bounds.get_unchecked(row).as_ptr());
        let away = bounds.sub(I::F32x8::splat(from)).abs();
        let lanes = I::F32x8::load(LANES.as_ptr().cast());
        I::permute8(lanes, I::sort_descending(away, mask)).store(order.as_mut_ptr().cast());
    }
    (order, mask.count_ones() as usize)
}
