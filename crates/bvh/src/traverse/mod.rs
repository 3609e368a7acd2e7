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
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, INVALID_ID, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::traverse::closest::closest as closest_packets;
use crate::traverse::exact::single::closest_exact_batch;
use crate::traverse::occluded::occluded as occluded_packets;
use crate::traverse::single::interleaved::{RaySource, RayTask};

kernel! {
    /// The nearest hits.
    fn closest(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) = closest_packets
}
kernel! {
    /// Whether there is any hit.
    fn occluded(scene: &Scene, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) = occluded_packets
}
kernel! {
    /// The nearest hits in float64.
    fn closest_exact(
        scene: &Scene, rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit],
    ) = closest_exact_batch
}

/// Parts of one ray may come as separate work, after others of it: the first hit of all counts.
struct ClosestSink<'a, W> {
    tasks: W,
    hits: &'a mut [Hit],
}

impl<W: Iterator<Item = RayTask>> RaySource for ClosestSink<'_, W> {
    #[inline(always)]
    fn next(&mut self) -> Option<RayTask> {
        let mut task = self.tasks.next()?;
        task.ray.clip_t_max(self.hits[task.ray_id].t);
        Some(task)
    }
    #[inline(always)]
    fn report(&mut self, ray_id: usize, hit: Hit) {
        self.hits[ray_id].keep_closer(hit);
    }
}

/// Parts of one ray may come as separate work: it is occluded if one of them is.
struct OcclusionSink<'a, W> {
    tasks: W,
    occluded: &'a mut [bool],
}

impl<W: Iterator<Item = RayTask>> RaySource for OcclusionSink<'_, W> {
    #[inline(always)]
    fn next(&mut self) -> Option<RayTask> {
        loop {
            let task = self.tasks.next()?;
            if !self.occluded[task.ray_id] {
                return Some(task);
            }
        }
    }
    #[inline(always)]
    fn report(&mut self, ray_id: usize, hit: Hit) {
        self.occluded[ray_id] |= hit.instance != INVALID_ID;
    }
}
