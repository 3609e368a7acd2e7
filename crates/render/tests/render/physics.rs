//! Closed forms of light transport.
//!
//! Each test was verified to fail when a factor of 1.01 (or 1/1.01) was inserted into the code that it tests:
//!
//! | factor | test that failed |
//! |---|---|
//! | sun: irradiance; radiance of the disk | `direct::lambertian_plane_under_the_sun_...`; `closed_form::irradiance_of_a_sun_...` |
//! | bulb: intensity; radiance of the sphere | `direct::lambertian_plane_under_a_bulb_...`, `closed_form::a_bulb_of_any_size_...` |
//! | rectangle: solid angle, density by area, positions of samples | `closed_form::area_light_irradiance_...`, `form_factors_of_squares_...` |
//! | disk: density; spot: power, falloff; IES: scale | `closed_form`, the test of each |
//! | sky, gradient, daylight, environment: radiance | `closed_form::sky_irradiance_equals_its_integral`, `daylight_...`, `environment_yaw_...` |
//! | sky, panorama, cone, disk: density | `light::tests::density`: the integral is 1.01 |
//! | cone, disk, rectangle: positions of samples | `light::tests::density`: chi-squared |
//! | light tree: probability of a draw; probability of a light | `tree::light_probabilities_...` |
//! | emissive triangles: density; emission | `light::textured_meshes_...`; `path::max_depth_counts_segments` |
//! | Lambertian reflection: value; weight of a sample | `form_factors_of_squares_...`; `path::a_white_furnace_stays_white` |
//! | opacity; probability of surviving roulette | `path::screens_blend_...`; `path::closed_sphere_...` |
//! | layers, Phong lobe: density | `bsdf::tests::density`: the integral is 1.01 |
//! | GGX: lambda; masking; density; height and azimuth of the samples | `bsdf::tests::density` |
//! | GGX: masking of both directions; stretching of the samples | `furnace::white_furnace_...`; `documented_losses_...` |
//! | multiple scattering: colour; single scattering: albedo | `furnace::white_furnace_...` |
//! | coat: value; light lost by the layers below | `clearcoat::albedo_equals_the_integrated_reflectance` |
//! | sheen: value; lobe and table | `sheen::sheen_lobe_matches_the_paper` |
//! | sheen: value; light left for the layers below | `sheen::albedo_and_base_transmittance_add_up_to_one` |
//! | thin film: value; reflection of the base | `thin_film::thick_films_...` |
//! | layers: value times 1 + 0.01 cos(light) | `reciprocity::bsdf_values_are_reciprocal` |
//! | mirror and refraction of smooth glass | `clear_objects_are_invisible_under_a_white_sky` |
//! | metal: Fresnel; absorption of glass | `smooth_metal_reflectance_follows_fresnel`, `glass_absorption_follows_beers_law` |
//! | lights only in `direct`; lights only in `path` | `path::direct_equals_path_with_one_bounce` |
//! | radiance: factor that depends on the thread's number | `path::path_images_have_the_same_bytes_...` |
//! | samples rejected but not counted | `direct::samples_beyond_float32_...` |
//! | random numbers: maximum 0.99; repetition after 64 samples | `sampler`: elementary intervals; `error_decreases_...` |

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Integrator, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{Camera, Glass, Light, Material, MaterialModel, Metal, World};

fn settings(integrator: Integrator, samples: u32) -> Settings {
    Settings { integrator, samples, ..Settings::default() }
}

fn mean(world: &World, camera: &Camera, settings: &Settings) -> f64 {
    let frame = render(world, camera, settings);
    let color = f32s(&frame, Channel::Color);
    color.iter().map(|&v| f64::from(v)).sum::<f64>() / color.len() as f64
}

/// Camera that shows the unit square around the origin from far above. All points of the square therefore
/// have the same weight in the image, apart from a relative error of about the squared field of view.
fn above() -> Camera {
    const HEIGHT: f64 = 1e4;
    let fov = 2.0 * (0.5 / HEIGHT).atan().to_degrees();
    look_at(DVec3::new(0.0, 0.0, HEIGHT), DVec3::ZERO, fov, [16, 16])
}

#[test]
fn form_factors_of_squares_match_the_catalogue() {
    // The closed forms are C-11 and C-14 of J. R. Howell, "A Catalog of Radiation Heat Transfer Configuration Factors".
    let parallel = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], 0.199_825);
    let upright = ([-0.5, 0.0, 0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], 0.200_044);
    for (position, u, v, expected) in [parallel, upright] {
        let mut world = plane(1.0, 1.0);
        world.add_light(Light::Rectangle { position, u, v, radiance: [1.0; 3], two_sided: false }).unwrap();
        for (integrator, depth) in [(Integrator::Direct, None), (Integrator::Path, Some(2))] {
            let settings = Settings { max_depth: depth, ..settings(integrator, 1024) };
            let found = mean(&world, &above(), &settings);
            assert!((found / expected - 1.0).abs() < 1e-3, "{integrator:?}: {found}, expected {expected}");
        }
    }
}

#[test]
fn clear_objects_are_invisible_under_a_white_sky() {
    let glass = |roughness, thin| MaterialModel::Glass(Glass { roughness, thin, ..Glass::default() });
    let dispersive = MaterialModel::Glass(Glass { dispersion: 0.5, ..Glass::default() });
    for reflectance in [
        dispersive,
        glass(0.0, false),
        glass(0.0, true),
        glass(0.3, false),
        glass(0.6, false),
        glass(1.0, false),
        glass(0.6, true),
    ] {
        let mut world = World::default();
        let ball = Material { model: reflectance.clone(), ..Material::default() };
        let mesh = primitive::sphere(1.0, 5).unwrap();
        add(&mut world, mesh, ball, DAffine3::IDENTITY);
        world.add_light(Light::Sky { radiance: Some([1.0; 3]), zenith: None, horizon: None, ground: None }).unwrap();
        let camera = look_at(DVec3::new(0.0, -6.0, 0.0), DVec3::ZERO, 16.0, [16, 16]);
        let found = mean(&world, &camera, &settings(Integrator::Path, 512));
        // Rough glass traps some light for many bounces, which is noisy; the furnace test of single surfaces is more
        // precise.
        let rough = matches!(&reflectance, MaterialModel::Glass(glass) if glass.roughness > 0.0);
        let off = if rough { 3e-2 } else { 1e-3 };
        assert!((found - 1.0).abs() < off, "{reflectance:?}: {found}");
    }
}

#[test]
fn glass_absorption_follows_beers_law() {
    let color = [0.9, 0.5, 0.1];
    // The medium has the index of air, so that nothing is reflected: two metres transmit the square of `color` at one
    // metre.
    let mut world = World::default();
    let block = Material {
        model: MaterialModel::Glass(Glass {
            ior: 1.0,
            attenuation_color: color,
            attenuation_distance: 1.0,
            ..Glass::default()
        }),
        ..Material::default()
    };
    let mesh = primitive::box_([2.0, 2.0, 2.0]).unwrap();
    add(&mut world, mesh, block, DAffine3::IDENTITY);
    world.add_light(Light::uniform_sky([1.0; 3])).unwrap();
    let camera = look_at(DVec3::new(0.0, 1e-3, 5.0), DVec3::ZERO, 0.1, [1, 1]);
    let frame = render(&world, &camera, &settings(Integrator::Path, 16));
    for (found, share) in f32s(&frame, Channel::Color).iter().zip(color) {
        let expected = share * share;
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }
}

#[test]
fn smooth_metal_reflectance_follows_fresnel() {
    let metal = Metal::named("copper").unwrap();
    let mut world = plane(4.0, 1.0);
    world.materials[0].model = MaterialModel::Metal(metal);
    world.add_light(Light::Sky { radiance: Some([1.0; 3]), zenith: None, horizon: None, ground: None }).unwrap();
    let camera = look_at(DVec3::new(0.0, 1e-3, 3.0), DVec3::ZERO, 0.1, [1, 1]);
    for integrator in [Integrator::Direct, Integrator::Path] {
        let frame = render(&world, &camera, &settings(integrator, 16));
        for (i, &found) in f32s(&frame, Channel::Color).iter().enumerate() {
            let (n, k) = (metal.ior[i], metal.extinction[i]);
            let expected = ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
            assert!((found - expected).abs() < 1e-4, "{found} {expected}");
        }
    }
}

#[test]
fn error_decreases_at_least_with_the_square_root_of_samples() {
    let world = still_life();
    let camera = look_at(DVec3::new(4.0, -6.0, 3.0), DVec3::new(0.0, 0.0, 0.7), 40.0, [20, 15]);
    let of = |samples, seed| {
        let settings = Settings { max_depth: Some(4), seed, ..settings(Integrator::Path, samples) };
        f32s(&render(&world, &camera, &settings), Channel::Color).to_vec()
    };
    let exact = of(16384, 1);
    // The test uses eight seeds, because a few bright samples of one image would change the slope.
    let off = |samples| {
        let square = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
        let of_seed = |seed| of(samples, seed).iter().zip(&exact).map(square).sum::<f64>();
        (2..10).map(of_seed).sum::<f64>().sqrt()
    };
    let errors = [16, 32, 64, 128, 256].map(off);
    // The slope is fitted by least squares over the powers of two.
    let slope = errors.iter().zip([-2.0, -1.0, 0.0, 1.0, 2.0]);
    let slope = slope.map(|(off, x)| off.log2() * x).sum::<f64>() / 10.0;
    assert!(slope <= -0.5, "{slope}: {errors:?}");
}
