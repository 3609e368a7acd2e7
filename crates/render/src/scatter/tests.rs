//! What must hold for every way to scatter light: energy, reciprocity, and samples as dense as they say.

use std::f64::consts::{PI, TAU};

use glam::Vec3;
use raycam_scene::{Glass, Metal};

use super::film::Film;
use super::frame::Frame;
use super::fresnel::Fresnel;
use super::ggx::Ggx;
use super::layered::{Coat, Layered, Layers};
use super::lecture::Lecture;
use super::phong::Lobe;
use super::sheen::Sheen;
use super::{Scatter, Value};

/// A flat surface seen at an angle, in degrees.
fn frame(degrees: f32, turn: f32) -> Frame {
    let (sin, cos) = degrees.to_radians().sin_cos();
    seen_from(Vec3::new(sin * turn.cos(), sin * turn.sin(), cos))
}

fn seen_from(view: Vec3) -> Frame {
    Frame {
        geometric: Vec3::Z,
        normal: Vec3::Z,
        tangent: Vec3::X,
        bitangent: Vec3::Y,
        view,
    }
}

/// A white dielectric without anything else.
fn plastic(roughness: f32) -> Layers {
    let fresnel = Fresnel::Schlick {
        f0: Vec3::splat(0.04),
        f90: Vec3::ONE,
        inside: None,
    };
    Layers {
        fresnel,
        over: fresnel,
        ggx: Ggx::isotropic(roughness),
        diffuse: Vec3::ONE,
        through: Vec3::ZERO,
        transmission: Vec3::ZERO,
        eta: 1.0,
        coat: None,
        sheen: None,
    }
}

fn white_metal(roughness: f32) -> Layers {
    let fresnel = Fresnel::Schlick {
        f0: Vec3::ONE,
        f90: Vec3::ONE,
        inside: None,
    };
    Layers {
        fresnel,
        diffuse: Vec3::ZERO,
        ..plastic(roughness)
    }
}

fn coated(layers: Layers, frame: &Frame) -> Layers {
    Layers {
        coat: Some(Coat {
            weight: 0.8,
            ggx: Ggx::isotropic(0.3),
            frame: *frame,
        }),
        ..layers
    }
}

const FILM: Film = Film {
    ior: 1.4,
    thickness: 450.0,
};

type Make = Box<dyn Fn(&Frame) -> Scatter<'static>>;
type Named = Vec<(String, Make)>;

/// Every kind of scattering by name: lossless ones, and the rest.
fn all() -> (Named, Named) {
    fn layers(name: String, make: impl Fn(&Frame) -> Layers + 'static) -> (String, Make) {
        let make = move |frame: &Frame| Scatter::Layered(Layered::new(make(frame), frame));
        (name, Box::new(make))
    }
    let mut lossless = vec![];
    let mut lossy = vec![];
    for roughness in [0.0f32, 0.1, 0.3, 0.6, 1.0] {
        lossless.push(layers(format!("metal {roughness}"), move |_| {
            white_metal(roughness)
        }));
        lossless.push(layers(format!("plastic {roughness}"), move |_| {
            plastic(roughness)
        }));
        lossless.push(layers(format!("translucent {roughness}"), move |_| {
            Layers {
                diffuse: Vec3::splat(0.3),
                through: Vec3::splat(0.7),
                ..plastic(roughness)
            }
        }));
        lossy.push(layers(format!("coated {roughness}"), move |frame| {
            coated(plastic(roughness), frame)
        }));
        lossy.push(layers(format!("cloth {roughness}"), move |_| Layers {
            sheen: Some(Sheen {
                color: Vec3::ONE,
                roughness,
            }),
            ..plastic(0.5)
        }));
        lossy.push(layers(format!("film {roughness}"), move |_| {
            let fresnel = Fresnel::Film {
                film: FILM,
                f0: Vec3::splat(0.04),
                f90: Vec3::ONE,
                share: 1.0,
            };
            Layers {
                fresnel,
                over: fresnel,
                ..plastic(roughness)
            }
        }));
        lossy.push(layers(format!("brushed {roughness}"), move |_| Layers {
            ggx: Ggx {
                x: 0.6,
                y: (roughness * roughness).max(1e-3),
            },
            ..white_metal(0.0)
        }));
        lossy.push(layers(format!("thin {roughness}"), move |_| Layers {
            diffuse: Vec3::splat(0.2),
            transmission: Vec3::splat(0.8),
            ..plastic(roughness)
        }));
        for thin in [false, true] {
            for front in [false, true] {
                let glass = Glass {
                    roughness,
                    thin,
                    ..Glass::default()
                };
                let name = format!("glass {roughness} {thin} {front}");
                let make = move |frame: &Frame| {
                    let eta = super::glass::eta(&glass, front, None);
                    Scatter::Layered(super::glass::glass(&glass, eta, Vec3::ONE, frame))
                };
                let made: (String, Make) = (name, Box::new(make));
                if roughness == 0.0 {
                    lossless.push(made);
                } else {
                    lossy.push(made);
                }
            }
        }
        let gold = Metal {
            roughness,
            ..Metal::named("gold").unwrap()
        };
        let make =
            move |frame: &Frame| Scatter::Layered(super::metal::metal(&gold, Vec3::ONE, frame));
        lossy.push((format!("gold {roughness}"), Box::new(make)));
    }
    let matte = |_: &Frame| {
        Scatter::Lecture(Lecture {
            diffuse: Vec3::ONE,
            specular: Vec3::ZERO,
            lobe: None,
        })
    };
    lossless.push(("matte".into(), Box::new(matte)));
    let lobe: &'static Lobe = Box::leak(Box::new(Lobe::new(20.0)));
    let lecture = move |_: &Frame| {
        Scatter::Lecture(Lecture {
            diffuse: Vec3::splat(0.6),
            specular: Vec3::splat(0.4),
            lobe: Some(lobe),
        })
    };
    lossy.push(("lecture".into(), Box::new(lecture)));
    (lossless, lossy)
}

/// Independent random numbers.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// What comes back of a white sky, by well spread samples; radiance that refraction squeezes counts as light.
fn furnace(scatter: &Scatter, frame: &Frame, samples: u32) -> Vec3 {
    let mut sum = glam::DVec3::ZERO;
    for i in 0..samples {
        // R. Roberts's additive sequence in three dimensions.
        let at = |step: f64| ((0.5 + step * f64::from(i)).fract() * 0.999_999_9) as f32;
        let random = [
            at(0.819_172_513_396_164_4),
            at(0.671_043_606_703_789_2),
            at(0.549_700_477_901_970_3),
        ];
        if let Some(sample) = scatter.sample(frame, random) {
            assert!(sample.weight.is_finite() && sample.weight.min_element() >= 0.0);
            assert!((sample.direction.length() - 1.0).abs() < 1e-4);
            sum += (sample.weight * sample.squeeze).as_dvec3();
        }
    }
    (sum / f64::from(samples)).as_vec3()
}

#[test]
fn a_white_furnace_shows_what_is_lost() {
    let (lossless, lossy) = all();
    let mut worst = vec![];
    for degrees in [0.0f32, 30.0, 60.0, 80.0, 88.0] {
        let frame = frame(degrees, 0.3);
        for (name, make) in &lossless {
            let found = furnace(&make(&frame), &frame, 1 << 18);
            // The tables of albedos are that exact.
            let tolerance = if degrees > 85.0 { 2e-3 } else { 1e-3 };
            if (found - Vec3::ONE).abs().max_element() > tolerance {
                worst.push(format!("{name} at {degrees}: {found}"));
            }
        }
        for (name, make) in &lossy {
            let found = furnace(&make(&frame), &frame, 1 << 16);
            if found.max_element() > 1.001 {
                worst.push(format!("{name} at {degrees}: {found} > 1"));
            }
        }
    }
    assert!(worst.is_empty(), "{}", worst.join("\n"));
}

#[test]
fn light_may_go_both_ways() {
    let (lossless, lossy) = all();
    let mut random = Random(5);
    for (name, make) in lossless.iter().chain(&lossy) {
        if name.starts_with("glass") && name.contains("false") {
            continue;
        }
        for _ in 0..200 {
            let mut direction = || {
                let z = 0.05 + 0.9 * random.next();
                let (sin, cos) = (std::f32::consts::TAU * random.next()).sin_cos();
                let r = (1.0 - z * z).sqrt();
                Vec3::new(r * cos, r * sin, z)
            };
            let (a, b) = (direction(), direction());
            let value = |v: Vec3, l: Vec3| {
                let frame = seen_from(v);
                make(&frame).evaluate(&frame, l).value / l.z
            };
            let (there, back) = (value(a, b), value(b, a));
            let off = (there - back).abs().max_element();
            assert!(
                off <= 1e-4 * there.max_element() + 1e-5,
                "{name}: {there} {back}"
            );
        }
    }
}

#[test]
fn refraction_is_squeezed_by_the_index() {
    // f(v, l) in air is f(l, v) in glass over n^2 (E. Veach, 1997, section 5.2).
    let glass = Glass {
        roughness: 0.5,
        ..Glass::default()
    };
    let value = |v: Vec3, l: Vec3, front: bool| {
        let frame = seen_from(v);
        let eta = super::glass::eta(&glass, front, None);
        let scatter = Scatter::Layered(super::glass::glass(&glass, eta, Vec3::ONE, &frame));
        scatter.evaluate(&frame, l).value.x / l.z.abs()
    };
    let (above, below) = (
        Vec3::new(0.5, 0.2, 0.8).normalize(),
        Vec3::new(0.3, 0.2, 0.9).normalize(),
    );
    let there = value(above, -below, true);
    let mirror = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
    let back = value(mirror(-below), mirror(above), false);
    assert!(there > 0.0);
    assert!((back / there - 2.25).abs() < 1e-4, "{there} {back}");
}

/// Critical value of chi-squared at one-sided probability `p` (Wilson and Hilferty), `z` being the normal's.
fn critical(freedom: f64, z: f64) -> f64 {
    let t = 2.0 / (9.0 * freedom);
    freedom * (1.0 - t + z * t.sqrt()).powi(3)
}

#[test]
fn samples_are_as_dense_as_their_density_says() {
    const SAMPLES: usize = 200_000;
    const RINGS: usize = 40;
    const TURNS: usize = 32;
    // 0.01 over all tests of this loop: 1 - 0.99^(1/200) = 5e-5, z = 3.89.
    const Z: f64 = 3.89;
    let (lossless, lossy) = all();
    let mut random = Random(11);
    for degrees in [20.0f32, 70.0] {
        let frame = frame(degrees, 0.3);
        for (name, make) in lossless.iter().chain(&lossy) {
            // Lobes too sharp for bins are covered by the furnace.
            if name.contains(" 0 ") || name.ends_with(" 0") || name.contains("0.1") {
                continue;
            }
            let scatter = make(&frame);
            let mut seen = vec![0.0f64; RINGS * TURNS + 1];
            for _ in 0..SAMPLES {
                let numbers = [random.next(), random.next(), random.next()];
                let bin = match scatter.sample(&frame, numbers) {
                    Some(sample) => {
                        let d = sample.direction.as_dvec3();
                        let ring = ((d.z + 1.0) / 2.0 * RINGS as f64) as usize;
                        let turn = (d.y.atan2(d.x) / TAU + 0.5) * TURNS as f64;
                        let Value { value, pdf } = scatter.evaluate(&frame, sample.direction);
                        assert!(
                            (value / pdf - sample.weight).abs().max_element()
                                <= 1e-4 * sample.weight.max_element() + 1e-6,
                            "{name}"
                        );
                        ring.min(RINGS - 1) * TURNS + (turn as usize).min(TURNS - 1)
                    }
                    None => RINGS * TURNS,
                };
                seen[bin] += 1.0;
            }
            let mut expected = vec![0.0f64; RINGS * TURNS + 1];
            const FINE: usize = 12;
            for ring in 0..RINGS * FINE {
                let z = (ring as f64 + 0.5) / (RINGS * FINE) as f64 * 2.0 - 1.0;
                let r = (1.0 - z * z).sqrt();
                for turn in 0..TURNS * FINE {
                    let phi = ((turn as f64 + 0.5) / (TURNS * FINE) as f64 - 0.5) * TAU;
                    let l = glam::DVec3::new(r * phi.cos(), r * phi.sin(), z).as_vec3();
                    let pdf = f64::from(scatter.evaluate(&frame, l).pdf);
                    expected[ring / FINE * TURNS + turn / FINE] += pdf;
                }
            }
            let cell = 4.0 * PI / (RINGS * TURNS * FINE * FINE) as f64;
            for value in &mut expected {
                *value *= cell * SAMPLES as f64;
            }
            // The whole is one: what is not found is what is rejected.
            let total: f64 = expected.iter().sum::<f64>() / SAMPLES as f64;
            let kept = 1.0 - seen[RINGS * TURNS] / SAMPLES as f64;
            assert!(
                (total - kept).abs() < 3e-3,
                "{name} at {degrees}: {total} of {kept}"
            );
            let (mut chi, mut freedom) = (0.0, -1.0);
            let (mut few_seen, mut few_expected) = (0.0, 0.0);
            for (seen, expected) in seen.iter().zip(&expected).take(RINGS * TURNS) {
                if *expected < 10.0 {
                    few_seen += seen;
                    few_expected += expected;
                } else {
                    chi += (seen - expected).powi(2) / expected;
                    freedom += 1.0;
                }
            }
            if few_expected > 10.0 {
                chi += (few_seen - few_expected).powi(2) / few_expected;
            }
            let limit = critical(freedom, Z);
            assert!(
                chi < limit,
                "{name} at {degrees}: {chi} > {limit} of {freedom}"
            );
        }
    }
}
