//! Thin-film interference, integrated to RGB.
//!
//! L. Belcour and P. Barla, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", 2017,
//! with the interfaces of `KHR_materials_iridescence`.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec3};

/// A thin film on top of another interface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ThinFilm {
    pub ior: f32,
    /// Thickness of the film in nanometres.
    pub thickness: f32,
}

/// Maximum order of interference; higher orders are not visible in RGB.
const INTERFERENCE_ORDERS: u32 = 2;

impl ThinFilm {
    /// The reflectance over a base with the reflectance `base` at normal incidence.
    pub fn reflectance(&self, cosine: f32, base: Vec3) -> Vec3 {
        // The index fades to 1 for very thin films, because a film without thickness has no interface.
        let fade = (self.thickness / 0.03).clamp(0.0, 1.0);
        let ior = 1.0 + (self.ior - 1.0) * (fade * fade * (3.0 - 2.0 * fade));
        let sin2 = (1.0 - cosine * cosine).max(0.0) / (ior * ior);
        if sin2 >= 1.0 {
            return Vec3::ONE;
        }
        let inner = (1.0 - sin2).sqrt();
        let top = fresnel(normal_reflectance(ior, 1.0), cosine);
        let through = 1.0 - top;
        let top_phase = if ior < 1.0 { PI } else { 0.0 };
        let channel = |base: f32| {
            let root = base.clamp(0.0, 0.9999).sqrt();
            let base_ior = (1.0 + root) / (1.0 - root);
            let bottom = fresnel(normal_reflectance(base_ior, ior), inner);
            let phase = PI - top_phase + if base_ior < ior { PI } else { 0.0 };
            (bottom, phase)
        };
        let parts = base.to_array().map(channel);
        let bottom = Vec3::from(parts.map(|(bottom, _)| bottom));
        let phase = Vec3::from(parts.map(|(_, phase)| phase));
        let both = (top * bottom).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
        let round = Vec3::from(both.to_array().map(f32::sqrt));
        let sum = through * through * bottom / (Vec3::ONE - both);
        let mut reflected = top + sum;
        let mut amplitude = sum - through;
        let difference = 2.0 * ior * self.thickness * inner;
        for order in 1..=INTERFERENCE_ORDERS {
            amplitude *= round;
            let order = order as f32;
            reflected += amplitude * 2.0 * sensitivity(order * difference, order * phase);
        }
        reflected.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

fn normal_reflectance(above: f32, below: f32) -> f32 {
    ((above - below) / (above + below)).powi(2)
}

fn fresnel(normal: f32, cosine: f32) -> f32 {
    normal + (1.0 - normal) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// Response of linear Rec. 709 to a spectrum that is a cosine of the wavenumber: the Fourier transform of
/// Gaussians fitted to the CIE 1931 colour matching functions (the paper's supplemental material, table of
/// section 2). `difference` is the optical path difference in nanometres.
fn sensitivity(difference: f32, shift: Vec3) -> Vec3 {
    let phase = TAU * difference * 1e-9;
    let gaussian = |value: f32, position: f32, variance: f32, shift: f32| {
        let damping = (-phase * phase * variance).exp();
        value * (TAU * variance).sqrt() * (position * phase + shift).cos() * damping
    };
    let x = gaussian(5.4856e-13, 1.6810e6, 4.3278e9, shift.x) + gaussian(9.7470e-14, 2.2399e6, 4.5282e9, shift.x);
    let y = gaussian(4.4201e-13, 1.7953e6, 9.3046e9, shift.y);
    let z = gaussian(5.2481e-13, 2.2084e6, 6.6121e9, shift.z);
    let rec709_from_xyz = Mat3::from_cols_array(&[
        3.2404542, -0.969_266, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314, 0.041_556, 1.0572252,
    ]);
    rec709_from_xyz * (Vec3::new(x, y, z) / 1.0685e-7)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BASE: Vec3 = Vec3::new(0.04, 0.3, 0.9);

    #[test]
    fn thick_films_reflect_like_two_separate_surfaces() {
        // Light that is out of phase adds up without interference: R1 + T1 R2 T1 / (1 - R1 R2), summed over the
        // reflections between both surfaces.
        let film = ThinFilm { ior: 1.4, thickness: 1e6 };
        for cosine in [1.0f32, 0.7, 0.3] {
            let inner = (1.0 - (1.0 - cosine * cosine) / (1.4 * 1.4)).sqrt();
            let schlick = |f0: f32, cosine: f32| f0 + (1.0 - f0) * (1.0 - cosine).powi(5);
            let first = schlick((0.4f32 / 2.4).powi(2), cosine);
            let expected = BASE.to_array().map(|base| {
                let index = (1.0 + base.sqrt()) / (1.0 - base.sqrt());
                let second = schlick(((index - 1.4) / (index + 1.4)).powi(2), inner);
                first + (1.0 - first).powi(2) * second / (1.0 - first * second)
            });
            let ratio = film.reflectance(cosine, BASE) / Vec3::from(expected);
            assert!((ratio - 1.0).abs().max_element() < 1e-3, "{cosine}: {ratio}");
        }
    }
}
