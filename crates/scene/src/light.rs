//! Lights, in radiometric units.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::color::Rgb;
use crate::error::SceneError;

/// A light, which of the closed set its `type` says: `{ type = "sun", ... }`. All values are radiometric and linear.
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
        let fail = |message: String| Err(SceneError::World(message));
        match self {
            Light::Sun {
                direction,
                irradiance,
            } => {
                if DVec3::from_array(*direction).try_normalize().is_none() {
                    return fail(format!(
                        "a sun of direction {direction:?}: expected three finite numbers, not all 0: the way its \
                         light travels"
                    ));
                }
                check_rgb("irradiance", *irradiance)
            }
            Light::Bulb {
                position,
                power,
                intensity,
                radius,
            } => {
                if !DVec3::from_array(*position).is_finite() {
                    return fail(format!(
                        "a bulb at {position:?}: its position must be finite"
                    ));
                }
                if !(radius.is_finite() && *radius >= 0.0) {
                    return fail(format!(
                        "a bulb of radius {radius}: expected a finite number >= 0"
                    ));
                }
                match (power, intensity) {
                    (Some(power), None) => check_rgb("power", *power),
                    (None, Some(intensity)) => check_rgb("intensity", *intensity),
                    (None, None) => fail(
                        "a bulb without power or intensity: give one of them, power in W over all directions or \
                         intensity in W/sr"
                            .into(),
                    ),
                    (Some(_), Some(_)) => fail(
                        "a bulb with both power and intensity: give one of them (intensity = power / 4π)".into(),
                    ),
                }
            }
            Light::Sky { radiance } => check_rgb("radiance", *radiance),
        }
    }
}

fn check_rgb(name: &str, rgb: Rgb) -> Result<(), SceneError> {
    if rgb.iter().all(|v| v.is_finite() && *v >= 0.0) {
        return Ok(());
    }
    Err(SceneError::World(format!(
        "{name} {rgb:?}: expected red, green, blue that are finite and >= 0"
    )))
}
