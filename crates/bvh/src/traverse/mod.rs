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
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::traverse::closest::closest as closest_packets;
use crate::traverse::exact::packet::closest_exact_batch;
use crate::traverse::occluded::occluded as occluded_packets;

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
