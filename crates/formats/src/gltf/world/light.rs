//! `KHR_lights_punctual`.
//!
//! Its lights are photometric, in candela and lux; ours are radiometric. One of theirs is one of ours, as one nit of an
//! emissive material is one W/(m² sr): all by the same factor, which is an exposure.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::DAffine3;
use raycam_scene::animation::NodeLight;
use raycam_scene::{Light, NoticeCode};

use crate::error::Result;
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
        let lights = document.root.extensions.lights.as_ref();
        let lights = lights.map_or(&[][..], |lights| &lights.lights);
        let json = document.get(lights, index, place)?;
        let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
        let color = self.numbers(&format!("{place}.color"), json.color, [0.0, 1.0]);
        let intensity = self.number(&format!("{place}.intensity"), json.intensity, NON_NEGATIVE);
        let power = color.map(|v| v * intensity);
        if json.range.is_some() {
            self.diagnostics.note(
                NoticeCode::IgnoredFeature,
                &place,
                "range is a hint to cut light off, which is not followed",
            );
        }
        let position = world_from_node.translation.to_array();
        // Light leaves along -z; scale does not matter.
        let direction = -world_from_node.matrix3.z_axis;
        let Some(direction) = direction.try_normalize() else {
            self.diagnostics.note(NoticeCode::IgnoredElement, &place, "its node flattens it: the light is left out");
            return Ok(None);
        };
        let light = match &json.kind[..] {
            "directional" => Light::Sun { direction: direction.to_array(), irradiance: power, angular_diameter: 0.0 },
            "point" => Light::Point { position, power: None, intensity: Some(power), radius: 0.0 },
            "spot" => {
                let (inner, outer) =
                    json.spot.as_ref().map_or((0.0, FRAC_PI_4), |spot| (spot.inner_cone_angle, spot.outer_cone_angle));
                if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2) {
                    return Err(document.fault(format!(
                        "{place}.spot: angles {inner} and {outer}, expected 0 <= inner < outer <= pi/2 \
                         (KHR_LIGHTS_PUNCTUAL_LIGHT_SPOT_ANGLES)"
                    )));
                }
                Light::Spot {
                    position,
                    direction: direction.to_array(),
                    power: None,
                    intensity: Some(power),
                    inner: inner.to_degrees(),
                    outer: outer.to_degrees(),
                }
            }
            kind => {
                return Err(document.fault(format!(
                    "{place}.type: {kind:?}, expected directional, point or spot (VALUE_NOT_IN_LIST)"
                )));
            }
        };
        let added = self.world.add_light(light.clone());
        let added = added.map_err(|error| document.scene(&place, error))?;
        Ok(Some(NodeLight { light: added, node, definition: index, base: light, color, intensity }))
    }
}
