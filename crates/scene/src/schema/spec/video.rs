//! `[video]`.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::video::{KeyframeInterpolation, Orbit};

/// A video: its length, and the motion of the camera (an orbit or keyframes) and of objects (keyframes).
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VideoSpec {
    /// Frames per second; default 24.
    pub fps: f64,
    /// Length in seconds; default: up to the last keyframe, or 4.
    pub seconds: Option<f64>,
    /// Orbit of the camera around a target.
    pub orbit: Option<Orbit>,
    /// Poses of the camera or of objects at times, in order of time for each: one table or several.
    #[schemars(schema_with = "crate::schema::shorthand::one_or_many::<KeyframeSpec>")]
    pub keyframe: Vec<KeyframeSpec>,
    /// Interpolation between keyframes: "smooth" (Catmull-Rom, starting and ending at rest) or "linear".
    pub interpolation: KeyframeInterpolation,
}

/// A pose at a time. Location and direction are interpolated separately, each between the keyframes that specify it; if
/// no keyframe specifies one, it does not change.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyframeSpec {
    /// Time in seconds from the start.
    pub time: f64,
    /// The name of the object that moves. Default: the camera moves, unless `rig` or `camera` is given.
    pub object: Option<String>,
    /// The name of the rig that moves.
    pub rig: Option<String>,
    /// The name of the world's camera that moves, while other cameras do not move with it.
    pub camera: Option<String>,
    /// The location at this time.
    pub location: Option<[f64; 3]>,
    /// Roll in degrees; default 0 if other angles are given.
    pub roll: Option<f64>,
    /// Pitch in degrees; default 0 if other angles are given.
    pub pitch: Option<f64>,
    /// Yaw in degrees; default 0 if other angles are given. Angles are interpolated as numbers: 0 to 360 is a whole
    /// turn, 350 to 370 turns by 20 degrees, and 350 to 10 turns back.
    pub yaw: Option<f64>,
    /// A point to face, instead of angles (objects face it with their x axis in a z-up world).
    pub target: Option<[f64; 3]>,
    /// The affine transform world_from_mesh of an object, or the pose world_from_camera of a named camera (x right, y
    /// down, z forward), 3x4 or 4x4, instead of location, angles and target. It must not mirror. Either all or none of
    /// the keyframes of an object or a camera have a matrix. The rotation follows the shorter arc, the stretch is
    /// interpolated linearly.
    pub matrix: Option<Vec<[f64; 4]>>,
    /// Interpolation from this keyframe to the next; default: the video's.
    pub interpolation: Option<KeyframeInterpolation>,
}

impl Default for VideoSpec {
    fn default() -> Self {
        Self {
            fps: 24.0,
            seconds: None,
            orbit: None,
            keyframe: Vec::new(),
            interpolation: KeyframeInterpolation::default(),
        }
    }
}
