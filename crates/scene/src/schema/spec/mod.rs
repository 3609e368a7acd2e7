//! TODO: what is here.

pub(crate) mod camera;
pub(crate) mod inline_image;
pub(crate) mod object;
pub(crate) mod optics;
pub(crate) mod pose;
pub(crate) mod render;
pub(crate) mod rig;
pub(crate) mod shape;
pub(crate) mod texture;
pub(crate) mod video;
