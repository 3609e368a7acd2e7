//! Exact arithmetic: expansions, the signs of rays, edges and planes, and the closest points of triangles. Independent
//! of the rest of this crate.

pub(crate) mod closest_point;
pub(crate) mod expansion;
pub(crate) mod predicates;
