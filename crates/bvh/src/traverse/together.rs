//! Packets through the scene: the nearest hits.

use super::NearestApart;
use super::alike::{Members, Parts, Who, number};
use super::fan::Apex;
use super::interleaved::trace;
use super::line::{Member, Met, meet_one, within};
use super::local::Extent;
use super::packet::{Packet, SIZE};
use super::packets::{Chunk, Inside, Packets};
use super::stack::Stack;
use super::steps::NO_SLOT;
use super::triangle::{Found, test_rays};
use crate::block::{Block, LEAF, Leaf, NO_CHILD, leaf, node};
use crate::mesh::Bvh;
use crate::ray::{Coherence, Hit, Ray};
use crate::scene::{Placed, Scene};
use crate::simd::Isa;

/// Rays of a packet that are fewer than this at a node go on alone.
pub const FEW: u32 = 5;

/// Rays of a packet that are as few at a leaf are tested against all its triangles: finding those that may be met costs
/// as much.
pub const ALL_TRIANGLES: u32 = 6;

/// What the rays of a packet met in a mesh; t stands in the packet.
struct Nearest {
    slot: [u32; SIZE],
    u: [f32; SIZE],
    v: [f32; SIZE],
}

impl Nearest {
    const NOTHING: Nearest = Nearest {
        slot: [NO_SLOT; SIZE],
        u: [0.0; SIZE],
        v: [0.0; SIZE],
    };
}

/// The nearest hits, for any number of rays.
#[inline(always)]
pub fn closest<I: Isa>(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) {
    let mut together = Together(Chunk::none(scene, coherence));
    let mut packets = Packets::NONE;
    for (k, given) in rays.chunks(SIZE).enumerate() {
        together.0.given = given;
        together.0.number = k * SIZE;
        let met = &mut hits[k * SIZE..][..given.len()];
        met.fill(Hit::MISS);
        if scene.root != NO_CHILD {
            together.chunk::<I>(&mut packets, met);
        }
        if together.0.is_full() {
            together.settle::<I>(hits);
        }
    }
    together.settle::<I>(hits);
}

/// The nearest hits of the chunk at hand.
struct Together<'a>(Chunk<'a>);

impl Together<'_> {
    /// Traces what was put aside.
    #[inline(always)]
    fn settle<I: Isa>(&mut self, hits: &mut [Hit]) {
        let work = self.0.aside.drain(..);
        trace::<I, _, false>(self.0.scene, &mut NearestApart { work, hits });
    }

    #[inline(always)]
    fn chunk<I: Isa>(&mut self, packets: &mut Packets, hits: &mut [Hit]) {
        let Packets {
            scaled,
            outer,
            in_scene,
            inside,
        } = packets;
        let rays = self.0.scaled(scaled);
        let (extent, pad) = (&self.0.scene.extent, self.0.outer_pad());
        let mut parts = Parts::of(rays);
        while let Some((part, pays)) = parts.next() {
            let (some, who) = outer.of_part(rays, None, part, parts.whole);
            // Nothing is above the only mesh.
            if self.0.scene.direct || pays && self.packed::<I>(some, extent, pad, in_scene) {
                self.in_scene::<I>(some, who, in_scene, inside, hits);
            } else if parts.whole {
                parts.sort(rays);
            } else {
                self.0.alone(part, 0, NO_CHILD, None);
            }
        }
    }

    #[inline(always)]
    fn packed<I: Isa>(&self, rays: &[Ray], extent: &Extent, pad: f32, packet: &mut Packet) -> bool {
        self.0.packed::<I>(rays, extent, pad, Apex::Origin, packet)
    }

    /// Through the tree over instances. `who` says which of the chunk the rays are.
    #[inline(always)]
    fn in_scene<I: Isa>(
        &mut self,
        rays: &[Ray],
        who: Who,
        packet: &mut Packet,
        inside: &mut Inside,
        hits: &mut [Hit],
    ) {
        let Inside {
            local,
            inner,
            packet: in_mesh,
        } = inside;
        let (scene, direct) = (self.0.scene, self.0.scene.direct);
        let mut stack = Stack::new();
        let (mut at, mut t_max) = match direct {
            true => (LEAF, 0.0),
            false => (scene.root, packet.farthest::<I>()),
        };
        loop {
            if at & LEAF == 0 {
                let node = node(scene.blocks(), at);
                let (mask, enter) = packet.fan.children::<I>(node, t_max);
                if mask != 0 {
                    at = stack.push::<I>(node, enter, mask);
                    continue;
                }
            } else if direct {
                self.in_instance::<I>(0, rays, who, inner, in_mesh, hits);
            } else {
                let instance = at & !LEAF;
                let placed = &scene.placed[instance as usize];
                let active = packet.enter::<I>(|row| placed.bounds[row], packet.active);
                if active != 0 && placed.bvh.root() != NO_CHILD {
                    local.gather(rays, who, active);
                    for (place, ray) in local.rays[..local.len].iter_mut().enumerate() {
                        let number = usize::from(local.who[place]);
                        ray.shorten(hits[number].t);
                        *ray = placed.local(ray);
                    }
                    let (some, who_of_some) = local.all();
                    self.in_instance::<I>(instance, some, who_of_some, inner, in_mesh, hits);
                    let mut active = active;
                    while active != 0 {
                        let place = active.trailing_zeros();
                        active &= active - 1;
                        let t_max = &mut packet.t_max[place as usize & (SIZE - 1)];
                        *t_max = t_max.min(hits[number(place, who)].t);
                    }
                    t_max = packet.farthest::<I>();
                }
            }
            match stack.pop(0, t_max) {
                Some(next) => at = next,
                None => return,
            }
        }
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
        hits: &mut [Hit],
    ) {
        let mesh = &*self.0.scene.placed[instance as usize].bvh;
        let mut parts = Parts::of(rays);
        while let Some((part, pays)) = parts.next() {
            let (some, who_of_some) = inner.of_part(rays, who, part, parts.whole);
            if pays && self.packed::<I>(some, mesh.extent(), 0.0, packet) {
                let mut nearest = Nearest::NOTHING;
                closest_in_mesh::<I>(mesh, packet, &mut nearest);
                for place in 0..some.len() {
                    if nearest.slot[place] == NO_SLOT {
                        continue;
                    }
                    let hit = &mut hits[number(place as u32, who_of_some)];
                    let t = packet.t_max[place];
                    if (t, instance) < (hit.t, hit.instance) {
                        *hit = Hit {
                            t,
                            u: nearest.u[place],
                            v: nearest.v[place],
                            instance,
                            triangle: mesh.id(nearest.slot[place]),
                        };
                    }
                }
            } else if parts.whole {
                parts.sort(rays);
            } else {
                self.0.alone(part, instance, mesh.root(), who);
            }
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
fn closest_in_mesh<I: Isa>(mesh: &Bvh, packet: &mut Packet, nearest: &mut Nearest) {
    let blocks = mesh.blocks();
    let mut stack = Stack::new();
    let mut found = Found::NOTHING;
    let mut t_max = packet.farthest::<I>();
    let mut at = mesh.root();
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
fn closest_in_leaf<I: Isa>(
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
