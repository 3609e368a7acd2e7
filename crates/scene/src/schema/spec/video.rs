//! `[video]`.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::video::{KeyframeInterpolation, Orbit};

/// A video: its length, and what moves the camera (an orbit or keyframes) and the objects (keyframes).
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VideoSpec {
    /// Frames per second; 24 where not given.
    pub fps: f64,
    /// Length; up to the last keyframe, or 4, where not given.
    pub seconds: Option<f64>,
    /// Carries the camera around a target.
    pub orbit: Option<Orbit>,
    /// Poses at times, of the camera or of objects, each in order of time: one table or several.
    #[schemars(schema_with = "crate::schema::shorthand::one_or_many::<KeyframeSpec>")]
    pub keyframe: Vec<KeyframeSpec>,
    /// Between keyframes: "smooth" (Catmull-Rom, starting and ending at rest) or "linear".
    pub interpolation: KeyframeInterpolation,
}

/// A pose at a time. Location and direction are interpolated apart, each through the keyframes that give it; what no
/// keyframe gives stays as it is.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyframeSpec {
    /// In seconds from the start.
    pub time: f64,
    /// The name of the object that moves; the camera where neither this nor `rig` is given.
    pub object: Option<String>,
    /// The name of the rig that moves.
    pub rig: Option<String>,
    /// Its location.
    pub location: Option<[f64; 3]>,
    /// In degrees; 0 where only other angles are given.
    pub roll: Option<f64>,
    /// In degrees; 0 where only other angles are given.
    pub pitch: Option<f64>,
    /// In degrees; 0 where only other angles are given. Angles are interpolated as numbers: 0 to 360 is a whole turn, 350 to 370
    /// a short one, and 350 to 10 turns back.
    pub yaw: Option<f64>,
    /// A point to look at (objects: with their x axis in a z-up world), instead of angles.
    pub target: Option<[f64; 3]>,
    /// The affine transform world_from_mesh of an object, 3x4 or 4x4, instead of location, angles and target. It must not
    /// mirror. An object has it in all keyframes or in none. Its rotation takes the shorter way, its stretch is interpolated
    /// linearly.
    pub matrix: Option<Vec<[f64; 4]>>,
    /// From this keyframe to the next; the video's where not given.
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
