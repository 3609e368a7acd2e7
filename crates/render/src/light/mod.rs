//! Lights ready to shine: the closed set of [`raycam_scene::Light`] and the surfaces that shine, relative to the scene's
//! origin.
//!
//! A light without a mesh is seen where it has a size, but stands in nobody's way: rays pass through it and pick up its
//! radiance. What a ray picks up is the sum of
//!
//! * [`Lights::intersect_visible`]: lights without a mesh between its start and what it meets,
//! * [`Lights::emission`]: what the surface that it meets shines by itself,
//! * [`Lights::escaped_radiance`]: what lies behind everything, where it meets nothing.
//!
//! [`Lights::sample`] draws a direction to any of these, and each of these says what density `sample` has for its
//! direction: that is all that multiple importance sampling needs (E. Veach, "Robust Monte Carlo Methods for Light
//! Transport Simulation", 1997, chapter 9).

pub(crate) mod bounds;
pub(crate) mod default_lights;
pub(crate) mod disk;
pub(crate) mod emissive_triangles;
pub(crate) mod environment;
pub(crate) mod environment_image;
pub(crate) mod equirect;
pub(crate) mod gradient_sky;
pub(crate) mod ies;
pub(crate) mod light_cull;
pub(crate) mod light_sampling;
pub(crate) mod lights;
pub(crate) mod point;
pub(crate) mod preetham;
pub(crate) mod prepared_light;
pub(crate) mod rectangle;
pub(crate) mod samples;
pub(crate) mod spot;
pub(crate) mod sun;
#[cfg(test)]
mod tests;
pub(crate) mod tree;
