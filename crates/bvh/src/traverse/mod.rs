//! From a batch of rays to its answers.

mod exact;
mod interleaved;
pub mod local;
mod stack;
mod steps;
mod triangle;

use crate::dispatch::kernel;
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, NOTHING, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;
use exact::closest_exact_batch;

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
fn closest_batch<I: Isa>(scene: &Scene, rays: &[Ray], hits: &mut [Hit], _coherence: Coherence) {
    interleaved::trace::<I, _, false>(
        scene,
        &mut Nearest {
            rays: rays.iter().enumerate(),
            hits,
        },
    );
}

#[inline(always)]
fn occluded_batch<I: Isa>(scene: &Scene, rays: &[Ray], dark: &mut [bool], _coherence: Coherence) {
    interleaved::trace::<I, _, true>(
        scene,
        &mut Any {
            rays: rays.iter().enumerate(),
            dark,
        },
    );
}

type Numbered<'a> = std::iter::Enumerate<std::slice::Iter<'a, Ray>>;

struct Nearest<'a> {
    rays: Numbered<'a>,
    hits: &'a mut [Hit],
}

impl interleaved::Batch for Nearest<'_> {
    #[inline(always)]
    fn next(&mut self) -> Option<(Ray, usize)> {
        self.rays.next().map(|(number, ray)| (*ray, number))
    }
    #[inline(always)]
    fn answer(&mut self, number: usize, hit: Hit) {
        self.hits[number] = hit;
    }
}

struct Any<'a> {
    rays: Numbered<'a>,
    dark: &'a mut [bool],
}

impl interleaved::Batch for Any<'_> {
    #[inline(always)]
    fn next(&mut self) -> Option<(Ray, usize)> {
        self.rays.next().map(|(number, ray)| (*ray, number))
    }
    #[inline(always)]
    fn answer(&mut self, number: usize, hit: Hit) {
        self.dark[number] = hit.instance != NOTHING;
    }
}
