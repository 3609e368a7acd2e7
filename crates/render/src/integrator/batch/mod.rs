//! TODO: what is here.

pub(crate) mod bsdf;
pub(crate) mod diffuse;
pub(crate) mod direct_lighting;
pub(crate) mod glossy;
pub(crate) mod hits;
pub(crate) mod path_lanes;
pub(crate) mod rough_dielectric;
pub(crate) mod specular;
