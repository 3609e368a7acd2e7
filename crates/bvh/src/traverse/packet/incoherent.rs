//! The nearest hits of packets whose rays have no more in common than where they head: each is tested against each box.

use crate::blas::Bvh;
use crate::node::{LEAF, WideNode, leaf, node};
use crate::simd::{Isa, Vector};
use crate::traverse::closest::{FEW, Nearest, closest_in_leaf};
use crate::traverse::packet::{Packet, SIZE};
use crate::traverse::stack::MaskStack;
use crate::traverse::triangle::packet_edges::Near;

/// Where rays of a packet go on alone.
pub struct Starts {
    pub alone: u64,
    /// Those that would have to in several places: they do at the root, and are in the packet no more.
    gone: u64,
    pub at: [u32; SIZE],
    /// Nodes and leaves until then.
    pub visits: usize,
}

impl Starts {
    const NONE: Starts = Starts {
        alone: 0,
        gone: 0,
        at: [0; SIZE],
        visits: 0,
    };

    #[inline(always)]
    fn add(&mut self, mut rays: u64, at: u32, root: u32) {
        self.gone |= rays & self.alone;
        self.alone |= rays;
        while rays != 0 {
            let i = rays.trailing_zeros() as usize & (SIZE - 1);
            rays &= rays - 1;
            self.at[i] = if self.gone >> i & 1 != 0 { root } else { at };
        }
    }
}

/// The nearest hits below a node of a mesh, but those of rays that go on alone: each does so once, from where is returned.
#[inline(always)]
pub fn closest_apart<I: Isa>(
    mesh: &Bvh,
    start: u32,
    packet: &mut Packet,
    nearest: &mut Nearest,
) -> Starts {
    let blocks = mesh.blocks();
    let mut starts = Starts::NONE;
    let mut stack = MaskStack::new();
    let mut near = Near::NOTHING;
    let t_max = packet.farthest::<I>();
    stack.push(start, packet.active);
    while let Some((at, active)) = stack.pop() {
        let active = active & !starts.gone;
        starts.visits += 1;
        if at & LEAF != 0 {
            let leaf = leaf(blocks, at);
            let active = packet.enter::<I>(|row| leaf.bounds[row], active);
            if active != 0 {
                closest_in_leaf::<I, false>(mesh, leaf, active, packet, nearest, &mut near);
            }
            continue;
        }
        let node = node(blocks, at);
        let (mask, _) = packet.fan.children::<I>(node, t_max);
        let (order, count) = farthest_first::<I>(mesh, node, packet, mask);
        let mut entered = [0; 8];
        let mut few = 0;
        for (entered, &lane) in entered.iter_mut().zip(&order[..count]) {
            let lane = lane as usize & 7;
            *entered = packet.enter::<I>(|row| node.bounds[row][lane], active);
            if node.child[lane] & LEAF == 0 && entered.count_ones() < FEW {
                few |= *entered;
            }
        }
        starts.add(few, at, start);
        for (entered, &lane) in entered.iter().zip(&order[..count]) {
            if entered & !few != 0 {
                stack.push(node.child[lane as usize & 7], entered & !few);
            }
        }
    }
    starts
}

/// The children of a mask, of which those that the rays come to first are last, and how many they are.
#[inline(always)]
fn farthest_first<I: Isa>(
    mesh: &Bvh,
    node: &WideNode,
    packet: &Packet,
    mask: u32,
) -> ([u32; 8], usize) {
    const LANES: [u32; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
    let main = packet.axes[2];
    let row = packet.entry[main];
    // Behind all of them, and all boxes.
    let [least, greatest] = packet.origins[main];
    let reach = mesh.extent().reach();
    let from = match row % 2 {
        0 => least - reach,
        _ => greatest + reach,
    };
    let mut order = [0; 8];
    // SAFETY: `entry` is one of the six rows; it and the arrays hold eight values, which as floats are only moved.
    unsafe {
        let bounds = I::F8::load(node.bounds.get_unchecked(row).as_ptr());
        let away = bounds.sub(I::F8::splat(from)).abs();
        let lanes = I::F8::load(LANES.as_ptr().cast());
        I::reorder(lanes, I::descending(away, mask)).store(order.as_mut_ptr().cast());
    }
    (order, mask.count_ones() as usize)
}
