//! Float64 answers for rays that run alike: the boxes are those of packets, padded as for a single exact ray.

use super::alike::{Members, Parts, Who, number};
use super::exact::{Moved, may_meet, off, through_mesh, through_scene, turned};
use super::fan::Apex;
use super::line::Member;
use super::local::EPS;
use super::packet::{Packet, SIZE};
use super::packets::{Inside, Packets};
use super::stack::Stack;
use crate::block::{LEAF, NO_CHILD, leaf, node};
use crate::ray::{ExactHit, ExactRay, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;

/// Rays start where they are given, and so at one point, up to this many times the reach of the scene.
const NEAR: f64 = 8.0;

/// The answers of at most 64 rays.
#[inline(always)]
pub fn closest_exact_chunk<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    hits: &mut [ExactHit],
    packets: &mut Packets,
) {
    let mut chunk = Chunk {
        scene,
        triangles,
        moved: [None; SIZE],
        drift: 0.0,
        distance: 0.0,
    };
    packets.scaled.clear();
    for (i, (ray, hit)) in rays.iter().zip(hits.iter_mut()).enumerate() {
        *hit = ExactHit::MISS;
        if let Some(mut moved) = Moved::new(scene, ray) {
            if moved.stay(scene, NEAR) {
                packets.scaled.push(chunk.add(&moved), i);
                chunk.moved[i] = Some(moved);
            } else {
                through_scene::<I>(scene, &mut moved, triangles);
                *hit = moved.answer();
            }
        }
    }
    if packets.scaled.len != 0 {
        chunk.trace::<I>(packets);
    }
    for (moved, hit) in chunk.moved.iter().zip(hits) {
        if let Some(moved) = moved {
            *hit = moved.answer();
        }
    }
}

/// Rays by number.
struct Chunk<'a> {
    scene: &'a Scene,
    triangles: &'a dyn ExactTriangles,
    /// `None` for what is not in packets.
    moved: [Option<Moved>; SIZE],
    /// The largest of them, in scaled scene coordinates.
    drift: f64,
    distance: f32,
}

impl Chunk<'_> {
    /// A ray in scaled scene coordinates.
    #[inline(always)]
    fn add(&mut self, ray: &Moved) -> Ray {
        let origin = ray.start.map(|x| x as f32);
        self.distance = origin.iter().fold(self.distance, |m, x| m.max(x.abs()));
        self.drift = self.drift.max(ray.drift);
        Ray {
            origin,
            direction: ray.direction.map(|d| (d * self.scene.unit) as f32),
            t_max: ray.limit().next_up(),
        }
    }

    /// The t up to which a ray is of interest.
    #[inline(always)]
    fn limit(&self, number: usize) -> f32 {
        let moved = &self.moved[number & (SIZE - 1)];
        moved.as_ref().map_or(0.0, |ray| ray.limit().next_up())
    }

    /// By how much boxes of instances are padded, of the scene's reach.
    fn pad(&self) -> f32 {
        (2.0 * self.scene.slack(self.distance) + self.drift as f32 * 2.0)
            / self.scene.extent.reach()
    }

    #[inline(always)]
    fn trace<I: Isa>(&mut self, packets: &mut Packets) {
        let Packets {
            scaled,
            outer,
            in_scene,
            inside,
        } = packets;
        let (rays, all) = scaled.all();
        let (extent, pad) = (&self.scene.extent, self.pad());
        let mut parts = Parts::of(rays);
        while let Some((part, pays)) = parts.next() {
            let (some, who) = outer.of_part(rays, all, part, parts.whole);
            // Nothing is above the only mesh.
            if self.scene.direct
                || pays && pad.is_finite() && in_scene.set::<I>(some, extent, pad, Apex::Origin)
            {
                self.in_scene::<I>(some, who, in_scene, inside);
            } else if parts.whole {
                parts.sort(rays);
            } else {
                for place in 0..some.len() {
                    if let Some(ray) = &mut self.moved[number(place as u32, who)] {
                        through_scene::<I>(self.scene, ray, self.triangles);
                    }
                }
            }
        }
    }

    /// Through the tree over instances. `who` says which of the chunk the rays are.
    #[inline(always)]
    fn in_scene<I: Isa>(
        &mut self,
        rays: &[Ray],
        who: Who,
        packet: &mut Packet,
        inside: &mut Inside,
    ) {
        let Inside {
            local,
            inner,
            packet: in_mesh,
        } = inside;
        let (scene, direct) = (self.scene, self.scene.direct);
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
                self.in_instance::<I>(0, rays, who, inner, in_mesh);
            } else {
                let instance = at & !LEAF;
                let placed = &scene.placed[instance as usize];
                let active = packet.enter::<I>(|row| placed.bounds[row], packet.active);
                local.gather(rays, who, active);
                for place in 0..local.len {
                    let (_, who) = local.all();
                    let number = number(place as u32, who);
                    if let Some(ray) = &self.moved[number] {
                        let (origin, direction) = turned(scene, placed, ray);
                        let t_max = self.limit(number);
                        local.rays[place] = Ray {
                            origin,
                            direction,
                            t_max,
                        };
                    }
                }
                let (rays, who_of_rays) = local.all();
                if !rays.is_empty() && placed.bvh.root() != NO_CHILD {
                    self.in_instance::<I>(instance, rays, who_of_rays, inner, in_mesh);
                    let mut active = active;
                    while active != 0 {
                        let place = active.trailing_zeros();
                        active &= active - 1;
                        packet.t_max[place as usize & (SIZE - 1)] = self.limit(number(place, who));
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
    ) {
        let placed = &self.scene.placed[instance as usize];
        let mesh = &*placed.bvh;
        let off = off(self.scene, placed, self.distance, self.drift);
        // Boxes are padded by `pad` of the ray's distance and the mesh's reach: at least the mesh's reach.
        let pad = off / mesh.reach();
        let mut parts = Parts::of(rays);
        while let Some((part, pays)) = parts.next() {
            let (some, who) = inner.of_part(rays, who, part, parts.whole);
            if pays && pad.is_finite() && packet.set::<I>(some, mesh.extent(), pad, Apex::Origin) {
                let distance = packet.distance();
                let off = off + 8.0 * EPS * (distance.max(mesh.reach()) + mesh.reach());
                self.in_mesh::<I>(instance, packet, who, off);
            } else if parts.whole {
                parts.sort(rays);
            } else {
                for place in 0..some.len() {
                    if let Some(ray) = &mut self.moved[number(place as u32, who)] {
                        through_mesh::<I>(self.scene, instance, ray, self.triangles);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn in_mesh<I: Isa>(&mut self, instance: u32, packet: &mut Packet, who: Who, off: f32) {
        let mesh = &*self.scene.placed[instance as usize].bvh;
        let mut stack = Stack::new();
        let mut t_max = packet.farthest::<I>();
        let mut at = mesh.root();
        loop {
            if at & LEAF == 0 {
                let node = node(mesh.blocks(), at);
                let (mask, enter) = packet.fan.children::<I>(node, t_max);
                if mask != 0 {
                    at = stack.push::<I>(node, enter, mask);
                    continue;
                }
            } else {
                let leaf = leaf(mesh.blocks(), at);
                let mut active = packet.enter::<I>(|row| leaf.bounds[row], packet.active);
                let mut closer = false;
                while active != 0 {
                    let place = active.trailing_zeros();
                    let i = place as usize & (SIZE - 1);
                    active &= active - 1;
                    let mut near = may_meet::<I>(leaf, Member(packet, i), off);
                    let ray = &mut self.moved[number(place, who)];
                    let Some(ray) = ray.as_mut().filter(|_| near != 0) else {
                        continue;
                    };
                    while near != 0 {
                        let triangle = mesh.id(leaf.first + near.trailing_zeros());
                        near &= near - 1;
                        let corners = self.triangles.corners(instance, triangle);
                        ray.decide(corners, instance, triangle);
                    }
                    packet.t_max[i] = ray.limit().next_up();
                    closer = true;
                }
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
}
