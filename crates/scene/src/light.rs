//! Lights, in radiometric units.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The closed set of lights, as written in world files and dicts: `{ type = "sun", ... }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub enum Light {
    /// Parallel light from far away.
    Sun {
        /// The way the light travels, in the world; any length but zero.
        direction: [f64; 3],
        /// Linear RGB in W/m² on a surface that faces the sun.
        irradiance: [f32; 3],
    },
    /// A light bulb: a point, or a sphere where `radius` > 0. Exactly one of `power` and `intensity`.
    Bulb {
        /// The centre, in the world.
        position: [f64; 3],
        /// Linear RGB in W, over the whole sphere of directions.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        power: Option<[f32; 3]>,
        /// Linear RGB in W/sr.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        intensity: Option<[f32; 3]>,
        /// In metres.
        #[serde(default)]
        radius: f64,
    },
    /// The same radiance from everywhere: the background, and an ambient term.
    Sky {
        /// Linear RGB in W/(m² sr).
        radiance: [f32; 3],
    },
}
