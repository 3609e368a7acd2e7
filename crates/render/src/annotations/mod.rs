//! TODO: what is here.

pub mod amodal;
pub mod flow;
pub mod keypoints;
pub mod ray_queries;
