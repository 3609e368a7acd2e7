//! Silhouettes compared with images of a world that contains only one object.

use crate::common::*;
use glam::{DAffine3, DQuat, DVec3};
use raycam_render::annotations::amodal::amodal_masks;
use raycam_render::annotations::viewpoint::Viewpoint;
use raycam_render::{Channel, Control, PreparedWorld, RenderError, Settings};
use raycam_scene::{Camera, Lens, LensModel, World};

fn settings() -> Settings {
    Settings { channels: vec![Channel::Instance], ..Settings::default() }
}

/// Viewpoint of a camera in a static world.
fn view<'a>(world: &'a PreparedWorld, camera: &'a Camera) -> Viewpoint<'a> {
    Viewpoint { world, animated_world: None, camera }
}

#[test]
fn amodal_mask_equals_coverage_of_the_object_alone() {
    let world = still_life();
    let camera = look_at(DVec3::new(3.0, -5.0, 3.0), DVec3::new(-1.0, 0.0, 0.4), 30.0, [70, 50]);
    check_alone(&world, &camera);
}

#[test]
fn masks_of_distant_rotated_and_squashed_objects_are_complete_through_a_lens() {
    let far = DVec3::new(1e6, -1e6, 1e6);
    let mut world = still_life();
    for (i, object) in world.objects.iter_mut().enumerate() {
        let turn = DQuat::from_rotation_y(0.4 * i as f64) * DQuat::from_rotation_z(0.7);
        let squash = DAffine3::from_scale(DVec3::new(1.0, 0.3, 1.6));
        object.world_from_mesh =
            DAffine3::from_translation(far + object.world_from_mesh.translation) * DAffine3::from_quat(turn) * squash;
    }
    let [eye, target] = [DVec3::new(3.0, -5.0, 3.0), DVec3::new(-1.0, 0.0, 0.4)];
    let camera = look_at(far + eye, far + target, 60.0, [70, 50]);
    check_alone(&world, &camera);
    let fisheye = Lens::new(LensModel::Fisheye, &[0.02, -0.004, 0.0, 0.0]).unwrap();
    check_alone(&world, &camera.with_lens(fisheye).unwrap());
}

fn check_alone(world: &World, camera: &Camera) {
    let prepared = prepare(world);
    let found = amodal_masks(view(&prepared, camera), &[2, 0, 1], [0, 0], None, &Control::new()).unwrap();
    assert_eq!(found.iter().map(|f| f.object).collect::<Vec<_>>(), [2, 0, 1]);
    for one in found {
        let mut alone = world.clone();
        alone.objects = vec![world.objects[one.object].clone()];
        let frame = render(&alone, camera, &settings());
        let [x, y, width, height] = one.region;
        for (i, id) in i32s(&frame, Channel::Instance).iter().enumerate() {
            let (u, v) = (i as i32 % 70 - x, i as i32 / 70 - y);
            let inside = (0..width).contains(&u) && (0..height).contains(&v);
            let covered = inside && one.mask[(v * width + u) as usize];
            assert_eq!(covered, *id == 0, "object {} at {i}", one.object);
        }
    }
}

#[test]
fn masks_do_not_depend_on_threads_or_tiles() {
    let world = prepare(&still_life());
    let camera = look_at(DVec3::new(3.0, -5.0, 3.0), DVec3::ZERO, 20.0, [33, 65]);
    let of = |margin, threads| {
        amodal_masks(view(&world, &camera), &[0, 1, 2], margin, Some(threads), &Control::new()).unwrap()
    };
    assert_eq!(of([40, 30], 1), of([40, 30], 3));
    // Another margin moves the tiles but must not change the pixels common to both.
    let (small, large) = (of([100, 100], 2), of([107, 101], 2));
    assert_eq!((&small[1], &small[2]), (&large[1], &large[2]));
}

#[test]
fn amodal_masks_refuse_invalid_arguments() {
    let world = prepare(&still_life());
    let camera = look_at(DVec3::new(3.0, -5.0, 3.0), DVec3::ZERO, 20.0, [8, 8]);
    let of = |objects: &[usize], margin| amodal_masks(view(&world, &camera), objects, margin, None, &Control::new());
    assert!(matches!(of(&[3], [0, 0]), Err(RenderError::Settings(_))));
    for margin in [[u32::MAX, 0], [1 << 20, 1 << 20]] {
        assert!(matches!(of(&[0], margin), Err(RenderError::TooLarge { .. })));
    }
    assert_eq!(of(&[], [0, 0]), Ok(vec![]));
    let control = Control::new();
    control.cancel();
    let stopped = amodal_masks(view(&world, &camera), &[0], [0, 0], None, &control);
    assert_eq!(stopped, Err(RenderError::Cancelled));
}
