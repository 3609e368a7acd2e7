//! Encoders of frames and masks: bytes from pixels. Stands alone; putting bytes on a disk is the business of the caller.

pub mod exr;
pub mod hdr;
pub mod jpeg;
pub mod mask;
pub mod png;
