//! Decoders of compressed parts of files, used by glTF's compression extensions.

pub mod draco;
pub mod meshopt;
