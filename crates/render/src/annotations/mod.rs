//! Ground truth in addition to image channels: optical flow, keypoints and amodal masks.
//!
//! This folder uses the prepared world, exact rays and the film's tiles. It does not compute radiance.

pub mod amodal;
pub mod flow;
pub mod keypoints;
pub mod viewpoint;
