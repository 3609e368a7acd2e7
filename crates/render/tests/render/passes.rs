//! Passes: parts of the colour, divided by the light's way to the camera or by its source.

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Control, Integrator, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{Alpha, Camera, Fog, Glass, Light, LightTraits, Material, MaterialModel, Metal, Principled, World};

const WAYS: [Channel; 3] = [Channel::Emission, Channel::Direct, Channel::Indirect];
const LOBES: [Channel; 4] = [Channel::Emission, Channel::Diffuse, Channel::Specular, Channel::Volume];

fn model(model: MaterialModel) -> Material {
    Material { model, color: [0.8, 0.6, 0.4], ..Material::default() }
}

/// Objects of every kind of material on a floor.
fn objects() -> World {
    let mut world = plane(12.0, 0.6);
    let coat = Principled { clearcoat: 1.0.into(), roughness: 0.4.into(), ..Principled::default() };
    let mut thin = Principled { transmission: 1.0.into(), roughness: 0.0.into(), ..Principled::default() };
    thin.metallic = 0.0.into();
    let mut materials = vec![
        model(MaterialModel::Phong { diffuse: 0.5, specular: [0.3; 3], shininess: 20.0 }),
        model(MaterialModel::Principled(Principled { metallic: 0.0.into(), ..coat }.into())),
        model(MaterialModel::Metal(Metal { roughness: 0.2, ..Metal::named("gold").unwrap() })),
        model(MaterialModel::Glass(Glass::default())),
        model(MaterialModel::Glass(Glass { roughness: 0.3, ..Glass::default() })),
        model(MaterialModel::Principled(thin.into())),
        Material { alpha: Alpha::Blend, opacity: 0.5, ..material([0.9, 0.2, 0.2], 0.8, 0.0, 1.0) },
        Material { model: MaterialModel::Unlit, color: [0.1, 0.3, 0.2], ..Material::default() },
    ];
    let mut lamp = material([0.5; 3], 0.5, 0.0, 1.0);
    lamp.emission.value = [2.0, 1.0, 0.5];
    materials.push(lamp);
    for (index, material) in materials.into_iter().enumerate() {
        let place = DVec3::new(index as f64 % 3.0 * 1.3 - 1.3, (index / 3) as f64 * 1.3 - 1.3, 0.55);
        add(&mut world, primitive::sphere(0.5, 3).unwrap(), material, DAffine3::from_translation(place));
    }
    world
}

fn camera() -> Camera {
    look_at(DVec3::new(3.0, -5.0, 3.0), DVec3::new(0.0, 0.0, 0.4), 40.0, [24, 20])
}

fn named(world: &mut World, name: &str, light: Light) {
    let number = world.add_light(light).unwrap();
    world.set_light_traits(number, LightTraits { name: Some(name.into()), ..LightTraits::default() }).unwrap();
}

/// Lights of every kind.
fn lights() -> Vec<(&'static str, Light)> {
    let (power, intensity) = (None, Some([3.0, 2.0, 1.0]));
    vec![
        ("sun", Light::Sun { direction: [1.0, 1.0, -2.0], irradiance: [1.0, 0.9, 0.8], angular_diameter: 2.0 }),
        ("point sun", Light::Sun { direction: [-1.0, 1.0, -2.0], irradiance: [0.3; 3], angular_diameter: 0.0 }),
        ("sky", Light::uniform_sky([0.1, 0.2, 0.3])),
        (
            "dusk",
            Light::Sky { radiance: None, zenith: Some([0.1, 0.1, 0.2]), horizon: Some([0.3, 0.2, 0.1]), ground: None },
        ),
        ("bulb", Light::Point { position: [2.0, -2.0, 2.5], power, intensity, radius: 0.2 }),
        (
            "spot",
            Light::Spot {
                position: [-2.0, -2.0, 4.0],
                direction: [0.5, 0.5, -1.0],
                power,
                intensity,
                inner: 10.0,
                outer: 40.0,
                radius: 0.1,
            },
        ),
        (
            "panel",
            Light::Rectangle {
                position: [0.0, 2.5, 3.0],
                u: [1.0, 0.0, 0.0],
                v: [0.0, 0.5, -1.0],
                radiance: [4.0; 3],
                two_sided: true,
            },
        ),
    ]
}

fn lit() -> World {
    let mut world = objects();
    for (name, light) in lights() {
        named(&mut world, name, light);
    }
    world
}

fn light_channels() -> Vec<Channel> {
    let names = lights().into_iter().map(|(name, _)| format!("light:{name}"));
    names.chain(["light:surfaces".into()]).map(|name| Channel::from_name(&name).unwrap()).collect()
}

/// Checks that the sum of channels is the colour within float32 rounding.
fn check_sum(frame: &raycam_render::Frame, channels: &[Channel], about: &str) {
    let color = f32s(frame, Channel::Color);
    for (i, &whole) in color.iter().enumerate() {
        let sum: f32 = channels.iter().map(|&channel| f32s(frame, channel)[i]).sum();
        assert!((sum - whole).abs() <= 2e-6 * whole.max(0.1), "{about}, value {i}: {sum} of {whole}");
    }
}

fn settings(integrator: Integrator, ambient_occlusion: Option<f64>) -> Settings {
    let mut channels = vec![Channel::Color, Channel::Diffuse, Channel::Specular, Channel::Volume];
    channels.extend(WAYS);
    channels.extend(light_channels());
    Settings { integrator, ambient_occlusion, channels, samples: 8, ..Settings::default() }
}

#[test]
fn passes_of_each_kind_add_up_to_the_color() {
    let fog = |extinction: f32| Fog { extinction: [extinction; 3], albedo: [0.9; 3], g: 0.4, height: None };
    for extinction in [None, Some(0.1)] {
        let mut world = lit();
        world.fog = extinction.map(fog);
        for (integrator, ambient) in [
            (Integrator::Path, None),
            (Integrator::Direct, None),
            (Integrator::Direct, Some(1.0)),
            (Integrator::Direct, Some(f64::INFINITY)),
        ] {
            let about = format!("{integrator:?}, {ambient:?}, fog {extinction:?}");
            let settings = settings(integrator, ambient);
            let frame = render(&world, &camera(), &settings);
            for channels in [&WAYS[..], &LOBES, &light_channels()] {
                check_sum(&frame, channels, &about);
            }
            let alone = Settings { channels: vec![Channel::Color], ..settings };
            let plain = render(&world, &camera(), &alone);
            assert_eq!(f32s(&frame, Channel::Color), f32s(&plain, Channel::Color), "{about}");
            let has_light = |channel: &Channel| f32s(&frame, *channel).iter().sum::<f32>() > 0.0;
            let is_empty = |channel: &Channel| *channel == Channel::Volume && extinction.is_none();
            let missing: Vec<_> = settings_channels().filter(|c| has_light(c) == is_empty(c)).collect();
            assert!(missing.is_empty(), "{about}: {missing:?}");
        }
    }
}

fn settings_channels() -> impl Iterator<Item = Channel> {
    settings(Integrator::Path, None).channels.into_iter()
}

#[test]
fn light_images_equal_images_of_worlds_with_one_light() {
    let settings = Settings { samples: 2048, ..settings(Integrator::Path, None) };
    let frame = render(&lit(), &camera(), &settings);
    let mean = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
    for (name, light) in lights() {
        let mut dark = objects();
        for material in &mut dark.materials {
            material.emission.value = [0.0; 3];
            if material.model.is_unlit() {
                *material = self::material([0.0; 3], 0.0, 0.0, 1.0);
            }
        }
        named(&mut dark, name, light);
        let alone = render(&dark, &camera(), &Settings { channels: vec![Channel::Color], ..settings.clone() });
        let expected = mean(f32s(&alone, Channel::Color));
        let found = mean(f32s(&frame, Channel::from_name(&format!("light:{name}")).unwrap()));
        // The spot's light arrives on few, bright paths.
        let tolerance = if name == "spot" { 0.05 } else { 0.02 };
        assert!((found / expected - 1.0).abs() < tolerance, "{name}: {found}, expected {expected}");
    }
}

#[test]
fn passes_of_a_matte_floor_follow_lamberts_law() {
    let mut world = plane(1e3, 0.5);
    named(
        &mut world,
        "noon",
        Light::Sun { direction: [0.0, 0.0, -1.0], irradiance: [std::f32::consts::PI; 3], angular_diameter: 0.0 },
    );
    let camera = look_at(DVec3::new(0.0, -2.0, 2.0), DVec3::ZERO, 20.0, [4, 4]);
    let channels = [Channel::Direct, Channel::Diffuse, Channel::from_name("light:noon").unwrap()];
    let dark = [Channel::Emission, Channel::Indirect, Channel::Specular, Channel::Volume];
    let settings = Settings {
        integrator: Integrator::Path,
        channels: channels.into_iter().chain(dark).collect(),
        ..Settings::default()
    };
    let frame = render(&world, &camera, &settings);
    for channel in channels {
        assert!(f32s(&frame, channel).iter().all(|value| (value - 0.5).abs() < 1e-6), "{channel:?}");
    }
    for channel in dark {
        assert!(f32s(&frame, channel).iter().all(|value| *value == 0.0), "{channel:?}");
    }
}

#[test]
fn unlit_integrators_show_all_light_as_emission() {
    for integrator in [Integrator::Flat, Integrator::Ao] {
        for samples in [1, 4] {
            let mut settings = Settings { samples, ..settings(integrator, None) };
            settings.channels.retain(|channel| !matches!(channel, Channel::Light(_)));
            let frame = render(&lit(), &camera(), &settings);
            assert_eq!(f32s(&frame, Channel::Emission), f32s(&frame, Channel::Color));
            check_sum(&frame, &WAYS, "flat");
            check_sum(&frame, &LOBES, "flat");
        }
    }
}

#[test]
fn unknown_light_names_are_refused_with_the_known_names() {
    let channel = Channel::from_name("light:key").unwrap();
    let error = |world: &World, integrator| {
        let settings = Settings { integrator, channels: vec![channel], ..Settings::default() };
        raycam_render::render(&prepare(world), &camera(), &settings, &Control::new()).unwrap_err().to_string()
    };
    let message = error(&lit(), Integrator::Path);
    for (name, _) in lights() {
        assert!(message.contains(name), "{message}");
    }
    assert!(message.contains("surfaces"));
    assert!(error(&plane(1.0, 0.5), Integrator::Direct).contains("sky, sun"));
    assert!(error(&lit(), Integrator::Flat).contains("integrator"));
}

#[test]
fn clamped_samples_keep_the_proportions_of_their_passes() {
    let settings = Settings { clamp: Some(0.3), ..settings(Integrator::Path, None) };
    let frame = render(&lit(), &camera(), &settings);
    for channels in [&WAYS[..], &LOBES, &light_channels()] {
        check_sum(&frame, channels, "clamped");
    }
}
