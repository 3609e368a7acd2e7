//! Caustic casters: mirrors, clear glass and glossy objects, which cast light on diffuse surfaces.
//!
//! [`find_caustic_candidates`] selects candidates by their materials. The photon pass measures how much light each
//! candidate casts, and [`choose_casters`] selects the candidates that cast the most light.

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
    /// Scene-local centre of the bounding sphere.
    pub center: DVec3,
    pub radius: f64,
    /// True if some surfaces of the caster are rough. Samples are guided to a rough caster only if it casts much light.
    pub is_rough: bool,
    /// The caster's share of guided samples, relative to the caster that casts the most light.
    pub weight: f32,
}

/// Maximum number of casters; each takes time at every diffuse hit. Lab note: "There are up to 32 casters", 11-26.
pub(crate) const MAX_CASTERS: usize = 32;
/// Number of casters that are always used. Lab note: "up to four caustic casters", 11-22.
const FIRST_CASTERS: usize = 4;
/// Minimum light that each further caster casts, relative to the first caster. Lab note: "a quarter of the largest
/// amount", 11-26.
const MIN_FURTHER_FRACTION: f64 = 0.25;
/// Number of the largest objects whose cast light is measured. Not tuned: twice [`MAX_CASTERS`].
pub(crate) const MAX_CANDIDATES: usize = 64;
/// Roughness above which metal counts as rough. Lab note: "roughness up to 0.45 (metal) or 0.35 (glass)", 11-23.
const MAX_SMOOTH_CONDUCTOR: f32 = 0.45;
/// Roughness above which glass counts as rough. Lab note: as for metal.
const MAX_SMOOTH_DIELECTRIC: f32 = 0.35;
/// Roughness above which an object is not a caster. Lab note: "a roughness up to 0.8", 11-26.
const MAX_ROUGHNESS: f32 = 0.8;
/// Minimum fraction of all light that a rough caster casts. Lab note: "a fifth of all light", 11-26.
const MIN_ROUGH_FRACTION: f64 = 0.2;
/// Minimum weight of a caster. Lab note: "with shares in proportion", 11-26; this minimum was not tuned.
const MIN_WEIGHT: f64 = 0.1;

/// Objects of a world that may be caustic casters, largest first.
pub(crate) fn find_caustic_candidates(geometry: &Geometry) -> Vec<CausticCaster> {
    let candidate = |(index, object): (usize, &PreparedInstance)| {
        if !object.is_visible {
            return None;
        }
        let slots = object.mesh.mesh.slot_count().max(1);
        let roughness = |&material: &usize| caustic_roughness(&geometry.materials[material].material);
        let all: Option<Vec<_>> = object.materials.iter().take(slots).map(roughness).collect();
        let is_rough = all?.contains(&CausticRoughness::Rough);
        Some(CausticCaster::bounding_sphere(index as u32, object, is_rough, geometry.origin))
    };
    let mut all: Vec<_> = geometry.instances.iter().enumerate().filter_map(candidate).collect();
    // The sort is stable: objects of equal size keep the world's order.
    all.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    all
}

/// Casters among the candidates, with their indices, sorted by the light that they cast. `thrown` is the
/// fraction of all light that each candidate casts, for the candidates whose light was measured. Smooth
/// candidates are included even if they cast no measured light, because light may reach them on other paths.
pub(crate) fn choose_casters(candidates: &[CausticCaster], thrown: &[f64]) -> Vec<(usize, CausticCaster)> {
    let mut all: Vec<_> = candidates.iter().copied().enumerate().take(thrown.len()).collect();
    all.retain(|&(index, caster)| !caster.is_rough || thrown[index] >= MIN_ROUGH_FRACTION);
    // The sort is stable: among candidates that cast no light, the largest comes first.
    all.sort_by(|&(a, _), &(b, _)| thrown[b].total_cmp(&thrown[a]));
    let most = all.first().map_or(0.0, |&(index, _)| thrown[index]);
    let is_enough = |&(index, _): &(usize, CausticCaster)| most > 0.0 && thrown[index] >= MIN_FURTHER_FRACTION * most;
    let further = all.iter().skip(FIRST_CASTERS).take_while(|caster| is_enough(caster)).count();
    all.truncate((FIRST_CASTERS + further).min(MAX_CASTERS));
    for (index, caster) in &mut all {
        caster.weight = if most > 0.0 { (thrown[*index] / most).max(MIN_WEIGHT) as f32 } else { 1.0 };
    }
    all
}

impl CausticCaster {
    fn bounding_sphere(index: u32, object: &PreparedInstance, is_rough: bool, origin: DVec3) -> Self {
        let placed = |point| object.world_from_mesh.transform_point3(point);
        let center = placed(object.mesh.center);
        let vertices = object.mesh.mesh.vertices.iter();
        let away = |&vertex: &DVec3| placed(vertex).distance_squared(center);
        let radius = vertices.map(away).fold(0.0, f64::max).sqrt();
        Self { instance: index, center: center - origin, radius, is_rough, weight: 1.0 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum CausticRoughness {
    Smooth,
    Rough,
}

/// Roughness of a material that may cast caustics; `None` for materials that do not focus light.
fn caustic_roughness(material: &Material) -> Option<CausticRoughness> {
    let (roughness, max_smooth) = match &material.model {
        MaterialModel::Metal(metal) => (metal.roughness, MAX_SMOOTH_CONDUCTOR),
        MaterialModel::Glass(glass) if !glass.thin => (glass.roughness, MAX_SMOOTH_DIELECTRIC),
        MaterialModel::Principled(p) if p.metallic.value > 0.5 => (p.roughness.value, MAX_SMOOTH_CONDUCTOR),
        MaterialModel::Principled(p) if has_interior(p) && p.transmission.value > 0.5 => {
            (p.roughness.value, MAX_SMOOTH_DIELECTRIC)
        }
        MaterialModel::Phong { .. }
        | MaterialModel::Unlit
        | MaterialModel::Boundary
        | MaterialModel::Glass(_)
        | MaterialModel::Principled(_) => {
            return None;
        }
    };
    match roughness {
        _ if roughness < max_smooth => Some(CausticRoughness::Smooth),
        _ if roughness < MAX_ROUGHNESS => Some(CausticRoughness::Rough),
        _ => None,
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
    use crate::guiding::LearnedGuiding;
    use crate::guiding::caustics::Caustics;
    use crate::path_guiding::{GuidingSlot, PathGuiding};
    use crate::prepare::world::PreparedWorld;
    use crate::render;
    use crate::settings::{Integrator, Settings};

    /// Balls over a floor: matte, gold, rough gold, glass, thin glass, glTF's glass, and a thin wall of glTF's glass.
    /// Only the requested number of these is placed.
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
    fn caustic_casters_are_smooth_metals_and_solid_glass() {
        let prepared = world(0..7);
        let mut seen: Vec<_> = find_caustic_candidates(&prepared.geometry)
            .iter()
            .filter(|caster| !caster.is_rough)
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
    fn objects_that_focus_the_most_light_become_caustic_casters() {
        let caster = |instance| CausticCaster {
            instance,
            center: DVec3::ZERO,
            radius: 1.0,
            is_rough: instance == 1,
            weight: 1.0,
        };
        let all: Vec<_> = (0..80).map(caster).collect();
        let chosen = |thrown: &[f64]| {
            choose_casters(&all, thrown).into_iter().map(|(index, caster)| (index, caster.weight)).collect::<Vec<_>>()
        };
        // The first four casters are always chosen, except rough casters that cast too little light.
        assert_eq!(chosen(&[0.0; 64]), [(0, 1.0), (2, 1.0), (3, 1.0), (4, 1.0)]);
        let mut thrown = [0.01; 64];
        (thrown[60], thrown[50]) = (0.08, 0.02);
        assert_eq!(chosen(&thrown), [(60, 1.0), (50, 0.25), (0, 0.125), (2, 0.125)]);
        // All objects that cast a quarter of the largest amount, up to the maximum number.
        thrown[60] = 0.04;
        assert_eq!(chosen(&thrown).len(), MAX_CASTERS);
        assert_eq!(chosen(&thrown[..9]).len(), 8);
        (thrown[60], thrown[7]) = (0.08, 0.021);
        thrown[8..20].fill(0.021);
        assert_eq!(chosen(&thrown).len(), 1 + 1 + 12 + 1);
    }

    #[test]
    fn guided_images_have_equal_light_and_less_noise() {
        let mut prepared = world(1..2);
        let size = [48, 24];
        let k = camera::intrinsics_from_fov(60.0, size, PixelCenter::Integer).unwrap();
        let eye = DVec3::new(0.0, -5.0, 2.0);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, k, size, PixelCenter::Integer).unwrap();
        let settings = |seed| Settings {
            integrator: Integrator::Path,
            samples: 256,
            max_depth: Some(5),
            channels: vec![Channel::Color],
            seed,
            ..Settings::default()
        };
        let picture = |prepared: &PreparedWorld, seed| {
            let frame = render(prepared, &camera, &settings(seed), &Control::new()).unwrap();
            match frame.plane(Channel::Color) {
                Some(ImagePlane::F32 { data, .. }) => data.clone(),
                other => panic!("{other:?}"),
            }
        };
        let mean = |picture: &[f32]| picture.iter().map(|x| f64::from(*x)).sum::<f64>();
        let apart = |a: &[f32], b: &[f32]| -> f64 { a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum() };
        let pictures = |prepared: &PreparedWorld| -> Vec<_> { (1..=8).map(|seed| picture(prepared, seed)).collect() };
        let thrown = pictures(&prepared);
        let learned = LearnedGuiding::default();
        learned.learn(&prepared.geometry, &prepared.lighting().lights, &settings(0));
        let casters = learned.caustics(&prepared.geometry).casters.clone();
        let mut of = |caustics: Caustics| {
            prepared.guiding = GuidingSlot::default();
            let guiding = LearnedGuiding { caustics: caustics.into(), ..LearnedGuiding::default() };
            prepared.guiding.install(|_| Some(Box::new(guiding)));
            pictures(&prepared)
        };
        let with = of(Caustics { casters, ..Caustics::default() });
        let without = of(Caustics::default());
        let all = [&thrown, &with, &without];
        let [a, b, c] = all.map(|all| all.iter().map(|one| mean(one)).sum::<f64>());
        let [guided, noise, plain] = all.map(|all| {
            let pairs = all.chunks(2).map(|pair| apart(&pair[0], &pair[1]));
            pairs.sum::<f64>()
        });
        for (a, b, noises) in [(a, b, guided + noise), (b, c, noise + plain)] {
            // The three channels have the same noise, so the variance of their sum is three times the sum of their
            // variances.
            let error = (3.0 * noises).sqrt();
            assert!(error < 3e-3 * b && (a - b).abs() < 4.0 * error, "{a} {b} {error}");
        }
        assert!(noise < 0.7 * plain, "{noise} {plain}");
        assert!(guided < 0.7 * noise, "{guided} {noise}");
    }
}
