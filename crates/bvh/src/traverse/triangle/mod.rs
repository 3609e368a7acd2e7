//! TODO: what is here.

pub(crate) mod edge;
pub(crate) mod single;
