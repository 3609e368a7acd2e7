//! Exact arithmetic: expansions, the signs of rays, edges and planes, and the closest points of triangles. This folder
//! does not depend on the rest of the crate.

pub(crate) mod closest_point;
pub(crate) mod expansion;
pub(crate) mod predicates;
