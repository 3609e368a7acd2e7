//! Cameras on one moving body.

use crate::common::{Random, node, rotation};
use glam::{DMat3, DVec2, DVec3};
use raycam_scene::camera::NamedCamera;
use raycam_scene::camera::{Pose, ReadoutDirection, Rig, ShutterMotion};
use raycam_scene::schema::{self, RigSpec, WorldFile};
use raycam_scene::{Camera, NoAssets, PixelCenter, SceneError, Up, World};

fn camera(r: DMat3, c: DVec3) -> Camera {
    let k = DMat3::from_cols(DVec3::new(400.0, 0.0, 0.0), DVec3::new(0.0, 410.0, 0.0), DVec3::new(320.0, 240.0, 1.0));
    Camera::new(k, r, c, [640, 480], PixelCenter::Integer).unwrap()
}

fn mounts(random: &mut Random) -> Vec<NamedCamera> {
    let mount = |name: &str, random: &mut Random| NamedCamera {
        name: name.into(),
        camera: camera(rotation(random), DVec3::new(0.1, 0.2, -0.3)),
    };
    vec![mount("left", random), mount("right", random)]
}

fn pose(random: &mut Random) -> Pose {
    Pose { r: rotation(random), c: DVec3::new(3.0, -2.0, 1.0) }
}

fn build(json: &str) -> Result<World, SceneError> {
    schema::from_value::<WorldFile>(&node(json))?.build(&mut NoAssets)
}

#[test]
fn rig_cameras_use_the_axes_of_the_body() {
    let mut random = Random(1);
    let (mounts, body) = (mounts(&mut random), pose(&mut random));
    let rig = Rig::new("rig", body, mounts.clone()).unwrap();
    for (mount, carried) in mounts.iter().zip(rig.cameras().unwrap()) {
        for _ in 0..50 {
            let in_body = mount.camera.c() + 5.0 * rotation(&mut random).x_axis;
            let in_world = body.c + body.r.transpose() * in_body;
            let (there, front) = mount.camera.project(in_body);
            let (here, also) = carried.camera.project(in_world);
            assert_eq!(front, also);
            assert!((here - there).length() < 1e-8 * there.length().max(1.0));
        }
    }
}

#[test]
fn turning_bodies_move_their_cameras_on_arcs() {
    let mut random = Random(2);
    let turn = |angle: f64| Pose { r: DMat3::from_rotation_z(angle).transpose(), c: DVec3::ZERO };
    let poses = vec![(0.0, turn(0.0)), (1.0, turn(2.0))];
    let motion = ShutterMotion::new(0.0, 1.0, ReadoutDirection::Down, poses).unwrap();
    let far = NamedCamera { name: "far".into(), camera: camera(rotation(&mut random), DVec3::new(2.0, 0.0, 0.0)) };
    let rig = Rig::new("rig", turn(0.0), vec![far]).unwrap();
    let rig = rig.with_motion(motion).unwrap();
    let moving = &rig.cameras().unwrap()[0].camera;
    for row in [0.0, 100.0, 350.0, 479.0] {
        let angle = 2.0 * (row + 0.5) / 480.0;
        let (origin, _) = moving.ray(DVec2::new(10.0, row));
        let expected = 2.0 * DVec3::new(angle.cos(), angle.sin(), 0.0);
        assert!((origin - expected).length() < 1e-12, "{origin} {expected}");
    }
    // If the rig is placed elsewhere, all of its cameras are translated.
    let pose = pose(&mut random);
    let moved = rig.at_pose(pose).unwrap().cameras().unwrap();
    let step = pose.r.transpose() * rig.body().r;
    let (before, _) = moving.ray(DVec2::new(10.0, 400.0));
    let (after, _) = moved[0].camera.ray(DVec2::new(10.0, 400.0));
    assert!((after - (pose.c + step * before)).length() < 1e-12);
}

#[test]
fn rig_descriptions_round_trip() {
    let mut random = Random(3);
    let rig = Rig::new("pair", pose(&mut random), mounts(&mut random)).unwrap();
    assert_eq!(RigSpec::from_rig(&rig).build(Up::Y, "", &mut NoAssets).unwrap(), rig);
    let track = vec![(0.0, pose(&mut random)), (0.1, pose(&mut random))];
    let motion = ShutterMotion::new(0.02, 0.08, ReadoutDirection::Left, track).unwrap();
    let moving = rig.with_motion(motion).unwrap();
    assert_eq!(RigSpec::from_rig(&moving).build(Up::Z, "", &mut NoAssets).unwrap(), moving);
    for camera in moving.cameras().unwrap() {
        let spec = schema::CameraSpec::from_camera(&camera.camera);
        assert_eq!(spec.build(Up::Y).unwrap(), camera.camera);
    }
}

#[test]
fn body_angles_refer_to_a_body_facing_x() {
    let world = build(
        r#"{"rig": {"name": "car", "location": [5, 0, 1], "yaw": 90, "camera": [
            {"name": "front", "focal": 100, "location": [2, 0, 0]},
            {"name": "back", "focal": 100, "location": [-2, 0.5, 0], "yaw": 180}]}}"#,
    )
    .unwrap();
    let names: Vec<_> = world.cameras.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["car/front", "car/back"]);
    let [front, back] = [0, 1].map(|i| &world.cameras[i].camera);
    assert!((front.c() - DVec3::new(5.0, 2.0, 1.0)).length() < 1e-12);
    assert!((front.forward() - DVec3::Y).length() < 1e-12);
    assert!((back.c() - DVec3::new(4.5, -2.0, 1.0)).length() < 1e-12);
    assert!((back.forward() + DVec3::Y).length() < 1e-12);
    let up_y = build(r#"{"up": "y", "rig": {"camera": {"focal": 100, "location": [0, 0, 0]}}}"#).unwrap();
    assert!((up_y.cameras[0].camera.forward() + DVec3::Z).length() < 1e-12);
    assert!((up_y.cameras[0].camera.r().row(1) + DVec3::Y).length() < 1e-12);
}

#[test]
fn videos_move_rigs_by_keyframes_or_like_the_camera() {
    let text = |keys: &str| {
        format!(
            r#"{{"rig": {{"name": "car", "camera": {{"focal": 100, "location": [1, 0, 0]}}}},
            "video": {{"interpolation": "linear", "seconds": 2, {keys}}}}}"#
        )
    };
    let keys = r#""keyframe": [{"time": 0, "rig": "car", "location": [0, 0, 0], "yaw": 0},
        {"time": 2, "rig": "car", "location": [4, 0, 0], "yaw": 180}]"#;
    for (keys, expected) in [
        (keys, DVec3::new(2.0, 1.0, 0.0)),
        (r#""orbit": {"target": [0, 0, 0], "degrees": 180}"#, DVec3::new(0.0, 1.0, 0.0)),
    ] {
        let world = build(&text(keys)).unwrap();
        let video = world.video.as_ref().unwrap();
        let rig = video.rig_at(&world.rigs[0], Some(0), 1.0).unwrap();
        let camera = &rig.cameras().unwrap()[0].camera;
        assert!((camera.c() - expected).length() < 1e-12, "{}", camera.c());
        assert!((camera.forward() - DVec3::Y).length() < 1e-12);
    }
}

#[test]
fn invalid_rig_values_are_refused() {
    for (json, expected) in [
        (r#"{"rig": {"name": "a"}}"#, "a rig without sensors"),
        (
            r#"{"rig": {"camera": [{"name": "a", "focal": 9, "location": [0, 0, 0]}, {"name": "a", "focal": 9, "location": [1, 0, 0]}]}}"#,
            "must have distinct names",
        ),
        (r#"{"rig": {"camera": [{"name": "a", "focal": 9, "location": [0, 0]}]}}"#, "rig[0].camera[0].location"),
        (
            r#"{"rig": {"R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "camera": {"focal": 9, "location": [0, 0, 0]}}}"#,
            "camera position",
        ),
        (r#"{"video": {"keyframe": {"time": 0, "rig": "car", "yaw": 1}}}"#, "no rig named \"car\""),
    ] {
        let error = build(json).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}
