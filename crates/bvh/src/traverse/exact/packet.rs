//! Float64 answers for rays that run alike: the boxes are those of packets, padded as for a single exact ray.

use crate::blas::Bvh;
use crate::node::{MAX_LEAF_TRIANGLES, LeafNode, NO_CHILD};
use crate::ray::{ExactHit, ExactRay, Ray};
use crate::scene::rebraid::Part;
use crate::scene::{ExactTriangles, Placed, Scene};
use crate::simd::Isa;
use crate::traverse::exact::rays::ExactRays;
use crate::traverse::exact::single::{Moved, may_meet, off, through_part, through_scene, turned};
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::tlas::{Packets, Query};
use crate::traverse::packet::traversal::{AtLeaf, leaf_by_leaf};
use crate::traverse::packet::{Packet, SIZE};
use crate::traverse::stream::packet_groups::{Members, Who, number, numbers};
use crate::traverse::trav_ray::EPS;
use crate::traverse::triangle::single::Member;

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
        let query = InMesh {
            query: self,
            mesh,
            instance: part.instance,
            off,
            who,
        };
        leaf_by_leaf::<I, _>(mesh, part.start, packet, query);
    }
}

/// The rays of a packet in a mesh.
struct InMesh<'a, 'b> {
    query: &'a mut Exact<'b>,
    mesh: &'a Bvh,
    instance: u32,
    /// What float32 coordinates there may be off by.
    off: f32,
    who: Who<'a>,
}

impl AtLeaf for InMesh<'_, '_> {
    #[inline(always)]
    fn meet<I: Isa>(&mut self, leaf: &LeafNode, active: u64, packet: &mut Packet) -> u64 {
        let Self {
            ref mut query,
            mesh,
            instance,
            off,
            who,
        } = *self;
        mesh.prefetch_id::<I>(leaf.first);
        let mut candidates = packet.candidates_within::<I>(leaf, 4.0 * off);
        // Large triangles are asked for all rays at a time, for many meet each; small ones where a ray may meet them.
        let large = candidates.count_ones() * RAYS_EACH <= active.count_ones();
        let (mut near, mut some) = ([0; SIZE], 0);
        if !large {
            candidates = 0;
            let mut left = active;
            while left != 0 {
                let place = left.trailing_zeros() as usize & (SIZE - 1);
                left &= left - 1;
                near[place] = may_meet::<I>(leaf, Member(packet, place), off);
                some |= u64::from(near[place] != 0) << place;
                candidates |= near[place];
            }
        }
        let mut triangles = [(0, [[0.0; 3]; 3]); MAX_LEAF_TRIANGLES];
        // They come from all over the memory: a short loop keeps many fetches under way.
        let mut left = candidates;
        while left != 0 {
            let k = left.trailing_zeros();
            left &= left - 1;
            let id = mesh.id(leaf.first + k);
            let corners = query.triangles.corners(instance, id);
            triangles[k as usize & (MAX_LEAF_TRIANGLES - 1)] = (id, corners);
        }
        if large {
            let rays = numbers(active, who);
            let mut closer = false;
            while candidates != 0 {
                let (id, corners) =
                    triangles[candidates.trailing_zeros() as usize & (MAX_LEAF_TRIANGLES - 1)];
                candidates &= candidates - 1;
                let triangle = (instance, id);
                closer |= query.rays.meet_all(rays, corners, triangle, query.hits);
            }
            some = if closer { active } else { 0 };
        }
        let mut sooner = 0;
        while some != 0 {
            let place = some.trailing_zeros();
            some &= some - 1;
            let number = number(place, who);
            let mut near = near[place as usize & (SIZE - 1)];
            while near != 0 {
                let (id, corners) = triangles[near.trailing_zeros() as usize & (MAX_LEAF_TRIANGLES - 1)];
                near &= near - 1;
                query.rays.meet(number, corners, (instance, id), query.hits);
            }
            sooner |= query.shorten(place, packet, who);
        }
        sooner
    }
}

impl Exact<'_> {
    /// Ends a ray of a packet at what it has met; its bit if that is sooner than before.
    #[inline(always)]
    fn shorten(&self, place: u32, packet: &mut Packet, who: Who) -> u64 {
        let t_max = &mut packet.t_max[place as usize & (SIZE - 1)];
        let limit = self.rays.limit(number(place, who)).next_up();
        let sooner = limit < *t_max;
        *t_max = limit;
        u64::from(sooner) << place
    }
}
