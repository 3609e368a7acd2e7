//! Packets through the scene: the nearest hits.

use super::NearestApart;
use super::alike::{Members, Who, number};
use super::apart::closest_apart;
use super::chunk::{ASIDE, Aside, Chunk, Chunks};
use super::fan::Apex;
use super::interleaved::trace;
use super::line::{Member, Met, meet_one, within};
use super::packet::{Packet, SIZE};
use super::packets::{Packets, Query};
use super::stack::Stack;
use super::steps::NO_SLOT;
use super::triangle::{Found, test_rays};
use crate::block::{Block, LEAF, Leaf, NO_CHILD, leaf, node};
use crate::mesh::Bvh;
use crate::part::Part;
use crate::ray::{Coherence, Hit, Ray};
use crate::scene::{Placed, Scene};
use crate::simd::Isa;

/// Rays of a packet that are fewer than this at a node go on alone.
pub const FEW: u32 = 5;

/// Rays of a packet that are as few at a leaf are tested against all its triangles: finding those that may be met costs
/// as much.
pub const ALL_TRIANGLES: u32 = 6;

/// What the rays of a packet met in a mesh; t stands in the packet.
pub struct Nearest {
    slot: [u32; SIZE],
    u: [f32; SIZE],
    v: [f32; SIZE],
}

impl Nearest {
    pub const NOTHING: Nearest = Nearest {
        slot: [NO_SLOT; SIZE],
        u: [0.0; SIZE],
        v: [0.0; SIZE],
    };
}

/// The nearest hits, for any number of rays.
#[inline(always)]
pub fn closest<I: Isa>(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) {
    // Each is compiled by itself: what camera rays do is done faster without the rest.
    match coherence {
        Coherence::Coherent => in_chunks::<I, false>(scene, rays, hits, coherence),
        _ => in_chunks::<I, true>(scene, rays, hits, coherence),
    }
}

/// The same; `APART` where some may run apart.
#[inline(always)]
fn in_chunks<I: Isa, const APART: bool>(
    scene: &Scene,
    rays: &[Ray],
    hits: &mut [Hit],
    coherence: Coherence,
) {
    if scene.root == NO_CHILD || coherence == Coherence::Incoherent {
        hits.fill(Hit::MISS);
    }
    if scene.root == NO_CHILD {
        return;
    }
    let mut scattered = [Hit::MISS; SIZE];
    let (mut packets, mut scaled) = (Packets::NONE, Members::NONE);
    let (mut aside, mut apart) = (Aside::default(), Vec::new());
    let mut chunks = Chunks::of(rays, coherence);
    while chunks.advance::<I>(&mut aside, &mut apart) {
        let chunk = chunks.chunk(scene, &mut aside, &mut apart);
        let (numbers, coherence) = (chunk.numbers, chunk.coherence);
        let before = chunk.aside.len();
        let scaled = chunk.scaled(&mut scaled);
        let headed = APART && coherence == Coherence::Incoherent;
        let first = numbers[0] as usize;
        let met = match headed {
            true => &mut scattered[..numbers.len()],
            false => &mut hits[first..first + numbers.len()],
        };
        met.fill(Hit::MISS);
        let mut together = Together::<APART> { chunk, hits: met };
        packets.ask::<I, _>(&mut together, scene, scaled, None);
        if headed {
            for (number, met) in numbers.iter().zip(&scattered) {
                hits[*number as usize] = *met;
            }
        }
        chunks.count(aside.len() - before, std::mem::take(&mut aside.visits));
        if aside.len() >= ASIDE {
            let work = aside.drain(rays);
            trace::<I, _, false>(scene, &mut NearestApart { work, hits });
        }
    }
    let work = aside.drain(rays);
    trace::<I, _, false>(scene, &mut NearestApart { work, hits });
}

/// The nearest hits of the chunk at hand.
struct Together<'a, 'b, const APART: bool> {
    chunk: Chunk<'a>,
    hits: &'b mut [Hit],
}

impl<const APART: bool> Query for Together<'_, '_, APART> {
    #[inline(always)]
    fn packed<I: Isa>(&self, rays: &[Ray], placed: Option<&Placed>, packet: &mut Packet) -> bool {
        self.chunk.packed::<I>(rays, placed, Apex::Origin, packet)
    }

    #[inline(always)]
    fn turned(&self, ray: &Ray, number: usize, placed: &Placed) -> Ray {
        let mut ray = *ray;
        ray.shorten(self.hits[number].t);
        placed.local(&ray)
    }

    #[inline(always)]
    fn limit(&self, number: usize, t_max: f32) -> f32 {
        t_max.min(self.hits[number].t)
    }

    #[inline(always)]
    fn alone<I: Isa>(&mut self, places: u64, part: Option<&Part>, who: Who) {
        self.chunk.alone(places, part, who);
    }

    #[inline(always)]
    fn in_part<I: Isa>(&mut self, part: &Part, packet: &mut Packet, who: Who) {
        let mesh = &*self.chunk.scene.placed[part.instance as usize].bvh;
        let mut nearest = Nearest::NOTHING;
        if APART && self.chunk.coherence == Coherence::Incoherent {
            let starts = closest_apart::<I>(mesh, part.start, packet, &mut nearest);
            self.chunk.aside.visits += starts.visits;
            let mut left = starts.alone;
            while left != 0 {
                let place = left.trailing_zeros() as usize & (SIZE - 1);
                left &= left - 1;
                self.chunk
                    .alone_from(1 << place, part.instance, starts.at[place], who);
            }
        } else {
            closest_below::<I>(mesh, part.start, packet, &mut nearest);
        }
        for place in 0..packet.active.count_ones() {
            let i = place as usize & (SIZE - 1);
            if nearest.slot[i] == NO_SLOT {
                continue;
            }
            let hit = Hit {
                t: packet.t_max[i],
                u: nearest.u[i],
                v: nearest.v[i],
                instance: part.instance,
                triangle: mesh.id(nearest.slot[i]),
            };
            self.hits[number(place, who)].take(hit);
        }
    }
}

impl Placed {
    /// A ray of the scene in the coordinates of the mesh's tree, by the arithmetic that single rays go through.
    #[inline(always)]
    pub fn local(&self, ray: &Ray) -> Ray {
        let m = &self.mesh_from_scene;
        let turned =
            |v: [f32; 3], row: usize| m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2];
        let (o, d) = (ray.origin, ray.direction);
        Ray {
            origin: [
                turned(o, 0) + m[0][3],
                turned(o, 1) + m[1][3],
                turned(o, 2) + m[2][3],
            ],
            direction: [turned(d, 0), turned(d, 1), turned(d, 2)],
            t_max: ray.t_max,
        }
    }
}

#[inline(always)]
fn closest_below<I: Isa>(mesh: &Bvh, start: u32, packet: &mut Packet, nearest: &mut Nearest) {
    let blocks = mesh.blocks();
    let mut stack = Stack::new();
    let mut found = Found::NOTHING;
    let mut t_max = packet.farthest::<I>();
    let mut at = start;
    loop {
        if at & LEAF == 0 {
            let node = node(blocks, at);
            let (mask, enter) = packet.fan.children::<I>(node, t_max);
            if mask != 0 {
                let mut soon = mask;
                while soon != 0 {
                    prefetch::<I>(blocks, node.child[soon.trailing_zeros() as usize & 7]);
                    soon &= soon - 1;
                }
                at = stack.push::<I>(node, enter, mask);
                continue;
            }
        } else {
            let leaf = leaf(blocks, at);
            let active = packet.enter::<I>(|row| leaf.bounds[row], packet.active);
            let closer = active != 0
                && closest_in_leaf::<I>(mesh, leaf, active, packet, nearest, &mut found);
            if closer {
                t_max = packet.farthest::<I>();
            }
        }
        match stack.pop(0, t_max) {
            Some(next) => at = next,
            None => return,
        }
    }
}

/// Whether anything was found.
#[inline(always)]
pub fn closest_in_leaf<I: Isa>(
    mesh: &Bvh,
    leaf: &Leaf,
    mut active: u64,
    packet: &mut Packet,
    nearest: &mut Nearest,
    found: &mut Found,
) -> bool {
    let mut closer = false;
    let mut triangles = u32::MAX;
    if active.count_ones() > ALL_TRIANGLES {
        triangles = packet.candidates::<I>(leaf);
    }
    if triangles.count_ones() * groups(active) < active.count_ones() {
        while triangles != 0 {
            let k = triangles.trailing_zeros();
            triangles &= triangles - 1;
            for group in 0..SIZE / 16 {
                let lanes = (active >> (16 * group)) as u32 & 0xffff;
                if lanes == 0 {
                    continue;
                }
                let mut hit = test_rays::<I>(leaf, k as usize, packet, group, lanes, found);
                closer |= hit != 0;
                while hit != 0 {
                    let lane = hit.trailing_zeros() as usize & 15;
                    hit &= hit - 1;
                    let met = found.at(lane);
                    nearest.take(mesh, leaf.first + k, met, 16 * group + lane, packet);
                }
            }
        }
        return closer;
    }
    // All edges first, without a branch; then the few triangles that remain.
    let mut near = [0u32; SIZE];
    let mut some = 0u64;
    while active != 0 {
        let i = active.trailing_zeros() as usize & (SIZE - 1);
        active &= active - 1;
        near[i] = within::<I>(leaf, Member(packet, i));
        some |= u64::from(near[i] != 0) << i;
    }
    while some != 0 {
        let i = some.trailing_zeros() as usize & (SIZE - 1);
        some &= some - 1;
        let mut near = near[i];
        while near != 0 {
            let lane = near.trailing_zeros();
            near &= near - 1;
            if let Some(met) = meet_one(leaf, lane as usize, Member(packet, i), packet.t_max[i]) {
                closer = true;
                nearest.take(mesh, leaf.first + lane, met, i, packet);
            }
        }
    }
    closer
}

/// How many groups of 16 rays have an active one.
#[inline(always)]
pub fn groups(active: u64) -> u32 {
    (0..SIZE / 16)
        .map(|g| u32::from(active >> (16 * g) & 0xffff != 0))
        .sum()
}

impl Nearest {
    /// Takes what was found for ray `i`, if it comes first by (t, id).
    #[inline(always)]
    fn take(&mut self, mesh: &Bvh, slot: u32, Met { t, u, v }: Met, i: usize, packet: &mut Packet) {
        let known = self.slot[i];
        let before = t < packet.t_max[i]
            || t == packet.t_max[i] && (known == NO_SLOT || mesh.id(slot) < mesh.id(known));
        if before {
            packet.t_max[i] = t;
            self.slot[i] = slot;
            self.u[i] = u;
            self.v[i] = v;
        }
    }
}

#[inline(always)]
pub fn prefetch<I: Isa>(blocks: &[Block], at: u32) {
    let start = blocks
        .as_ptr()
        .wrapping_add((at & !LEAF) as usize)
        .cast::<u8>();
    for line in 0..4 {
        I::prefetch(start.wrapping_add(64 * line));
    }
}
