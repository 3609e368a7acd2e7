//! Hits of one bounce, [`crate::soa::LANES`] at a time: loading, BSDFs, direct lighting, shading.
//!
//! [`sort`] groups hits by kind. [`hits`] stores the data that all hits of the bounce require, and evaluates the
//! materials of a chunk. [`shade`] then advances each path of the chunk. This folder uses the steps of
//! [`crate::integrator::path_tracer`].

pub(crate) mod bsdf;
pub(crate) mod direct_lighting;
pub(crate) mod hits;
pub(crate) mod path_lanes;
pub(crate) mod shade;
pub(crate) mod sort;
