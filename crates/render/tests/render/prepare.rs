//! Preparing worlds: reuse of prepared parts, and errors.

use std::sync::Arc;

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Control, Integrator, PreparedWorld, RenderError, Settings};
use raycam_scene::{Light, TextureSlot, World};

#[test]
fn unchanged_meshes_are_not_rebuilt() {
    let world = still_life();
    let first = prepare(&world);
    let mut moved = world.clone();
    moved.objects[1].world_from_mesh = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0));
    moved.lights.clear();
    let control = Control::new();
    let second = PreparedWorld::new(&moved, Some(&first), None, &control).unwrap();
    assert_eq!(control.total(), 0, "nothing was built");
    for object in 0..world.objects.len() {
        assert!(Arc::ptr_eq(first.bvh(object).unwrap(), second.bvh(object).unwrap()));
    }
    assert!(first.bvh(world.objects.len()).is_none());
    // The image shows the new world, exactly as if it had been prepared from scratch.
    let camera = look_at(DVec3::new(1.0, -6.0, 3.0), DVec3::ZERO, 50.0, [40, 30]);
    let settings = Settings { channels: all_channels(), ..Settings::default() };
    let again = raycam_render::render(&second, &camera, &settings, &control).unwrap();
    assert_eq!(bits(&again), bits(&render(&moved, &camera, &settings)));
    assert_ne!(bits(&again), bits(&render(&world, &camera, &settings)));
    // A changed mesh is built again; other meshes are not.
    Arc::make_mut(&mut moved.meshes[2]).vertices[0].x += 0.1;
    let third = PreparedWorld::new(&moved, Some(&second), None, &control).unwrap();
    assert_eq!(control.total(), 1);
    assert!(!Arc::ptr_eq(second.bvh(2).unwrap(), third.bvh(2).unwrap()));
    assert!(Arc::ptr_eq(second.bvh(1).unwrap(), third.bvh(1).unwrap()));
}

#[test]
fn inconsistent_worlds_are_refused() {
    let refused = |change: &dyn Fn(&mut World), word: &str| {
        let mut world = still_life();
        change(&mut world);
        match PreparedWorld::new(&world, None, None, &Control::new()) {
            Err(RenderError::World(message)) => assert!(message.contains(word), "{message}"),
            other => panic!("{word}: {other:?}"),
        }
    };
    refused(&|w| w.objects[0].mesh = 9, "mesh 9, but the world has 3");
    refused(&|w| w.objects[1].materials = vec![5], "material 5, but the world has 3");
    refused(&|w| w.objects[1].materials.clear(), "0 materials");
    refused(&|w| w.materials[0].texture = Some(TextureSlot::plain(2)), "texture 2, but the world has 0");
    refused(&|w| w.materials[0].color = [2.0; 3], "color");
    refused(&|w| w.objects[0].world_from_mesh = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)), "invertible");
    refused(&|w| w.objects[0].world_from_mesh.translation.x = f64::NAN, "invertible");
    refused(&|w| w.objects[0].world_from_mesh.translation.x = 1e200, "float32");
    refused(&|w| Arc::make_mut(&mut w.meshes[1]).triangles[3][1] = 1_000_000, "mesh 1");
    refused(&|w| Arc::make_mut(&mut w.meshes[1]).vertices[3].z = f64::INFINITY, "mesh 1");
    refused(&|w| Arc::make_mut(&mut w.meshes[2]).face_colors = Some(vec![]), "mesh 2");
    refused(
        &|w| {
            w.lights.push(Light::Sun { direction: [0.0; 3], irradiance: [1.0; 3], angular_diameter: 0.0 });
        },
        "direction",
    );
}

#[test]
fn deformed_meshes_are_refitted_until_their_bvh_degrades() {
    let world = still_life();
    let first = prepare(&world);
    let bent = |amount: f64| {
        let mut bent = world.clone();
        let mesh = Arc::make_mut(&mut bent.meshes[world.objects[1].mesh]);
        for vertex in &mut mesh.vertices {
            vertex.x += amount * (5.0 * vertex.z).sin();
        }
        bent
    };
    let camera = look_at(DVec3::new(1.0, -6.0, 3.0), DVec3::ZERO, 50.0, [40, 30]);
    for (amount, refitted) in [(0.1, true), (30.0, false)] {
        let bent = bent(amount);
        let moved = PreparedWorld::new(&bent, Some(&first), None, &Control::new()).unwrap();
        let new = prepare(&bent);
        let cost = |world: &PreparedWorld| world.bvh(1).unwrap().sah_cost();
        assert_eq!(cost(&moved) != cost(&new), refitted, "{amount}");
        // Unchanged meshes keep their BVH.
        assert_eq!(moved.objects_shared_with(&first), 2);
        for still in [0, 2] {
            assert!(Arc::ptr_eq(moved.bvh(still).unwrap(), first.bvh(still).unwrap()));
        }
        let picture = |world| raycam_render::render(world, &camera, &Settings::default(), &Control::new()).unwrap();
        let (moved, new) = (picture(&moved), picture(&new));
        for (a, b) in moved.planes.iter().zip(&new.planes) {
            assert!(a == b, "{amount}");
        }
    }
}

#[test]
fn lights_are_prepared_on_demand_and_shared_by_derived_worlds() {
    let world = still_life();
    let camera = look_at(DVec3::new(1.0, -6.0, 3.0), DVec3::ZERO, 50.0, [8, 6]);
    let picture = |world: &PreparedWorld, channels: Vec<Channel>| {
        let settings = Settings { integrator: Integrator::Direct, samples: 2, channels, ..Settings::default() };
        raycam_render::render(world, &camera, &settings, &Control::new()).unwrap()
    };
    let first = prepare(&world);
    picture(&first, vec![Channel::Depth, Channel::Instance, Channel::Albedo, Channel::Coverage]);
    assert!(!first.has_lighting());
    let mut moved = world.clone();
    moved.objects[1].world_from_mesh.translation.x += 0.01;
    let control = Control::new();
    let second = PreparedWorld::new(&moved, Some(&first), None, &control).unwrap();
    picture(&second, vec![Channel::Color]);
    // The lights and the origin are equal, so the lights are prepared only once.
    assert!(second.has_lighting() && first.has_lighting());
    moved.lights.pop();
    let third = PreparedWorld::new(&moved, Some(&second), None, &control).unwrap();
    assert!(!third.has_lighting());
}

#[test]
fn worlds_that_share_meshes_build_each_mesh_once_even_after_one_is_dropped() {
    let world = still_life();
    let family = Arc::default();
    let control = Control::new();
    let moment = world.clone();
    drop(PreparedWorld::in_family(&moment, &family, None, None, &control).unwrap());
    assert_eq!(control.total(), 3);
    PreparedWorld::in_family(&world, &family, None, None, &control).unwrap();
    assert_eq!(control.total(), 0, "no tree must be built again");
    // After all worlds with a mesh have been dropped, the mesh is built again.
    drop((moment, world));
    let world = still_life();
    PreparedWorld::in_family(&world, &family, None, None, &control).unwrap();
    assert_eq!(control.total(), 3);
}

#[test]
fn invisible_objects_do_not_change_the_image() {
    let mut world = still_life();
    let camera = look_at(DVec3::new(1.0, -6.0, 3.0), DVec3::ZERO, 50.0, [24, 18]);
    for samples in [1, 64] {
        for integrator in [Integrator::Direct, Integrator::Path] {
            let settings = Settings { integrator, samples, channels: all_channels(), ..Settings::default() };
            world.objects[2].visible = false;
            let hidden = bits(&render(&world, &camera, &settings));
            let mut without = world.clone();
            without.objects.pop();
            assert_eq!(hidden, bits(&render(&without, &camera, &settings)), "{samples}");
            world.objects[2].visible = true;
            assert_ne!(hidden, bits(&render(&world, &camera, &settings)));
        }
    }
}
