//! Closest points: float32 boxes and triangles give lower bounds of the distance, float64 corners decide.
//!
//! Every float32 bound is lowered by its error, and equal bounds are not pruned, so neither the order of the search nor
//! the bound that it starts with changes an answer.

pub(crate) mod bounds;
pub(crate) mod search;
