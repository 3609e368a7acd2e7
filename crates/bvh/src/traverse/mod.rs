//! Traversal: from a batch of rays to hits.
//!
//! 1. Ray stream (`stream`): a batch is cut into chunks of 64 rays. Rays that miss the root are culled; incoherent rays
//!    are sorted by direction octant and major axis; each chunk is divided into octant groups, which are packets of
//!    coherent rays.
//! 2. Frustum packets (`packet`): a packet traverses the TLAS, is regrouped in each instance, and traverses the BLAS.
//!    One frustum test per node serves all rays (Reshetov, Soupikov and Hurley 2005); packets of incoherent rays are
//!    tested ray by ray. Rays that leave their group are queued.
//! 3. Interleaved single rays (`single`): queued rays are advanced in turn on the same thread, so that memory latencies
//!    overlap (as in AMAC, Kocberber, Falsafi and Grot 2015).
//!
//! All three use one watertight triangle test (Woop, Benthin and Wald 2013; `triangle`, `packet::triangle`) with the
//! same operations in the same order, and slabs padded so that no hit is lost (`trav_ray`). A ray therefore has the
//! same hit, bit for bit, whether it is traced in a packet or individually. `exact` contains the float64 versions of
//! these three steps, and finds all crossings; `point` finds closest points; `closest` and `occluded` are the queries
//! in float32.
//!
//! Imports within this folder: stack, trav_ray, node_test ← triangle ← single ← packet ← stream ← exact ← point;
//! closest, occluded.

pub(crate) mod closest;
pub(crate) mod exact;
pub(crate) mod near_ties;
pub(crate) mod node_test;
pub(crate) mod occluded;
mod packet;
pub(crate) mod point;
pub(crate) mod single;
mod stack;
pub(crate) mod stream;
pub mod trav_ray;
pub(crate) mod triangle;

use crate::platform::dispatch::kernel;
use crate::ray::{ClosestPoint, Coherence, ExactHit, ExactRay, Hit, HitFilter, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::traverse::closest::closest as closest_packets;
use crate::traverse::exact::crossings::{Crossings, crossings_batch};
use crate::traverse::exact::packet::closest_exact_batch;
use crate::traverse::exact::refine::{intersect_each, orient_each, refine_each};
use crate::traverse::exact::single::filter_hits;
use crate::traverse::exact::ties::MarkedHits;
use crate::traverse::occluded::occluded as occluded_packets;
use crate::traverse::point::search::closest_points_batch;

kernel! {
    /// Finds the closest hits, and the rays that may have hit coplanar surfaces of two instances.
    fn closest(
        scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence, marked: &mut Vec<u32>,
    ) = closest_packets
}
kernel! {
    /// Sets `occluded` to true for rays that hit anything.
    fn occluded(scene: &Scene, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) = occluded_packets
}
kernel! {
    /// Finds the closest hits, or any hits, in float64. For closest hits that float32 determines, only the ids are set.
    fn closest_exact(
        scene: &Scene, rays: &[ExactRay], triangles: &dyn ExactTriangles, any_hit: bool, answers: MarkedHits,
    ) = closest_exact_batch
}
kernel! {
    /// Finds any hits that a filter accepts or, in a search for closest hits, replaces each given hit that the filter
    /// rejects by the closest accepted hit.
    fn filter_exact(
        scene: &Scene, rays: &[ExactRay], triangles: &dyn ExactTriangles, filter: &dyn HitFilter, any_hit: bool,
        answers: MarkedHits,
    ) = filter_hits
}
kernel! {
    /// Computes the intersections of hits whose triangles are known.
    fn intersect(rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit]) = intersect_each
}
kernel! {
    /// Computes the normals and sides of hits whose triangles are known.
    fn orient(rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit]) = orient_each
}
kernel! {
    /// Refines hits to an accuracy of one unit in the last place.
    fn refine(rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit]) = refine_each
}
kernel! {
    /// Finds the crossings of every ray.
    fn crossings(
        scene: &Scene, rays: &[ExactRay], triangles: &dyn ExactTriangles, filter: Option<&dyn HitFilter>,
        answers: &mut Crossings,
    ) = crossings_batch
}
kernel! {
    /// Finds the closest point to every given point.
    fn closest_points(
        scene: &Scene, points: &[[f64; 3]], max_distance: &[f64], triangles: &dyn ExactTriangles,
        filter: Option<&dyn HitFilter>, found: &mut [ClosestPoint],
    ) = closest_points_batch
}
