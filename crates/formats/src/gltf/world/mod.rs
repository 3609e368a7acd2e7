//! Conversion of the document to a world: each module adds one type of element, such as cameras or materials, to the
//! [`Builder`](builder::Builder).

pub(crate) mod animation;
pub(crate) mod animation_pointer;
pub(crate) mod builder;
pub(crate) mod camera;
pub(crate) mod light;
pub(crate) mod material;
pub(crate) mod mesh;
pub(crate) mod node;
pub(crate) mod skin;
pub(crate) mod specular_glossiness;
pub(crate) mod texture;
