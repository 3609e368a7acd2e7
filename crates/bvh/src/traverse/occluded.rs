//! Packets through the scene: any hits.

use crate::node::{LEAF, LeafNode, NO_CHILD, leaf, node};
use crate::ray::{Coherence, Ray};
use crate::scene::rebraid::Part;
use crate::scene::{Placed, Scene};
use crate::simd::Isa;
use crate::traverse::Any;
use crate::traverse::packet::Packet;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::tlas::{Packets, Query};
use crate::traverse::packet::traversal::prefetch;
use crate::traverse::single::interleaved::trace;
use crate::traverse::stack::MaskStack;
use crate::traverse::stream::chunker::{ASIDE, Aside, Chunk, Chunks};
use crate::traverse::stream::packet_groups::{Members, Who, numbers};
use crate::traverse::triangle::packet::meet_each;
use crate::traverse::triangle::packet_edges::Near;

/// Packets of a chunk do not pay if they visit more nodes and leaves than so many for each ray, where each ray that goes on
/// alone counts as so many visits.
const MOST_VISITS: usize = 4;
const VISITS_ALONE: usize = 4;

/// Rays of a packet that are as few at a node go on alone. (At a leaf they do not: its triangles are tested at once.)
const FEW: u32 = 2;

/// Whether there is any hit, for any number of rays.
#[inline(always)]
pub fn occluded<I: Isa>(scene: &Scene, rays: &[Ray], dark: &mut [bool], coherence: Coherence) {
    dark.fill(false);
    if scene.root == NO_CHILD {
        return;
    }
    let (mut packets, mut scaled) = (Packets::NONE, Members::NONE);
    let (mut aside, mut apart) = (Aside::default(), Vec::new());
    let mut chunks = Chunks::of(scene, rays, coherence);
    while chunks.advance::<I>(&mut aside, &mut apart) {
        let chunk = chunks.chunk(scene, &mut aside, &mut apart);
        let (numbers, coherence) = (chunk.numbers, chunk.coherence);
        let together = coherence != Coherence::Incoherent;
        let most = MOST_VISITS * numbers.len();
        if together && scene.shadows.should_skip() {
            chunk.aside.whole.extend_from_slice(numbers);
        } else {
            let before = chunk.aside.len();
            let scaled = chunk.scaled(&mut scaled);
            let mut shadows = Shadows { chunk, dark: 0 };
            packets.ask::<I, _>(&mut shadows, scene, scaled, None);
            let met = shadows.dark;
            if coherence == Coherence::Incoherent {
                for (i, number) in numbers.iter().enumerate() {
                    dark[*number as usize] = met >> i & 1 != 0;
                }
            } else {
                let first = numbers[0] as usize;
                for (i, dark) in dark[first..first + numbers.len()].iter_mut().enumerate() {
                    *dark = met >> i & 1 != 0;
                }
            }
            let alone = aside.len() - before;
            let visits = std::mem::take(&mut aside.visits);
            chunks.count(alone, visits);
            if together {
                let pays = visits + VISITS_ALONE * alone <= most;
                scene.shadows.record(pays);
            }
        }
        if aside.len() >= ASIDE {
            let work = aside.drain(rays);
            trace::<I, _, true>(scene, &mut Any { work, dark });
        }
    }
    if aside.len() > 0 {
        let work = aside.drain(rays);
        trace::<I, _, true>(scene, &mut Any { work, dark });
    }
}

/// Any hits of the chunk at hand.
struct Shadows<'a> {
    chunk: Chunk<'a>,
    /// Bit i: ray i of the chunk meets something, and was not put aside before that was known.
    dark: u64,
}

impl Query for Shadows<'_> {
    #[inline(always)]
    fn packed<I: Isa>(&self, rays: &[Ray], placed: Option<&Placed>, packet: &mut Packet) -> bool {
        self.chunk.packed::<I>(rays, placed, Apex::of(rays), packet)
    }

    #[inline(always)]
    fn turned(&self, ray: &Ray, _number: usize, placed: &Placed) -> Ray {
        placed.local(ray)
    }

    #[inline(always)]
    fn limit(&self, number: usize, t_max: f32) -> f32 {
        match self.dark >> number & 1 {
            0 => t_max,
            _ => -1.0,
        }
    }

    #[inline(always)]
    fn alone<I: Isa>(&mut self, places: u64, part: Option<&Part>, who: Who) {
        self.chunk.alone(places, part, who);
    }

    #[inline(always)]
    fn in_part<I: Isa>(&mut self, part: &Part, packet: &mut Packet, who: Who) {
        let mesh = &*self.chunk.scene.placed[part.instance as usize].bvh;
        let blocks = mesh.blocks();
        let mut stack = MaskStack::new();
        let mut near = Near::NOTHING;
        let t_max = packet.farthest::<I>();
        let mut dark = 0u64;
        stack.push(part.start, packet.active);
        while let Some((at, active)) = stack.pop() {
            let active = active & !dark;
            self.chunk.aside.visits += 1;
            if active == 0 {
                continue;
            }
            if at & LEAF == 0 && active.count_ones() <= FEW {
                self.chunk.alone_from(active, part.instance, at, who);
            } else if at & LEAF == 0 {
                let node = node(blocks, at);
                let (mut mask, _) = packet.fan.children::<I>(node, t_max);
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    let entered = packet.enter::<I>(|row| node.bounds[row][lane], active);
                    if entered != 0 {
                        prefetch::<I>(blocks, node.child[lane]);
                        stack.push(node.child[lane], entered);
                    }
                }
            } else {
                dark |= dark_in_leaf::<I>(leaf(blocks, at), active, packet, &mut near);
            }
        }
        self.dark |= numbers(dark, who);
    }
}

/// The rays of `active` that meet something in a leaf.
#[inline(always)]
fn dark_in_leaf<I: Isa>(leaf: &LeafNode, active: u64, packet: &Packet, near: &mut Near) -> u64 {
    let mut dark = 0;
    near.find::<I, false>(leaf, active, packet);
    while near.some != 0 {
        let mut groups = near.groups::<I>();
        while groups != 0 {
            let group = groups.trailing_zeros() as usize;
            groups &= groups - 1;
            let met = meet_each::<I, true>(leaf, packet, group, near);
            dark |= u64::from(met.hit) << (I::RAYS * group);
        }
        near.next();
    }
    dark
}
