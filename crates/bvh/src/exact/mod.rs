//! Exact arithmetic: expansions, and the signs of rays, edges and planes. Uses nothing of this crate.

pub(crate) mod expansion;
pub(crate) mod predicates;
