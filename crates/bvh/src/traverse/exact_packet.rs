//! Float64 answers for rays that run alike: the boxes are those of a packet, padded as for a single exact ray.

use super::exact::{Moved, may_meet, off};
use super::fan::Apex;
use super::line::Member;
use super::local::EPS;
use super::packet::{Packet, SIZE};
use super::stack::Stack;
use super::together::NO_RAY;
use crate::block::{LEAF, NO_CHILD, leaf, node};
use crate::ray::{ExactHit, ExactRay, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;

/// Rays start where they are given, and so at one point, up to this many times the reach of the scene.
const NEAR: f64 = 8.0;

/// The answers of at most 64 rays; false, and nothing is answered, if they make no packet, or the scene is more than
/// one mesh in its own place.
#[inline(always)]
pub fn closest_exact_packet<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    hits: &mut [ExactHit],
) -> bool {
    if !scene.direct || scene.root == NO_CHILD {
        return false;
    }
    let placed = &scene.placed[0];
    let mesh = &*placed.bvh;
    let world = scene.origin();
    let mut moved: [Option<Moved>; SIZE] = [None; SIZE];
    let mut local = [NO_RAY; SIZE];
    let mut index = [0usize; SIZE];
    let (mut count, mut drift, mut distance) = (0, 0.0f64, 0.0f32);
    for (i, ray) in rays.iter().enumerate() {
        let Some(mut ray) = Moved::new(scene, ray) else {
            continue;
        };
        ray.start = std::array::from_fn(|a| (ray.origin[a] - world[a]) * scene.unit);
        ray.forward = 0.0;
        if ray
            .start
            .iter()
            .any(|x| x.abs() > NEAR * f64::from(scene.reach))
        {
            return false;
        }
        let start = ray.start.map(|x| x as f32);
        distance = start.iter().fold(distance, |m, x| m.max(x.abs()));
        drift = drift.max(ray.drift);
        local[count] = Ray {
            origin: start,
            direction: ray.direction.map(|d| (d * scene.unit) as f32),
            t_max: ray.limit().next_up(),
        };
        moved[count] = Some(ray);
        index[count] = i;
        count += 1;
    }
    hits.fill(ExactHit::MISS);
    if count == 0 {
        return true;
    }
    let off = off(scene, placed, distance, drift);
    // Boxes are padded by `pad` of the ray's distance and the mesh's reach: at least the mesh's reach.
    let pad = off / mesh.reach();
    let mut packet = Packet::NONE;
    if !pad.is_finite() || !packet.set::<I>(&local[..count], mesh.extent(), pad, Apex::Origin) {
        return false;
    }
    let off = off + 8.0 * EPS * (distance + mesh.reach());
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
                let i = active.trailing_zeros() as usize & (SIZE - 1);
                active &= active - 1;
                let mut near = may_meet::<I>(leaf, Member(&packet, i), off);
                let Some(ray) = moved[i].as_mut().filter(|_| near != 0) else {
                    continue;
                };
                while near != 0 {
                    let triangle = mesh.id(leaf.first + near.trailing_zeros());
                    near &= near - 1;
                    ray.decide(triangles.corners(0, triangle), 0, triangle);
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
            None => break,
        }
    }
    for (ray, i) in moved[..count].iter().flatten().zip(index) {
        hits[i] = ray.answer();
    }
    true
}
