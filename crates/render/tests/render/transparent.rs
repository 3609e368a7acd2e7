//! Ground truth behind transparent surfaces.

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Frame, Settings, TruthSurface};
use raycam_scene::material::Alpha;
use raycam_scene::mesh::primitive;
use raycam_scene::{Camera, Material, MaterialModel, World};

/// Planes of these materials at heights 4, 3, 2, ..., with the first plane on top; a camera looks down from height 6.
fn stack(materials: Vec<Material>) -> (World, Camera) {
    let mut world = World::default();
    for (i, material) in materials.into_iter().enumerate() {
        let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, 4.0 - i as f64));
        add(&mut world, primitive::plane([9.0, 9.0]).unwrap(), material, place);
    }
    (world, look_at(DVec3::new(0.1, 0.2, 6.0), DVec3::new(0.0, 0.3, 0.0), 40.0, [20, 16]))
}

fn seen(world: &World, camera: &Camera, surface: TruthSurface) -> Frame {
    let settings = Settings { channels: all_channels(), surface, ..Settings::default() };
    render(world, camera, &settings)
}

fn veil(opacity: f32, alpha: Alpha) -> Material {
    Material { opacity, alpha, ..Material::default() }
}

#[test]
fn ground_truth_skips_transparent_surfaces() {
    let glass = Material { model: MaterialModel::Glass(Default::default()), ..Material::default() };
    let (world, camera) = stack(vec![
        veil(0.2, Alpha::Blend),
        veil(0.3, Alpha::Mask { cutoff: 0.5 }),
        glass,
        veil(0.6, Alpha::Blend),
        Material::default(),
    ]);
    let first = seen(&world, &camera, TruthSurface::First);
    assert!(i32s(&first, Channel::Instance).iter().all(|id| *id == 0));
    let solid = seen(&world, &camera, TruthSurface::Solid);
    assert!(i32s(&solid, Channel::Instance).iter().all(|id| *id == 3));
    assert!(i32s(&solid, Channel::Material).iter().all(|id| *id == 3));
    for (i, position) in f64s(&solid, Channel::Position).chunks_exact(3).enumerate() {
        assert!((position[2] - 1.0).abs() < 1e-9);
        let at = DVec3::from_slice(position);
        let distance = f64::from(f32s(&solid, Channel::Distance)[i]);
        assert!((distance - at.distance(camera.c())).abs() < 1e-6 * distance);
        let pixel = camera.pixel_center_of(i as u32 % 20, i as u32 / 20);
        assert!((camera.project(at).0 - pixel).length() < 1e-9);
    }
    // The colour shows the first triangles, because the integrator handles transparency itself.
    assert_eq!(f32s(&first, Channel::Color), f32s(&solid, Channel::Color));
}

#[test]
fn back_faces_of_one_sided_surfaces_are_skipped() {
    let one_sided = Material { double_sided: false, ..Material::default() };
    let (mut world, camera) = stack(vec![one_sided, Material::default()]);
    let ids = |world: &World| {
        let frame = seen(world, &camera, TruthSurface::Solid);
        i32s(&frame, Channel::Instance).to_vec()
    };
    assert!(ids(&world).iter().all(|id| *id == 0), "the front side is visible");
    let turned = DAffine3::from_rotation_x(std::f64::consts::PI);
    world.objects[0].world_from_mesh *= turned;
    assert!(ids(&world).iter().all(|id| *id == 1));
    // Mirroring reverses the winding, which must not exchange front and back.
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    world.objects[0].world_from_mesh *= mirror;
    assert_eq!(ids(&world)[0], 1, "mirroring must not exchange a mesh's front and back");
}

#[test]
fn background_is_behind_the_last_transparent_surface() {
    let (world, camera) = stack(vec![veil(0.0, Alpha::Blend); 40]);
    let frame = seen(&world, &camera, TruthSurface::Solid);
    assert!(i32s(&frame, Channel::Instance).iter().all(|id| *id == -1));
    assert!(f32s(&frame, Channel::Depth).iter().all(|d| *d == f32::INFINITY));
    assert!(f64s(&frame, Channel::Position).iter().all(|d| d.is_nan()));
}

#[test]
fn coverage_counts_the_surfaces_that_ground_truth_shows() {
    // A small veil is in front of the edge of a small solid plane, above a large plane. The visible result is the same
    // with and without the veil.
    let scene = |veiled: bool| {
        let mut world = World::default();
        for (size, z, x) in [(9.0, 0.0, 0.0), (1.5, 1.0, -0.6)] {
            let place = DAffine3::from_translation(DVec3::new(x, 0.0, z));
            let turned = place * DAffine3::from_rotation_z(0.4);
            let mesh = primitive::plane([size, size]).unwrap();
            add(&mut world, mesh, Material::default(), turned);
        }
        if veiled {
            let place = DAffine3::from_translation(DVec3::new(0.1, 0.1, 2.0));
            let mesh = primitive::plane([1.1, 0.7]).unwrap();
            add(&mut world, mesh, veil(0.3, Alpha::Blend), place);
        }
        world
    };
    let camera = look_at(DVec3::new(0.1, 0.2, 6.0), DVec3::new(0.0, 0.3, 0.0), 40.0, [40, 32]);
    for samples in [1, 64] {
        let picture = |world: &World, surface| {
            let settings = Settings {
                channels: vec![Channel::Instance, Channel::Coverage],
                samples,
                surface,
                ..Settings::default()
            };
            render(world, &camera, &settings)
        };
        let without = picture(&scene(false), TruthSurface::First);
        let behind = picture(&scene(true), TruthSurface::Solid);
        let first = picture(&scene(true), TruthSurface::First);
        let ids = |frame| i32s(frame, Channel::Instance).to_vec();
        assert_eq!(ids(&without), ids(&behind));
        assert_ne!(ids(&first), ids(&behind));
        let expected = f32s(&without, Channel::Coverage);
        let found = f32s(&behind, Channel::Coverage);
        for (i, (a, b)) in expected.iter().zip(found).enumerate() {
            // Along an edge, float32 and float64 may hit different triangles.
            assert!((a - b).abs() <= 1.0 / 64.0, "pixel {i}: {b}, without {a}");
        }
        assert_eq!(samples > 1, expected.iter().any(|c| *c < 1.0));
    }
}
