//! The key `medium` of an object.

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess};

use crate::error::{Result, SceneError, suggestion};
use crate::error_code::ErrorCode;
use crate::medium::{Medium, preset};
use crate::schema::shorthand::Splat;
use crate::written::{written, written_schema};

/// A medium: the name of a preset, or its coefficients.
#[derive(Clone, Debug, PartialEq)]
pub enum MediumSpec {
    /// The name of a preset.
    Name(String),
    /// Coefficients.
    Table(MediumTable),
}

/// The table `{ absorption, scattering, g }`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MediumTable {
    /// The fraction of light that is absorbed, per metre: a number or red, green, blue >= 0. Default: 0.
    pub absorption: Option<Splat<3>>,
    /// The fraction of light that is scattered, per metre: a number or red, green, blue >= 0. Default: 0.
    pub scattering: Option<Splat<3>>,
    /// The mean cosine of the scattering angle, between -1 and 1: 0 scatters equally in all directions. Default: 0.
    pub g: Option<f64>,
}

written! {
    MediumSpec: "the name of a medium or a table { absorption, scattering, g }",

    fn visit_str<E: Error>(self, v: &str) -> Result<MediumSpec, E> {
        Ok(MediumSpec::Name(v.into()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MediumSpec, A::Error> {
        Ok(MediumSpec::Table(Deserialize::deserialize(MapAccessDeserializer::new(map))?))
    }
}

written_schema!(MediumSpec, "Medium", |generator| {
    let table = generator.subschema_for::<MediumTable>();
    let names: Vec<_> = preset::names().collect();
    schemars::json_schema!({ "anyOf": [{ "enum": names }, table] })
});

impl MediumSpec {
    /// Returns the described medium.
    ///
    /// # Errors
    /// [`SceneError::Schema`]: an unknown name, and the errors of [`Medium::validate`].
    pub fn build(&self) -> Result<Medium> {
        let medium = match self {
            Self::Name(name) => Medium::named(name).ok_or_else(|| {
                let message = format!("unknown medium {name:?}{}", suggestion(name, preset::names()));
                SceneError::schema(ErrorCode::UnknownName, "", message)
            })?,
            Self::Table(MediumTable { absorption, scattering, g }) => {
                let rgb = |given: &Option<Splat<3>>| given.map_or([0.0; 3], |Splat(values)| values.map(|v| v as f32));
                Medium { absorption: rgb(absorption), scattering: rgb(scattering), g: g.unwrap_or(0.0) as f32 }
            }
        };
        medium.validate()?;
        Ok(medium)
    }
}
