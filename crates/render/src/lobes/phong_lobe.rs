//! The modified Phong lobe.
//!
//! E. P. Lafortune and Y. D. Willems, "Using the modified Phong reflectance model for physically based rendering",
//! report CW 197, K.U. Leuven, 1994: f = diffuse / pi + specular (n + 2) / (2 pi) cos^n(a), where a is the angle
//! between the light and the mirror direction of the view. Its albedo is exactly `specular` at normal incidence and
//! falls off where the lobe dips below the horizon.

use std::f32::consts::PI;

use glam::Vec3;
use raycam_scene::MaterialModel;

use crate::lobes::shading_frame::sincos_turns;

/// A specular Phong lobe with a given exponent.
#[derive(Debug)]
pub(crate) struct PhongLobe {
    shininess: f32,
    /// Directional albedo at cosines 0, 1/32, ... 1 between view and normal.
    albedo: [f32; ALBEDO_STEPS + 1],
}

const ALBEDO_STEPS: usize = 32;

impl PhongLobe {
    /// Exponent of a material model with a specular Phong lobe; `None` for other models.
    pub fn shininess(reflectance: &MaterialModel) -> Option<f32> {
        match *reflectance {
            MaterialModel::Phong { specular, shininess, .. } if specular != [0.0; 3] => Some(shininess),
            _ => None,
        }
    }

    pub fn new(shininess: f32) -> Self {
        let albedo = std::array::from_fn(|i| albedo(f64::from(shininess), i as f64 / ALBEDO_STEPS as f64) as f32);
        Self { shininess, albedo }
    }

    /// The exponent of the lobe.
    pub fn exponent(&self) -> f32 {
        self.shininess
    }

    /// The value of a white lobe in 1/sr, from world directions.
    pub fn eval(&self, normal: Vec3, wo: Vec3, wi: Vec3) -> f32 {
        let mirror = 2.0 * normal.dot(wo) * normal - wo;
        let cosine = mirror.dot(wi).min(1.0);
        if cosine <= 0.0 {
            return 0.0;
        }
        (self.shininess + 2.0) / (2.0 * PI) * cosine.powf(self.shininess)
    }

    /// The density of [`PhongLobe::sample`] by solid angle.
    pub fn pdf(&self, normal: Vec3, wo: Vec3, wi: Vec3) -> f32 {
        self.eval(normal, wo, wi) * ((self.shininess + 1.0) / (self.shininess + 2.0))
    }

    /// Samples a world direction around the mirror direction with density (n + 1) / (2 pi) cos^n. The direction may lie
    /// below the surface.
    pub fn sample(&self, normal: Vec3, wo: Vec3, [x, y]: [f32; 2]) -> Vec3 {
        let mirror = 2.0 * normal.dot(wo) * normal - wo;
        let cosine = (1.0 - x).powf(1.0 / (self.shininess + 1.0));
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (right, up) = mirror.any_orthonormal_pair();
        let (sin, cos) = sincos_turns(y);
        (right * cos + up * sin) * sine + mirror * cosine
    }

    /// The directional albedo of a white lobe.
    pub fn albedo(&self, cosine: f32) -> f32 {
        let position = cosine.clamp(0.0, 1.0) * ALBEDO_STEPS as f32;
        let first = (position as usize).min(ALBEDO_STEPS - 1);
        let fraction = position - first as f32;
        self.albedo[first] + (self.albedo[first + 1] - self.albedo[first]) * fraction
    }
}

/// The integral of (n + 2) / (2 pi) cos^n(a) max(0, cos(theta)) over all directions at angle a to the mirror
/// direction, whose cosine to the normal is given. In (a, phi) around the mirror direction, cos(theta) is
/// cos(a) c + sin(a) s cos(phi): phi is integrated in closed form, cos^(n+1)(a) by the midpoint rule.
fn albedo(n: f64, c: f64) -> f64 {
    const POINTS: usize = 128;
    let s = (1.0 - c * c).max(0.0).sqrt();
    let ring = |i: usize| {
        let cos_a = ((i as f64 + 0.5) / POINTS as f64).powf(1.0 / (n + 1.0));
        let sin_a = (1.0 - cos_a * cos_a).max(0.0).sqrt();
        let (a, b) = (cos_a * c, sin_a * s);
        if a >= b {
            std::f64::consts::TAU * a
        } else {
            let phi = (-a / b).acos();
            2.0 * (a * phi + b * phi.sin())
        }
    };
    let mean = (0..POINTS).map(ring).sum::<f64>() / POINTS as f64;
    (n + 2.0) / (n + 1.0) * mean / std::f64::consts::TAU
}
