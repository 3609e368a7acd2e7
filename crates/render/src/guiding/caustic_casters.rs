//! Caustic casters: mirrors, clear glass and nearly specular objects, which focus light on diffuse surfaces.

use glam::DVec3;
use raycam_scene::{Material, MaterialModel};

use crate::lobes::classify::has_interior;
use crate::prepare::geometry::Geometry;
use crate::prepare::instance::PreparedInstance;

/// An object that casts caustics, and its bounding sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CausticCaster {
    /// Index into the world's instances.
    pub instance: u32,
    /// Scene-local centre.
    pub center: DVec3,
    pub radius: f64,
}

/// The largest casters that count: each costs time at every diffuse hit.
pub(crate) const MAX_CASTERS: usize = 4;
/// Rougher objects focus little, and light sampling at their surfaces finds it.
const MAX_CONDUCTOR_ROUGHNESS: f32 = 0.45;
const MAX_DIELECTRIC_ROUGHNESS: f32 = 0.35;

/// The caustic casters of a world, largest first.
pub(crate) fn find_caustic_casters(geometry: &Geometry) -> Vec<CausticCaster> {
    let casts = |(_, object): &(usize, &PreparedInstance)| {
        if !object.is_visible {
            return false;
        }
        let slots = object.mesh.mesh.slot_count().max(1);
        let casts_caustics = |&material: &usize| casts_caustics(&geometry.materials[material].material);
        object.materials.iter().take(slots).all(casts_caustics)
    };
    let mut all: Vec<_> = geometry
        .instances
        .iter()
        .enumerate()
        .filter(casts)
        .map(|(index, object)| CausticCaster::bounding_sphere(index as u32, object, geometry.origin))
        .collect();
    // A stable sort: the order of the world among equal sizes.
    all.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    all.truncate(MAX_CASTERS);
    all
}

impl CausticCaster {
    fn bounding_sphere(index: u32, object: &PreparedInstance, origin: DVec3) -> Self {
        let placed = |point| object.world_from_mesh.transform_point3(point);
        let center = placed(object.mesh.center);
        let vertices = object.mesh.mesh.vertices.iter();
        let away = |&vertex: &DVec3| placed(vertex).distance_squared(center);
        Self { instance: index, center: center - origin, radius: vertices.map(away).fold(0.0, f64::max).sqrt() }
    }
}

fn casts_caustics(material: &Material) -> bool {
    match &material.model {
        MaterialModel::Metal(metal) => metal.roughness < MAX_CONDUCTOR_ROUGHNESS,
        MaterialModel::Glass(glass) => !glass.thin && glass.roughness < MAX_DIELECTRIC_ROUGHNESS,
        MaterialModel::Principled(p) => {
            let roughness = p.roughness.value;
            (p.metallic.value > 0.5 && roughness < MAX_CONDUCTOR_ROUGHNESS)
                || (has_interior(p) && p.transmission.value > 0.5 && roughness < MAX_DIELECTRIC_ROUGHNESS)
        }
        MaterialModel::Phong { .. } | MaterialModel::Unlit => false,
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Camera, Glass, Light, Metal, PixelCenter, Principled, World, camera};

    use super::*;
    use crate::control::Control;
    use crate::film::channel::Channel;
    use crate::film::image_plane::ImagePlane;
    use crate::prepare::world::PreparedWorld;
    use crate::render;
    use crate::settings::{Integrator, Settings};

    /// Balls over a floor: matte, of gold, of rough gold, of glass and of thin glass, of glTF's glass and of a thin wall of it, as
    /// many of these as are asked for.
    fn world(balls: std::ops::Range<usize>) -> PreparedWorld {
        let mut world = World::default();
        let of = |reflectance| Material { model: reflectance, ..Material::default() };
        let gold = Metal::named("gold").unwrap();
        let rough = Metal { roughness: 0.5, ..gold };
        let glass = |thin| Glass { thin, ..Glass::default() };
        let principled = |thickness| {
            let mut p = Principled::default();
            (p.metallic.value, p.roughness.value) = (0.0, 0.0);
            (p.transmission.value, p.thickness.value) = (1.0, thickness);
            p
        };
        let materials = [
            Material::default(),
            of(MaterialModel::Metal(gold)),
            of(MaterialModel::Metal(rough)),
            of(MaterialModel::Glass(glass(false))),
            of(MaterialModel::Glass(glass(true))),
            of(MaterialModel::Principled(principled(0.1).into())),
            of(MaterialModel::Principled(principled(0.0).into())),
        ]
        .map(|material| world.add_material(material).unwrap());
        let floor = world.add_mesh(primitive::plane([12.0, 12.0]).unwrap());
        let ball = world.add_mesh(primitive::sphere(0.5, 3).unwrap());
        for (i, material) in materials.into_iter().enumerate() {
            if !balls.contains(&i) {
                continue;
            }
            let at = DVec3::new(1.5 * i as f64 - 3.0, 0.3, 0.6);
            let place = DAffine3::from_translation(at) * DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.8));
            let object = raycam_scene::Object::new("", ball, vec![material], place);
            world.add_object(object).unwrap();
        }
        let object = raycam_scene::Object::new("", floor, vec![materials[0]], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
        world.lights.push(Light::Rectangle {
            position: [0.0, 0.5, 3.0],
            u: [0.5, 0.0, 0.0],
            v: [0.0, -0.5, 0.0],
            radiance: [40.0; 3],
            two_sided: false,
        });
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    #[test]
    fn casters_are_smooth_metals_and_solid_glass() {
        let prepared = world(0..7);
        let mut seen: Vec<_> = prepared
            .caustic_casters()
            .iter()
            .map(|mirror| (mirror.center + prepared.geometry.origin, mirror.radius))
            .collect();
        seen.sort_by(|(a, _), (b, _)| a.x.total_cmp(&b.x));
        let places = [-1.5, 1.5, 4.5].map(|x| DVec3::new(x, 0.3, 0.6));
        assert_eq!(seen.len(), 3);
        for ((center, radius), place) in seen.into_iter().zip(places) {
            assert!(center.distance(place) < 1e-9 && (0.49..0.501).contains(&radius), "{center} {radius}");
        }
    }

    #[test]
    fn guiding_keeps_the_light_and_reduces_noise() {
        let mut prepared = world(1..2);
        let size = [48, 24];
        let k = camera::intrinsics_from_fov(60.0, size, PixelCenter::Integer).unwrap();
        let eye = DVec3::new(0.0, -5.0, 2.0);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, k, size, PixelCenter::Integer).unwrap();
        let picture = |prepared: &PreparedWorld, seed| {
            let settings = Settings {
                integrator: Integrator::Path,
                samples: 256,
                max_depth: Some(5),
                channels: vec![Channel::Color],
                seed,
                ..Settings::default()
            };
            let frame = render(prepared, &camera, &settings, &Control::new()).unwrap();
            match frame.plane(Channel::Color) {
                Some(ImagePlane::F32 { data, .. }) => data.clone(),
                other => panic!("{other:?}"),
            }
        };
        let mean = |picture: &[f32]| picture.iter().map(|x| f64::from(*x)).sum::<f64>();
        let apart = |a: &[f32], b: &[f32]| -> f64 { a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum() };
        let pictures = |prepared: &PreparedWorld| -> Vec<_> { (1..=8).map(|seed| picture(prepared, seed)).collect() };
        let thrown = pictures(&prepared);
        prepared.guiding.caustic_maps = vec![].into();
        let with = pictures(&prepared);
        prepared.guiding.caustic_casters = vec![].into();
        let without = pictures(&prepared);
        let all = [&thrown, &with, &without];
        let [a, b, c] = all.map(|all| all.iter().map(|one| mean(one)).sum::<f64>());
        let [guided, noise, plain] = all.map(|all| {
            let pairs = all.chunks(2).map(|pair| apart(&pair[0], &pair[1]));
            pairs.sum::<f64>()
        });
        for (a, b, noises) in [(a, b, guided + noise), (b, c, noise + plain)] {
            // The three channels have one noise, so that their sum has three times the variance.
            let error = (3.0 * noises).sqrt();
            assert!(error < 3e-3 * b && (a - b).abs() < 4.0 * error, "{a} {b} {error}");
        }
        assert!(noise < 0.7 * plain, "{noise} {plain}");
        assert!(guided < 0.7 * noise, "{guided} {noise}");
    }
}
