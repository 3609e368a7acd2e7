//! From up to 64 rays to packets of those that run alike: through the tree over instances, and in each instance anew,
//! because there they run elsewhere. What is asked for is a [`Query`].

use crate::node::{LEAF, node};
use crate::ray::Ray;
use crate::scene::rebraid::Part;
use crate::scene::{Placed, Scene};
use crate::simd::Isa;
use crate::traverse::packet::{Packet, SIZE};
use crate::traverse::stack::Stack;
use crate::traverse::stream::packet_groups::{Members, Parts, Who, number};

/// What rays are asked for. They are known by their number in the chunk; `who` says which numbers those at hand have.
pub trait Query {
    /// Makes rays a packet, in scaled scene coordinates or in those of a placed mesh; false where it may not pay.
    fn packed<I: Isa>(&self, rays: &[Ray], placed: Option<&Placed>, packet: &mut Packet) -> bool;

    /// A ray in the coordinates of a placed mesh, no longer than it is of interest by now.
    fn turned(&self, ray: &Ray, number: usize, placed: &Placed) -> Ray;

    /// The t up to which a ray that was of interest up to `t_max` still is; below 0 for none.
    fn limit(&self, number: usize, t_max: f32) -> f32;

    /// Takes a packet through a part of a mesh.
    fn in_part<I: Isa>(&mut self, part: &Part, packet: &mut Packet, who: Who);

    /// Takes each ray of a mask by itself through a part or, without one, through everything.
    fn alone<I: Isa>(&mut self, places: u64, part: Option<&Part>, who: Who);
}

/// Room for the packets of a chunk.
pub struct Packets {
    /// In scaled scene coordinates: those that run alike.
    outer: Members,
    in_scene: Packet,
    inside: Inside,
}

/// The same in the coordinates of a mesh: all that enter an instance, and those of them that run alike.
struct Inside {
    local: Members,
    inner: Members,
    packet: Packet,
}

impl Packets {
    pub const NONE: Packets = Packets {
        outer: Members::NONE,
        in_scene: Packet::NONE,
        inside: Inside {
            local: Members::NONE,
            inner: Members::NONE,
            packet: Packet::NONE,
        },
    };

    /// Asks for rays in scaled scene coordinates; the scene is not empty.
    #[inline(always)]
    pub fn ask<I: Isa, Q: Query>(&mut self, query: &mut Q, scene: &Scene, rays: &[Ray], who: Who) {
        let mut parts = Parts::of(rays);
        while let Some((part, pays)) = parts.next() {
            let (some, who_of_some) = self.outer.of_part(rays, who, part, parts.whole);
            // Nothing is above the only mesh.
            if scene.direct || pays && query.packed::<I>(some, None, &mut self.in_scene) {
                let packet = &mut self.in_scene;
                in_scene::<I, Q>(query, scene, some, who_of_some, packet, &mut self.inside);
            } else if parts.whole {
                parts.sort(rays);
            } else {
                query.alone::<I>(part, None, who);
            }
        }
    }
}

/// Through the tree over instances.
#[inline(always)]
fn in_scene<I: Isa, Q: Query>(
    query: &mut Q,
    scene: &Scene,
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
    let mut stack = Stack::new();
    let (mut at, mut t_max) = match scene.direct {
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
        } else {
            let part = &scene.parts[(at & !LEAF) as usize];
            let placed = &scene.placed[part.instance as usize];
            let mut entered = 0;
            if !scene.direct {
                entered = packet.enter::<I>(|row| part.corners[row % 2][row / 2], packet.active);
                local.gather(rays, who, entered);
                for (ray, number) in local.rays[..local.len].iter_mut().zip(&local.who) {
                    *ray = query.turned(ray, usize::from(*number), placed);
                }
            }
            if scene.direct || entered != 0 {
                let (some, who_of_some) = match scene.direct {
                    true => (rays, who),
                    false => local.all(),
                };
                in_part::<I, Q>(query, placed, part, some, who_of_some, inner, in_mesh);
            }
            if entered != 0 {
                while entered != 0 {
                    let place = entered.trailing_zeros();
                    entered &= entered - 1;
                    let t_max = &mut packet.t_max[place as usize & (SIZE - 1)];
                    *t_max = query.limit(number(place, who), *t_max);
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

/// Through a part of a mesh, for rays in its coordinates: as one packet, or one for each heading.
#[inline(always)]
fn in_part<I: Isa, Q: Query>(
    query: &mut Q,
    placed: &Placed,
    part: &Part,
    rays: &[Ray],
    who: Who,
    inner: &mut Members,
    packet: &mut Packet,
) {
    let mut alike = Parts::of(rays);
    while let Some((places, pays)) = alike.next() {
        let (some, who_of_some) = inner.of_part(rays, who, places, alike.whole);
        if pays && query.packed::<I>(some, Some(placed), packet) {
            query.in_part::<I>(part, packet, who_of_some);
        } else if alike.whole {
            alike.sort(rays);
        } else {
            query.alone::<I>(places, Some(part), who);
        }
    }
}
