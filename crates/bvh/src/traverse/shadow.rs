//! Packets through the scene: any hits.

use super::Any;
use super::alike::{Members, Parts, Who, numbers, places};
use super::fan::Apex;
use super::interleaved::trace;
use super::line::{Member, within};
use super::local::Extent;
use super::packet::{Packet, SIZE};
use super::packets::{Chunk, Inside, Packets};
use super::stack::MaskStack;
use super::steps::any;
use super::together::{ALL_TRIANGLES, FEW, groups, prefetch};
use super::triangle::{Found, test_rays};
use crate::block::{LEAF, Leaf, NO_CHILD, leaf, node};
use crate::mesh::Bvh;
use crate::ray::{Coherence, Ray};
use crate::scene::Scene;
use crate::simd::Isa;

/// How many chunks make no packets after one that fell apart.
const SKIP: u32 = 12;

/// Whether there is any hit, for any number of rays.
#[inline(always)]
pub fn occluded<I: Isa>(scene: &Scene, rays: &[Ray], dark: &mut [bool], coherence: Coherence) {
    dark.fill(false);
    let mut shadows = Shadows(Chunk::none(scene, coherence));
    let mut packets = Packets::NONE;
    // Where packets fall apart into many pieces, the next few are not made.
    let mut skip = 0u32;
    for (k, given) in rays.chunks(SIZE).enumerate() {
        shadows.0.given = given;
        shadows.0.number = k * SIZE;
        let before = shadows.0.aside.len();
        if skip == 0 && scene.root != NO_CHILD {
            let met = shadows.chunk::<I>(&mut packets);
            for (i, dark) in dark[k * SIZE..][..given.len()].iter_mut().enumerate() {
                *dark = met >> i & 1 != 0;
            }
        } else {
            shadows.0.alone(shadows.0.every(), 0, NO_CHILD, None);
            skip = skip.saturating_sub(1);
        }
        if skip == 0 && shadows.0.aside.len() - before > 3 * SIZE {
            skip = SKIP;
        }
        if shadows.0.is_full() {
            shadows.settle::<I>(dark);
        }
    }
    shadows.settle::<I>(dark);
}

/// Any hits of the chunk at hand.
struct Shadows<'a>(Chunk<'a>);

impl Shadows<'_> {
    /// Traces what was put aside.
    #[inline(always)]
    fn settle<I: Isa>(&mut self, dark: &mut [bool]) {
        let work = self.0.aside.drain(..);
        trace::<I, _, true>(self.0.scene, &mut Any { work, dark });
    }

    /// Bit i: ray i of the chunk meets something, if it was not put aside.
    #[inline(always)]
    fn chunk<I: Isa>(&mut self, packets: &mut Packets) -> u64 {
        let Packets {
            scaled,
            outer,
            in_scene,
            inside,
        } = packets;
        let rays = self.0.scaled(scaled);
        let (extent, pad) = (&self.0.scene.extent, self.0.outer_pad());
        let mut met = 0;
        let mut parts = Parts::of(rays);
        while let Some((part, pays)) = parts.next() {
            let (some, who) = outer.of_part(rays, None, part, parts.whole);
            // Nothing is above the only mesh.
            if self.0.scene.direct || pays && self.packed::<I>(some, extent, pad, in_scene) {
                met |= self.in_scene::<I>(some, who, in_scene, inside);
            } else if parts.whole {
                parts.sort(rays);
            } else {
                self.0.alone(part, 0, NO_CHILD, None);
            }
        }
        met
    }

    #[inline(always)]
    fn packed<I: Isa>(&self, rays: &[Ray], extent: &Extent, pad: f32, packet: &mut Packet) -> bool {
        self.0
            .packed::<I>(rays, extent, pad, Apex::of(rays), packet)
    }

    /// Through the tree over instances. `who` says which of the chunk the rays are; so does what is returned.
    #[inline(always)]
    fn in_scene<I: Isa>(
        &mut self,
        rays: &[Ray],
        who: Who,
        packet: &Packet,
        inside: &mut Inside,
    ) -> u64 {
        let Inside {
            local,
            inner,
            packet: in_mesh,
        } = inside;
        let blocks = self.0.scene.blocks();
        let mut stack = MaskStack::new();
        let mut dark = 0u64;
        let (root, t_max) = match self.0.scene.direct {
            true => (LEAF, 0.0),
            false => (self.0.scene.root, packet.farthest::<I>()),
        };
        stack.push(root, u64::MAX >> (SIZE - rays.len()));
        while let Some((at, mut active)) = stack.pop() {
            active &= !places(dark, who);
            if active == 0 {
                continue;
            }
            if at & LEAF == 0 {
                let node = node(blocks, at);
                let (mut mask, _) = packet.fan.children::<I>(node, t_max);
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    let entered = packet.enter::<I>(|row| node.bounds[row][lane], active);
                    if entered != 0 {
                        stack.push(node.child[lane], entered);
                    }
                }
                continue;
            }
            let instance = at & !LEAF;
            let placed = &self.0.scene.placed[instance as usize];
            if placed.bvh.root() == NO_CHILD {
                continue;
            }
            if !self.0.scene.direct {
                local.gather(rays, who, active);
                local.turn(placed);
            }
            let (rays, who) = match self.0.scene.direct {
                true => (rays, who),
                false => local.all(),
            };
            dark |= self.in_instance::<I>(instance, rays, who, inner, in_mesh);
        }
        dark
    }

    /// Through one mesh, for rays in its coordinates: as one packet, or one for each heading.
    #[inline(always)]
    fn in_instance<I: Isa>(
        &mut self,
        instance: u32,
        rays: &[Ray],
        who: Who,
        inner: &mut Members,
        packet: &mut Packet,
    ) -> u64 {
        let mesh = &*self.0.scene.placed[instance as usize].bvh;
        let mut met = 0;
        let mut parts = Parts::of(rays);
        while let Some((part, pays)) = parts.next() {
            let (some, who_of_some) = inner.of_part(rays, who, part, parts.whole);
            if pays && self.packed::<I>(some, mesh.extent(), 0.0, packet) {
                met |= self.in_mesh::<I>(mesh, instance, packet, who_of_some);
            } else if parts.whole {
                parts.sort(rays);
            } else {
                self.0.alone(part, instance, mesh.root(), who);
            }
        }
        met
    }

    #[inline(always)]
    fn in_mesh<I: Isa>(&mut self, mesh: &Bvh, instance: u32, packet: &Packet, who: Who) -> u64 {
        let blocks = mesh.blocks();
        let mut stack = MaskStack::new();
        let mut found = Found::NOTHING;
        let t_max = packet.farthest::<I>();
        let mut dark = 0u64;
        stack.push(mesh.root(), packet.active);
        while let Some((at, active)) = stack.pop() {
            let active = active & !dark;
            if active.count_ones() <= FEW {
                self.0.alone(active, instance, at, who);
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
                dark |= dark_in_leaf::<I>(leaf(blocks, at), active, packet, &mut found);
            }
        }
        numbers(dark, who)
    }
}

/// The rays of `active` that meet something in a leaf.
#[inline(always)]
fn dark_in_leaf<I: Isa>(leaf: &Leaf, mut active: u64, packet: &Packet, found: &mut Found) -> u64 {
    let mut dark = 0;
    let mut triangles = u32::MAX;
    if active.count_ones() > ALL_TRIANGLES {
        triangles = packet.candidates::<I>(leaf);
    }
    if triangles.count_ones() * groups(active) < active.count_ones() {
        while triangles != 0 {
            let k = triangles.trailing_zeros() as usize;
            triangles &= triangles - 1;
            for group in 0..SIZE / 16 {
                let lanes = ((active & !dark) >> (16 * group)) as u32 & 0xffff;
                if lanes != 0 {
                    dark |= u64::from(test_rays::<I>(leaf, k, packet, group, lanes, found))
                        << (16 * group);
                }
            }
        }
        return dark;
    }
    while active != 0 {
        let i = active.trailing_zeros() as usize & (SIZE - 1);
        active &= active - 1;
        let ray = Member(packet, i);
        if any(leaf, within::<I>(leaf, ray), ray, packet.t_max[i]) {
            dark |= 1 << i;
        }
    }
    dark
}
