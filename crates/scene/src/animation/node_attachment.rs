//! Lights and cameras attached to nodes, and their animated properties (`KHR_animation_pointer`).

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::camera::{Camera, Center, intrinsics_from_fov};
use crate::light::Light;

/// Property of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LightProperty {
    /// Colour: three numbers, multiplied by the intensity.
    Color,
    /// Intensity in W/sr, or in W/m² for a sun.
    Intensity,
    /// Inner angle of a spot's cone, in radians.
    InnerAngle,
    /// Outer angle of a spot's cone, in radians.
    OuterAngle,
}

/// Light attached to a node: it shines along the node's -z axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeLight {
    /// Index into the world's lights.
    pub light: usize,
    /// Index into [`NodeTree::nodes`](crate::animation::NodeTree::nodes).
    pub node: usize,
    /// Index of the light's definition in the file. An animation of the definition changes all its copies.
    pub definition: usize,
    /// State at rest.
    pub base: Light,
    /// Colour, which is multiplied by the intensity.
    pub color: [f32; 3],
    /// Intensity, which multiplies the colour.
    pub intensity: f32,
}

impl NodeLight {
    pub(crate) fn set(&mut self, property: LightProperty, value: &[f64]) {
        let first = value.first().map_or(0.0, |&v| v);
        match (property, &mut self.base) {
            (LightProperty::Color, _) => {
                let part = |i: usize| value.get(i).map_or(0.0, |&v| v.clamp(0.0, 1.0) as f32);
                self.color = std::array::from_fn(part);
            }
            (LightProperty::Intensity, _) => self.intensity = first.max(0.0) as f32,
            (LightProperty::InnerAngle, Light::Spot { inner, outer, .. }) => {
                *inner = first.to_degrees().clamp(0.0, *outer);
            }
            (LightProperty::OuterAngle, Light::Spot { inner, outer, .. }) => {
                *outer = first.to_degrees().clamp(0.0, 90.0);
                *inner = inner.min(*outer);
            }
            _ => {}
        }
    }

    /// Returns the light with its current colour, intensity and angles.
    pub(crate) fn light(self) -> Light {
        let rgb = self.color.map(|v| v * self.intensity);
        let mut light = self.base;
        match &mut light {
            Light::Sun { irradiance, .. } => *irradiance = rgb,
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity = Some(rgb),
            _ => {}
        }
        light
    }
}

/// Camera attached to a node: it looks along the node's -z axis, with y up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeCamera {
    /// Index into the world's cameras.
    pub camera: usize,
    /// Index into [`NodeTree::nodes`](crate::animation::NodeTree::nodes).
    pub node: usize,
    /// Index of the camera's definition in the file.
    pub definition: usize,
    /// State at rest.
    pub base: Camera,
}

impl NodeCamera {
    /// Sets the vertical field of view in radians; invalid values are ignored.
    pub(crate) fn set_fov(&mut self, fov: f64) {
        let base = &self.base;
        if base.center() != Center::Point {
            return;
        }
        let (size, center) = (base.size(), base.pixel_center());
        let made = intrinsics_from_fov(fov.to_degrees(), size, center)
            .and_then(|k| Camera::new(k, base.r(), base.c(), size, center))
            .and_then(|camera| camera.with_lens(base.lens().clone()));
        if let Ok(camera) = made {
            self.base = camera;
        }
    }

    /// Sets half the width (axis 0) or height (axis 1) of an orthographic camera's view; invalid values are ignored.
    pub(crate) fn set_magnification(&mut self, axis: usize, half: f64) {
        let base = &self.base;
        let (size, mut k) = (base.size(), base.k());
        k.col_mut(axis)[axis] = f64::from(size[axis]) / (2.0 * half);
        if base.center() == Center::Plane
            && let Ok(camera) = base.with_intrinsics(k, size)
        {
            self.base = camera;
        }
    }
}

/// Moves a light to the position and direction of its node.
pub(crate) fn move_light(light: &mut Light, place: DVec3, along: Option<DVec3>) {
    match light {
        Light::Sun { direction, .. } => {
            if let Some(along) = along {
                *direction = along.to_array();
            }
        }
        Light::Point { position, .. } => *position = place.to_array(),
        Light::Spot { position, direction, .. } => {
            *position = place.to_array();
            if let Some(along) = along {
                *direction = along.to_array();
            }
        }
        _ => {}
    }
}
