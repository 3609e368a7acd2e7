//! Encoders of frames and masks (bytes from pixels), and compression. The encoders are independent of other folders;
//! the caller writes the bytes to disk.

pub mod exr;
pub mod hdr;
pub mod jpeg;
pub mod lzf;
pub mod mask;
pub mod png;
