//! Ground truth in addition to image channels: optical flow, keypoints and amodal masks.
//!
//! This folder uses the prepared world, exact rays and the film's tiles; it computes no radiance.

pub mod amodal;
pub mod flow;
pub mod keypoints;
pub mod viewpoint;
