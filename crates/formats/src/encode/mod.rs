//! TODO: what is here.

pub mod exr;
pub mod hdr;
pub mod mask;
pub mod png;
