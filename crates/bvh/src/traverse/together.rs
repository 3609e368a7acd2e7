//! Packets through the scene: the nearest hits.

use super::fan::Apex;
use super::line::{Member, Met, meet_one, within};
use super::packet::{Packet, SIZE};
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

/// By how much the boxes of instances are padded, of the largest coordinate at hand.
pub fn outer_pad(scene: &Scene) -> f32 {
    if scene.direct { 0.0 } else { scene.rounding() }
}

/// The rays in scaled scene coordinates.
#[inline(always)]
pub fn scaled<'a>(scene: &Scene, rays: &'a [Ray], room: &'a mut [Ray; SIZE]) -> &'a [Ray] {
    if scene.unit == 1.0 {
        return rays;
    }
    let unit = scene.unit as f32;
    for (to, ray) in room.iter_mut().zip(rays) {
        *to = Ray {
            origin: ray.origin.map(|x| x * unit),
            direction: ray.direction.map(|x| x * unit),
            ..*ray
        };
    }
    &room[..rays.len()]
}

pub const NO_RAY: Ray = Ray {
    origin: [0.0; 3],
    direction: [0.0; 3],
    t_max: 0.0,
};

/// What the rays of a packet met in a mesh; t stands in the packet.
struct Nearest {
    slot: [u32; SIZE],
    u: [f32; SIZE],
    v: [f32; SIZE],
}

/// The nearest hits of at most 64 rays; false, and nothing is answered, if they make no packet.
#[inline(always)]
pub fn closest<I: Isa>(
    scene: &Scene,
    rays: &[Ray],
    hits: &mut [Hit],
    coherence: Coherence,
    packet: &mut Packet,
) -> bool {
    let mut room = [NO_RAY; SIZE];
    let rays = scaled(scene, rays, &mut room);
    if scene.root == NO_CHILD
        || !packet.set::<I>(rays, &scene.extent, outer_pad(scene), Apex::Origin)
    {
        return false;
    }
    // Parallel rays from all over share their signs, but no boxes.
    if coherence == Coherence::Unknown && packet.spread() > scene.reach / 16.0 {
        return false;
    }
    let mut nearest = Nearest {
        slot: [NO_SLOT; SIZE],
        u: [0.0; SIZE],
        v: [0.0; SIZE],
    };
    if scene.direct {
        let mesh = &*scene.placed[0].bvh;
        closest_in_mesh::<I>(mesh, packet, &mut nearest);
        for (i, hit) in hits.iter_mut().enumerate() {
            *hit = Hit::MISS;
            if nearest.slot[i] != NO_SLOT {
                let (t, triangle) = (packet.t_max[i], mesh.id(nearest.slot[i]));
                *hit = Hit {
                    t,
                    u: nearest.u[i],
                    v: nearest.v[i],
                    instance: 0,
                    triangle,
                };
            }
        }
        return true;
    }
    let mut met = [Hit::MISS; SIZE];
    if !closest_in_instances::<I>(scene, rays, packet, &mut met) {
        return false;
    }
    hits.copy_from_slice(&met[..hits.len()]);
    true
}

/// Through the tree over instances; false if the rays make no packet in one of them.
#[inline(always)]
fn closest_in_instances<I: Isa>(
    scene: &Scene,
    rays: &[Ray],
    outer: &mut Packet,
    met: &mut [Hit; SIZE],
) -> bool {
    let mut stack = Stack::new();
    let mut inner = Packet::NONE;
    let mut t_max = outer.farthest::<I>();
    let mut at = scene.root;
    loop {
        if at & LEAF == 0 {
            let node = node(scene.blocks(), at);
            let (mask, enter) = outer.fan.children::<I>(node, t_max);
            if mask != 0 {
                at = stack.push::<I>(node, enter, mask);
                continue;
            }
        } else {
            let instance = at & !LEAF;
            let placed = &scene.placed[instance as usize];
            let local: [Ray; SIZE] = std::array::from_fn(|i| match rays.get(i) {
                Some(ray) => Ray {
                    t_max: outer.t_max[i],
                    ..placed.local(ray)
                },
                None => NO_RAY,
            });
            if placed.bvh.root() != NO_CHILD {
                if !inner.set::<I>(&local[..rays.len()], placed.bvh.extent(), 0.0, Apex::Origin) {
                    return false;
                }
                let mut nearest = Nearest {
                    slot: [NO_SLOT; SIZE],
                    u: [0.0; SIZE],
                    v: [0.0; SIZE],
                };
                closest_in_mesh::<I>(&placed.bvh, &mut inner, &mut nearest);
                for (i, hit) in met[..rays.len()].iter_mut().enumerate() {
                    let t = inner.t_max[i];
                    if nearest.slot[i] != NO_SLOT && (t, instance) < (hit.t, hit.instance) {
                        let triangle = placed.bvh.id(nearest.slot[i]);
                        *hit = Hit {
                            t,
                            u: nearest.u[i],
                            v: nearest.v[i],
                            instance,
                            triangle,
                        };
                        outer.t_max[i] = t;
                    }
                }
                t_max = outer.farthest::<I>();
            }
        }
        match stack.pop(0, t_max) {
            Some(next) => at = next,
            None => return true,
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
