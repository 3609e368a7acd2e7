//! What people write: world files and Python dicts, one schema for both.
//!
//! The structs are the reference: their doc comments are the documentation, and [`json_schema`] is made from them. A text
//! or a dict becomes a [`Node`] first; [`from_node`] reads a struct from it, with errors that name the key, its place in
//! the text and the nearest valid name.

mod build;
mod camera;
mod geometry;
mod keys;
mod node;
mod object;
mod optics;
mod place;
mod pose;
mod read;
mod render;
mod rig;
mod shape;
mod slot;
mod style;
mod texels;
mod texture;
mod video;
mod words;

use schemars::JsonSchema;
use serde::Deserialize;

pub use camera::{CameraSpec, Projection};
pub use node::{Entry, Node, Value};
pub use object::{MaterialType, ObjectSpec};
pub use optics::{ApertureSpec, ShutterSpec, TrackSpec};
pub use pose::PoseSpec;
pub use read::from_node;
pub use render::{AmbientOcclusion, FilterName, IntegratorName, RenderSpec};
pub use rig::RigSpec;
pub use shape::{BoxShape, ConeShape, CylinderShape, PlaneShape, SphereShape, TorusShape};
pub use texture::{ImageSpec, TextureChannel, TextureSpec, TextureTable, TexturesSpec};
pub use video::{Interpolation, KeyframeSpec, OrbitSpec, VideoSpec};
pub use words::{Category, Color, Refine, Scheme, Splat, Wraps};

use crate::light::Light;
use crate::world::Up;

/// A world: its objects, lights and cameras, how to render it and its video.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(title = "raycam world")]
pub struct WorldFile {
    /// Which axis points up: "z" or "y". It matters to roll, pitch and yaw, orbits and the sky; vertices are never
    /// turned.
    pub up: Up,
    /// The cameras: one table or several, the default camera first.
    #[schemars(schema_with = "one_or_many::<CameraSpec>")]
    pub camera: Vec<CameraSpec>,
    /// The rigs, several cameras on one body: one table or several. Their cameras come after those of `camera`, under
    /// the names rig/camera.
    #[schemars(schema_with = "one_or_many::<RigSpec>")]
    pub rig: Vec<RigSpec>,
    /// The objects: one table or several.
    #[schemars(schema_with = "one_or_many::<ObjectSpec>")]
    pub object: Vec<ObjectSpec>,
    /// The lights: one table or several.
    #[schemars(schema_with = "one_or_many::<Light>")]
    pub light: Vec<Light>,
    /// How to render it, where the command line or the call does not say.
    pub render: RenderSpec,
    /// A video of it.
    pub video: Option<VideoSpec>,
}

/// The JSON Schema (2020-12) of a world file, for editors and the reference.
pub fn json_schema() -> schemars::Schema {
    schemars::schema_for!(WorldFile)
}

/// A table stands for a list of one.
fn one_or_many<T: JsonSchema>(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let one = generator.subschema_for::<T>();
    schemars::json_schema!({ "anyOf": [one, { "type": "array", "items": one }] })
}
