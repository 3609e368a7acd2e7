//! Closest hits and crossings in float64. Boxes are those of float32, padded; uses all other folders of the traversal.

pub(crate) mod crossings;
pub(crate) mod packet;
pub(crate) mod rays;
pub(crate) mod single;
pub(crate) mod triangle;
