//! Lights: the closed set of [`raycam_scene::Light`] and emissive triangles, relative to the scene's origin.
//!
//! A light without a mesh is visible if it has an extent, but occludes nothing: rays cross it and add its radiance.
//! The radiance of a ray is the sum of
//!
//! * [`lights::Lights::intersect_visible`]: lights without a mesh between the ray's origin and its hit,
//! * [`emission`](crate::prepare::geometry::Geometry::emission): emission of the surface hit,
//! * [`lights::Lights::escaped_radiance`]: infinite lights, for a ray that misses.
//!
//! [`lights::Lights::sample`] samples a direction towards any of these lights (next-event estimation). The functions of
//! the list also return the density with which it samples their light, which multiple importance sampling (MIS)
//! requires (E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, chapter 9).
//!
//! Uses the geometry and interactions; does not depend on BSDFs.

pub(crate) mod air_light;
pub(crate) mod bounds;
pub(crate) mod default_lights;
pub(crate) mod disk;
pub(crate) mod emission_table;
pub(crate) mod emissive_triangles;
pub(crate) mod environment;
pub(crate) mod ies;
pub(crate) mod light_cull;
pub(crate) mod light_sampling;
pub(crate) mod lighting;
pub(crate) mod lights;
pub(crate) mod point;
pub(crate) mod prepared_light;
pub(crate) mod projector;
pub(crate) mod rectangle;
pub(crate) mod samples;
pub(crate) mod spot;
pub(crate) mod sun;
#[cfg(test)]
mod tests;
pub(crate) mod tree;
