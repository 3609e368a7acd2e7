//! Rays of the caller's own.

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::PreparedWorld;

/// What each ray met first, one entry per ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayHits {
    /// In lengths of the ray's direction; +inf for a miss.
    pub t: Vec<f64>,
    /// Index of the object; -1 for a miss.
    pub instance: Vec<i32>,
    /// Index of the triangle within its mesh; -1 for a miss.
    pub triangle: Vec<i32>,
    /// Weights of the triangle's three corners; 0 for a miss.
    pub barycentric: Vec<[f32; 3]>,
    /// The triangle's unit normal in the world, on the side the ray comes from; 0 for a miss.
    pub normal: Vec<[f32; 3]>,
    /// The surface point in the world; NaN for a miss.
    pub position: Vec<[f64; 3]>,
}

/// The nearest hit of each ray `origin + t * direction`, t >= 0, in world coordinates.
///
/// Directions need no normalisation. A ray that is not finite or has a zero direction is a miss. `coherent` says
/// whether neighbours in the arrays run alike (`None`: they are looked at); it changes the speed, never the answer.
pub fn cast_rays(
    _world: &PreparedWorld,
    _origins: &[[f64; 3]],
    _directions: &[[f64; 3]],
    _coherent: Option<bool>,
    _threads: Option<usize>,
    _control: &Control,
) -> Result<RayHits, RenderError> {
    Err(RenderError::Settings("cast_rays is not built yet".into()))
}

/// Whether anything lies on each ray at `0 <= t <= t_max` (`t_max` has one entry for all rays, or one per ray).
pub fn occluded(
    _world: &PreparedWorld,
    _origins: &[[f64; 3]],
    _directions: &[[f64; 3]],
    _t_max: &[f64],
    _coherent: Option<bool>,
    _threads: Option<usize>,
    _control: &Control,
) -> Result<Vec<bool>, RenderError> {
    Err(RenderError::Settings("occluded is not built yet".into()))
}
