//! Single-ray traversal: the state machine of a ray, and many rays interleaved on one thread.

pub(crate) mod closest_hit;
pub(crate) mod interleaved;
pub(crate) mod ray_state;
