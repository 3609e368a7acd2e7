//! Preetham sky: A. J. Preetham, P. Shirley and B. Smits, "A practical analytic model for daylight", SIGGRAPH 1999.
//!
//! The sky is the paper's equation 3 with the coefficients of its appendix A.2. The sun, white outside of the
//! atmosphere, is its appendix A.1 at three wavelengths that stand for red, green and blue.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2, TAU};

use glam::{DVec3, Mat3, Vec3};
use raycam_bvh::{WithSimd, dispatch_simd};
use raycam_scene::Up;
use raycam_scene::light::LUMENS_PER_WATT;

use crate::light::environment::equirect::EquirectFrame;
use crate::light::sun::SunLight;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Albedo of the diffuse plane below the horizon.
const GROUND_ALBEDO: f64 = 0.2;
/// Angular diameter of the sun in degrees.
const SUN_DIAMETER: f64 = 0.533;
/// Illuminance outside of the atmosphere in lux: the solar constant of 1361 W/m² weighted by the eye.
const SUN_ILLUMINANCE: f64 = 133_100.0;

#[derive(Debug, PartialEq)]
pub(crate) struct PreethamSky {
    up: Vec3,
    /// Unit direction towards the sun.
    sun: Vec3,
    /// Luminance and both chromaticities are products of two curves: a curve over the cosine of the zenith angle, which
    /// includes the zenith value divided by F(0, sun angle), and a curve over [`sun_distance`].
    zenith_curves: LinearTable,
    sun_curves: LinearTable,
    scale: f32,
    ground: Vec3,
}

impl PreethamSky {
    /// Returns the sky and its sun. `direction` is the direction in which sunlight travels; in worlds, the sun is
    /// always above the horizon.
    pub fn new(up: Up, direction: DVec3, turbidity: f64, scale: f64) -> (Self, SunLight) {
        let vertical = up.axis();
        let towards = -direction.normalize_or_zero();
        let zenith_angle = towards.dot(vertical).clamp(0.0, 1.0).acos();
        let perez = perez_coefficients(turbidity, zenith_angle);
        let by_zenith = |cosine: f64| {
            // At the horizon the model divides by zero.
            perez.map(|(coefficients, zenith)| zenith * perez_zenith_factor(&coefficients, cosine.max(1e-3)))
        };
        let by_sun = |position: f64| {
            let angle = angle_of_sun_distance(position);
            perez.map(|(coefficients, _)| perez_sun_factor(&coefficients, angle, angle.cos()))
        };
        let mut sky = Self {
            up: vertical.as_vec3(),
            sun: towards.as_vec3(),
            zenith_curves: LinearTable::tabulate(by_zenith),
            sun_curves: LinearTable::tabulate(by_sun),
            scale: (scale * 1000.0 / LUMENS_PER_WATT) as f32,
            ground: Vec3::ZERO,
        };
        let irradiance = sun_irradiance(turbidity, zenith_angle) * scale;
        let sun = SunLight::new(direction.to_array(), irradiance.as_vec3().to_array(), SUN_DIAMETER);
        let on_ground = irradiance * towards.dot(vertical).max(0.0) + sky.irradiance(up);
        sky.ground = (on_ground * (GROUND_ALBEDO / PI)).as_vec3();
        (sky, sun)
    }

    /// Irradiance of a horizontal plane by the sky without the sun, with the midpoint rule.
    fn irradiance(&self, up: Up) -> DVec3 {
        const QUADRATURE_RADIAL: usize = 64;
        const QUADRATURE_ANGULAR: usize = 128;
        let frame = EquirectFrame::new(up, 0.0);
        let mut sum = DVec3::ZERO;
        for ring in 0..QUADRATURE_RADIAL {
            // The sines are uniform in their squares, so that every point has the same weight in the irradiance.
            let sine = ((ring as f64 + 0.5) / QUADRATURE_RADIAL as f64).sqrt();
            for turn in 0..QUADRATURE_ANGULAR {
                let (y, x) = ((turn as f64 + 0.5) / QUADRATURE_ANGULAR as f64 * TAU).sin_cos();
                let local = DVec3::new(x * sine, y * sine, (1.0 - sine * sine).sqrt());
                sum += self.radiance(frame.to_world(local).as_vec3()).as_dvec3();
            }
        }
        sum * (PI / (QUADRATURE_RADIAL * QUADRATURE_ANGULAR) as f64)
    }

    /// Linear Rec. 709 radiance from a direction.
    #[inline(always)]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let up = direction.dot(self.up);
        // Colours outside Rec. 709 are clipped at 0.
        let values = self.zenith_curves.lookup(up.max(0.0)) * self.sun_curves.lookup(sun_distance(direction, self.sun));
        let [luminance, x, y] = values.to_array();
        let xyz = Vec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance.max(0.0);
        let sky = (RGB_FROM_XYZ * xyz).max(Vec3::ZERO) * self.scale;
        if up < 0.0 { self.ground } else { sky }
    }

    /// Same as [`PreethamSky::radiance`], for many directions.
    pub fn radiance_many<const N: usize>(&self, directions: &Vec3xN<f32, N>) -> Vec3xN<f32, N> {
        let mut radiances = [[0.0; N]; 3];
        dispatch_simd(EvaluateSky { sky: self, directions, radiances: &mut radiances });
        radiances
    }
}

/// Loop over lanes that computes [`PreethamSky::radiance_many`].
struct EvaluateSky<'a, const N: usize> {
    sky: &'a PreethamSky,
    directions: &'a Vec3xN<f32, N>,
    radiances: &'a mut Vec3xN<f32, N>,
}

impl<const N: usize> WithSimd for EvaluateSky<'_, N> {
    #[inline(always)]
    fn run(self) {
        for lane in 0..N {
            let radiance = self.sky.radiance(get_lane(self.directions, lane).into());
            set_lane(self.radiances, lane, radiance.to_array());
        }
    }
}

/// Distance to the sun on the unit sphere, from 0 to 1: the chord to the sun or, if that is shorter, to the opposite
/// direction. Near the sun, this value is almost equal to the angle and does not require an arc cosine.
#[inline(always)]
fn sun_distance(direction: Vec3, sun: Vec3) -> f32 {
    let position = |way: Vec3| way.length() * (0.5 / SQRT_2 as f32);
    if direction.dot(sun) >= 0.0 { position(direction - sun) } else { 1.0 - position(direction + sun) }
}

/// Angle to the sun at a [`sun_distance`].
fn angle_of_sun_distance(position: f64) -> f64 {
    let angle = 2.0 * (position.min(1.0 - position) * SQRT_2).asin();
    if position <= 0.5 { angle } else { PI - angle }
}

/// Three functions on 0..=1, tabulated at even steps and interpolated linearly: accurate to 1e-4 for the sky's curves,
/// and faster than their exponentials.
#[derive(Debug, PartialEq)]
struct LinearTable(Vec<Vec3>);

impl LinearTable {
    const STEPS: usize = 1024;

    fn tabulate(curves: impl Fn(f64) -> [f64; 3]) -> Self {
        let at = |step| DVec3::from(curves(step as f64 / Self::STEPS as f64)).as_vec3();
        Self((0..=Self::STEPS).map(at).collect())
    }

    #[inline(always)]
    fn lookup(&self, x: f32) -> Vec3 {
        let position = x * Self::STEPS as f32;
        let step = (position as usize).min(Self::STEPS - 1);
        self.0[step].lerp(self.0[step + 1], (position - step as f32).min(1.0))
    }
}

/// XYZ to linear Rec. 709, white D65 (IEC 61966-2-1).
const RGB_FROM_XYZ: Mat3 = Mat3::from_cols(
    Vec3::new(3.240_625, -0.968_931, 0.055_710),
    Vec3::new(-1.537_208, 1.875_756, -0.204_021),
    Vec3::new(-0.498_629, 0.041_518, 1.056_996),
);

/// Perez F, the paper's equation 3: the product of a zenith factor and a sun factor.
fn perez_f(coefficients: &[f64; 5], cos_theta: f64, gamma: f64, cos_gamma: f64) -> f64 {
    perez_zenith_factor(coefficients, cos_theta) * perez_sun_factor(coefficients, gamma, cos_gamma)
}

fn perez_zenith_factor([a, b, ..]: &[f64; 5], cos_theta: f64) -> f64 {
    1.0 + a * (b / cos_theta).exp()
}

fn perez_sun_factor([.., c, d, e]: &[f64; 5], gamma: f64, cos_gamma: f64) -> f64 {
    1.0 + c * (d * gamma).exp() + e * cos_gamma * cos_gamma
}

/// Perez coefficients and zenith values of luminance (kcd/m²) and chromaticities: the paper's appendix A.2.
fn perez_coefficients(t: f64, sun: f64) -> [([f64; 5], f64); 3] {
    let coefficients = [
        [0.1787 * t - 1.4630, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771, -0.0670 * t + 0.3703],
        [-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125, -0.0641 * t - 0.8989, -0.0033 * t + 0.0452],
        [-0.0167 * t - 0.2608, -0.0950 * t + 0.0092, -0.0079 * t + 0.2102, -0.0441 * t - 1.6537, -0.0109 * t + 0.0529],
    ];
    let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * sun);
    let luminance = (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192;
    let cubic = |rows: [[f64; 4]; 3]| {
        let at = |[a, b, c, d]: [f64; 4]| ((a * sun + b) * sun + c) * sun + d;
        (at(rows[0]) * t + at(rows[1])) * t + at(rows[2])
    };
    let x = cubic([
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ]);
    let y = cubic([
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ]);
    let zenith = [luminance, x, y];
    [0, 1, 2].map(|i| {
        let reference = perez_f(&coefficients[i], 1.0, sun, sun.cos());
        (coefficients[i], zenith[i] / reference)
    })
}

/// Irradiance of a surface that faces the sun, in W/m²: the paper's appendix A.1 with Rayleigh scattering, aerosols
/// and ozone.
fn sun_irradiance(turbidity: f64, zenith_angle: f64) -> DVec3 {
    let degrees = 93.885 - zenith_angle.min(FRAC_PI_2).to_degrees();
    let mass = 1.0 / (zenith_angle.cos() + 0.15 * degrees.powf(-1.253));
    let beta = 0.046_083_65 * turbidity - 0.045_860_26;
    // Wavelengths in micrometres, with the absorption per centimetre of ozone; the column is 0.35 cm.
    let [r, g, b] = [(0.610, 0.127), (0.550, 0.085), (0.465, 0.010)].map(|(wavelength, ozone)| {
        let wavelength: f64 = wavelength;
        let rayleigh = 0.008_735 * wavelength.powf(-4.08);
        let aerosol = beta * wavelength.powf(-1.3);
        SUN_ILLUMINANCE / LUMENS_PER_WATT * (-mass * (rayleigh + aerosol + 0.35 * ozone)).exp()
    });
    DVec3::new(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sky_curves_match_the_model() {
        for (turbidity, degrees) in [(2.0, 3.0_f64), (3.0, 40.0), (6.0, 85.0), (10.0, 60.0)] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let (sky, _) = PreethamSky::new(Up::Z, -DVec3::new(cos, 0.0, sin), turbidity, 1.0);
            let perez = perez_coefficients(turbidity, FRAC_PI_2 - degrees.to_radians());
            let mut most: f32 = 0.0;
            for i in 0..20_000 {
                // The directions are denser near the sun and the horizon.
                let height = (f64::from(i % 200) / 199.0).powi(3);
                let turn = PI * (f64::from(i / 200) / 99.0).powi(3);
                let level = (1.0 - height * height).sqrt();
                let direction = DVec3::new(turn.cos() * level, turn.sin() * level, height);
                let cos_gamma = direction.dot(DVec3::new(cos, 0.0, sin)).clamp(-1.0, 1.0);
                let [luminance, x, y] = perez.map(|(coefficients, zenith)| {
                    zenith * perez_f(&coefficients, height.max(1e-3), cos_gamma.acos(), cos_gamma)
                });
                let xyz = DVec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance;
                let rgb = (RGB_FROM_XYZ.as_dmat3() * xyz * (1000.0 / LUMENS_PER_WATT)).as_vec3();
                let found = sky.radiance(direction.as_vec3());
                let off = (found - rgb.max(Vec3::ZERO)).abs().max_element() / rgb.max_element();
                most = most.max(off);
            }
            assert!(most < 1e-4, "turbidity {turbidity}, sun at {degrees}: {most}");
        }
    }
}
