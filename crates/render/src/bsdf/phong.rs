//! The lecture's material: Lambert plus modified Phong. Matte is its diffuse part alone.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::bsdf::diffuse::Matte;
use crate::bsdf::{ScatterSample, Scattering, Value};
use crate::lobes::phong_lobe::Lobe;
use crate::lobes::shading_frame::{Frame, cosine_density, cosine_direction};

/// Its shares at a point.
#[derive(Clone, Debug)]
pub(crate) struct Lecture<'a> {
    /// Albedo of the diffuse part.
    pub diffuse: Vec3,
    /// Albedo of the specular part at normal incidence.
    pub specular: Vec3,
    /// Its lobe; `None` where `specular` is 0.
    pub lobe: Option<&'a Lobe>,
}

impl Lecture<'_> {
    /// How often the specular lobe is sampled.
    fn specular_share(&self) -> f32 {
        if self.lobe.is_none() {
            return 0.0;
        }
        let (specular, diffuse) = (self.specular.element_sum(), self.diffuse.element_sum());
        if specular == 0.0 {
            0.0
        } else {
            specular / (specular + diffuse)
        }
    }

    /// Of light on the viewer's side.
    #[inline]
    fn value(&self, frame: &Frame, light: Vec3) -> Value {
        let cosine = frame.normal.dot(light);
        if cosine <= 0.0 {
            return Value::default();
        }
        let mut reflected = self.diffuse * FRAC_1_PI;
        let mut pdf = cosine_density(cosine);
        if let Some(lobe) = self.lobe {
            reflected += self.specular * lobe.evaluate(frame.normal, frame.view, light);
            let share = self.specular_share();
            pdf += (lobe.pdf(frame.normal, frame.view, light) - pdf) * share;
        }
        Value {
            value: reflected * cosine,
            pdf,
        }
    }
}

impl Scattering for Lecture<'_> {
    /// A triangle sends light back on the viewer's side, whatever the smooth surface says.
    #[inline]
    fn evaluate(&self, frame: &Frame, light: Vec3) -> Value {
        if frame.geometric.dot(light) > 0.0 {
            self.value(frame, light)
        } else {
            Value::default()
        }
    }

    #[inline]
    fn sample(&self, frame: &Frame, [choice, x, y]: [f32; 3]) -> Option<ScatterSample> {
        let direction = match self.lobe {
            Some(lobe) if choice < self.specular_share() => {
                lobe.sample(frame.normal, frame.view, [x, y])
            }
            _ => frame.world(cosine_direction([x, y])),
        };
        if frame.geometric.dot(direction) <= 0.0 {
            return None;
        }
        if self.lobe.is_none() {
            let albedo = self.diffuse;
            let matte = Matte {
                albedo,
                direction,
                aims: None,
            };
            return matte.sample(frame, [choice, x, y]);
        }
        let Value { value, pdf } = self.value(frame, direction);
        (pdf > 0.0).then(|| ScatterSample {
            direction,
            weight: value / pdf,
            pdf,
            delta: false,
            squeeze: 1.0,
        })
    }

    fn albedo(&self, frame: &Frame) -> Vec3 {
        let specular = self
            .lobe
            .map_or(0.0, |lobe| lobe.albedo(frame.normal.dot(frame.view)));
        self.diffuse + self.specular * specular
    }

    fn is_lit(&self) -> bool {
        true
    }

    fn is_transmissive(&self) -> bool {
        false
    }

    fn chooses(&self) -> bool {
        self.lobe.is_some()
    }
}
