//! Instruction sets, memory and stores of the machine. Uses nothing of this crate but the portable SIMD type.

pub(crate) mod dispatch;
pub(crate) mod huge_page_vec;
