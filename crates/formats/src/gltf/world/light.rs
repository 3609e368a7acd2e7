//! `KHR_lights_punctual`.
//!
//! glTF's lights are photometric, in candela and lux; raycam's are radiometric. Photometric glTF units become
//! radiometric units with the factor 1: one candela becomes one W/sr, and one nit of an emissive material becomes one
//! W/(m² sr). The common factor has the effect of an exposure.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::DAffine3;
use raycam_scene::animation::NodeLight;
use raycam_scene::{ErrorCode, Light, LightTraits, NoticeCode};

use crate::error::Result;
use crate::gltf::json::extensions::Spot;
use crate::gltf::json::lenient::Lenient;
use crate::gltf::world::builder::Builder;
use crate::gltf::world::material::NON_NEGATIVE;

impl Builder<'_, '_> {
    /// Adds the light that a node refers to.
    pub(crate) fn light(
        &mut self,
        place: &str,
        index: usize,
        node: usize,
        world_from_node: DAffine3,
    ) -> Result<Option<NodeLight>> {
        let document = self.document;
        let lights = match &document.root.extensions.lights {
            None => &[][..],
            Some(Lenient::Valid(lights)) => &lights.lights,
            Some(Lenient::Faulty(fault)) => {
                return Err(document
                    .fault(ErrorCode::WrongType, format!("extensions.KHR_lights_punctual: {fault} (TYPE_MISMATCH)")));
            }
        };
        const LIGHTS: &str = "extensions.KHR_lights_punctual.lights";
        let json = document.get_valid(lights, index, place, LIGHTS)?;
        let place = format!("{LIGHTS}[{index}]");
        let color = self.numbers(&format!("{place}.color"), json.color, [0.0, 1.0]);
        let intensity = self.number(&format!("{place}.intensity"), json.intensity, NON_NEGATIVE);
        let power = color.map(|v| v * intensity);
        if json.range.is_some() {
            self.diagnostics.note(
                NoticeCode::IgnoredFeature,
                &place,
                "range is ignored, because lights in raycam have no maximum distance",
            );
        }
        let position = world_from_node.translation.to_array();
        // Light is emitted along the node's -z axis; the node's scale has no effect.
        let direction = -world_from_node.matrix3.z_axis;
        let Some(direction) = direction.try_normalize() else {
            self.diagnostics.note(
                NoticeCode::IgnoredElement,
                &place,
                "light omitted: its node has zero scale along \
                an axis",
            );
            return Ok(None);
        };
        let light = match &json.kind[..] {
            "directional" => Light::Sun { direction: direction.to_array(), irradiance: power, angular_diameter: 0.0 },
            "point" => Light::Point { position, power: None, intensity: Some(power), radius: 0.0 },
            "spot" => {
                let (inner, outer) = self.spot_angles(&place, json.spot.as_ref())?;
                Light::Spot {
                    position,
                    direction: direction.to_array(),
                    power: None,
                    intensity: Some(power),
                    inner: inner.to_degrees(),
                    outer: outer.to_degrees(),
                    radius: 0.0,
                }
            }
            kind => {
                return Err(document.fault(
                    ErrorCode::UnknownName,
                    format!("{place}.type: {kind:?}; expected directional, point or spot (VALUE_NOT_IN_LIST)"),
                ));
            }
        };
        let added = self.world.add_light(light.clone());
        let added = added.map_err(|error| document.scene(&place, error))?;
        self.name_light(added, node);
        Ok(Some(NodeLight { light: added, node, definition: index, base: light, color, intensity }))
    }

    /// Names a light like its node, if no other light has this name.
    fn name_light(&mut self, light: usize, node: usize) {
        let name = self.document.root.nodes.get(node).map(|node| node.name.clone());
        let traits = LightTraits { name: name.filter(|name| !name.is_empty()), ..LightTraits::default() };
        // The light keeps its default name if another light has the node's name.
        let _ = self.world.set_light_traits(light, traits);
    }

    /// Inner and outer angle of a spot in radians, clamped to 0 <= inner <= outer <= pi/2. Blender writes equal angles,
    /// and pi/2 as a float32, which is slightly larger.
    fn spot_angles(&mut self, place: &str, spot: Option<&Spot>) -> Result<(f64, f64)> {
        const ROUNDING: f64 = 1e-6;
        const CODE: &str = "KHR_LIGHTS_PUNCTUAL_LIGHT_SPOT_ANGLES";
        let (inner, outer) = spot.map_or((0.0, FRAC_PI_4), |spot| (spot.inner_cone_angle, spot.outer_cone_angle));
        if outer.is_nan() || outer <= 0.0 {
            let message = format!("{place}.spot.outerConeAngle: {outer}; expected a number greater than 0 ({CODE})");
            return Err(self.document.fault(ErrorCode::OutOfRange, message));
        }
        let used_outer = outer.min(FRAC_PI_2);
        let used_inner = inner.clamp(0.0, used_outer);
        if (used_outer - outer).abs() > ROUNDING || (used_inner - inner).abs() > ROUNDING {
            let message = format!(
                "angles {inner} and {outer} are clamped to {used_inner} and {used_outer}; expected 0 <= inner < outer \
                 <= pi/2 ({CODE})"
            );
            self.diagnostics.note(NoticeCode::ClampedValue, format!("{place}.spot"), message);
        }
        Ok((used_inner, used_outer))
    }
}
