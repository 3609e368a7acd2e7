//! TODO: what is here.

pub(crate) mod clearcoat;
pub(crate) mod glossy;
pub(crate) mod glossy_params;
pub(crate) mod glossy_sample;
pub(crate) mod rough_dielectric;
pub(crate) mod rough_dielectric_params;
pub(crate) mod rough_dielectric_sample;
pub(crate) mod specular;
