//! The key `displace` of an object.

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess};

use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::mesh::subdivide::MAX_SUBDIVIDED_TRIANGLES;
use crate::written::{written, written_schema};

/// Displacement of the surface by the texture `height`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DisplaceSpec {
    /// On with the defaults, or off.
    Switch(bool),
    /// On, with these settings.
    Table(DisplaceTable),
}

/// The table `{ max_edge, zero, max_triangles }`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DisplaceTable {
    /// Length in metres below which edges are not split. Default: edges are split until they are as short as a texel.
    pub max_edge: f64,
    /// Value of the texture `height` where the surface does not move; default 0.
    pub zero: f64,
    /// Maximum number of triangles of the displaced mesh, at most 33,554,432; default 4,000,000.
    pub max_triangles: usize,
}

impl Default for DisplaceTable {
    fn default() -> Self {
        Self { max_edge: 0.0, zero: 0.0, max_triangles: 4_000_000 }
    }
}

written! {
    DisplaceSpec: "true, false or a table { max_edge, zero, max_triangles }",

    fn visit_bool<E: Error>(self, v: bool) -> Result<DisplaceSpec, E> {
        Ok(DisplaceSpec::Switch(v))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<DisplaceSpec, A::Error> {
        Ok(DisplaceSpec::Table(Deserialize::deserialize(MapAccessDeserializer::new(map))?))
    }
}

written_schema!(DisplaceSpec, "Displace", |generator| {
    let table = generator.subschema_for::<DisplaceTable>();
    schemars::json_schema!({ "anyOf": [{ "type": "boolean" }, table] })
});

impl DisplaceSpec {
    /// True if the surface is displaced.
    pub(crate) fn is_on(&self) -> bool {
        *self != Self::Switch(false)
    }

    /// The settings of a displaced surface.
    ///
    /// # Errors
    /// [`SceneError::Schema`] for a number outside its range.
    pub(crate) fn settings(self) -> Result<DisplaceTable> {
        let table = match self {
            Self::Switch(_) => DisplaceTable::default(),
            Self::Table(table) => table,
        };
        let fail = |key: &str, message: String| {
            Err(SceneError::schema(ErrorCode::OutOfRange, format!("displace.{key}"), message))
        };
        let DisplaceTable { max_edge, zero, max_triangles } = table;
        if !(max_edge.is_finite() && max_edge >= 0.0) {
            return fail("max_edge", format!("{max_edge}; expected a number of metres >= 0"));
        }
        if !zero.is_finite() {
            return fail("zero", format!("{zero}; expected a finite number"));
        }
        if !(1..=MAX_SUBDIVIDED_TRIANGLES).contains(&max_triangles) {
            return fail("max_triangles", format!("{max_triangles}; expected 1 to {MAX_SUBDIVIDED_TRIANGLES}"));
        }
        Ok(table)
    }
}
