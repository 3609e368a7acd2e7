//! Energy that surfaces return to a lidar: pi f(d, d) cos(theta), with the BRDF f at the laser's wavelength.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::error::RenderError;
use crate::thread_pool::with_pool;

/// Minimum distance in metres: nearer surfaces return as much light as surfaces at this distance.
const MIN_DISTANCE: f64 = 1e-6;
/// Cosine of incidence below which the rough specular part returns nothing.
const MIN_COSINE: f64 = 1e-9;

/// Properties of a surface at the laser's wavelength.
#[derive(Clone, Debug)]
pub struct LidarMaterial {
    /// Factor of the base colour for the diffuse part.
    pub diffuse: f64,
    /// Albedo and exponent of the Phong lobe.
    pub phong: [f64; 2],
    /// GGX's alpha of the rough specular part; 0 for none.
    pub alpha: f64,
    /// Reflectance of the rough specular part at normal incidence, in addition to `metallic` times the base colour.
    pub f0: f64,
    /// Share of the base colour that is added to `f0`.
    pub metallic: f64,
    /// Opacity.
    pub opacity: f64,
    /// Diffuse reflectance, independent of the base colour; NaN to derive it from the base colour.
    pub reflectance: f64,
    /// Coefficient of retroreflection at normal incidence, in cd/(lx m²).
    pub retroreflection: f64,
    /// Angles of incidence in degrees and coefficients of retroreflection; replaces `retroreflection` unless empty.
    pub retroreflection_table: Vec<[f64; 2]>,
}

/// Hits of a lidar's rays.
#[derive(Clone, Copy, Debug)]
pub struct LidarHits<'a> {
    /// Unit directions of the rays.
    pub directions: &'a [[f64; 3]],
    /// Unit normals of the surfaces.
    pub normals: &'a [[f64; 3]],
    /// Base colours; the red channel is used.
    pub albedos: &'a [[f32; 3]],
    /// Reflectance from each hit's texture, NaN for a hit without such a texture; `None` if no surface has
    /// such a texture.
    pub reflectances: Option<&'a [f32]>,
    /// Index of each hit's material.
    pub materials: &'a [i64],
    /// Geometric length of the path to each hit, in metres.
    pub lengths: &'a [f64],
    /// Share of the pulse's energy that reaches each hit and, from there, the receiver: one value per hit, or a single
    /// value.
    pub shares: &'a [f64],
}

/// Light that hits return.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReturnedLight {
    /// Cosines of the angles of incidence.
    pub cosines: Vec<f64>,
    /// Angles of incidence, in degrees.
    pub incidences: Vec<f32>,
    /// Energies, in units of a white diffuse surface at normal incidence at 1 m.
    pub energies: Vec<f64>,
}

/// Returned light of each hit.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length or a material is unknown, and errors of `with_pool`.
pub fn returned_light(
    hits: &LidarHits,
    materials: &[LidarMaterial],
    threads: Option<usize>,
) -> Result<ReturnedLight, RenderError> {
    let n = hits.directions.len();
    let others = [hits.normals.len(), hits.albedos.len(), hits.materials.len(), hits.lengths.len()];
    if others != [n; 4]
        || ![1, n].contains(&hits.shares.len())
        || hits.reflectances.is_some_and(|values| values.len() != n)
        || !hits.materials.iter().all(|&number| usize::try_from(number).is_ok_and(|at| at < materials.len()))
    {
        return Err(RenderError::settings(format!(
            "hits: expected {n} normals, albedos, materials, lengths and reflectances, 1 or {n} shares, and material \
             numbers below {}; got {others:?} normals, albedos, materials and lengths",
            materials.len()
        )));
    }
    let light = |i: usize| {
        let (material, [x, y, z], [a, b, c]) =
            (&materials[hits.materials[i] as usize], hits.directions[i], hits.normals[i]);
        let cosine = (x * a + y * b + z * c).abs().clamp(0.0, 1.0);
        let albedo = f64::from(hits.albedos[i][0]);
        let texel = hits.reflectances.map_or(f64::NAN, |values| f64::from(values[i]));
        let length = hits.lengths[i].max(MIN_DISTANCE);
        let share = hits.shares[if hits.shares.len() == 1 { 0 } else { i }];
        let energy = share * material.opacity * material.returned_share(albedo, texel, cosine) / (length * length);
        (cosine, libm::acos(cosine).to_degrees() as f32, energy)
    };
    with_pool(threads, || {
        let mut found = ReturnedLight::default();
        let pairs: (Vec<f64>, (Vec<f32>, Vec<f64>)) = (0..n)
            .into_par_iter()
            .with_min_len(4096)
            .map(light)
            .map(|(cosine, angle, energy)| (cosine, (angle, energy)))
            .unzip();
        (found.cosines, (found.incidences, found.energies)) = pairs;
        found
    })
}

impl LidarMaterial {
    /// pi f(d, d) cos(theta): 1 for a diffuse white surface at normal incidence.
    ///
    /// The lobes are Lafortune and Willems' modified Phong and GGX (Walter et al. 2007), with the half vector along the
    /// ray. `texel` is the reflectance of a texture, which `reflectance` multiplies; NaN without a texture.
    fn returned_share(&self, albedo: f64, texel: f64, cosine: f64) -> f64 {
        let lambert = self.diffuse_reflectance(albedo, texel) * cosine;
        let [strength, exponent] = self.phong;
        let mirrored = (2.0 * cosine * cosine - 1.0).clamp(0.0, 1.0);
        let phong = match strength != 0.0 && mirrored > 0.0 {
            true => strength * (exponent + 2.0) / 2.0 * libm::pow(mirrored, exponent) * cosine,
            false => 0.0,
        };
        lambert + phong + self.rough_part(albedo, cosine) + self.sheeting(cosine)
    }

    fn diffuse_reflectance(&self, albedo: f64, texel: f64) -> f64 {
        match (texel.is_nan(), self.reflectance.is_nan()) {
            (true, true) => self.diffuse * albedo,
            (true, false) => self.reflectance,
            (false, true) => texel,
            (false, false) => texel * self.reflectance,
        }
    }

    /// Rough specular part: D G F / (4 cos), with Smith's masking-shadowing 1 / (1 + 2 lambda).
    fn rough_part(&self, albedo: f64, cosine: f64) -> f64 {
        if self.alpha <= 0.0 || cosine <= MIN_COSINE {
            return 0.0;
        }
        let (square, cos2) = (self.alpha * self.alpha, cosine * cosine);
        let spread = cos2 * (square - 1.0) + 1.0;
        let density = square / (spread * spread);
        let masking = 1.0 / (1.0 + square * ((1.0 - cos2) / cos2)).sqrt();
        (self.f0 + self.metallic * albedo) * density * masking / (4.0 * cosine)
    }

    /// Retroreflective part: pi R_A(theta) / cos(theta), with R_A(theta) = R_A cos(theta)^4 without a table (ASTM
    /// E808).
    ///
    /// With a table, R_A is linear between the table's angles, constant below the first angle, and
    /// proportional to cos^4 above the last.
    fn sheeting(&self, cosine: f64) -> f64 {
        let fourth = |cosine: f64| (cosine * cosine) * (cosine * cosine);
        let table = &self.retroreflection_table;
        let (Some(&[first, lowest]), Some(&[last, value])) = (table.first(), table.last()) else {
            return PI * self.retroreflection * (cosine * cosine * cosine);
        };
        let angle = libm::acos(cosine).to_degrees();
        let coefficient = if angle > last {
            let end = libm::cos(last.to_radians());
            if end > MIN_COSINE { value * fourth(cosine / end) } else { value }
        } else if angle <= first {
            lowest
        } else {
            let after = table.partition_point(|[start, _]| *start < angle);
            let ([start, from], [end, to]) = (table[after - 1], table[after]);
            (to - from) / (end - start) * (angle - start) + from
        };
        PI * coefficient / cosine.max(MIN_COSINE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIFFUSE: LidarMaterial = LidarMaterial {
        diffuse: 1.0,
        phong: [0.0; 2],
        alpha: 0.0,
        f0: 0.0,
        metallic: 0.0,
        opacity: 1.0,
        reflectance: f64::NAN,
        retroreflection: 0.0,
        retroreflection_table: vec![],
    };

    fn energy_of(material: &LidarMaterial, cosine: f64, texel: f32) -> f64 {
        let hits = LidarHits {
            directions: &[[1.0, 0.0, 0.0]],
            normals: &[[-cosine, (1.0 - cosine * cosine).sqrt(), 0.0]],
            albedos: &[[0.5, 0.0, 0.0]],
            reflectances: Some(&[texel]),
            materials: &[0],
            lengths: &[2.0],
            shares: &[0.5],
        };
        let found = returned_light(&hits, std::slice::from_ref(material), Some(1)).unwrap();
        assert!((f64::from(found.incidences[0]) - cosine.acos().to_degrees()).abs() < 1e-5);
        found.energies[0]
    }

    #[test]
    fn diffuse_surfaces_return_reflectance_times_cosine_over_squared_distance() {
        let expected = 0.5 * 0.5 * 0.8 / 4.0;
        assert!((energy_of(&DIFFUSE, 0.8, f32::NAN) - expected).abs() < 1e-15);
        // A texture replaces the colour; a number multiplies the texture.
        assert!((energy_of(&DIFFUSE, 0.8, 0.25) - expected / 2.0).abs() < 1e-15);
        let number = LidarMaterial { reflectance: 0.5, ..DIFFUSE };
        assert!((energy_of(&number, 0.8, 0.25) - expected / 4.0).abs() < 1e-15);
        assert!((energy_of(&number, 0.8, f32::NAN) - expected).abs() < 1e-15);
    }

    #[test]
    fn retroreflection_tables_are_interpolated() {
        let sheet =
            |pairs: &[[f64; 2]]| LidarMaterial { diffuse: 0.0, retroreflection_table: pairs.to_vec(), ..DIFFUSE };
        let cosine = 20f64.to_radians().cos();
        let expected = |coefficient: f64| 0.5 * PI * coefficient / cosine / 4.0;
        let table = sheet(&[[10.0, 300.0], [30.0, 100.0]]);
        assert!((energy_of(&table, cosine, f32::NAN) / expected(200.0) - 1.0).abs() < 1e-9);
        let falling = (cosine / 10f64.to_radians().cos()).powi(4);
        assert!((energy_of(&sheet(&[[10.0, 300.0]]), cosine, f32::NAN) / expected(300.0 * falling) - 1.0).abs() < 1e-9);
        assert!(
            (energy_of(&sheet(&[[40.0, 70.0], [50.0, 1.0]]), cosine, f32::NAN) / expected(70.0) - 1.0).abs() < 1e-9
        );
    }
}
