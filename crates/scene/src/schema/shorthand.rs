//! Values with several notations.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, Expected, MapAccess, SeqAccess, Visitor};

use crate::color::{Rgb, linear_from_srgb8};
use crate::error::suggestion;
use crate::schema::color_names::{self, srgb8_of_name};
use crate::texture::Wrap;
use crate::world::{Object, RayVisibility};
use crate::written::{written, written_schema};

/// `N` numbers, or a single number that is used for all `N`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat<const N: usize>(pub [f64; N]);

/// A colour: linear red, green, blue from 0 to 1, or "#rrggbb" in 8-bit sRGB. Stored as linear values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Color(pub Rgb);

/// Subdivision of the mesh: a number of levels, or `{ levels, scheme }`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refine {
    /// Number of levels; each level replaces each triangle by four.
    pub levels: u32,
    /// Placement of the new vertices.
    pub scheme: Scheme,
}

/// Placement of new vertices by subdivision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scheme {
    /// Loop (1987): approaches a smooth surface, with boundary edges kept sharp.
    #[default]
    Loop,
    /// At the midpoints of the edges: the same surface with smaller triangles.
    Midpoint,
}

/// A class of objects: a name, or a whole number, which is converted to the name with the same digits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Category(pub String);

written! {
    Category: format_args!("a name or a whole number from 0 to {}", i32::MAX),

    fn visit_str<E: Error>(self, v: &str) -> Result<Category, E> {
        if v.is_empty() {
            return Err(E::invalid_value(serde::de::Unexpected::Str(v), &self));
        }
        Ok(Category(v.into()))
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<Category, E> {
        match i32::try_from(v) {
            Ok(id @ 0..) => Ok(Category(id.to_string())),
            _ => Err(E::invalid_value(serde::de::Unexpected::Signed(v), &self)),
        }
    }
}

written_schema!(Category, "Category", |_| schemars::json_schema!({ "anyOf": [
    { "type": "string", "minLength": 1 },
    { "type": "integer", "minimum": 0, "maximum": i32::MAX },
] }));

/// Visibility of an object: a switch, or the kinds of rays to which it is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visible {
    /// Visible or hidden.
    Switch(bool),
    /// The object is visible to some kinds of rays.
    Rays(RayVisibility),
}

impl Visible {
    /// Sets the visibility of an object.
    pub(crate) fn apply(self, object: &mut Object) {
        (object.visible, object.ray_visibility) = match self {
            Self::Switch(is_visible) => (is_visible, RayVisibility::default()),
            Self::Rays(rays) => (true, rays),
        };
    }
}

written! {
    Visible: "true, false, or a table such as { camera = true, shadow = false, reflection = true }",

    fn visit_bool<E: Error>(self, v: bool) -> Result<Visible, E> {
        Ok(Visible::Switch(v))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Visible, A::Error> {
        RayVisibility::deserialize(MapAccessDeserializer::new(map)).map(Visible::Rays)
    }
}

written_schema!(Visible, "Visible", |generator| {
    let rays = generator.subschema_for::<RayVisibility>();
    schemars::json_schema!({ "anyOf": [{ "type": "boolean" }, rays] })
});

/// Wrap modes of u and v.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wraps(pub [Wrap; 2]);

impl<'de, const N: usize> Deserialize<'de> for Splat<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SplatVisitor<const N: usize>;
        impl<'de, const N: usize> Visitor<'de> for SplatVisitor<N> {
            type Value = Splat<N>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "a number or a list of {N} numbers")
            }

            fn visit_f64<E: Error>(self, v: f64) -> Result<Splat<N>, E> {
                Ok(Splat([v; N]))
            }

            fn visit_i64<E: Error>(self, v: i64) -> Result<Splat<N>, E> {
                Ok(Splat([v as f64; N]))
            }

            fn visit_u64<E: Error>(self, v: u64) -> Result<Splat<N>, E> {
                Ok(Splat([v as f64; N]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Splat<N>, A::Error> {
                let mut values = [0.0; N];
                for (i, value) in values.iter_mut().enumerate() {
                    *value = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
                }
                Ok(Splat(values))
            }
        }
        deserializer.deserialize_any(SplatVisitor::<N>)
    }
}

impl<const N: usize> serde::Serialize for Splat<N> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0)
    }
}

impl<const N: usize> JsonSchema for Splat<N> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("NumberOr{N}").into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "anyOf": [
            { "type": "number" },
            { "type": "array", "items": { "type": "number" }, "minItems": N, "maxItems": N },
        ] })
    }
}

written! {
    Color: "3 numbers (linear, 0 to 1), one number (grey), \"#rrggbb\" (8-bit sRGB) or a name (\"red\")",

    fn visit_f64<E: Error>(self, v: f64) -> Result<Color, E> {
        refuse_bytes([v; 3])?;
        Ok(Color([v as f32; 3]))
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<Color, E> {
        self.visit_f64(v as f64)
    }

    fn visit_str<E: Error>(self, v: &str) -> Result<Color, E> {
        let hex = v.strip_prefix('#').filter(|hex| hex.len() == 6 && !hex.contains('+'));
        let byte = |i| hex.and_then(|hex| u8::from_str_radix(hex.get(i..i + 2)?, 16).ok());
        if let [Some(r), Some(g), Some(b)] = [byte(0), byte(2), byte(4)] {
            return Ok(Color(linear_from_srgb8([r, g, b])));
        }
        if let Some(srgb) = srgb8_of_name(v) {
            return Ok(Color(linear_from_srgb8(srgb)));
        }
        let near = if v.starts_with('#') { String::new() } else { suggestion(v, color_names::names()) };
        Err(E::custom(format_args!("{v:?}; expected {}{near}", &self as &dyn Expected)))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Color, A::Error> {
        let mut rgb = [0.0_f64; 3];
        for (i, value) in rgb.iter_mut().enumerate() {
            *value = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
        }
        refuse_bytes(rgb)?;
        Ok(Color(rgb.map(|value| value as f32)))
    }
}

/// Rejects values that can only be bytes, and suggests the notation for bytes.
fn refuse_bytes<E: Error>(rgb: [f64; 3]) -> Result<(), E> {
    let is_byte = |v: f64| (0.0..=255.0).contains(&v) && v.fract() == 0.0;
    if !rgb.iter().all(|&v| is_byte(v)) || !rgb.iter().any(|&v| v > 1.0) {
        return Ok(());
    }
    let [r, g, b] = rgb.map(|v| v as u8);
    Err(E::custom(format_args!(
        "[{r}, {g}, {b}]; expected linear numbers from 0 to 1 (for bytes, write \"#{r:02x}{g:02x}{b:02x}\", or in \
         Python numpy.uint8([{r}, {g}, {b}]))"
    )))
}

written_schema!(Color, "Color", |_| schemars::json_schema!({ "anyOf": [
    { "type": "array", "items": { "type": "number", "minimum": 0, "maximum": 1 }, "minItems": 3, "maxItems": 3 },
    { "type": "number", "minimum": 0, "maximum": 1 },
    { "type": "string", "pattern": "^(#[0-9a-fA-F]{6}|[a-zA-Z]+)$" },
] }));

/// The table `{ levels, scheme }`.
#[derive(serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RefineTable {
    /// Number of levels; each level replaces each triangle by four.
    levels: u32,
    /// Placement of the new vertices.
    #[serde(default)]
    scheme: Scheme,
}

written! {
    Refine: "a whole number of levels or a table { levels, scheme }",

    fn visit_i64<E: Error>(self, v: i64) -> Result<Refine, E> {
        let levels = u32::try_from(v).map_err(|_| E::invalid_value(serde::de::Unexpected::Signed(v), &self))?;
        Ok(Refine { levels, scheme: Scheme::default() })
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Refine, A::Error> {
        let RefineTable { levels, scheme } = Deserialize::deserialize(MapAccessDeserializer::new(map))?;
        Ok(Refine { levels, scheme })
    }
}

written_schema!(Refine, "Refine", |generator| {
    let table = generator.subschema_for::<RefineTable>();
    schemars::json_schema!({ "anyOf": [{ "type": "integer", "minimum": 0 }, table] })
});

written! {
    Wraps: "\"repeat\", \"clamp\" or \"mirror\", or a list of two of them",

    fn visit_str<E: Error>(self, v: &str) -> Result<Wraps, E> {
        let wrap = Wrap::deserialize(serde::de::value::StrDeserializer::new(v))?;
        Ok(Wraps([wrap; 2]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Wraps, A::Error> {
        let mut wraps = [Wrap::default(); 2];
        for (i, wrap) in wraps.iter_mut().enumerate() {
            *wrap = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
        }
        Ok(Wraps(wraps))
    }
}

written_schema!(Wraps, "Wraps", |generator| {
    let wrap = generator.subschema_for::<Wrap>();
    schemars::json_schema!({ "anyOf": [wrap, { "type": "array", "items": wrap, "minItems": 2, "maxItems": 2 }] })
});

/// JSON Schema of a list, or of a table that counts as a list of one.
pub(crate) fn one_or_many<T: JsonSchema>(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let one = generator.subschema_for::<T>();
    schemars::json_schema!({ "anyOf": [one, { "type": "array", "items": one }] })
}
