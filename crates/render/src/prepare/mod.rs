//! Preparation: converts the world's description to the form that is traced.
//!
//! [`world::PreparedWorld`] composes [`geometry::Geometry`] (BVH, instances, materials, textures), the lights
//! and the data of path guiding. All files except `world.rs` use only the lobes and the sampling; `world.rs`
//! also uses the lights.

pub(crate) mod dielectric_bounds;
pub(crate) mod family;
pub(crate) mod fog;
pub(crate) mod geometry;
pub(crate) mod instance;
pub(crate) mod material;
pub(crate) mod medium;
pub(crate) mod mesh;
pub(crate) mod on_demand_scenes;
pub(crate) mod one_instance;
pub(crate) mod stretch;
pub(crate) mod texture;
pub(crate) mod validate;
mod watertight;
pub(crate) mod world;
