//! From a batch of rays to its answers.

mod alike;
mod chunk;
mod exact;
mod exact_packet;
mod exact_rays;
mod fan;
mod interleaved;
mod line;
pub mod local;
mod packet;
mod packets;
mod rows;
mod shadow;
mod stack;
mod steps;
mod together;
mod triangle;

use crate::block::NO_CHILD;
use crate::dispatch::kernel;
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, NOTHING, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;
use exact::closest_exact_batch;
use interleaved::{Batch, Work};

kernel! {
    /// The nearest hits.
    fn closest(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) = closest_batch
}
kernel! {
    /// Whether there is any hit.
    fn occluded(scene: &Scene, rays: &[Ray], dark: &mut [bool], coherence: Coherence) = occluded_batch
}
kernel! {
    /// The nearest hits in float64.
    fn closest_exact(
        scene: &Scene, rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit],
    ) = closest_exact_batch
}

#[inline(always)]
fn closest_batch<I: Isa>(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) {
    if coherence == Coherence::Incoherent {
        let work = rays.iter().enumerate().map(whole);
        interleaved::trace::<I, _, false>(scene, &mut Nearest { work, hits });
    } else {
        together::closest::<I>(scene, rays, hits, coherence);
    }
}

#[inline(always)]
fn occluded_batch<I: Isa>(scene: &Scene, rays: &[Ray], dark: &mut [bool], coherence: Coherence) {
    if coherence == Coherence::Incoherent {
        dark.fill(false);
        let work = rays.iter().enumerate().map(whole);
        interleaved::trace::<I, _, true>(scene, &mut Any { work, dark });
    } else {
        shadow::occluded::<I>(scene, rays, dark, coherence);
    }
}

fn whole((number, ray): (usize, &Ray)) -> Work {
    Work {
        ray: *ray,
        number,
        instance: 0,
        start: NO_CHILD,
    }
}

struct Nearest<'a, W> {
    work: W,
    hits: &'a mut [Hit],
}

impl<W: Iterator<Item = Work>> Batch for Nearest<'_, W> {
    #[inline(always)]
    fn next(&mut self) -> Option<Work> {
        self.work.next()
    }
    #[inline(always)]
    fn answer(&mut self, number: usize, hit: Hit) {
        self.hits[number] = hit;
    }
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
