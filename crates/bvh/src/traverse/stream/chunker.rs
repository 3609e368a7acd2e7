//! Rays as they are given, 64 at a time, and those of them that go on alone.

use crate::node::NO_CHILD;
use crate::ray::{Coherence, Ray};
use crate::scene::rebraid::Part;
use crate::scene::{Placed, Scene};
use crate::simd::Isa;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::{Packet, SIZE};
use crate::traverse::single::interleaved::Work;
use crate::traverse::stream::octant_sort::{BLOCK, Headed};
use crate::traverse::stream::packet_groups::{Members, Who, number};
use crate::traverse::stream::root_cull::{ASKED, Gate};

/// How much work is put aside before it is done, or a little more.
pub const ASIDE: usize = 2048;

/// Rays that go on alone.
#[derive(Default)]
pub struct Aside {
    work: Vec<Work>,
    /// The numbers of those that go through everything.
    pub whole: Vec<u32>,
    /// Nodes and leaves that the packets visited.
    pub visits: usize,
}

impl Aside {
    /// How often a ray goes on alone.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.work.len() + self.whole.len()
    }

    /// All that they are to go through.
    #[inline(always)]
    pub fn drain(&mut self, rays: &[Ray]) -> impl Iterator<Item = Work> {
        let whole = self.whole.drain(..).map(|number| Work {
            ray: rays[number as usize],
            number: number as usize,
            instance: 0,
            start: NO_CHILD,
        });
        self.work.drain(..).chain(whole)
    }
}

/// The chunk at hand, and the rays that go on alone.
pub struct Chunk<'a> {
    pub scene: &'a Scene,
    pub coherence: Coherence,
    pub given: &'a [Ray],
    /// Their numbers in the batch.
    pub numbers: &'a [u32],
    pub aside: &'a mut Aside,
    /// The numbers of those that run apart from the others of the chunk.
    pub apart: &'a mut Vec<u32>,
}

impl<'a> Chunk<'a> {
    /// Puts rays aside, to go through a part or, without one, through everything.
    #[inline(always)]
    pub fn alone(&mut self, places: u64, part: Option<&Part>, who: Who) {
        match part {
            Some(part) if !self.scene.direct => {
                self.alone_from(places, part.instance, part.start, who);
            }
            _ => self.set_apart(places, who),
        }
    }

    /// Puts rays aside, to go on at a node of an instance.
    #[inline(always)]
    pub fn alone_from(&mut self, mut places: u64, instance: u32, start: u32, who: Who) {
        while places != 0 {
            let i = number(places.trailing_zeros(), who);
            places &= places - 1;
            self.aside.work.push(Work {
                ray: self.given[i],
                number: self.numbers[i] as usize,
                instance,
                start,
            });
        }
    }

    /// Puts rays aside that have not met anything of the scene yet.
    #[inline(always)]
    fn set_apart(&mut self, mut places: u64, who: Who) {
        let apart = match self.coherence {
            Coherence::Unknown => &mut *self.apart,
            Coherence::Coherent | Coherence::Incoherent => &mut self.aside.whole,
        };
        while places != 0 {
            let i = number(places.trailing_zeros(), who);
            places &= places - 1;
            apart.push(self.numbers[i]);
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

/// Goes through the rays of a batch: 64 at a time as they are given, and in between those that run apart, by where they
/// head.
pub struct Chunks<'a> {
    rays: &'a [Ray],
    coherence: Coherence,
    taken: usize,
    /// Of those taken last.
    numbers: [u32; SIZE],
    len: usize,
    gate: Gate<'a>,
    headed: Headed<'a>,
    /// Whether those at hand are of `headed`.
    apart: bool,
}

impl<'a> Chunks<'a> {
    #[inline(always)]
    pub fn of(scene: &'a Scene, rays: &'a [Ray], coherence: Coherence) -> Chunks<'a> {
        debug_assert!(u32::try_from(rays.len()).is_ok());
        Chunks {
            rays,
            coherence,
            taken: 0,
            numbers: [0; SIZE],
            len: 0,
            gate: Gate::of(scene),
            headed: Headed::new(&scene.packets),
            apart: false,
        }
    }

    /// Goes to the next chunk; false where there is none. Some rays may be put aside at once; those of `apart` are taken
    /// from there.
    #[inline(always)]
    pub fn advance<I: Isa>(&mut self, aside: &mut Aside, apart: &mut Vec<u32>) -> bool {
        loop {
            self.apart = self.headed.advance(self.rays, &mut aside.whole);
            if self.apart {
                return true;
            }
            let left = self.rays.len() - self.taken;
            if self.coherence == Coherence::Incoherent {
                let most = self.headed.most();
                while self.taken < self.rays.len() && apart.len() + ASKED <= most {
                    let end = self.rays.len().min(self.taken + ASKED);
                    let from = apart.len();
                    apart.extend(self.taken as u32..end as u32);
                    self.gate.pass::<I>(self.rays, apart, from);
                    self.taken = end;
                }
            } else if left > 0 && apart.len() <= BLOCK - SIZE {
                self.len = left.min(SIZE);
                for (i, number) in self.numbers[..self.len].iter_mut().enumerate() {
                    *number = (self.taken + i) as u32;
                }
                self.taken += self.len;
                self.prefetch::<I>();
                return true;
            }
            if apart.is_empty() {
                return false;
            }
            if self.coherence == Coherence::Unknown {
                self.gate.pass::<I>(self.rays, apart, 0);
            }
            if I::WIDE {
                self.headed.set::<I>(self.rays, apart, &mut aside.whole);
            } else {
                aside.whole.extend_from_slice(apart);
            }
            apart.clear();
        }
    }

    /// How many rays of the batch have been taken, put aside at once or not.
    #[inline(always)]
    pub fn taken(&self) -> usize {
        self.taken
    }

    /// Asks for the rays that come next: until they are needed, they are there.
    #[inline(always)]
    fn prefetch<I: Isa>(&self) {
        let rays = &self.rays[self.taken..];
        prefetch_all::<I, _>(&rays[..rays.len().min(SIZE)]);
    }

    /// Is told how often one of those at hand went on alone, and what their packets visited.
    #[inline(always)]
    pub fn count(&mut self, alone: usize, visits: usize) {
        if self.apart {
            self.headed.count(alone, visits);
        }
    }

    /// The chunk at hand.
    #[inline(always)]
    pub fn chunk<'b>(
        &'b self,
        scene: &'b Scene,
        aside: &'b mut Aside,
        apart: &'b mut Vec<u32>,
    ) -> Chunk<'b> {
        let (given, numbers, coherence) = if self.apart {
            let (rays, numbers) = self.headed.taken();
            (rays, numbers, Coherence::Incoherent)
        } else {
            let rays = &self.rays[self.taken - self.len..self.taken];
            (rays, &self.numbers[..self.len], self.coherence)
        };
        Chunk {
            scene,
            coherence,
            given,
            numbers,
            aside,
            apart,
        }
    }
}

/// Asks for all lines of some values.
#[inline(always)]
pub fn prefetch_all<I: Isa, T>(values: &[T]) {
    for line in 0..size_of_val(values).div_ceil(64) {
        I::prefetch(values.as_ptr().cast::<u8>().wrapping_add(64 * line));
    }
}
