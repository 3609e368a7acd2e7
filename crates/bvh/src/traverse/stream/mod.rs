//! The ray stream: batches become packets of coherent rays.
//!
//! `chunker` cuts a batch into chunks; `root_cull` removes rays that miss the root; `octant_sort` and `packet_groups`
//! group rays by direction octant and major axis (octant groups); `tlas` takes packets through the TLAS into instances.

pub(crate) mod chunker;
pub(crate) mod octant_sort;
pub(crate) mod packet_groups;
pub(crate) mod root_cull;
pub(crate) mod tlas;
