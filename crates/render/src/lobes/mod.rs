//! Scattering mathematics of single lobes: microfacets, Fresnel terms, albedo tables, sheen, clear coat, thin films.
//!
//! This folder does not depend on worlds, textures or paths. Every formula is written once, for one point, and inlined:
//! the batched BSDFs call the same functions in loops over lanes, which the compiler turns into vector code. Such
//! functions select values instead of branching if lanes may differ.
//!
//! Directions `wo` (towards the viewer) and `wi` (towards the light) point away from the surface, have unit length, and
//! are local unless stated otherwise: coordinates along tangent, bitangent and shading normal.

pub(crate) mod albedo_anisotropic;
pub(crate) mod albedo_dielectric;
pub(crate) mod albedo_grid;
pub(crate) mod albedo_internal;
pub(crate) mod albedo_tables;
pub(crate) mod classify;
pub(crate) mod clearcoat;
pub(crate) mod cone_mixture;
pub(crate) mod fresnel;
pub(crate) mod ggx;
pub(crate) mod henyey_greenstein;
pub(crate) mod mean_color;
pub(crate) mod phong_lobe;
pub(crate) mod shading_frame;
pub(crate) mod sheen;
pub(crate) mod thin_film;
