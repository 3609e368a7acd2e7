//! Encoders of frames and masks: bytes from pixels. They are independent of other folders; the caller writes the bytes
//! to disk.

pub mod exr;
pub mod hdr;
pub mod jpeg;
pub mod mask;
pub mod png;
