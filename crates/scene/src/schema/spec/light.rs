//! Keys of lights: keys of the light's type, keys that every light has, and photometric units.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};

use crate::color::Rgb;
use crate::error::{Result, SceneError};
use crate::light::blackbody::{TEMPERATURES, blackbody_color};
use crate::light::{LUMENS_PER_WATT, Light, LightTraits, LightVisibility};
use crate::schema::deserialize::value::{Entry, SpannedValue, Value};
use crate::schema::spec::camera::CameraSpec;
use crate::up::Up;

/// A light of a description.
#[derive(Clone, Debug)]
pub struct LightSpec {
    /// The values of the light's type.
    pub light: Light,
    common: CommonKeys,
}

/// Keys that every light has.
#[derive(Clone, Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct CommonKeys {
    /// Name by which the channel `light:NAME` refers to the light. Default: the light's type, with a number if other
    /// lights have the same name.
    name: Option<String>,
    /// Kinds of rays to which the light is visible. With `camera = false`, the light is invisible to the camera;
    /// with `reflection = false`, mirrors and glass do not show the light; with `light = false`, it illuminates
    /// nothing, for example an environment that is only the background.
    visible: LightVisibility,
    /// Only `area`, `disk`, and `point` and `spot` with a `radius`: true if the light is an object too. The object has
    /// the light's name, occludes other lights and what is behind it, and appears in ids and all other ground truth.
    body: Option<bool>,
    /// Colour temperature in kelvin, 1000 to 40000: the light's strength is multiplied by the colour of a black body
    /// with luminance 1, so that the light's luminance does not change. 2700 is an incandescent lamp, 6500 daylight.
    temperature: Option<f64>,
    /// Only `sun` and `projector`: illuminance of a surface that faces the light, in lx, instead of `irradiance`. White
    /// light of 683 lm/W, unless `temperature` gives its colour.
    lux: Option<f64>,
    /// Only `point` and `spot`: luminous intensity in cd, instead of `intensity`; for a spot, on its axis.
    candela: Option<f64>,
    /// Only `point`, `spot`, `ies`, `projector`, `area` and `disk`: luminous flux of all emitted light in lm, instead
    /// of `power` or `radiance`.
    lumen: Option<f64>,
    /// Only `projector`: the camera along whose rays the image is projected, with the keys of a camera (size,
    /// intrinsics, lens and pose).
    camera: Option<CameraSpec>,
    /// Only `area`, `disk` and `sky`: luminance in cd/m², instead of `radiance`.
    nit: Option<f64>,
}

/// Photometric unit: its key, and pairs of a light's type and the key that the unit replaces there.
struct PhotometricUnit {
    key: &'static str,
    replaces: &'static [(&'static str, &'static str)],
}

const UNITS: [PhotometricUnit; 4] = [
    PhotometricUnit { key: "lux", replaces: &[("sun", "irradiance"), ("projector", "irradiance")] },
    PhotometricUnit {
        key: "candela",
        replaces: &[("point", "intensity"), ("bulb", "intensity"), ("spot", "intensity")],
    },
    PhotometricUnit {
        key: "lumen",
        replaces: &[
            ("point", "power"),
            ("bulb", "power"),
            ("spot", "power"),
            ("ies", "power"),
            ("projector", "power"),
            ("area", "radiance"),
            ("disk", "radiance"),
        ],
    },
    PhotometricUnit { key: "nit", replaces: &[("area", "radiance"), ("disk", "radiance"), ("sky", "radiance")] },
];

/// Keys of [`CommonKeys`].
const COMMON_KEYS: [&str; 9] = ["name", "visible", "body", "temperature", "lux", "candela", "lumen", "nit", "camera"];

/// Splits a light's table into the keys that every light has and the keys of its type; a photometric unit is replaced
/// by a strength of 1.
///
/// # Errors
/// A message if the light's type does not support the photometric unit, or if the table also contains the key that the
/// unit replaces, or a second unit.
pub(crate) fn split_light_keys(entries: &[Entry]) -> std::result::Result<[SpannedValue; 2], String> {
    let is_given = |key: &str| entries.iter().any(|entry| entry.key == key && entry.value.value != Value::Null);
    let is_common = |entry: &&Entry| COMMON_KEYS.contains(&entry.key.as_str());
    let (common, mut own): (Vec<_>, Vec<_>) = entries.iter().cloned().partition(|entry| is_common(&entry));
    let kind = entries.iter().find_map(|entry| match &entry.value.value {
        Value::String(name) if entry.key == "type" => Some(name.as_str()),
        _ => None,
    });
    let mut units = UNITS.iter().filter(|unit| is_given(unit.key));
    if let (Some(unit), Some(kind)) = (units.next(), kind) {
        if let Some(other) = units.next() {
            return Err(format!("a light with both {} and {}; use only one of them", unit.key, other.key));
        }
        let Some((_, strength)) = unit.replaces.iter().find(|(known, _)| *known == kind) else {
            let kinds: Vec<&str> =
                unit.replaces.iter().map(|(known, _)| *known).filter(|known| *known != "bulb").collect();
            return Err(format!(
                "{} is not a unit of lights of type {kind:?}; types with this unit: {}",
                unit.key,
                kinds.join(", ")
            ));
        };
        if is_given(strength) {
            return Err(format!("a light with both {} and {strength}; use only one of them", unit.key));
        }
        own.push(Entry { key: (*strength).into(), key_span: None, value: Value::Float(1.0).into() });
    }
    Ok([common, own].map(|entries| Value::Table(entries).into()))
}

impl<'de> Deserialize<'de> for LightSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Parts;

        impl<'de> Visitor<'de> for Parts {
            type Value = LightSpec;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a table")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> std::result::Result<LightSpec, A::Error> {
                let missing = || A::Error::custom("a stored light must consist of two tables");
                let common = parts.next_element()?.ok_or_else(missing)?;
                let light = parts.next_element()?.ok_or_else(missing)?;
                Ok(LightSpec { light, common })
            }
        }
        deserializer.deserialize_tuple_struct("LightSpec", 2, Parts)
    }
}

impl JsonSchema for LightSpec {
    fn schema_name() -> Cow<'static, str> {
        "Light".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = Light::json_schema(generator);
        let common = CommonKeys::json_schema(generator);
        let all = common.get("properties").and_then(|keys| keys.as_object()).cloned().unwrap_or_default();
        for variant in schema.get_mut("oneOf").and_then(|kinds| kinds.as_array_mut()).into_iter().flatten() {
            let kind = variant["properties"]["type"]["const"].as_str().unwrap_or_default().to_owned();
            let unit = |key: &str| UNITS.iter().find(|unit| unit.key == key);
            let replaced = |unit: &PhotometricUnit| unit.replaces.iter().find(|(known, _)| *known == kind);
            let has = |key: &str| match key {
                "camera" => kind == "projector",
                "body" => ["area", "disk", "point", "spot"].contains(&&*kind),
                _ => unit(key).is_none_or(|unit| replaced(unit).is_some()),
            };
            let optional: Vec<&str> = UNITS.iter().filter_map(|unit| replaced(unit).map(|(_, key)| *key)).collect();
            if let Some(required) = variant.get_mut("required").and_then(|keys| keys.as_array_mut()) {
                required.retain(|key| !optional.contains(&key.as_str().unwrap_or_default()));
            }
            if let Some(properties) = variant.get_mut("properties").and_then(|keys| keys.as_object_mut()) {
                properties
                    .extend(all.iter().filter(|(key, _)| has(key)).map(|(key, value)| (key.clone(), value.clone())));
            }
        }
        schema
    }
}

impl LightSpec {
    /// Returns the light with its strength in radiometric units, and its name, visibility and body.
    ///
    /// # Errors
    /// [`SceneError::World`] for an invalid name, temperature or photometric value.
    pub fn build(self, up: Up) -> Result<(Light, LightTraits)> {
        let Self { mut light, common } = self;
        match (&mut light, &common.camera) {
            (Light::Projector { camera, .. }, Some(spec)) => {
                *camera = Some(Box::new(spec.build(up).map_err(|error| error.in_context("camera"))?));
            }
            (light, Some(_)) => {
                let kind = light.type_name();
                return Err(SceneError::light(format!(
                    "camera is not a key of lights of type {kind:?}; use projector"
                )));
            }
            _ => {}
        }
        let mut factor = [1.0; 3];
        let units = [("lux", common.lux), ("candela", common.candela), ("lumen", common.lumen), ("nit", common.nit)];
        for (unit, value) in units {
            let Some(value) = value else { continue };
            if !(value.is_finite() && value >= 0.0) {
                return Err(SceneError::light(format!("{unit} is {value}; expected a finite number >= 0")));
            }
            let watts = value / LUMENS_PER_WATT;
            let strength = if unit == "lumen" { watts / emitted_power(&light) } else { watts };
            factor = factor.map(|own: f32| own * strength as f32);
        }
        if let Some(kelvin) = common.temperature {
            if !TEMPERATURES.contains(&kelvin) {
                let [low, high] = [TEMPERATURES.start(), TEMPERATURES.end()];
                return Err(SceneError::light(format!("temperature is {kelvin}; expected {low} to {high} K")));
            }
            let tint = blackbody_color(kelvin);
            factor = [0, 1, 2].map(|i| factor[i] * tint[i]);
        }
        if factor != [1.0; 3] {
            light.scale_strength(factor)?;
        }
        if common.name.as_deref().is_some_and(|name| name.is_empty() || name.chars().any(char::is_control)) {
            let message = "an invalid name; expected at least one character, and no control characters";
            return Err(SceneError::light(message));
        }
        Ok((
            light,
            LightTraits { name: common.name, visible: common.visible, has_body: common.body.unwrap_or_default() },
        ))
    }
}

/// Emitted power of a light whose strength is 1: its power, or its radiance times pi and its area.
fn emitted_power(light: &Light) -> f64 {
    let area = match light {
        Light::Rectangle { u, v, .. } => glam::DVec3::from(*u).cross(glam::DVec3::from(*v)).length(),
        Light::Disk { radius, .. } => std::f64::consts::PI * radius * radius,
        _ => return 1.0,
    };
    let sides = if matches!(light, Light::Rectangle { two_sided: true, .. } | Light::Disk { two_sided: true, .. }) {
        2.0
    } else {
        1.0
    };
    sides * std::f64::consts::PI * area
}

impl Light {
    /// Multiplies the strength of every colour.
    ///
    /// # Errors
    /// [`SceneError::World`] for a light whose colour comes from an image, a model or a file.
    fn scale_strength(&mut self, factor: Rgb) -> Result<()> {
        let scale = |rgb: &mut Rgb| *rgb = [0, 1, 2].map(|i| rgb[i] * factor[i]);
        match self {
            Self::Sun { irradiance: strength, .. }
            | Self::Rectangle { radiance: strength, .. }
            | Self::Disk { radiance: strength, .. } => scale(strength),
            Self::Projector { power, irradiance, .. } => power.iter_mut().chain(irradiance).for_each(scale),
            Self::Point { power, intensity, .. } | Self::Spot { power, intensity, .. } => {
                power.iter_mut().chain(intensity).for_each(scale);
            }
            Self::Sky { radiance, zenith, horizon, ground } => {
                [radiance, zenith, horizon, ground].into_iter().flatten().for_each(scale);
            }
            Self::Ies { power: Some(power), .. } => scale(power),
            Self::Ies { power: None, .. } | Self::Preetham { .. } | Self::Environment { .. } => {
                let remedy = match self {
                    Self::Ies { .. } => "; add lumen or power",
                    _ => "",
                };
                return Err(SceneError::light(format!(
                    "temperature cannot be used with a light of type {:?}, whose file or model \
                     specifies the colour{remedy}",
                    self.type_name()
                )));
            }
        }
        Ok(())
    }
}
