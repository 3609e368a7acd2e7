//! Float64 answers for rays that run alike: the boxes are those of packets, padded as for a single exact ray.

use super::alike::{Members, Who, number, numbers};
use super::exact::{Moved, may_meet, off, through_part, through_scene, turned};
use super::exact_rays::ExactRays;
use super::fan::Apex;
use super::line::Member;
use super::local::EPS;
use super::packet::{Packet, SIZE};
use super::packets::{Packets, Query};
use super::stack::Stack;
use crate::block::{LEAF, Leaf, NO_CHILD, leaf, node};
use crate::part::Part;
use crate::ray::{ExactHit, ExactRay, Ray};
use crate::scene::{ExactTriangles, Placed, Scene};
use crate::simd::Isa;

/// Rays start where they are given, and so at one point, up to this many times the reach of the scene.
const NEAR: f64 = 8.0;

/// Candidates for each ray from which on each triangle of a leaf is tested by itself for every ray at once.
const RAYS_EACH: u32 = 2;

/// The answers of at most 64 rays.
#[inline(always)]
pub fn closest_exact_chunk<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    hits: &mut [ExactHit],
    (packets, near, exact): (&mut Packets, &mut Members, &mut ExactRays),
) {
    hits.fill(ExactHit::MISS);
    if scene.root == NO_CHILD {
        return;
    }
    exact.take(scene, rays, NEAR * f64::from(scene.reach));
    near.clear();
    let (mut distance, mut drift) = (0.0f32, 0.0f64);
    for (i, (ray, hit)) in rays.iter().zip(hits.iter_mut()).enumerate() {
        match exact.starts_near(i) {
            None => {}
            Some(true) => {
                let (ray, farthest, off) = exact.rounded(scene, i);
                near.push(ray, i);
                (distance, drift) = (distance.max(farthest), drift.max(off));
            }
            Some(false) => {
                if let Some(mut moved) = Moved::new(scene, ray) {
                    through_scene::<I>(scene, &mut moved, triangles);
                    *hit = moved.answer();
                }
            }
        }
    }
    if near.len == 0 {
        return;
    }
    let (some, who) = near.all();
    // In their own places, if they are all there are.
    let who = who.filter(|_| some.len() < rays.len());
    let mut query = Exact {
        scene,
        triangles,
        rays: exact,
        hits,
        drift,
        distance,
    };
    packets.ask::<I, _>(&mut query, scene, some, who);
    for i in 0..rays.len() {
        if exact.starts_near(i) == Some(true) {
            exact.answer(i, &mut hits[i]);
        }
    }
}

/// The rays of a chunk that start near, by number.
struct Exact<'a> {
    scene: &'a Scene,
    triangles: &'a dyn ExactTriangles,
    rays: &'a mut ExactRays,
    /// The nearest so far; their t is not told yet.
    hits: &'a mut [ExactHit],
    /// The largest of them, in scaled scene coordinates.
    drift: f64,
    distance: f32,
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
    fn turned(&self, _: &Ray, number: usize, placed: &Placed) -> Ray {
        let line = self.rays.line(self.scene, number);
        let (origin, direction) = turned(self.scene, placed, line);
        Ray {
            origin,
            direction,
            t_max: self.rays.limit(number).next_up(),
        }
    }

    #[inline(always)]
    fn limit(&self, number: usize, _: f32) -> f32 {
        self.rays.limit(number).next_up()
    }

    #[inline(always)]
    fn alone<I: Isa>(&mut self, mut places: u64, part: Option<&Part>, who: Who) {
        while places != 0 {
            let i = number(places.trailing_zeros(), who);
            places &= places - 1;
            let mut ray = self.rays.alone(self.scene, i, &self.hits[i]);
            match part {
                None => through_scene::<I>(self.scene, &mut ray, self.triangles),
                Some(part) => through_part::<I>(self.scene, part, &mut ray, self.triangles),
            }
            self.rays.keep(i, &ray, &mut self.hits[i]);
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
                let active = packet.enter::<I>(|row| leaf.bounds[row], packet.active);
                if active != 0 && self.in_leaf::<I>(leaf, active, off, part, packet, who) {
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

impl Exact<'_> {
    /// The rays of a packet that enter a leaf; whether any of them now ends sooner.
    #[inline(always)]
    fn in_leaf<I: Isa>(
        &mut self,
        leaf: &Leaf,
        mut active: u64,
        off: f32,
        part: &Part,
        packet: &mut Packet,
        who: Who,
    ) -> bool {
        let mesh = &*self.scene.placed[part.instance as usize].bvh;
        let mut candidates = packet.candidates_within::<I>(leaf, 4.0 * off);
        let mut closer = false;
        if candidates.count_ones() * RAYS_EACH <= active.count_ones() {
            // Large triangles: many rays meet each.
            let rays = numbers(active, who);
            while candidates != 0 {
                let triangle = mesh.id(leaf.first + candidates.trailing_zeros());
                candidates &= candidates - 1;
                let corners = self.triangles.corners(part.instance, triangle);
                let triangle = (part.instance, triangle);
                closer |= self.rays.meet_all(rays, corners, triangle, self.hits);
            }
            while closer && active != 0 {
                let place = active.trailing_zeros();
                active &= active - 1;
                let t_max = self.rays.limit(number(place, who)).next_up();
                packet.t_max[place as usize & (SIZE - 1)] = t_max;
            }
            return closer;
        }
        while active != 0 {
            let place = active.trailing_zeros();
            let i = place as usize & (SIZE - 1);
            active &= active - 1;
            let mut near = may_meet::<I>(leaf, Member(packet, i), off);
            if near == 0 {
                continue;
            }
            let number = number(place, who);
            while near != 0 {
                let triangle = mesh.id(leaf.first + near.trailing_zeros());
                near &= near - 1;
                let corners = self.triangles.corners(part.instance, triangle);
                let triangle = (part.instance, triangle);
                self.rays.meet(number, corners, triangle, self.hits);
            }
            packet.t_max[i] = self.rays.limit(number).next_up();
            closer = true;
        }
        closer
    }
}
