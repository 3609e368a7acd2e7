//! Tests that compare every light with its closed form and every sampler with its density: shared lights and helpers.

mod closed_form;
mod density;
mod tree;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use raycam_scene::{FileRef, IesProfile, Image, Light, Texels, Up};

use crate::interaction::LightSampleContext;
use crate::light::lights::Lights;
use crate::light::prepared_light::PreparedLight;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;

pub(super) const RADIANCE: [f32; 3] = [2.0; 3];
pub(super) const AT_ORIGIN: LightSampleContext = LightSampleContext { position: DVec3::ZERO, normal: Vec3::Z };

pub(super) fn lights(lights: &[Light]) -> Lights {
    for light in lights {
        light.validate().expect("a valid light");
    }
    Lights::sharing(lights, &[], Up::Z, DVec3::ZERO, &[])
}

pub(super) fn source(light: Light) -> PreparedLight {
    lights(&[light]).lights.remove(0)
}

/// The n-th of many pairs of numbers that cover the square evenly.
pub(super) fn random(n: u32) -> [f32; 2] {
    Sampler::new(7, 0, [3, 5], n).get_2d(Dimension::PixelFilter)
}

/// Irradiance of a surface at the origin; the number of samples must be a power of two.
pub(super) fn irradiance(source: &PreparedLight, from: &LightSampleContext, samples: u32) -> f64 {
    let one = |n| {
        let sample = source.sample(from, random(n))?;
        let cosine = f64::from(sample.direction.dot(from.normal).max(0.0));
        Some(f64::from(sample.radiance.y) / f64::from(sample.pdf) * cosine)
    };
    (0..samples).filter_map(one).sum::<f64>() / f64::from(samples)
}

pub(super) fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "found {found}, expected {expected}");
}

pub(super) fn area(position: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Light {
    Light::Rectangle { position, u, v, radiance: RADIANCE, two_sided: false }
}

pub(super) fn disk(position: [f64; 3], direction: [f64; 3], radius: f64) -> Light {
    Light::Disk { position, direction, radius, radiance: RADIANCE, two_sided: false }
}

pub(super) fn sun(direction: [f64; 3], angular_diameter: f64) -> Light {
    Light::Sun { direction, irradiance: [3.0; 3], angular_diameter }
}

pub(super) fn bulb(position: [f64; 3], radius: f64) -> Light {
    Light::Point { position, power: None, intensity: Some([5.0; 3]), radius }
}

pub(super) fn spot(inner: f64, outer: f64, power: bool) -> Light {
    Light::Spot {
        position: [0.0, 0.0, 2.0],
        direction: [0.0, 0.0, -1.0],
        power: power.then_some([5.0; 3]),
        intensity: (!power).then_some([5.0; 3]),
        inner,
        outer,
        radius: 0.0,
    }
}

pub(super) fn daylight(degrees: f64) -> Light {
    let angle = degrees.to_radians();
    Light::Preetham { direction: [-angle.cos(), 0.0, -angle.sin()], turbidity: 3.0, scale: 1.0 }
}

pub(super) fn environment(size: [u32; 2], radiance: impl Fn(u32, u32) -> f32) -> Light {
    let texel = |i: u32| [radiance(i % size[0], i / size[0]); 4];
    let image = Image::new("", size, Texels::Float((0..size[0] * size[1]).map(texel).collect()));
    Light::Environment { image: FileRef::loaded("made", Arc::new(image)), yaw: 30.0, scale: 1.0 }
}

/// Environment with one bright texel among dim ones, and a black stripe.
pub(super) fn hard_environment() -> Light {
    environment([16, 8], |x, y| match (x, y) {
        (5, 2) => 500.0,
        (9, _) => 0.0,
        _ => 0.5 + 0.1 * (x + y) as f32,
    })
}

pub(super) fn ies(candela: &[f32], vertical: &[f64], horizontal: &[f64], power: Option<[f32; 3]>) -> Light {
    let profile = IesProfile { vertical: vertical.into(), horizontal: horizontal.into(), candela: candela.into() };
    Light::Ies {
        profile: FileRef::loaded("made", Arc::new(profile)),
        position: [0.0, 0.0, 2.0],
        direction: [0.0, 0.0, -1.0],
        front: None,
        power,
    }
}
