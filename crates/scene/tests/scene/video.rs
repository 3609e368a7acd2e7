//! Videos: orbits, keyframes, and interpolation between them.

use crate::common::node;
use glam::{DMat3, DVec3};
use raycam_scene::schema::{self, VideoSpec, WorldFile};
use raycam_scene::{Camera, NoAssets, SceneError, Up, World};

/// A world with a camera and a box, and this video.
fn world(up: &str, video: &str) -> Result<World, SceneError> {
    schema::from_value::<WorldFile>(&node(&format!(
        r#"{{ "up": "{up}",
              "camera": {{ "focal": 500, "location": [4, -3, 2], "target": [0, 0, 0.5] }},
              "object": {{ "name": "box", "box": {{}}, "location": [1, 2, 3], "yaw": 30, "scale": [1, -2, 3] }},
              "video": {video} }}"#
    )))?
    .build(&mut NoAssets)
}

fn camera_at(world: &World, time: f64) -> Camera {
    world.video.as_ref().unwrap().camera_at(&world.cameras[0].camera, None, time).unwrap()
}

fn keyframes(interpolation: &str, keys: &str) -> World {
    world("z", &format!(r#"{{ "interpolation": "{interpolation}", "keyframe": [{keys}] }}"#)).unwrap()
}

fn close(a: DVec3, b: DVec3) -> bool {
    (a - b).length() < 1e-12
}

#[test]
fn orbits_start_with_the_still_image_and_keep_their_distance() {
    for (up, axis) in [("z", DVec3::Z), ("y", DVec3::Y)] {
        let world = world(up, r#"{ "fps": 10, "seconds": 2, "orbit": { "target": [0, 0, 0.5] } }"#).unwrap();
        let still = &world.cameras[0].camera;
        let video = world.video.as_ref().unwrap();
        assert_eq!(video.frame_count(), 20);
        assert_eq!(video.camera_at(still, None, video.time(0)).unwrap(), *still);
        let target = DVec3::new(0.0, 0.0, 0.5);
        for frame in 0..20 {
            let camera = video.camera_at(still, None, video.time(frame)).unwrap();
            assert!(((camera.c() - target).length() - (still.c() - target).length()).abs() < 1e-12);
            assert!(((camera.c() - still.c()).dot(axis)).abs() < 1e-12, "level");
            assert!((camera.project(target).0 - still.project(target).0).length() < 1e-9, "the target keeps its pixel");
            assert_eq!(camera.k(), still.k());
        }
        // Counter-clockwise as seen from above: a quarter turn moves east to north.
        let quarter = video.camera_at(still, None, 0.5).unwrap().c() - target;
        let expected = DMat3::from_axis_angle(axis, std::f64::consts::FRAC_PI_2) * (still.c() - target);
        assert!(close(quarter, expected));
        let around = video.camera_at(still, None, 2.0).unwrap();
        assert!(close(around.c(), still.c()) && close(around.forward(), still.forward()));
    }
}

#[test]
fn linear_keyframes_move_at_constant_speed_and_hold_at_the_ends() {
    let world = keyframes(
        "linear",
        r#"{ "time": 1, "location": [0, 0, 0] }, { "time": 3, "location": [2, 4, 6] }, { "time": 4, "location": [0, 0, 0] }"#,
    );
    for (time, expected) in [
        (0.0, [0.0, 0.0, 0.0]),
        (1.0, [0.0, 0.0, 0.0]),
        (1.5, [0.5, 1.0, 1.5]),
        (3.0, [2.0, 4.0, 6.0]),
        (3.25, [1.5, 3.0, 4.5]),
        (9.0, [0.0, 0.0, 0.0]),
    ] {
        let camera = camera_at(&world, time);
        assert!(close(camera.c(), DVec3::from_array(expected)), "{time}");
        assert_eq!(camera.r(), world.cameras[0].camera.r(), "no angles: no turning");
    }
    assert_eq!(world.video.unwrap().seconds(), 4.0, "up to the last keyframe");
}

#[test]
fn smooth_keyframes_have_continuous_speed() {
    let world = keyframes(
        "smooth",
        r#"{ "time": 0, "location": [0, 0, 0], "yaw": 0 }, { "time": 1, "location": [1, 1, 0], "yaw": 40, "pitch": 10 },
           { "time": 3, "location": [4, 0, 2], "yaw": 170, "roll": 20 }, { "time": 4, "location": [4, 4, 4], "yaw": -120 }"#,
    );
    let position = |time| camera_at(&world, time).c();
    for (time, expected) in [(1.0, [1.0, 1.0, 0.0]), (3.0, [4.0, 0.0, 2.0]), (4.0, [4.0, 4.0, 4.0])] {
        assert!(close(position(time), DVec3::from_array(expected)));
    }
    for (found, expected) in camera_at(&world, 3.0).roll_pitch_yaw(Up::Z).into_iter().zip([20.0, 0.0, 170.0]) {
        assert!((found - expected).abs() < 1e-9);
    }
    let h = 1e-6;
    for time in [1.0, 3.0] {
        let speed = |of: &dyn Fn(f64) -> DVec3, t: f64| (of(t + h) - of(t)) / h;
        for of in [&position as &dyn Fn(f64) -> DVec3, &|t| camera_at(&world, t).forward(), &|t| {
            camera_at(&world, t).r().row(0)
        }] {
            let (before, after) = (speed(of, time - h), speed(of, time));
            assert!((before - after).length() < 1e-4 * (1.0 + after.length()), "{before} {after}");
            assert!(after.length() > 0.1);
        }
    }
    // The velocity at an inner key is the velocity of the parabola through three keys: (v- dt+ + v+ dt-) / (dt- + dt+).
    let expected = (DVec3::new(1.0, 1.0, 0.0) * 2.0 + DVec3::new(1.5, -0.5, 1.0)) / 3.0;
    let found = (position(1.0 + h) - position(1.0 - h)) / (2.0 * h);
    assert!((found - expected).length() < 1e-5, "{found} {expected}");
    // The motion starts and ends at rest.
    assert!((position(h) - position(0.0)).length() / h < 1e-4);
    assert!((position(4.0) - position(4.0 - h)).length() / h < 1e-4);
}

#[test]
fn two_smooth_keyframes_give_a_smoothstep() {
    let world = keyframes("smooth", r#"{ "time": 0, "yaw": -10 }, { "time": 2, "yaw": 70 }"#);
    for time in [0.0, 0.3, 1.0, 1.7, 2.0] {
        let s: f64 = time / 2.0;
        let expected = -10.0 + 80.0 * s * s * (3.0 - 2.0 * s);
        let [roll, pitch, yaw] = camera_at(&world, time).roll_pitch_yaw(Up::Z);
        assert!(roll.abs() < 1e-9 && pitch.abs() < 1e-9 && (yaw - expected).abs() < 1e-9, "{yaw} {expected}");
    }
}

#[test]
fn angles_are_interpolated_as_plain_numbers() {
    for from in [-400, -180, -10, 0, 90, 350] {
        for turn in [-720, -360, -190, -60, 20, 180, 270, 360, 1000] {
            let keys = format!(r#"{{ "time": 0, "yaw": {from} }}, {{ "time": 1, "yaw": {} }}"#, from + turn);
            let world = keyframes("linear", &keys);
            for time in [0.1, 0.25, 0.6] {
                let [_, _, yaw] = camera_at(&world, time).roll_pitch_yaw(Up::Z);
                let off = yaw - (f64::from(from) + time * f64::from(turn));
                assert!((off / 360.0 - (off / 360.0).round()).abs() < 1e-11, "{from} {turn} {yaw}");
            }
        }
    }
    // All three angles are tested, for a camera and for an object.
    let keys = |object: &str| {
        format!(
            r#"{{ {object} "time": 0, "roll": 10, "pitch": 20, "yaw": 30 }},
               {{ {object} "time": 1, "roll": -50, "pitch": -40, "yaw": 440 }}"#
        )
    };
    let expected = [10.0 - 0.3 * 60.0, 20.0 - 0.3 * 60.0, 30.0 + 0.3 * 410.0];
    let found = camera_at(&keyframes("linear", &keys("")), 0.3).roll_pitch_yaw(Up::Z);
    assert!(found.into_iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {expected:?}");
    let world = keyframes("linear", &keys(r#""object": "box","#)).at_video_time(0.3).unwrap();
    let [roll, pitch, yaw] = expected.map(f64::to_radians);
    let rotation = DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll);
    let difference =
        world.objects[0].world_from_mesh.matrix3 - rotation * DMat3::from_diagonal(DVec3::new(1.0, -2.0, 3.0));
    assert!(difference.to_cols_array().iter().all(|v| v.abs() < 1e-12), "{difference}");
}

#[test]
fn matrix_rotations_follow_the_shorter_arc() {
    // The rotation from 10 to 350 degrees about z takes the shorter way: 20 degrees backwards.
    let matrix = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        format!("[[{cos}, {}, 0, 0], [{sin}, {cos}, 0, 0], [0, 0, 1, 0]]", -sin)
    };
    let keys = [(0, 10.0), (1, 350.0)]
        .map(|(time, degrees)| format!(r#"{{ "object": "box", "time": {time}, "matrix": {} }}"#, matrix(degrees)));
    let world = keyframes("linear", &keys.join(", ")).at_video_time(0.25).unwrap();
    let expected = DMat3::from_rotation_z(5f64.to_radians());
    let difference = world.objects[0].world_from_mesh.matrix3 - expected;
    assert!(difference.to_cols_array().iter().all(|v| v.abs() < 1e-12), "{difference}");
}

#[test]
fn cameras_face_their_target_at_all_times() {
    let world = keyframes(
        "linear",
        r#"{ "time": 0, "location": [5, 0, 1], "target": [0, 0, 0] }, { "time": 2, "location": [0, 5, 1], "target": [0, 0, 2] }"#,
    );
    for time in [0.0, 0.5, 1.3, 2.0] {
        let camera = camera_at(&world, time);
        let (pixel, in_front) = camera.project(DVec3::new(0.0, 0.0, time));
        assert!((pixel - glam::DVec2::new(319.5, 239.5)).length() < 1e-9 && in_front);
    }
}

#[test]
fn objects_move_and_keep_their_scale() {
    let world = keyframes(
        "linear",
        r#"{ "object": "box", "time": 0, "location": [0, 0, 0] }, { "object": "box", "time": 1, "location": [2, 0, 0] },
           { "object": "box", "time": 2, "yaw": 90 }"#,
    );
    let before = world.objects[0].world_from_mesh;
    let moved = world.at_video_time(0.5).unwrap();
    let now = moved.objects[0].world_from_mesh;
    assert!(close(now.translation, DVec3::X));
    // A single keyframe with angles applies at all times; the scale in the object's description is kept.
    let expected =
        DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2) * DMat3::from_diagonal(DVec3::new(1.0, -2.0, 3.0));
    assert!((now.matrix3 - expected).to_cols_array().iter().all(|v| v.abs() < 1e-12));
    assert_eq!(world.objects[0].world_from_mesh, before, "the original world is unchanged");
    assert!(std::sync::Arc::ptr_eq(&world.meshes[0], &moved.meshes[0]), "geometry is shared");
    assert_eq!(camera_at(&world, 1.0), world.cameras[0].camera);
}

#[test]
fn objects_keep_their_angles_unless_a_target_is_given() {
    let world = keyframes("linear", r#"{ "object": "box", "time": 0, "location": [7, 7, 7] }"#);
    let placed = world.at_video_time(0.0).unwrap().objects[0].world_from_mesh;
    assert_eq!(placed.matrix3, world.objects[0].world_from_mesh.matrix3);
    assert_eq!(placed.translation, DVec3::splat(7.0));
    for (up, ahead) in [("z", DVec3::X), ("y", -DVec3::Z)] {
        let keys = r#"{ "keyframe": { "object": "box", "time": 0, "location": [0, 0, 0], "target": [1, 3, 2] } }"#;
        let world = self::world(up, keys).unwrap();
        let placed = world.at_video_time(0.0).unwrap().objects[0].world_from_mesh;
        let faced = placed.transform_vector3(ahead).normalize();
        assert!(close(faced, DVec3::new(1.0, 3.0, 2.0).normalize()), "{up} {faced}");
    }
    let keys = r#"{ "keyframe": { "object": "box", "time": 0, "location": [0, 0, 0], "target": [0, 0, 2] } }"#;
    let error = self::world("z", keys).unwrap().at_video_time(0.0).unwrap_err().to_string();
    assert!(error.contains(r#"object "box" at [0, 0, 0] cannot face [0, 0, 2] at 0 s"#), "{error}");
}

#[test]
fn named_cameras_move_by_their_own_keyframes_only() {
    // The camera moves from (0, 0, 1), where it faces down with x to the right, to (2, 0, 1), where it is turned by 90
    // degrees about the optical axis.
    let keys = r#"{ "camera": "camera", "time": 0, "matrix": [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1]] },
        { "camera": "camera", "time": 1, "matrix": [[0, 1, 0, 2], [1, 0, 0, 0], [0, 0, -1, 1]] },
        { "time": 0, "location": [9, 9, 9] }"#;
    let world = keyframes("linear", keys);
    let video = world.video.as_ref().unwrap();
    let base = &world.cameras[0].camera;
    assert_eq!(world.keyframed_camera(base), Some(0));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let world_from_camera = DMat3::from_cols_array(&[half, half, 0.0, half, -half, 0.0, 0.0, 0.0, -1.0]);
    for moved in
        [video.camera_at(base, Some(0), 0.5).unwrap(), world.at_video_time(0.5).unwrap().cameras[0].camera.clone()]
    {
        assert!(close(moved.c(), DVec3::new(1.0, 0.0, 1.0)));
        let difference = moved.r().transpose() - world_from_camera;
        assert!(difference.to_cols_array().iter().all(|v| v.abs() < 1e-12), "{difference}");
    }
    assert!(close(video.camera_at(base, None, 0.5).unwrap().c(), DVec3::splat(9.0)), "other cameras follow the video");
    let other = base.at_pose(base.r(), DVec3::X).unwrap();
    assert_eq!(world.keyframed_camera(&other), None);
    let mut fewer = world.clone();
    fewer.remove_camera("camera").unwrap();
    assert!(fewer.clone().validated().is_ok(), "keyframes of a removed camera are removed");
}

#[test]
fn invalid_video_values_are_refused() {
    let fails = |video: &str, expected: &str| {
        let error = world("z", video).expect_err("an error").to_string();
        assert_eq!(error.split(" (available: ").next(), Some(expected));
    };
    fails(r#"{ "fps": 0 }"#, "video.fps: 0; expected a finite number greater than 0");
    fails(r#"{ "seconds": -1 }"#, "video.seconds: -1; expected a number greater than 0, and at most 1000000 frames");
    fails(
        r#"{ "seconds": 1e9 }"#,
        "video.seconds: 1000000000; expected a number greater than 0, and at most 1000000 frames",
    );
    fails(
        r#"{ "keyframe": [{ "time": 2, "yaw": 3 }, { "time": 1, "yaw": 4 }] }"#,
        "video.keyframe[1].time: 1 follows 2; expected increasing times for the keyframes of each object or camera",
    );
    fails(
        r#"{ "keyframe": { "time": -1, "yaw": 3 } }"#,
        "video.keyframe[0].time: -1; expected a finite number of seconds >= 0",
    );
    fails(r#"{ "keyframe": { "yaw": 3 } }"#, r#"video.keyframe[0]: the key "time" is missing"#);
    fails(
        r#"{ "keyframe": { "time": 1 } }"#,
        "video.keyframe[0]: empty keyframe; expected location, roll, pitch and yaw, or target",
    );
    fails(
        r#"{ "keyframe": { "time": 1, "yaw": 1, "target": [0, 0, 0] } }"#,
        "video.keyframe[0]: some keyframes have angles and others targets; use only one of them for each object or camera",
    );
    fails(
        r#"{ "keyframe": { "time": 1, "object": "bx", "yaw": 1 } }"#,
        r#"video.keyframe[0].object: no object named "bx"; the world has 1 object; did you mean "box"?"#,
    );
    fails(
        r#"{ "orbit": { "target": [0, 0, 0] }, "keyframe": { "time": 1, "yaw": 1 } }"#,
        "video.orbit: cannot be combined with keyframes of the camera; use only one of them",
    );
    fails(
        r#"{ "keyframe": { "time": 1, "camera": "camera", "matrix": [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] } }"#,
        "video.keyframe[0].matrix: a camera's matrix must consist of a rotation and a translation",
    );
    fails(
        r#"{ "keyframe": { "time": 1, "camera": "camera", "object": "box", "yaw": 1 } }"#,
        "video.keyframe[0]: object, rig and camera are alternatives; expected only one of them",
    );
    fails(
        r#"{ "orbit": { "targt": [0, 0, 0] } }"#,
        r#"video.orbit.targt: unknown key "targt"; did you mean "target"?"#,
    );
}

#[test]
fn videos_report_the_time_of_every_frame() {
    let world = World::default();
    let video = |fps, seconds| {
        let spec = VideoSpec { fps, seconds: Some(seconds), ..VideoSpec::default() };
        spec.build(&world).unwrap()
    };
    assert_eq!(video(24.0, 4.0).frame_count(), 96);
    assert_eq!(video(30.0, 0.001).frame_count(), 1);
    assert_eq!(video(29.97, 10.0).frame_count(), 300);
    assert_eq!(video(25.0, 1.0).time(5), 0.2);
    assert_eq!(video(25.0, 1.0).fps(), 25.0);
}
