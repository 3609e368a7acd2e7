//! From a batch of rays to its answers.

pub(crate) mod closest;
pub(crate) mod exact;
pub(crate) mod node_test;
pub(crate) mod occluded;
mod packet;
pub(crate) mod single;
mod stack;
pub(crate) mod stream;
pub mod trav_ray;
pub(crate) mod triangle;

use crate::platform::dispatch::kernel;
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, NOTHING, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::traverse::closest::closest as closest_packets;
use crate::traverse::exact::single::closest_exact_batch;
use crate::traverse::occluded::occluded as occluded_packets;
use crate::traverse::single::interleaved::{Batch, Work};

kernel! {
    /// The nearest hits.
    fn closest(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) = closest_packets
}
kernel! {
    /// Whether there is any hit.
    fn occluded(scene: &Scene, rays: &[Ray], dark: &mut [bool], coherence: Coherence) = occluded_packets
}
kernel! {
    /// The nearest hits in float64.
    fn closest_exact(
        scene: &Scene, rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit],
    ) = closest_exact_batch
}

/// Parts of one ray may come as separate work, after others of it: the first hit of all counts.
struct NearestApart<'a, W> {
    work: W,
    hits: &'a mut [Hit],
}

impl<W: Iterator<Item = Work>> Batch for NearestApart<'_, W> {
    #[inline(always)]
    fn next(&mut self) -> Option<Work> {
        let mut work = self.work.next()?;
        work.ray.shorten(self.hits[work.number].t);
        Some(work)
    }
    #[inline(always)]
    fn answer(&mut self, number: usize, hit: Hit) {
        self.hits[number].take(hit);
    }
}

/// Parts of one ray may come as separate work: it is dark if one of them is.
struct Any<'a, W> {
    work: W,
    dark: &'a mut [bool],
}

impl<W: Iterator<Item = Work>> Batch for Any<'_, W> {
    #[inline(always)]
    fn next(&mut self) -> Option<Work> {
        loop {
            let work = self.work.next()?;
            if !self.dark[work.number] {
                return Some(work);
            }
        }
    }
    #[inline(always)]
    fn answer(&mut self, number: usize, hit: Hit) {
        self.dark[number] |= hit.instance != NOTHING;
    }
}
