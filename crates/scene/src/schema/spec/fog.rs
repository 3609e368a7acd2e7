//! `[fog]`.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::medium::fog::Fog;
use crate::medium::visibility_constant;
use crate::schema::shorthand::Splat;

/// Fog with the same density everywhere outside objects. Requires exactly one of `visibility` and `extinction`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FogSpec {
    /// The distance in metres after which 5 % of the contrast remains (meteorological optical range): extinction is
    /// ln 20 / visibility.
    pub visibility: Option<f64>,
    /// The fraction of light that is absorbed or scattered, per metre: a number or red, green, blue >= 0.
    pub extinction: Option<Splat<3>>,
    /// The fraction of that light which is scattered: a number or red, green, blue from 0 to 1. Default: 1.
    pub albedo: Option<Splat<3>>,
    /// The mean cosine of the scattering angle, between -1 and 1: 0 scatters equally in all directions, 0.9 mostly
    /// forward. Default: 0.
    pub g: Option<f64>,
    /// The coordinate along the up axis below which the fog is. Default: everywhere.
    pub height: Option<f64>,
}

impl FogSpec {
    /// Returns the described fog.
    ///
    /// # Errors
    /// [`SceneError::Schema`]: both or none of `visibility` and `extinction`, and the errors of [`Fog::validate`].
    pub fn build(&self) -> Result<Fog> {
        let rgb = |Splat(values): Splat<3>| values.map(|v| v as f32);
        let extinction = match (self.visibility, self.extinction) {
            (Some(visibility), None) => [(visibility_constant() / check_visibility(visibility)?) as f32; 3],
            (None, Some(extinction)) => rgb(extinction),
            (None, None) => {
                let message = "the fog has no density; set visibility in metres or extinction per metre";
                return Err(SceneError::schema(ErrorCode::MissingValue, "", message));
            }
            (Some(_), Some(_)) => {
                let message =
                    "visibility and extinction are both given; use only one of them (extinction = ln 20 / visibility)";
                return Err(SceneError::schema(ErrorCode::ConflictingValues, "extinction", message));
            }
        };
        let fog = Fog {
            extinction,
            albedo: self.albedo.map_or([1.0; 3], rgb),
            g: self.g.unwrap_or(0.0) as f32,
            height: self.height,
        };
        fog.validate()?;
        Ok(fog)
    }
}

/// Checks that a visibility is positive and that its extinction is finite in float32.
fn check_visibility(visibility: f64) -> Result<f64> {
    if visibility.is_finite() && visibility > 0.0 && ((visibility_constant() / visibility) as f32).is_finite() {
        return Ok(visibility);
    }
    let message = format!("{visibility}; expected a finite number of metres > 0");
    Err(SceneError::schema(ErrorCode::OutOfRange, "visibility", message))
}
