//! Decoders of compressed parts of files: what glTF's compression extensions put in the place of plain bytes.

pub mod draco;
pub mod meshopt;
