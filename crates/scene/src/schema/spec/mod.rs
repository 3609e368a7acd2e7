//! The tables of a world file as structs, with one source file per table. They define the keys; `schema` builds the
//! described parts.

pub(crate) mod camera;
pub(crate) mod displace;
pub(crate) mod fog;
pub(crate) mod inline_image;
pub(crate) mod light;
pub(crate) mod medium;
pub(crate) mod object;
pub(crate) mod optics;
pub(crate) mod pose;
pub(crate) mod rig;
pub(crate) mod sensor;
pub(crate) mod shape;
pub(crate) mod slots;
pub(crate) mod texture;
pub(crate) mod video;
