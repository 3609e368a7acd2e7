//! TODO: what is here.

pub mod rotation;
