//! Instruction sets, memory and stores of the machine. Uses only the portable SIMD type of this crate.

pub(crate) mod dispatch;
pub(crate) mod huge_page_vec;
