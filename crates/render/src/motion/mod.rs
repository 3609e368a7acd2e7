//! TODO: what is here.

pub(crate) mod shutter;
