//! Annotations and queries beside images: flow, keypoints, amodal masks, queries of rays and points.
//!
//! Uses the prepared world, exact rays and the film's tiles; renders no radiance.

pub mod amodal;
pub mod flow;
pub mod keypoints;
pub mod queries;
pub mod viewpoint;
