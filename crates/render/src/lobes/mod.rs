//! TODO: what is here.

pub(crate) mod albedo_anisotropic;
pub(crate) mod albedo_dielectric;
pub(crate) mod albedo_tables;
pub(crate) mod clearcoat;
pub(crate) mod fresnel;
pub(crate) mod ggx;
pub(crate) mod phong_lobe;
pub(crate) mod shading_frame;
pub(crate) mod sheen;
pub(crate) mod thin_film;
