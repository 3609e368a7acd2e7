//! From a batch of rays to its answers.

mod alike;
mod apart;
mod candidates;
mod chunk;
mod exact;
mod exact_packet;
mod exact_rays;
mod fan;
mod gate;
mod headed;
mod interleaved;
mod leaf_by_leaf;
mod line;
pub mod local;
mod near;
mod packet;
mod packets;
mod ready;
mod rows;
mod shadow;
pub mod skip;
mod slot;
mod stack;
mod steps;
mod together;
mod triangle;

use crate::dispatch::kernel;
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, NOTHING, Ray};
use crate::scene::{ExactTriangles, Scene};
use exact::closest_exact_batch;
use interleaved::{Batch, Work};
use shadow::occluded as occluded_packets;
use together::closest as closest_packets;

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
