//! What is made of up to 64 rays: packets of those that run alike, and the rays that go on alone.

use super::alike::{Members, Who, number};
use super::fan::Apex;
use super::interleaved::Work;
use super::local::Extent;
use super::packet::{Packet, SIZE};
use crate::ray::{Coherence, Ray};
use crate::scene::Scene;
use crate::simd::Isa;

/// How much work is put aside before it is done, or a little more.
const ASIDE: usize = 512;

/// Room for the packets of a chunk.
pub struct Packets {
    /// In scaled scene coordinates: all, and those that run alike.
    pub scaled: Members,
    pub outer: Members,
    pub in_scene: Packet,
    pub inside: Inside,
}

/// The same in the coordinates of a mesh.
pub struct Inside {
    pub local: Members,
    pub inner: Members,
    pub packet: Packet,
}

impl Packets {
    pub const NONE: Packets = Packets {
        scaled: Members::NONE,
        outer: Members::NONE,
        in_scene: Packet::NONE,
        inside: Inside {
            local: Members::NONE,
            inner: Members::NONE,
            packet: Packet::NONE,
        },
    };
}

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

    /// Puts rays aside, to go on at a node of an instance or, without one, from the start.
    #[inline(always)]
    pub fn alone(&mut self, mut places: u64, instance: u32, start: u32, who: Who) {
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

    /// By how much the boxes of instances are padded, of the largest coordinate at hand.
    pub fn outer_pad(&self) -> f32 {
        if self.scene.direct {
            0.0
        } else {
            self.scene.rounding()
        }
    }

    /// Whether rays make a packet that may pay. Parallel rays from all over share their signs, but no boxes.
    #[inline(always)]
    pub fn packed<I: Isa>(
        &self,
        rays: &[Ray],
        extent: &Extent,
        pad: f32,
        apex: Apex,
        packet: &mut Packet,
    ) -> bool {
        packet.set::<I>(rays, extent, pad, apex)
            && !(self.coherence == Coherence::Unknown
                && apex == Apex::Origin
                && packet.spread() > extent.reach() / 16.0)
    }
}
