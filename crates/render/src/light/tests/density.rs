//! Distributions of light samples compared with their densities.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};
use raycam_scene::{Light, Up, World};

use super::*;
use crate::control::Control;
use crate::light::light_sampling::{LightSampleContexts, LightSampling};
use crate::light::samples::LightRandom;
use crate::prepare::world::PreparedWorld;
use crate::sampling::chi_squared::{limit, statistic};

/// Parametrisation of the directions of a light: direction and solid angle per area of the unit square, and its
/// inverse.
struct Chart {
    at: Box<dyn Fn(DVec2) -> (DVec3, f64)>,
    of: Box<dyn Fn(DVec3) -> DVec2>,
}

/// Spherical cap around an axis with cosines from `low` to 1.
fn cap(axis: DVec3, low: f64) -> Chart {
    let axis = axis.normalize();
    let (right, up) = axis.any_orthonormal_pair();
    Chart {
        at: Box::new(move |p| {
            let cos = 1.0 - p.x * (1.0 - low);
            let (sin, turn) = ((1.0 - cos * cos).max(0.0).sqrt(), TAU * p.y);
            ((right * turn.cos() + up * turn.sin()) * sin + axis * cos, TAU * (1.0 - low))
        }),
        of: Box::new(move |d| {
            // Computing 1 - cos from the sine keeps precision for narrow caps.
            let sin2 = axis.cross(d).length_squared();
            let height =
                if axis.dot(d) > 0.0 { sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt()) } else { 1.0 - axis.dot(d) };
            let turn = d.dot(up).atan2(d.dot(right)) / TAU;
            DVec2::new(height / (1.0 - low), turn.rem_euclid(1.0))
        }),
    }
}

/// Chart of the directions to a parallelogram at `corner` with the edges u and v; if `round`, to the disk around
/// `corner` with the half axes u and v.
fn sheet(corner: DVec3, u: DVec3, v: DVec3, round: bool) -> Chart {
    let normal = u.cross(v);
    let place = move |p: DVec2| {
        if round {
            let (sin, cos) = (TAU * p.y).sin_cos();
            corner + (u * cos + v * sin) * p.x.sqrt()
        } else {
            corner + u * p.x + v * p.y
        }
    };
    let area = normal.length() * if round { PI } else { 1.0 };
    Chart {
        at: Box::new(move |p| {
            let offset = place(p);
            let cos = offset.normalize().dot(normal.normalize()).abs();
            (offset.normalize(), area * cos / offset.length_squared())
        }),
        of: Box::new(move |d| {
            let inside = d * (corner.dot(normal) / d.dot(normal)) - corner;
            let n2 = normal.length_squared();
            let [x, y] = [inside.cross(v).dot(normal) / n2, u.cross(inside).dot(normal) / n2];
            if round { DVec2::new(x * x + y * y, (y.atan2(x) / TAU).rem_euclid(1.0)) } else { DVec2::new(x, y) }
        }),
    }
}

/// Zenith angle and azimuth in the frame of the environment, which has a yaw of 30 degrees.
fn panorama() -> Chart {
    let frame = crate::light::environment::equirect::EquirectFrame::new(Up::Z, 30.0);
    Chart {
        at: Box::new(move |p| {
            let (sin, cos) = (TAU * (0.5 - p.x)).sin_cos();
            let angle = p.y * PI;
            let local = DVec3::new(cos * angle.sin(), sin * angle.sin(), angle.cos());
            (frame.to_world(local), TAU * PI * angle.sin())
        }),
        of: Box::new(move |d| frame.to_uv(d.as_vec3()).map(f64::from).into()),
    }
}

#[test]
fn light_samples_follow_their_density() {
    const CELLS: usize = 16;
    const POINTS: usize = 24;
    const SAMPLES: u32 = 1 << 20;
    let towards = DVec3::new(1.0, 0.0, 1.5);
    let everywhere = || cap(DVec3::Z, -1.0);
    let tilted = |normal| LightSampleContext { normal, ..AT_ORIGIN };
    let cosine = |radius: f64, distance: f64| (1.0 - (radius / distance).powi(2)).sqrt();
    let cases: Vec<(&str, Light, LightSampleContext, Chart)> = vec![
        ("sun", sun([-1.0, 0.0, -1.5], 0.53), AT_ORIGIN, cap(towards, 0.265f64.to_radians().cos())),
        ("wide sun", sun([-1.0, 0.0, -1.5], 80.0), AT_ORIGIN, cap(towards, 40f64.to_radians().cos())),
        ("bulb", bulb([1.0, 0.0, 1.5], 0.5), AT_ORIGIN, cap(towards, cosine(0.5, towards.length()))),
        ("near bulb", bulb([1.0, 0.0, 1.5], 1.8), AT_ORIGIN, cap(towards, cosine(1.8, towards.length()))),
        (
            "rectangle",
            area([0.3, 0.5, 0.4], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]),
            AT_ORIGIN,
            sheet(DVec3::new(-0.2, -0.5, 0.4), DVec3::Y * 2.0, DVec3::X, false),
        ),
        (
            "parallelogram",
            area([0.3, 0.5, 1.0], [0.5, 2.0, 0.0], [1.0, 0.0, 0.2]),
            AT_ORIGIN,
            sheet(DVec3::new(-0.45, -0.5, 0.9), DVec3::new(0.5, 2.0, 0.0), DVec3::new(1.0, 0.0, 0.2), false),
        ),
        (
            "disk",
            disk([0.5, 0.0, 0.7], [0.0, 0.0, -1.0], 0.8),
            AT_ORIGIN,
            sheet(DVec3::new(0.5, 0.0, 0.7), DVec3::X * 0.8, DVec3::Y * 0.8, true),
        ),
        ("even sky", Light::uniform_sky([1.0; 3]), AT_ORIGIN, cap(DVec3::Z, 0.0)),
        ("even sky around", Light::uniform_sky([1.0; 3]), tilted(Vec3::ZERO), everywhere()),
        (
            "sky that changes",
            Light::Sky { radiance: None, zenith: Some([0.2, 0.4, 1.0]), horizon: Some([1.0; 3]), ground: None },
            AT_ORIGIN,
            cap(DVec3::Z, 0.0),
        ),
        ("environment", hard_environment(), AT_ORIGIN, panorama()),
    ];
    let tests = cases.len();
    for (name, light, from, chart) in cases {
        let lights = lights(&[light]);
        let source = &lights.lights[0];
        let density = |direction: Vec3| {
            let mut density = f64::from(lights.radiance_and_pdf(&from, LightSampling::Uniform, direction, None).1);
            lights.intersect_visible(&from, LightSampling::Uniform, direction, f64::INFINITY, |_, _, _, pdf| {
                density += f64::from(pdf)
            });
            density
        };
        let mut expected = vec![0.0; CELLS * CELLS];
        let step = 1.0 / (CELLS * POINTS) as f64;
        for y in 0..CELLS * POINTS {
            for x in 0..CELLS * POINTS {
                let (direction, solid) = (chart.at)(DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * step);
                expected[y / POINTS * CELLS + x / POINTS] += density(direction.as_vec3()) * solid * step * step;
            }
        }
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 1e-3, "{name}: the density integrates to {total}");
        let mut found = vec![0u32; CELLS * CELLS];
        for n in 0..SAMPLES {
            // The test uses independent random numbers, because it would pass too easily with stratified numbers.
            let random = Sampler::new(11, 0, [n, 1], 0).get_2d(Dimension::PixelFilter);
            let sample = source.sample(&from, random).expect("the light must be sampled");
            let place = (chart.of)(sample.direction.as_dvec3()) * CELLS as f64;
            let cell = |x: f64| (x.max(0.0) as usize).min(CELLS - 1);
            found[cell(place.y) * CELLS + cell(place.x)] += 1;
            let stated = density(sample.direction);
            // Rounding may move a direction across a boundary.
            assert!(
                stated == 0.0 || (stated / f64::from(sample.pdf) - 1.0).abs() < 1e-3,
                "{name}: {} and {stated}",
                sample.pdf
            );
        }
        let expected = expected.iter().map(|share| share * f64::from(SAMPLES));
        let (chi2, freedom) = statistic(found.iter().map(|&n| f64::from(n)).zip(expected));
        assert!(chi2 < limit(freedom - 1.0, tests), "{name}: chi squared {chi2} of {freedom} cells");
    }
}

#[test]
fn environments_are_sampled_equally_alone_and_next_to_a_black_environment() {
    let alone = lights(&[hard_environment()]);
    assert!(alone.is_single_infinite(LightSampling::Importance) && !alone.is_single_infinite(LightSampling::Uniform));
    // The second environment is black.
    let dark = environment([16, 8], |_, _| 0.0);
    let several = lights(&[hard_environment(), dark]);
    assert!(!several.is_single_infinite(LightSampling::Importance));
    let world = PreparedWorld::new(&World::default(), None, None, &Control::new()).unwrap();
    let (_, environment) = alone.environment().unwrap();
    let random: Vec<_> = (0..64).map(random).collect();
    let mut drawn = vec![];
    environment.sample_many(&random, &mut drawn);
    for (random, around) in random.into_iter().zip(drawn) {
        let around = Some((0, around));
        let ask = |lights: &Lights, choice, which| {
            let drawn = LightRandom { random, environment: around };
            let by = LightSampleContexts::from(&AT_ORIGIN);
            lights.sample(&by, &world.geometry, choice, which, &drawn).unwrap()
        };
        let (one, half) =
            (ask(&alone, LightSampling::Importance, 0.25), ask(&several, LightSampling::Importance, 0.25));
        assert_eq!(one.direction, half.direction);
        assert_eq!(one.radiance, half.radiance);
        assert_eq!(one.pdf, 2.0 * half.pdf);
        let (direction, known) = (one.direction, environment.radiance_and_pdf(one.direction));
        let behind = |known| alone.radiance_and_pdf(&AT_ORIGIN, LightSampling::Importance, direction, known);
        assert_eq!(behind(Some((0, known))), behind(None));
        assert_eq!(behind(None), (one.radiance, one.pdf));
    }
}
