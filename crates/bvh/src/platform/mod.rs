//! Instruction sets and memory of the machine. This folder uses only the portable SIMD type of this crate.

pub(crate) mod dispatch;
pub(crate) mod huge_page_vec;
