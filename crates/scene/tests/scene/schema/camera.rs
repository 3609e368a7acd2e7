//! Cameras in descriptions.

use glam::DVec3;
use raycam_scene::PixelCenter;

use crate::schema::described::{assert_error, camera};

#[test]
fn cameras_require_one_set_of_intrinsics_and_one_pose() {
    let k = r#""K": [[500, 2, 300], [0, 510, 200], [0, 0, 1]]"#;
    let r = r#""R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"#;
    let here = r#""location": [0, 0, 0]"#;
    let world = camera(&format!(r#"{k}, {r}, "t": [1, 2, 3], "pixel_center": "half""#)).unwrap();
    let built = &world.cameras[0].camera;
    assert_eq!((built.k().y_axis.x, built.c()), (2.0, DVec3::new(-1.0, -2.0, -3.0)));
    assert_eq!(built.pixel_center(), PixelCenter::Half);
    let world = camera(&format!(r#""focal": [500, 400], "skew": 3, "principal_point": [5, 6], {here}"#)).unwrap();
    let k_built = world.cameras[0].camera.k();
    assert_eq!(k_built.to_cols_array(), [500.0, 0.0, 0.0, 3.0, 400.0, 0.0, 5.0, 6.0, 1.0]);
    let world = camera(r#""matrix": [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 2]]"#).unwrap();
    assert_eq!(world.cameras[0].camera.c(), -DVec3::Z);
    let world = camera(r#""fov": 60, "location": [0, -5, 0], "target": [0, 0, 0]"#).unwrap();
    assert!((world.cameras[0].camera.forward() - DVec3::Y).length() < 1e-15);

    let fails = |json: &str, expected: &str| assert_error(camera(json), expected);
    fails(here, "camera[0]: no intrinsics given; expected one of focal, fov, K, height, matrix");
    fails(
        &format!(r#""focal": 5, "fov": 5, {here}"#),
        "camera[0].fov: cannot be combined with \"focal\"; expected only one of the keys for the intrinsics: \
         focal, fov, K, height, matrix",
    );
    fails(
        &format!(r#"{k}, "skew": 1, {here}"#),
        r#"camera[0].skew: cannot be combined with "K", which already contains it; use only one of them"#,
    );
    fails(
        r#""focal": 5"#,
        "camera[0]: no pose; expected location with roll, pitch, yaw or target, or R with C or t, or matrix",
    );
    fails(&format!(r#"{k}, {r}"#), "camera[0]: no camera position given; expected one of C, t");
    fails(
        &format!(r#"{k}, {r}, "C": [0, 0, 0], "yaw": 3"#),
        r#"camera[0].yaw: cannot be combined with "R"; use R with only C or t"#,
    );
    fails(
        &format!(r#"{k}, "C": [0, 0, 0]"#),
        r#"camera[0].C: requires "R" (with angles or a target, use "location"), which is missing"#,
    );
    fails(
        &format!(r#""focal": 5, {here}, "target": [1, 0, 0], "yaw": 3"#),
        r#"camera[0].yaw: cannot be combined with "target"; use either angles or a target"#,
    );
    fails(
        &format!(r#""focal": 5, {here}, "up": [1, 0, 0]"#),
        r#"camera[0].up: requires "target", which is missing; with angles, use roll to tilt the camera"#,
    );
    fails(
        &format!(r#""fov": 200, {here}"#),
        "camera[0].fov: the vertical field of view is 200; expected degrees greater than 0 and less than 180",
    );
    fails(
        r#""matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]]"#,
        "camera[0].matrix: P = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]] has rank 2; a camera matrix must have rank 3",
    );
    fails(
        r#""matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]], "fov": 3"#,
        r#"camera[0].fov: cannot be combined with "matrix", which already contains it; use only one of them"#,
    );
}
