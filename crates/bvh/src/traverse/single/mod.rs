//! TODO: what is here.

pub(crate) mod closest_hit;
pub(crate) mod interleaved;
pub(crate) mod ray_state;
