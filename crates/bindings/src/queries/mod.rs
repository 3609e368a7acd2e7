//! Queries of worlds: rays, points and pairs of points.

pub(crate) mod points;
pub(crate) mod rays;
