//! TODO: what is here.

pub(crate) mod cull;
pub(crate) mod packet;
pub(crate) mod packet_edges;
pub(crate) mod single;
