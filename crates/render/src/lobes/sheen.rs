//! Sheen of cloth, the Charlie lobe: A. C. Estevez and C. Kulla, "Production Friendly Microfacet Sheen BRDF", 2017, as
//! in `KHR_materials_sheen`.

use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

use glam::Vec3;

use crate::lobes::albedo_grid::interpolate;

/// Entries per axis of the albedo table: the square root of the cosine, and perceptual roughness.
const TABLE_STEPS: usize = 32;
/// Quadrature points per table entry.
const RADIAL_POINTS: u32 = 64;
const ANGULAR_POINTS: u32 = 32;

/// A layer of fibres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheen {
    pub color: Vec3,
    /// Perceptual roughness.
    pub roughness: f32,
}

static ALBEDO_TABLE: LazyLock<[[f32; TABLE_STEPS]; TABLE_STEPS]> = LazyLock::new(|| {
    let step = |i| i as f32 / (TABLE_STEPS - 1) as f32;
    std::array::from_fn(|row| std::array::from_fn(|column| albedo(step(row), step(column).powi(2))))
});

impl Sheen {
    /// The sheen's reflectance times the cosine of `wi`.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        // Near the horizon, the albedo of the model exceeds 1. The value is then divided by the larger albedo
        // of both directions.
        let excess = self.albedo(wo.z).max(self.albedo(wi.z)).max(1.0);
        self.color * (charlie_brdf(charlie_alpha(self.roughness), wo, wi) * wi.z / excess)
    }

    /// The directional albedo of white fibres.
    fn albedo(&self, cosine: f32) -> f32 {
        let at = |row: usize| interpolate(&ALBEDO_TABLE[row], cosine);
        let position = self.roughness.clamp(0.0, 1.0) * (TABLE_STEPS - 1) as f32;
        let first = (position as usize).min(TABLE_STEPS - 2);
        at(first) + (at(first + 1) - at(first)) * (position - first as f32)
    }

    /// The directional albedo for each colour.
    pub fn albedo_color(&self, cosine: f32) -> Vec3 {
        self.color * self.albedo(cosine).min(1.0)
    }

    /// The fraction of light that passes to the layers below: the minimum over the colours.
    pub fn base_transmittance(&self, cosine: f32) -> f32 {
        (1.0 - self.color.max_element() * self.albedo(cosine)).max(0.0)
    }
}

/// Width of the distribution for a perceptual roughness. It has a minimum, because thinner fibres would be visible only
/// at the horizon.
fn charlie_alpha(roughness: f32) -> f32 {
    (roughness * roughness).max(0.01)
}

fn charlie_brdf(alpha: f32, v: Vec3, l: Vec3) -> f32 {
    let h = (v + l).normalize_or(Vec3::Z);
    let sine = (1.0 - h.z * h.z).max(0.0).sqrt();
    let density = (2.0 + 1.0 / alpha) * sine.powf(1.0 / alpha) / TAU;
    let shadowing = 1.0 + lambda(alpha, v.z) + lambda(alpha, l.z);
    density / (4.0 * shadowing * v.z * l.z)
}

/// Function that the paper fits to the shadowing term.
fn lambda(alpha: f32, cosine: f32) -> f32 {
    let t = (1.0 - alpha) * (1.0 - alpha);
    let mix = |soft: f32, sharp: f32| soft + (sharp - soft) * t;
    let a = mix(21.5473, 25.3245);
    let b = mix(3.82987, 3.32435);
    let c = mix(0.19823, 0.16801);
    let d = mix(-1.97760, -1.27393);
    let e = mix(-4.32054, -4.85967);
    let curve = |x: f32| a / (1.0 + b * x.powf(c)) + d * x + e;
    if cosine < 0.5 { curve(cosine).exp() } else { (2.0 * curve(0.5) - curve(1.0 - cosine)).exp() }
}

fn albedo(roughness: f32, cosine: f32) -> f32 {
    let cosine = cosine.max(1e-3);
    let v = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let mut sum = 0.0;
    for ring in 0..RADIAL_POINTS {
        // The rings are denser towards the horizon, where the lobe peaks.
        let root = (ring as f32 + 0.5) / RADIAL_POINTS as f32;
        let z = root * root;
        let radius = (1.0 - z * z).sqrt();
        for turn in 0..ANGULAR_POINTS {
            let (sin, cos) = (PI * (turn as f32 + 0.5) / ANGULAR_POINTS as f32).sin_cos();
            let l = Vec3::new(radius * cos, radius * sin, z);
            sum += f64::from(charlie_brdf(charlie_alpha(roughness), v, l) * z * 2.0 * root);
        }
    }
    (sum * f64::from(TAU) / f64::from(RADIAL_POINTS * ANGULAR_POINTS)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::tests::over_the_hemisphere;

    fn white(roughness: f32) -> Sheen {
        Sheen { color: Vec3::ONE, roughness }
    }

    #[test]
    fn sheen_lobe_matches_the_paper() {
        // The expected value follows from the paper's equations 2 and 3, with the row of table 1 for alpha =
        // 1, which is not interpolated with the other row.
        let cosine = 0.6f64;
        let (a, b, c, d, e) = (21.5473, 3.82987, 0.19823, -1.97760, -4.32054);
        let fit = |x: f64| a / (1.0 + b * x.powf(c)) + d * x + e;
        let lambda = (2.0 * fit(0.5) - fit(1.0 - cosine)).exp();
        let sine = (1.0 - cosine * cosine).sqrt();
        let v = Vec3::new(sine as f32, 0.0, cosine as f32);
        // The directions towards the viewer and the light are equal, and so is the half vector.
        let density = (2.0 + 1.0) * sine / (2.0 * std::f64::consts::PI);
        let expected = density / ((1.0 + 2.0 * lambda) * 4.0 * cosine);
        let found = f64::from(white(1.0).eval(v, v).x);
        assert!((found / expected - 1.0).abs() < 1e-4, "{found}, {expected}");
    }

    #[test]
    fn albedo_and_base_transmittance_add_up_to_one() {
        for (roughness, cosine) in [(0.7f32, 0.5f32), (0.9, 0.9), (1.0, 0.6), (1.0, 0.25)] {
            let sheen = white(roughness);
            let view = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let sent = over_the_hemisphere(|light| sheen.eval(view, light).x);
            let said = f64::from(sheen.albedo_color(cosine).x);
            assert!(
                (sent / said - 1.0).abs() < 4e-3,
                "roughness {roughness}, cosine {cosine}: reflected {sent}, expected {said}"
            );
            let sum = said + f64::from(sheen.base_transmittance(cosine));
            assert!((sum - 1.0).abs() < 1e-6, "{roughness}, {cosine}: {sum}");
        }
    }
}
