//! What there is: worlds made of triangles, their materials and lights, and the cameras that see them.
//!
//! Plain data, joined by index, and its mathematics. [`schema`] is what people write (world files and Python dicts);
//! [`World`] is what it says, with files read and names resolved. Nothing here reads a user's file or traces a ray; the one file is
//! the temporary one of a [`TextureCache`].

#![forbid(unsafe_code)]

pub mod animation;
pub mod camera;
pub mod color;
mod error;
pub mod light;
pub mod material;
pub mod math;
pub mod mesh;
pub mod model;
pub mod schema;
pub mod texture;
pub mod video;
pub mod world;

pub use crate::color::view_transform::ViewTransform;
pub use crate::material::glass::Glass;
pub use crate::material::metal::Metal;
pub use crate::material::principled::{NormalMap, Principled, Textured};
pub use crate::world::statistics::WorldStats;
pub use camera::{Camera, Lens, LensModel, PixelCenter};
pub use error::{SceneError, suggestion};
pub use light::{FileRef, IesProfile, Light};
pub use material::{Alpha, Material, MaterialModel};
pub use mesh::Mesh;
pub use model::{AssetLoader, MeshFile, MeshPart, NoAssets};
pub use texture::{
    Image, TexelFilter, Texels, Texture, TextureCache, TextureSampler, TextureSlot, Wrap,
};
pub use video::Video;
pub use world::{Object, Up, World};
