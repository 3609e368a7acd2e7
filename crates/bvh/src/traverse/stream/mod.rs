//! TODO: what is here.

pub(crate) mod chunker;
pub(crate) mod octant_sort;
pub(crate) mod packet_groups;
pub(crate) mod root_cull;
pub(crate) mod tlas;
