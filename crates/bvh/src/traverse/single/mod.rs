//! TODO: what is here.

pub(crate) mod interleaved;
pub(crate) mod ray_state;
