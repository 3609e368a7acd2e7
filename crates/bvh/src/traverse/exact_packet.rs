//! Float64 answers for rays that run alike: the boxes are those of packets, padded as for a single exact ray.

use super::alike::{Members, Who, number};
use super::exact::{Moved, may_meet, off, through_part, through_scene, turned};
use super::fan::Apex;
use super::line::Member;
use super::local::EPS;
use super::packet::{Packet, SIZE};
use super::packets::{Packets, Query};
use super::stack::Stack;
use crate::block::{LEAF, leaf, node};
use crate::part::Part;
use crate::ray::{ExactHit, ExactRay, Ray};
use crate::scene::{ExactTriangles, Placed, Scene};
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
    near: &mut Members,
) {
    let mut exact = Exact {
        scene,
        triangles,
        moved: [None; SIZE],
        drift: 0.0,
        distance: 0.0,
    };
    near.clear();
    for (i, (ray, hit)) in rays.iter().zip(hits.iter_mut()).enumerate() {
        *hit = ExactHit::MISS;
        if let Some(mut moved) = Moved::new(scene, ray) {
            if moved.stay(scene, NEAR) {
                near.push(exact.add(&moved), i);
                exact.moved[i] = Some(moved);
            } else {
                through_scene::<I>(scene, &mut moved, triangles);
                *hit = moved.answer();
            }
        }
    }
    if near.len != 0 {
        let (rays, who) = near.all();
        packets.ask::<I, _>(&mut exact, scene, rays, who);
    }
    for (moved, hit) in exact.moved.iter().zip(hits) {
        if let Some(moved) = moved {
            *hit = moved.answer();
        }
    }
}

/// The rays of a chunk that start near, by number.
struct Exact<'a> {
    scene: &'a Scene,
    triangles: &'a dyn ExactTriangles,
    /// `None` for what is not in packets.
    moved: [Option<Moved>; SIZE],
    /// The largest of them, in scaled scene coordinates.
    drift: f64,
    distance: f32,
}

impl Exact<'_> {
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
}

impl Query for Exact<'_> {
    /// Boxes are padded by a part of the distance of the rays and the reach of what they meet: of that reach at least.
    #[inline(always)]
    fn packed<I: Isa>(&self, rays: &[Ray], placed: Option<&Placed>, packet: &mut Packet) -> bool {
        let (extent, pad) = match placed {
            Some(placed) => {
                let off = off(self.scene, placed, self.distance, self.drift);
                (placed.bvh.extent(), off / placed.bvh.reach())
            }
            None => {
                let extent = &self.scene.extent;
                let slack = self.scene.slack(self.distance) + self.drift as f32;
                (extent, 2.0 * slack / extent.reach())
            }
        };
        pad.is_finite() && packet.set::<I>(rays, extent, pad, Apex::Origin)
    }

    #[inline(always)]
    fn turned(&self, ray: &Ray, number: usize, placed: &Placed) -> Ray {
        let Some(moved) = &self.moved[number & (SIZE - 1)] else {
            return *ray;
        };
        let (origin, direction) = turned(self.scene, placed, moved);
        Ray {
            origin,
            direction,
            t_max: moved.limit().next_up(),
        }
    }

    #[inline(always)]
    fn limit(&self, number: usize, t_max: f32) -> f32 {
        let moved = &self.moved[number & (SIZE - 1)];
        moved.as_ref().map_or(t_max, |ray| ray.limit().next_up())
    }

    #[inline(always)]
    fn alone<I: Isa>(&mut self, mut places: u64, part: Option<&Part>, who: Who) {
        while places != 0 {
            let ray = &mut self.moved[number(places.trailing_zeros(), who)];
            places &= places - 1;
            match (ray, part) {
                (None, _) => {}
                (Some(ray), None) => through_scene::<I>(self.scene, ray, self.triangles),
                (Some(ray), Some(part)) => through_part::<I>(self.scene, part, ray, self.triangles),
            }
        }
    }

    #[inline(always)]
    fn in_part<I: Isa>(&mut self, part: &Part, packet: &mut Packet, who: Who) {
        let placed = &self.scene.placed[part.instance as usize];
        let mesh = &*placed.bvh;
        let off = off(self.scene, placed, self.distance, self.drift)
            + 8.0 * EPS * (packet.distance().max(mesh.reach()) + mesh.reach());
        let mut stack = Stack::new();
        let mut t_max = packet.farthest::<I>();
        let mut at = part.start;
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
                        let corners = self.triangles.corners(part.instance, triangle);
                        ray.decide(corners, part.instance, triangle);
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
