//! Ground truth: exact float64 rays through the pixel centres, and the channels read from their hits.
//!
//! Uses the prepared world; does not depend on integrators.

pub(crate) mod center_rays;
pub(crate) mod channels;
pub(crate) mod convert;
pub(crate) mod coplanar;
pub(crate) mod lit_points;
pub(crate) mod transparent;
pub(crate) mod triangle_cache;
