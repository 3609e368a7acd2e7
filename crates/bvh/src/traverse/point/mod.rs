//! Closest points: float32 boxes and triangles give lower bounds of the distance, float64 corners decide.
//!
//! Every float32 bound is reduced by its error, and equal bounds are not pruned, so neither the order of the search nor
//! its initial bound changes an answer.

pub(crate) mod bounds;
pub(crate) mod search;
