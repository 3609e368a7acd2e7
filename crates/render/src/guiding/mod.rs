//! TODO: what is here.

pub(crate) mod caustic_casters;
pub(crate) mod caustic_map;
pub(crate) mod cones;
pub(crate) mod sample_cones;
