//! Packets through the scene: the nearest hits.

use crate::blas::{Bvh, TRIANGLE_LIMIT};
use crate::node::{LeafNode, NO_CHILD};
use crate::ray::{Coherence, Hit, NOTHING, Ray};
use crate::scene::rebraid::Part;
use crate::scene::{Placed, Scene};
use crate::simd::{Isa, Quad, Vector};
use crate::traverse::NearestApart;
use crate::traverse::node_test::NO_SLOT;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::incoherent::closest_apart;
use crate::traverse::packet::soa::{keep, load, rays, store};
use crate::traverse::packet::tlas::{Packets, Query};
use crate::traverse::packet::traversal::{AtLeaf, leaf_by_leaf};
use crate::traverse::packet::{Packet, SIZE};
use crate::traverse::single::interleaved::trace;
use crate::traverse::stream::chunker::{ASIDE, Aside, Chunk, Chunks, prefetch_all};
use crate::traverse::stream::packet_groups::{Members, Who, number};
use crate::traverse::triangle::packet::{MetEach, meet_each};
use crate::traverse::triangle::packet_edges::Near;

/// Rays of a packet that are fewer than this at a node go on alone.
pub const FEW: u32 = 5;

/// What the rays of a packet met in a mesh; t stands in the packet.
pub struct Nearest {
    /// Words in the bits of floats.
    slot: [f32; SIZE],
    /// Times `det`, until [`Nearest::divide`].
    u: [f32; SIZE],
    v: [f32; SIZE],
    det: [f32; SIZE],
}

impl Nearest {
    pub const NOTHING: Nearest = Nearest {
        slot: [f32::from_bits(NO_SLOT); SIZE],
        u: [0.0; SIZE],
        v: [0.0; SIZE],
        det: [1.0; SIZE],
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
    if scene.root == NO_CHILD {
        hits.fill(Hit::MISS);
        return;
    }
    let (mut packets, mut scaled) = (Packets::NONE, Members::NONE);
    let (mut aside, mut apart) = (Aside::default(), Vec::new());
    let mut chunks = Chunks::of(scene, rays, coherence);
    let mut cleared = 0;
    while chunks.advance::<I>(&mut aside, &mut apart) {
        // What is written soon is cleared when it is taken, not all of a long batch before.
        if APART || !scene.direct {
            hits[cleared..chunks.taken()].fill(Hit::MISS);
            cleared = chunks.taken();
        }
        let chunk = chunks.chunk(scene, &mut aside, &mut apart);
        if !APART {
            prefetch_all::<I, _>(&hits[chunk.numbers[0] as usize..][..chunk.numbers.len()]);
        }
        let before = chunk.aside.len();
        let scaled = chunk.scaled(&mut scaled);
        let mut together = Together::<APART> { chunk, hits };
        packets.ask::<I, _>(&mut together, scene, scaled, None);
        chunks.count(aside.len() - before, std::mem::take(&mut aside.visits));
        if aside.len() >= ASIDE {
            let work = aside.drain(rays);
            trace::<I, _, false>(scene, &mut NearestApart { work, hits });
        }
    }
    if APART || !scene.direct {
        hits[cleared..].fill(Hit::MISS);
    }
    if aside.len() > 0 {
        let work = aside.drain(rays);
        trace::<I, _, false>(scene, &mut NearestApart { work, hits });
    }
}

/// The nearest hits of the chunk at hand.
struct Together<'a, 'b, const APART: bool> {
    chunk: Chunk<'a>,
    /// Of the whole batch.
    hits: &'b mut [Hit],
}

impl<const APART: bool> Together<'_, '_, APART> {
    /// Where in the batch a ray of the chunk is.
    #[inline(always)]
    fn at(&self, number: usize) -> usize {
        self.chunk.numbers[number] as usize
    }
}

impl<const APART: bool> Query for Together<'_, '_, APART> {
    #[inline(always)]
    fn packed<I: Isa>(&self, rays: &[Ray], placed: Option<&Placed>, packet: &mut Packet) -> bool {
        self.chunk.packed::<I>(rays, placed, Apex::Origin, packet)
    }

    #[inline(always)]
    fn turned(&self, ray: &Ray, number: usize, placed: &Placed) -> Ray {
        let mut ray = *ray;
        ray.shorten(self.hits[self.at(number)].t);
        placed.local(&ray)
    }

    #[inline(always)]
    fn limit(&self, number: usize, t_max: f32) -> f32 {
        t_max.min(self.hits[self.at(number)].t)
    }

    #[inline(always)]
    fn alone<I: Isa>(&mut self, places: u64, part: Option<&Part>, who: Who) {
        if !APART && self.chunk.scene.direct {
            for place in (0..SIZE as u32).filter(|place| places >> place & 1 != 0) {
                let at = self.at(number(place, who));
                self.hits[at] = Hit::MISS;
            }
        }
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
        nearest.divide::<I>();
        let first = self.chunk.numbers[0] as usize;
        if !APART
            && self.chunk.scene.direct
            && who.is_none()
            && let Ok(hits) = (&mut self.hits[first..][..self.chunk.numbers.len()]).try_into()
        {
            nearest.write::<I>(mesh, part.instance, packet, hits);
            return;
        }
        for place in 0..packet.active.count_ones() {
            let i = place as usize & (SIZE - 1);
            let slot = nearest.slot[i].to_bits();
            let mut hit = Hit::MISS;
            if slot != NO_SLOT {
                hit = Hit {
                    t: packet.t_max[i],
                    u: nearest.u[i],
                    v: nearest.v[i],
                    instance: part.instance,
                    triangle: mesh.id(slot),
                };
            }
            let at = self.at(number(place, who));
            let known = &mut self.hits[at];
            if !APART && self.chunk.scene.direct {
                *known = hit;
            } else if slot != NO_SLOT {
                known.take(hit);
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
fn closest_below<I: Isa>(mesh: &Bvh, start: u32, packet: &mut Packet, nearest: &mut Nearest) {
    let mut near = Near::NOTHING;
    leaf_by_leaf::<I, _>(
        mesh,
        start,
        packet,
        Closest {
            mesh,
            nearest,
            near: &mut near,
        },
    );
}

/// The nearest hits in the leaves of a mesh.
struct Closest<'a> {
    mesh: &'a Bvh,
    nearest: &'a mut Nearest,
    near: &'a mut Near,
}

impl AtLeaf for Closest<'_> {
    #[inline(always)]
    fn meet<I: Isa>(&mut self, leaf: &LeafNode, active: u64, packet: &mut Packet) -> u64 {
        closest_in_leaf::<I, true>(self.mesh, leaf, active, packet, self.nearest, self.near)
    }
}

/// The rays for which anything was found. `ONE` as in [`Near::find`].
#[inline(always)]
pub fn closest_in_leaf<I: Isa, const ONE: bool>(
    mesh: &Bvh,
    leaf: &LeafNode,
    active: u64,
    packet: &mut Packet,
    nearest: &mut Nearest,
    near: &mut Near,
) -> u64 {
    let mut closer = 0;
    near.find::<I, ONE>(leaf, active, packet);
    while near.some != 0 {
        let mut groups = near.groups::<I>();
        while groups != 0 {
            let group = groups.trailing_zeros() as usize;
            groups &= groups - 1;
            let met = meet_each::<I, false>(leaf, packet, group, near);
            let first = nearest.take::<I>(mesh, leaf, met, group, packet);
            closer |= u64::from(first) << (I::RAYS * group);
        }
        near.next();
    }
    if closer != 0 {
        mesh.prefetch_id::<I>(leaf.first);
    }
    closer
}

const _: () = assert!(TRIANGLE_LIMIT < f32::INFINITY.to_bits() as usize);

impl Nearest {
    /// Makes u and v what they are, once all has been met.
    #[inline(always)]
    fn divide<I: Isa>(&mut self) {
        for group in 0..SIZE / 16 {
            let det = load::<I>(&self.det, group);
            let u = load::<I>(&self.u, group).div(det);
            let v = load::<I>(&self.v, group).div(det);
            store::<I>(&mut self.u, group, u);
            store::<I>(&mut self.v, group, v);
        }
    }

    /// Writes the hits of a full packet, each in its place: four at a time, and without a branch, for where rays miss is
    /// anybody's guess.
    #[inline(always)]
    fn write<I: Isa>(&self, mesh: &Bvh, instance: u32, packet: &Packet, hits: &mut [Hit; SIZE]) {
        let (mut t, mut instances) = ([0.0; SIZE], [0.0; SIZE]);
        let [far, here, nowhere] = [
            f32::INFINITY,
            f32::from_bits(instance),
            f32::from_bits(NOTHING),
        ]
        .map(I::F16::splat);
        for group in 0..SIZE / 16 {
            let slot = load::<I>(&self.slot, group);
            // As a float, `NO_SLOT` is NaN, and no other is: there are too few triangles.
            let met = slot.eq(slot);
            let known = load::<I>(&packet.t_max, group);
            store::<I>(&mut t, group, I::F16::select(met, known, far));
            store::<I>(&mut instances, group, I::F16::select(met, here, nowhere));
        }
        for (four, hits) in hits.chunks_exact_mut(4).enumerate() {
            let columns = [&t, &self.u, &self.v, &instances];
            let columns = columns.map(|row| Quad::new(std::array::from_fn(|i| row[4 * four + i])));
            let rows = Quad::transpose(columns);
            for (i, (hit, row)) in hits.iter_mut().zip(rows).enumerate() {
                // SAFETY: a hit begins with t, u, v and the instance, four words.
                unsafe { (&raw mut *hit).cast::<[f32; 4]>().write(row.array()) };
                // All bits of what is nothing are set.
                let slot = self.slot[4 * four + i].to_bits();
                let missed = u32::from(slot == NO_SLOT).wrapping_neg();
                hit.triangle = mesh.id(slot & !missed) | missed;
            }
        }
    }

    /// Takes what rays of a group met, where it comes first by (t, id); returns the lanes where it does.
    #[inline(always)]
    fn take<I: Isa>(
        &mut self,
        mesh: &Bvh,
        leaf: &LeafNode,
        met: MetEach<I::Rays>,
        group: usize,
        packet: &mut Packet,
    ) -> u32 {
        let MetEach {
            hit, t, u, v, det, ..
        } = met;
        let known = rays::<I>(&packet.t_max, group);
        let slot = I::plus(met.triangle, leaf.first);
        let ties = <I::Rays as Vector>::bits(t.eq(known)) & hit;
        let mut first = hit & !ties;
        if ties != 0 {
            first |= self.ties::<I>(mesh, slot, group, ties);
        }
        let lanes = <I::Rays as Vector>::mask(first);
        keep::<I>(&mut packet.t_max, group, lanes, t);
        keep::<I>(&mut self.u, group, lanes, u);
        keep::<I>(&mut self.v, group, lanes, v);
        keep::<I>(&mut self.det, group, lanes, det);
        keep::<I>(&mut self.slot, group, lanes, slot);
        first
    }

    /// Of lanes whose t is the one that is known those that come first by their id, or because nothing was met there.
    #[cold]
    #[inline(never)]
    fn ties<I: Isa>(&self, mesh: &Bvh, slot: I::Rays, group: usize, ties: u32) -> u32 {
        let mut slots = [0u32; 16];
        // SAFETY: the array holds at least as many words, which as floats are only moved.
        unsafe { slot.store(slots.as_mut_ptr().cast()) };
        (0..16)
            .filter(|lane| ties >> lane & 1 != 0)
            .filter(|lane| {
                let known = self.slot[I::RAYS * group + lane].to_bits();
                known == NO_SLOT || mesh.id(slots[*lane]) < mesh.id(known)
            })
            .fold(0, |lanes, lane| lanes | 1 << lane)
    }
}
