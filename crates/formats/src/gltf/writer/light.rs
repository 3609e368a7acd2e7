//! Lights as `KHR_lights_punctual`: one W/sr becomes one candela, one W/m² one lux, as in the reader.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DQuat, DVec3};
use raycam_scene::{Light, NoticeCode};
use serde_json::{Value, json};

use crate::gltf::writer::document::Writer;

/// Light in the document: its index and its pose.
pub(super) struct PlacedLight {
    pub(super) index: usize,
    pub(super) world_from_node: DAffine3,
}

impl Writer<'_> {
    /// Adds a light; `None`, with a notice, if glTF does not support its type.
    pub(super) fn light(&mut self, number: usize, light: &Light) -> Option<PlacedLight> {
        let spread = |power: Option<[f32; 3]>, intensity: Option<[f32; 3]>, over: f64| {
            let share = |v: f32| (f64::from(v) / over) as f32;
            intensity.or(power.map(|power| power.map(share)))
        };
        let (mut json, rgb, position, direction) = match light {
            Light::Sun { direction, irradiance, angular_diameter } => {
                if *angular_diameter > 0.0 {
                    let message = "its angular diameter is omitted, because glTF's directional lights have no size";
                    self.note(NoticeCode::NotWritten, format!("light {number}: {message}"));
                }
                let json = json!({ "type": "directional" });
                (json, *irradiance, DVec3::ZERO, DVec3::from(*direction))
            }
            Light::Point { position, power, intensity, radius } => {
                if *radius > 0.0 {
                    let message = "its radius is omitted, because glTF's point lights have no size";
                    self.note(NoticeCode::NotWritten, format!("light {number}: {message}"));
                }
                let rgb = spread(*power, *intensity, 4.0 * PI).unwrap_or_default();
                let json = json!({ "type": "point" });
                (json, rgb, DVec3::from(*position), DVec3::NEG_Z)
            }
            Light::Spot { position, direction, power, intensity, inner, outer, radius } => {
                if *radius > 0.0 {
                    let message = "its radius is omitted, because glTF's spot lights have no size";
                    self.note(NoticeCode::NotWritten, format!("light {number}: {message}"));
                }
                let [a, b] = [inner, outer].map(|angle| angle.to_radians().cos());
                let whole = TAU * (1.0 - a + (a - b) / 3.0);
                let rgb = spread(*power, *intensity, whole).unwrap_or_default();
                let (inner, outer) = (inner.to_radians(), outer.to_radians());
                // glTF does not allow equal inner and outer angles.
                let inner = if inner < outer { inner } else { outer * (1.0 - 1e-6) };
                let spot = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
                let json = json!({ "type": "spot", "spot": spot });
                (json, rgb, DVec3::from(*position), DVec3::from(*direction))
            }
            other => {
                let kind = serde_json::to_value(other).ok();
                let kind = kind.as_ref().and_then(Value::as_object);
                let kind = kind.and_then(|object| object.keys().next().cloned());
                let kind = kind.unwrap_or_default();
                let message = format!("omitted, because KHR_lights_punctual does not support the type {kind}");
                self.note(NoticeCode::NotWritten, format!("light {number}: {message}"));
                return None;
            }
        };
        let (color, intensity) = color_and_strength(rgb);
        if color != [1.0; 3] {
            json["color"] = crate::gltf::writer::number::shortest_f32s(&color);
        }
        json["intensity"] = json!(crate::gltf::writer::number::shortest_f32(intensity));
        self.lights.push(json);
        let rotation = match direction.normalize_or(DVec3::NEG_Z) {
            DVec3::NEG_Z => DQuat::IDENTITY,
            direction => DQuat::from_rotation_arc(DVec3::NEG_Z, direction),
        };
        Some(PlacedLight {
            index: self.lights.len() - 1,
            world_from_node: DAffine3::from_mat3_translation(DMat3::from_quat(rotation), position),
        })
    }
}

/// Colour whose largest component is at most 1, and its exact factor: 1 if possible, otherwise the largest component or
/// the next power of two.
pub(super) fn color_and_strength(rgb: [f32; 3]) -> ([f32; 3], f32) {
    let largest = rgb.into_iter().fold(0.0, f32::max);
    if largest == 0.0 {
        return ([1.0; 3], 0.0);
    }
    let exact = |strength: f32| rgb.iter().all(|&v| v / strength * strength == v);
    let strength = if exact(largest) { largest } else { largest.log2().ceil().exp2() };
    (rgb.map(|v| (v / strength).min(1.0)), strength)
}
