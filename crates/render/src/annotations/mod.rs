//! Annotations and queries beside images: flow, keypoints, amodal masks, ray casts.
//!
//! Uses the prepared world, exact rays and the film's tiles; renders no radiance.

pub mod amodal;
pub mod flow;
pub mod keypoints;
pub mod ray_queries;
pub mod viewpoint;
