//! A clear sky: A. J. Preetham, P. Shirley and B. Smits, "A practical analytic model for daylight", SIGGRAPH 1999. The
//! sky is the paper's equation 3 with the coefficients of its appendix A.2; the sun, white outside of the atmosphere, its
//! appendix A.1 at three wavelengths that stand for red, green and blue.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat3, DVec3, Vec3};
use raycam_scene::Up;

use super::LightSample;
use super::panorama::{Frame, Table};
use super::sun::Sun;

/// Of light of one colour that the eye sees best.
const LUMEN_PER_WATT: f64 = 683.0;
/// Of what lies below the horizon: a matte plain.
const GROUND_ALBEDO: f64 = 0.2;
/// Of the sun, in degrees.
const SUN_DIAMETER: f64 = 0.533;
/// In lux, outside of the atmosphere: the solar constant of 1361 W/m² seen by the eye.
const SUN_ILLUMINANCE: f64 = 133_100.0;

#[derive(Debug)]
pub(crate) struct Daylight {
    up: DVec3,
    /// Towards the sun.
    sun: DVec3,
    /// Of luminance and the two chromaticities: A to E, and the value at the zenith over F(0, angle of the sun).
    perez: [([f64; 5], f64); 3],
    scale: f64,
    ground: Vec3,
    frame: Frame,
    table: Option<Table>,
}

impl Daylight {
    /// The sky and its sun. `direction` is the way sunlight travels; a sun below the horizon stands at it.
    pub fn new(up: Up, direction: DVec3, turbidity: f64, scale: f64) -> (Self, Sun) {
        let vertical = up.axis();
        let towards = -direction.normalize_or_zero();
        let zenith_angle = towards.dot(vertical).clamp(0.0, 1.0).acos();
        let mut sky = Self {
            up: vertical,
            sun: towards,
            perez: perez(turbidity, zenith_angle),
            scale: scale * 1000.0 / LUMEN_PER_WATT,
            ground: Vec3::ZERO,
            frame: Frame::new(up, 0.0),
            table: None,
        };
        let irradiance = sun_irradiance(turbidity, zenith_angle) * scale;
        let sun = Sun::new(
            direction.to_array(),
            irradiance.as_vec3().to_array(),
            SUN_DIAMETER,
        );
        let on_ground = irradiance * towards.dot(vertical).max(0.0) + sky.irradiance();
        sky.ground = (on_ground * (GROUND_ALBEDO / PI)).as_vec3();
        let [columns, rows] = [256, 128];
        // The brightest of a cell's corners and middle, so that the glow around the sun is not missed.
        sky.table = Table::new([columns, rows], |column, row| {
            let at = |dx: f64, dy: f64| {
                let u = (column as f64 + dx) / columns as f64;
                let angle = (row as f64 + dy) / rows as f64 * PI;
                let (sin, cos) = (TAU * (0.5 - u)).sin_cos();
                let local = DVec3::new(cos * angle.sin(), sin * angle.sin(), angle.cos());
                let [r, g, b] = sky.radiance(sky.frame.world(local).as_vec3()).to_array();
                f64::from(r + g + b)
            };
            let places = [(0.5, 0.5), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
            places
                .map(|(dx, dy)| at(dx, dy))
                .into_iter()
                .fold(0.0, f64::max)
        });
        (sky, sun)
    }

    /// On a horizontal plane, from the sky alone: the midpoint rule.
    fn irradiance(&self) -> DVec3 {
        const RINGS: usize = 64;
        const TURNS: usize = 128;
        let mut sum = DVec3::ZERO;
        for ring in 0..RINGS {
            // Even in the square of the sine: each place has the same share of the irradiance.
            let sine = ((ring as f64 + 0.5) / RINGS as f64).sqrt();
            for turn in 0..TURNS {
                let (y, x) = ((turn as f64 + 0.5) / TURNS as f64 * TAU).sin_cos();
                let local = DVec3::new(x * sine, y * sine, (1.0 - sine * sine).sqrt());
                sum += self.above(self.frame.world(local));
            }
        }
        sum * (PI / (RINGS * TURNS) as f64)
    }

    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let direction = direction.as_dvec3();
        if direction.dot(self.up) < 0.0 {
            self.ground
        } else {
            self.above(direction).as_vec3()
        }
    }

    /// The sky above the horizon, in linear Rec. 709; colours outside of it lose what is negative.
    fn above(&self, direction: DVec3) -> DVec3 {
        // At the horizon itself the model divides by zero.
        let cos_theta = direction.dot(self.up).max(1e-3);
        let cos_gamma = direction.dot(self.sun).clamp(-1.0, 1.0);
        let gamma = cos_gamma.acos();
        let [luminance, x, y] = self.perez.map(|(coefficients, zenith)| {
            zenith * shape(&coefficients, cos_theta, gamma, cos_gamma)
        });
        let xyz = DVec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance.max(0.0);
        (RGB_FROM_XYZ * xyz).max(DVec3::ZERO) * self.scale
    }

    pub fn sample(&self, random: [f32; 2]) -> Option<LightSample> {
        let direction = self.table.as_ref()?.sample(&self.frame, random);
        Some(LightSample {
            direction,
            end: None,
            radiance: self.radiance(direction),
            pdf: self.pdf(direction),
            delta: false,
        })
    }

    pub fn pdf(&self, direction: Vec3) -> f32 {
        let place = self.frame.place(direction);
        self.table.as_ref().map_or(0.0, |table| table.pdf(place))
    }
}

/// XYZ to linear Rec. 709, white D65 (IEC 61966-2-1).
const RGB_FROM_XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(3.240_625, -0.968_931, 0.055_710),
    DVec3::new(-1.537_208, 1.875_756, -0.204_021),
    DVec3::new(-0.498_629, 0.041_518, 1.056_996),
);

/// Perez' F, the paper's equation 3.
fn shape([a, b, c, d, e]: &[f64; 5], cos_theta: f64, gamma: f64, cos_gamma: f64) -> f64 {
    (1.0 + a * (b / cos_theta).exp()) * (1.0 + c * (d * gamma).exp() + e * cos_gamma * cos_gamma)
}

/// The paper's appendix A.2: luminance in kcd/m², and the chromaticities.
fn perez(t: f64, sun: f64) -> [([f64; 5], f64); 3] {
    let coefficients = [
        [
            0.1787 * t - 1.4630,
            -0.3554 * t + 0.4275,
            -0.0227 * t + 5.3251,
            0.1206 * t - 2.5771,
            -0.0670 * t + 0.3703,
        ],
        [
            -0.0193 * t - 0.2592,
            -0.0665 * t + 0.0008,
            -0.0004 * t + 0.2125,
            -0.0641 * t - 0.8989,
            -0.0033 * t + 0.0452,
        ],
        [
            -0.0167 * t - 0.2608,
            -0.0950 * t + 0.0092,
            -0.0079 * t + 0.2102,
            -0.0441 * t - 1.6537,
            -0.0109 * t + 0.0529,
        ],
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
        let reference = shape(&coefficients[i], 1.0, sun, sun.cos());
        (coefficients[i], zenith[i] / reference)
    })
}

/// On a surface that faces the sun, in W/m²: the paper's appendix A.1 with Rayleigh scattering, aerosols and ozone.
fn sun_irradiance(turbidity: f64, zenith_angle: f64) -> DVec3 {
    let degrees = 93.885 - zenith_angle.min(FRAC_PI_2).to_degrees();
    let mass = 1.0 / (zenith_angle.cos() + 0.15 * degrees.powf(-1.253));
    let beta = 0.046_083_65 * turbidity - 0.045_860_26;
    // In micrometres, with the absorption of ozone per centimetre, of which there is 0.35.
    let [r, g, b] = [(0.610, 0.127), (0.550, 0.085), (0.465, 0.010)].map(|(wavelength, ozone)| {
        let wavelength: f64 = wavelength;
        let rayleigh = 0.008_735 * wavelength.powf(-4.08);
        let aerosol = beta * wavelength.powf(-1.3);
        SUN_ILLUMINANCE / LUMEN_PER_WATT * (-mass * (rayleigh + aerosol + 0.35 * ozone)).exp()
    });
    DVec3::new(r, g, b)
}
