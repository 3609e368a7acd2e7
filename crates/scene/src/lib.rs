//! What there is: worlds made of triangles, their materials and lights, and the cameras that see them.
//!
//! Plain data, joined by index, and its mathematics. [`schema`] is what people write (world files and Python dicts);
//! [`World`] is what it says, with files read and names resolved. Nothing here reads a user's file or traces a ray; the one file is
//! the temporary one of a [`TextureMemory`].

#![forbid(unsafe_code)]

pub mod animation;
pub mod camera;
pub mod category;
pub mod color;
mod counts;
mod error;
pub mod glass;
pub mod light;
pub mod material;
pub mod mesh;
pub mod metal;
pub mod model;
pub mod oriented_box;
pub mod pose;
pub mod primitive;
pub mod principled;
pub mod refine;
pub mod schema;
pub mod texture;
mod validate;
pub mod variant;
pub mod video;
pub mod view;
pub mod world;

pub use camera::{Camera, Lens, LensModel, PixelCenter};
pub use counts::Counts;
pub use error::{SceneError, suggestion};
pub use glass::Glass;
pub use light::{FromFile, Light, Profile};
pub use material::{Alpha, Material, Reflectance};
pub use mesh::Mesh;
pub use metal::Metal;
pub use model::{Files, Model, NoFiles, Part};
pub use principled::{NormalMap, Principled, Textured};
pub use texture::{
    Image, Interpolation, Texels, Texture, TextureMemory, TextureSampler, TextureSlot, Wrap,
};
pub use video::Video;
pub use view::View;
pub use world::{Object, Up, World};
