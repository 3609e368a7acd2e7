//! Tables of a world file, as structs: one file a table. They know the keys; `schema` builds the parts that they describe.

pub(crate) mod camera;
pub(crate) mod fog;
pub(crate) mod inline_image;
pub(crate) mod object;
pub(crate) mod optics;
pub(crate) mod pose;
pub(crate) mod rig;
pub(crate) mod shape;
pub(crate) mod texture;
pub(crate) mod video;
