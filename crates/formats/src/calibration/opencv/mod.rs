//! TODO: what is here.

pub(crate) mod read;
pub(crate) mod write;
