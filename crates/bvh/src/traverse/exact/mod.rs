//! TODO: what is here.

pub(crate) mod packet;
pub(crate) mod rays;
pub(crate) mod single;
