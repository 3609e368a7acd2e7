//! `[video]`.

use schemars::JsonSchema;
use serde::Deserialize;

/// A video: its length, and what moves the camera (an orbit or keyframes) and the objects (keyframes).
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VideoSpec {
    /// Frames per second; 24 where not given.
    pub fps: f64,
    /// Length; up to the last keyframe, or 4, where not given.
    pub seconds: Option<f64>,
    /// Carries the camera around a target.
    pub orbit: Option<OrbitSpec>,
    /// Poses at times, of the camera or of objects, each in order of time: one table or several.
    #[schemars(schema_with = "crate::schema::one_or_many::<KeyframeSpec>")]
    pub keyframe: Vec<KeyframeSpec>,
    /// Between keyframes: "smooth" (Catmull-Rom, starting and ending at rest) or "linear".
    pub interpolation: KeyframeInterpolation,
}

/// Carries the camera around the upright axis through a target, as a whole: the first frame is the still picture.
#[derive(Clone, Debug, PartialEq, serde::Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OrbitSpec {
    /// The point to go around.
    pub target: [f64; 3],
    /// How far, over the whole video; positive is counter-clockwise seen from above; 360 where not given.
    #[serde(default = "full_turn")]
    pub degrees: f64,
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
    /// Where it is.
    pub location: Option<[f64; 3]>,
    /// In degrees; 0 where only other angles are given.
    pub roll: Option<f64>,
    /// In degrees; 0 where only other angles are given.
    pub pitch: Option<f64>,
    /// In degrees; 0 where only other angles are given. Between keyframes turns take the shorter way round.
    pub yaw: Option<f64>,
    /// A point to look at (objects: with their x axis in a z-up world), instead of angles.
    pub target: Option<[f64; 3]>,
    /// From this keyframe to the next; the video's where not given.
    pub interpolation: Option<KeyframeInterpolation>,
}

/// What happens between keyframes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Interpolation")]
pub enum KeyframeInterpolation {
    /// Straight lines at constant speed.
    Linear,
    /// Catmull-Rom curves that start and end at rest: no corners, no jumps in speed.
    #[default]
    Smooth,
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

fn full_turn() -> f64 {
    360.0
}
