//! Rays as they are given, 64 at a time, and those of them that go on alone.

use super::alike::{Members, Who, number};
use super::fan::Apex;
use super::interleaved::Work;
use super::packet::{Packet, SIZE};
use crate::block::NO_CHILD;
use crate::part::Part;
use crate::ray::{Coherence, Ray};
use crate::scene::{Placed, Scene};
use crate::simd::Isa;

/// How much work is put aside before it is done, or a little more.
const ASIDE: usize = 512;

/// The chunk at hand, and the rays that go on alone.
pub struct Chunk<'a> {
    pub scene: &'a Scene,
    pub coherence: Coherence,
    pub given: &'a [Ray],
    /// Of the first of them in the batch.
    pub number: usize,
    pub aside: Vec<Work>,
}

impl<'a> Chunk<'a> {
    pub fn none(scene: &'a Scene, coherence: Coherence) -> Chunk<'a> {
        Chunk {
            scene,
            coherence,
            given: &[],
            number: 0,
            aside: Vec::new(),
        }
    }

    /// A bit for each ray.
    pub fn every(&self) -> u64 {
        u64::MAX >> (SIZE - self.given.len())
    }

    /// Whether it is time to do what was put aside.
    pub fn is_full(&self) -> bool {
        self.aside.len() >= ASIDE
    }

    /// Puts rays aside, to go through a part or, without one, through everything.
    #[inline(always)]
    pub fn alone(&mut self, places: u64, part: Option<&Part>, who: Who) {
        match part {
            Some(part) => self.alone_from(places, part.instance, part.start, who),
            None => self.alone_from(places, 0, NO_CHILD, who),
        }
    }

    /// Puts rays aside, to go on at a node of an instance.
    #[inline(always)]
    pub fn alone_from(&mut self, mut places: u64, instance: u32, start: u32, who: Who) {
        while places != 0 {
            let i = number(places.trailing_zeros(), who);
            places &= places - 1;
            self.aside.push(Work {
                ray: self.given[i],
                number: self.number + i,
                instance,
                start,
            });
        }
    }

    /// The rays in scaled scene coordinates.
    #[inline(always)]
    pub fn scaled<'b>(&self, room: &'b mut Members) -> &'b [Ray]
    where
        'a: 'b,
    {
        if self.scene.unit == 1.0 {
            return self.given;
        }
        let unit = self.scene.unit as f32;
        room.clear();
        for (i, ray) in self.given.iter().enumerate() {
            let scaled = Ray {
                origin: ray.origin.map(|x| x * unit),
                direction: ray.direction.map(|x| x * unit),
                ..*ray
            };
            room.push(scaled, i);
        }
        room.all().0
    }

    /// Whether rays make a packet that may pay. Parallel rays from all over share their signs, but no boxes.
    #[inline(always)]
    pub fn packed<I: Isa>(
        &self,
        rays: &[Ray],
        placed: Option<&Placed>,
        apex: Apex,
        packet: &mut Packet,
    ) -> bool {
        let (extent, pad) = match placed {
            Some(placed) => (placed.bvh.extent(), 0.0),
            None => {
                let within = |ray: &Ray| self.scene.is_within(ray.origin);
                let (extent, reach) = (&self.scene.extent, self.scene.reach);
                let pad = self.scene.rounding(rays.iter().all(within));
                // Packets count from the reach of the boxes; that of the meshes may be more.
                (extent, pad * (reach / extent.reach()).max(1.0))
            }
        };
        pad.is_finite()
            && packet.set::<I>(rays, extent, pad, apex)
            && !(self.coherence == Coherence::Unknown
                && apex == Apex::Origin
                && packet.spread() > extent.reach() / 16.0)
    }
}
