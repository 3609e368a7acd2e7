//! Schema of world files and Python dicts.
//!
//! The structs are the reference: their doc comments are the documentation, and [`json_schema`] is generated from them.
//! A text or a dict first becomes a [`SpannedValue`]; [`from_value`] reads a struct from it, with errors that name the
//! key, its position in the text and the nearest valid name.

mod build_failure;
mod build_object;
mod build_texture;
mod build_video;
mod build_world;
mod change_object;
mod color_names;
mod deserialize;
mod displace_object;
mod geometry;
mod keys;
mod material_keys;
mod material_slots;
mod object_keys;
mod shorthand;
mod spec;
mod texture_binding;

use schemars::JsonSchema;
use serde::Deserialize;

pub use crate::schema::deserialize::from_value;
pub use crate::schema::deserialize::value::{Entry, SpannedValue, Value};
pub use crate::schema::shorthand::{Category, Color, Refine, Scheme, Splat, Visible, Wraps};
pub use crate::schema::spec::camera::{CameraSpec, Projection};
pub use crate::schema::spec::displace::{DisplaceSpec, DisplaceTable};
pub use crate::schema::spec::fog::FogSpec;
pub use crate::schema::spec::light::LightSpec;
pub use crate::schema::spec::medium::{MediumSpec, MediumTable};
pub use crate::schema::spec::object::{MaterialType, ObjectSpec};
pub use crate::schema::spec::optics::{ApertureSpec, ShutterSpec, TrackSpec};
pub use crate::schema::spec::pose::PoseSpec;
pub use crate::schema::spec::rig::RigSpec;
pub use crate::schema::spec::sensor::{LidarReturns, LidarSpec, SensorSpec};
pub use crate::schema::spec::shape::{BoxShape, ConeShape, CylinderShape, PlaneShape, SphereShape, TorusShape};
pub use crate::schema::spec::texture::{ImageSpec, TextureChannel, TextureSpec, TextureTable, TexturesSpec};
pub use crate::schema::spec::video::{KeyframeSpec, VideoSpec};

use crate::render_options::RenderOptions;
use crate::schema::shorthand::one_or_many;
use crate::up::Up;

/// A world: its objects, lights and cameras, how to render it, and its video.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(title = "raycam world")]
pub struct WorldFile {
    /// Axis that points up: "z" or "y". It affects roll, pitch and yaw, orbits and the sky; vertices are never rotated.
    pub up: Up,
    /// The cameras: one table or several, the default camera first.
    #[schemars(schema_with = "one_or_many::<CameraSpec>")]
    pub camera: Vec<CameraSpec>,
    /// The rigs, each with several cameras on one body: one table or several. The rigs' cameras follow the cameras of
    /// `camera` and have names of the form rig/camera.
    #[schemars(schema_with = "one_or_many::<RigSpec>")]
    pub rig: Vec<RigSpec>,
    /// The lidars that are not on a rig: one table or several.
    #[schemars(schema_with = "one_or_many::<LidarSpec>")]
    pub lidar: Vec<LidarSpec>,
    /// Other sensors that are not on a rig, which are Python classes: one table or several.
    #[schemars(schema_with = "one_or_many::<SensorSpec>")]
    pub sensor: Vec<SensorSpec>,
    /// The objects: one table or several.
    #[schemars(schema_with = "one_or_many::<ObjectSpec>")]
    pub object: Vec<ObjectSpec>,
    /// The lights: one table or several.
    #[schemars(schema_with = "one_or_many::<LightSpec>")]
    pub light: Vec<LightSpec>,
    /// Fog that fills the world.
    pub fog: Option<FogSpec>,
    /// Render settings. Arguments of the call and options of the command line take precedence.
    pub render: RenderOptions,
    /// A video of the world.
    pub video: Option<VideoSpec>,
}

/// Returns the JSON Schema (2020-12) of a world file, for editors and the reference.
pub fn json_schema() -> schemars::Schema {
    schemars::schema_for!(WorldFile)
}
