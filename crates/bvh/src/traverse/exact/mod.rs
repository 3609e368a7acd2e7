//! Closest hits and crossings in float64, with padded float32 boxes. This folder uses all other folders of the
//! traversal.

pub(crate) mod clipped_ray;
pub(crate) mod crossings;
pub(crate) mod lane_hits;
pub(crate) mod leaf;
pub(crate) mod packet;
pub(crate) mod ray_state;
pub(crate) mod rays;
pub(crate) mod refine;
pub(crate) mod single;
pub(crate) mod ties;
pub(crate) mod triangle;
