//! The scene as data: worlds of meshes, materials, lights and cameras, and their mathematics.
//!
//! Parts refer to each other by index. [`schema`] describes world files and Python dicts; [`World`] is the result, with
//! files read and names resolved. This crate reads no user files and traces no rays; the only file it uses is the
//! temporary file of a [`TextureCache`].
//!
//! ```text
//! codes               macro for tables of codes
//! counted             counted nouns in messages
//! notice error_code   codes of notices and errors, with cause and remedy
//! error up            errors; the axis that points up
//! foreign_terms       other programs' terms, for hints in errors
//! written             values that may be written in more than one way
//! named_enum          closed sets with names
//! math color          rotations, Hermite curves; colour spaces, view transforms
//! mesh texture        triangles, primitives, subdivision; images, mip maps, the texture cache
//! medium              fog, and coefficients of absorption and scattering
//! material            reflection models
//! camera              projection, lens models, aperture, shutter, rigs
//! light               emitters
//! animation           node hierarchies, skins, morph targets (glTF)
//! render_options      options of a render
//! video               orbits and keyframes
//! model               contents of a mesh file, loader of assets
//! world               all parts by index, at a time, validated
//! schema              world files: deserialisation, specs, building a world
//! ```
//!
//! A folder imports only from folders above it in this list.

#![forbid(unsafe_code)]

pub mod animation;
pub mod camera;
mod codes;
pub mod color;
mod counted;
mod displacement;
mod error;
mod error_code;
pub mod foreign_terms;
pub mod light;
pub mod material;
pub mod math;
pub mod medium;
pub mod mesh;
pub mod model;
mod named_enum;
mod notice;
pub mod render_options;
pub mod schema;
pub mod texture;
pub mod triangles;
pub mod up;
pub mod video;
pub mod world;
mod written;

pub use crate::color::view_transform::ViewTransform;
pub use crate::material::glass::Glass;
pub use crate::material::height_map::{HeightMap, HeightUnit};
pub use crate::material::metal::Metal;
pub use crate::material::principled::{NormalMap, Principled, Textured};
pub use crate::world::statistics::WorldStats;
pub use camera::{Camera, Lens, LensModel, PixelCenter};
pub use counted::counted;
pub use error::{Result, SceneError, suggestion};
pub use error_code::{ErrorCode, Message};
pub use light::{FileRef, IesProfile, Light, LightTraits, LightVisibility};
pub use material::{Alpha, Material, MaterialModel};
pub use medium::Medium;
pub use medium::fog::Fog;
pub use mesh::Mesh;
pub use model::{AssetLoader, MeshFile, MeshPart, NoAssets, SingleMesh};
pub use notice::{Notice, NoticeCode};
pub use texture::{
    ByteString, ColorUse, EncodedImage, Image, TexelFilter, Texels, Texture, TextureCache, TextureSampler, TextureSlot,
    Wrap,
};
pub use up::Up;
pub use video::Video;
pub use world::{Object, World};
