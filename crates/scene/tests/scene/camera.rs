//! Cameras: every finite P, every pose, and project and ray as inverses.

use crate::common::{Random, rotation};
use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};
use raycam_scene::camera::{Aperture, intrinsics_from_focal, intrinsics_from_fov, nearest_rotation};
use raycam_scene::{Camera, Lens, LensModel, PixelCenter, SceneError, Up};

const SIZE: [u32; 2] = [640, 480];

fn camera(random: &mut Random) -> Camera {
    let (fx, fy) = (random.between(50.0, 5000.0), random.between(50.0, 5000.0));
    let (skew, cx, cy) = (random.between(-50.0, 50.0), random.between(-900.0, 900.0), random.between(-900.0, 900.0));
    let k = DMat3::from_cols(DVec3::new(fx, 0.0, 0.0), DVec3::new(skew, fy, 0.0), DVec3::new(cx, cy, 1.0));
    let c = DVec3::from_array(std::array::from_fn(|_| random.between(-20.0, 20.0)));
    Camera::new(k, rotation(random), c, SIZE, PixelCenter::Integer).unwrap()
}

fn distance(a: DMat3, b: DMat3) -> f64 {
    (a - b).to_cols_array().into_iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

fn message(result: Result<Camera, SceneError>) -> String {
    result.expect_err("an error").to_string()
}

#[test]
fn camera_matrices_of_any_scale_and_sign_are_decomposed() {
    let mut random = Random(1);
    for _ in 0..1000 {
        let camera = camera(&mut random);
        for scale in [1.0, -1.0, 1e-9, -3.7e12, 1e-200, -1e200] {
            let p = camera.p().map(|row| row.map(|v| v * scale));
            let found = Camera::from_matrix(p, SIZE, PixelCenter::Integer).unwrap();
            assert!(distance(found.k(), camera.k()) < 1e-9, "{} {}", found.k(), camera.k());
            assert!(distance(found.r(), camera.r()) < 1e-12);
            assert!((found.c() - camera.c()).length() < 1e-10);
            assert!((found.forward() - camera.forward()).length() < 1e-12);
        }
    }
}

#[test]
fn ill_conditioned_camera_matrices_keep_their_digits() {
    let mut random = Random(2);
    for _ in 0..300 {
        let m = rotation(&mut random) * DMat3::from_diagonal(DVec3::new(1.0, 1e-3, 1e-8)) * rotation(&mut random);
        let column: [f64; 3] = std::array::from_fn(|_| random.between(-1.0, 1.0));
        let given = [0, 1, 2].map(|i| [m.row(i).x, m.row(i).y, m.row(i).z, column[i]]);
        let camera = Camera::from_matrix(given, SIZE, PixelCenter::Half).unwrap();
        let p = camera.p();
        // The matrices are compared as directions in twelve dimensions, so that scale and sign do not matter.
        let dot = |a: &[[f64; 4]; 3], b: &[[f64; 4]; 3]| -> f64 {
            a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
        };
        let scale = dot(&p, &given) / dot(&given, &given);
        let largest = p.as_flattened().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for (found, given) in p.as_flattened().iter().zip(given.as_flattened()) {
            assert!((found - scale * given).abs() <= 1e-12 * largest, "{p:?}");
        }
        // K R equals M up to scale, and R is a rotation for any condition number.
        let kr = camera.k() * camera.r();
        for (i, row) in p.iter().enumerate() {
            let row = DVec3::from_slice(&row[..3]);
            assert!((kr.row(i) - row).length() <= 1e-13 * row.length().max(kr.row(i).length()));
        }
        assert!(distance(camera.r() * camera.r().transpose(), DMat3::IDENTITY) < 1e-15 * 8.0);
        assert!((camera.r().determinant() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn project_and_ray_are_inverses() {
    let mut random = Random(3);
    for _ in 0..300 {
        let camera = camera(&mut random);
        for _ in 0..30 {
            let pixel = DVec2::new(random.between(-100.0, 740.0), random.between(-100.0, 580.0));
            let (origin, direction) = camera.ray(pixel);
            assert_eq!(origin, camera.c());
            assert!((direction.length() - 1.0).abs() < 1e-15 && direction.dot(camera.forward()) > 0.0);
            for t in [0.01, 1.0, 1e6] {
                let (back, in_front) = camera.project(origin + t * direction);
                // The point itself has the rounding error of world coordinates, which the tolerance includes.
                let rounding = camera.c().length() / t.min(1.0) * 1e-15 * camera.k().x_axis.x.max(camera.k().y_axis.y);
                let steepness = 1.0 / direction.dot(camera.forward()).powi(2);
                assert!((back - pixel).length() < 1e-12 * 1000.0 + 8.0 * rounding * steepness, "{back} {pixel}");
                assert!(in_front);
                assert!(!camera.project(origin - t * direction).1);
            }
        }
    }
}

#[test]
fn batched_rays_equal_single_rays() {
    let mut random = Random(4);
    for round in 0..60 {
        let mut camera = camera(&mut random);
        if round % 3 == 0 {
            let (k, r, c) = (camera.k(), camera.r(), camera.c());
            camera = Camera::orthographic(k, r, c, SIZE, PixelCenter::Half).unwrap();
        }
        let pixels: Vec<DVec2> =
            (0..40).map(|i| DVec2::new(random.between(-9.0, 649.0), f64::from(i / 8 * 7 % 5) / 4.0)).collect();
        let mut rays = vec![];
        camera.rays(pixels.iter().copied(), |ray| rays.push(ray));
        let bits = |v: DVec3| v.to_array().map(f64::to_bits);
        for (pixel, (origin, direction)) in pixels.iter().zip(&rays) {
            let (start, along) = camera.ray(*pixel);
            assert_eq!(bits(*origin), bits(start));
            assert_eq!(bits(*direction), bits(along));
        }
        assert_eq!(rays.len(), pixels.len());
    }
}

#[test]
fn pinholes_have_the_rays_of_their_camera() {
    let mut random = Random(5);
    for _ in 0..300 {
        let camera = camera(&mut random);
        let pinhole = camera.pinhole().unwrap();
        let pixel = DVec2::new(random.between(-100.0, 740.0), random.between(-100.0, 580.0));
        let sample = camera.generate_ray(pixel, [0.1, 0.9], 0.3);
        assert_eq!(sample.origin, pinhole.center);
        assert_eq!(sample.direction, pinhole.direction(pixel));
    }
    let camera = camera(&mut random);
    let lens = Aperture::new(0.1, 2.0, 0, 0.0).unwrap();
    let open = camera.clone().with_aperture(Some(lens)).unwrap();
    assert!(open.pinhole().is_none());
    let equidistant = Lens::new(LensModel::Fisheye, &[0.0; 4]).unwrap();
    assert!(camera.with_lens(equidistant).unwrap().pinhole().is_none());
}

#[test]
fn forward_direction_matches_the_lecture() {
    let mut random = Random(4);
    for _ in 0..200 {
        let camera = camera(&mut random);
        let scale = random.between(-5.0, 5.0);
        let p = camera.p().map(|row| row.map(|v| v * scale));
        let m = DMat3::from_cols_array_2d(&p.map(|row| [row[0], row[1], row[2]])).transpose();
        let lecture = m.determinant().signum() * m.row(2).normalize();
        let found = Camera::from_matrix(p, SIZE, PixelCenter::Integer).unwrap();
        assert!((found.forward() - lecture).length() < 1e-12);
    }
}

#[test]
fn roll_pitch_yaw_round_trip() {
    let mut random = Random(5);
    let k = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    for up in [Up::Z, Up::Y] {
        for _ in 0..500 {
            let angles = [random.between(-180.0, 180.0), random.between(-89.9, 89.9), random.between(-180.0, 180.0)];
            let [roll, pitch, yaw] = angles;
            let camera = Camera::from_pose(DVec3::ONE, roll, pitch, yaw, up, k, SIZE, PixelCenter::Integer).unwrap();
            for (found, given) in camera.roll_pitch_yaw(up).into_iter().zip(angles) {
                assert!((found - given).abs() < 1e-9, "{found} {given}");
            }
        }
    }
}

#[test]
fn zero_angles_look_ahead_and_signs_follow_the_conventions() {
    let k = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    let pose = |roll, pitch, yaw, up| {
        Camera::from_pose(DVec3::ZERO, roll, pitch, yaw, up, k, SIZE, PixelCenter::Integer).unwrap()
    };
    for (up, forward, left) in [(Up::Z, DVec3::X, DVec3::Y), (Up::Y, -DVec3::Z, -DVec3::X)] {
        let zero = pose(0.0, 0.0, 0.0, up);
        assert_eq!(zero.forward(), forward);
        assert_eq!(-zero.r().row(1), up.axis(), "up in the image is the world's up axis");
        assert_eq!(-zero.r().row(0), left);
        assert_eq!(pose(0.0, 0.0, 90.0, up).forward(), left, "positive yaw turns left");
        assert_eq!(pose(0.0, 90.0, 0.0, up).forward(), -up.axis(), "positive pitch looks down");
        // Positive roll tilts to the right: the image's former up direction now points to the right of the world's up.
        assert_eq!(-pose(90.0, 0.0, 0.0, up).r().row(1), -left);
    }
}

#[test]
fn straight_down_views_have_zero_roll() {
    let k = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    for pitch in [90.0, -90.0] {
        let given = Camera::from_pose(DVec3::ZERO, 20.0, pitch, 50.0, Up::Z, k, SIZE, PixelCenter::Integer).unwrap();
        let [roll, found, yaw] = given.roll_pitch_yaw(Up::Z);
        assert_eq!(roll, 0.0);
        assert!((found - pitch).abs() < 1e-9);
        let again = Camera::from_pose(DVec3::ZERO, roll, found, yaw, Up::Z, k, SIZE, PixelCenter::Integer).unwrap();
        assert!(distance(again.r(), given.r()) < 1e-12);
    }
}

#[test]
fn look_at_shows_the_target_at_the_principal_point_and_up_pointing_upwards() {
    let mut random = Random(6);
    let k = DMat3::from_cols(DVec3::new(700.0, 0.0, 0.0), DVec3::new(3.0, 650.0, 0.0), DVec3::new(11.0, 22.0, 1.0));
    for _ in 0..200 {
        let [eye, target] = [0, 1].map(|_| DVec3::from_array(std::array::from_fn(|_| random.between(-5.0, 5.0))));
        let camera = Camera::look_at(eye, target, DVec3::Z, k, SIZE, PixelCenter::Half).unwrap();
        let (pixel, in_front) = camera.project(target);
        assert!((pixel - DVec2::new(11.0, 22.0)).length() < 1e-9 && in_front);
        assert!(camera.project(target + 1e-3 * DVec3::Z).0.y < 22.0);
        assert!(camera.r().row(0).z.abs() < 1e-12, "no roll");
    }
    let look = |eye, target, up| message(Camera::look_at(eye, target, up, k, SIZE, PixelCenter::Half));
    assert!(look(DVec3::ZERO, DVec3::Z * 3.0, DVec3::Z).contains("parallel to the viewing direction"));
    assert!(look(DVec3::ZERO, DVec3::X, DVec3::ZERO).contains("up [0, 0, 0] is zero or parallel"));
    assert!(look(DVec3::ONE, DVec3::ONE, DVec3::Z).contains("two different finite points"));
}

#[test]
fn opencv_and_opengl_poses_give_the_same_camera() {
    let mut random = Random(7);
    for _ in 0..100 {
        let camera = camera(&mut random);
        let rvec = DQuat::from_mat3(&camera.r()).to_scaled_axis();
        let cv = Camera::from_opencv(camera.k(), rvec, camera.t(), SIZE, PixelCenter::Integer).unwrap();
        let world_from_camera = camera.r().transpose();
        let gl = DMat4::from_cols(
            world_from_camera.x_axis.extend(0.0),
            (-world_from_camera.y_axis).extend(0.0),
            (-world_from_camera.z_axis).extend(0.0),
            camera.c().extend(1.0),
        );
        let gl_camera = Camera::from_opengl(camera.k(), gl, SIZE, PixelCenter::Integer).unwrap();
        for other in [cv, gl_camera] {
            assert!(distance(other.r(), camera.r()) < 1e-12);
            assert!((other.c() - camera.c()).length() < 1e-11);
        }
    }
    let k = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    let transposed = DMat4::from_translation(DVec3::X).transpose();
    assert!(message(Camera::from_opengl(k, transposed, SIZE, PixelCenter::Half)).contains("is the matrix transposed?"));
}

#[test]
fn default_principal_point_is_the_image_centre() {
    let integer = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    assert_eq!([integer.z_axis.x, integer.z_axis.y], [319.5, 239.5]);
    let half = intrinsics_from_fov(90.0, SIZE, PixelCenter::Half).unwrap();
    assert_eq!([half.z_axis.x, half.z_axis.y], [320.0, 240.0]);
    assert!((half.y_axis.y - 240.0).abs() < 1e-12 && half.x_axis.x == half.y_axis.y);
    for fov in [0.0, 180.0, -3.0, f64::NAN] {
        assert!(intrinsics_from_fov(fov, SIZE, PixelCenter::Half).is_err());
    }
    let camera = Camera::new(half, DMat3::IDENTITY, DVec3::ZERO, SIZE, PixelCenter::Half).unwrap();
    assert_eq!(camera.pixel_center_of(3, 4), DVec2::new(3.5, 4.5));
}

#[test]
fn homogeneous_intrinsics_are_normalised() {
    let k = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    let camera = Camera::new(k * -2.0, DMat3::IDENTITY, DVec3::ZERO, SIZE, PixelCenter::Integer).unwrap();
    assert_eq!(camera.k(), k);
}

#[test]
fn rotations_rounded_in_text_become_the_nearest_rotation() {
    let mut random = Random(8);
    let k = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    for _ in 0..50 {
        let exact = rotation(&mut random);
        let rounded = DMat3::from_cols_array(&exact.to_cols_array().map(|v| (v * 1e7).round() / 1e7));
        let camera = Camera::new(k, rounded, DVec3::ZERO, SIZE, PixelCenter::Integer).unwrap();
        assert!(distance(camera.r() * camera.r().transpose(), DMat3::IDENTITY) < 4e-15);
        assert!(distance(camera.r(), exact) < 1e-7);
    }
}

#[test]
fn nearest_rotation_commutes_with_the_transpose_up_to_the_tolerance() {
    let mut random = Random(9);
    for digits in [1e3, 1e4, 1e6] {
        for _ in 0..50 {
            let exact = rotation(&mut random);
            let rounded = DMat3::from_cols_array(&exact.to_cols_array().map(|v| (v * digits).round() / digits));
            let (forth, off) = nearest_rotation(rounded).unwrap();
            let (back, same) = nearest_rotation(rounded.transpose()).unwrap();
            assert!(distance(forth, back.transpose()) < 1e-14 && (off - same).abs() < 1e-14);
            assert!(distance(forth * forth.transpose(), DMat3::IDENTITY) < 4e-15);
            assert!(off <= 1.0 / digits && distance(forth, exact) < 2.0 / digits);
        }
    }
}

#[test]
fn invalid_cameras_are_refused_with_a_reason() {
    let k = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    let new = |k, r, size| message(Camera::new(k, r, DVec3::ZERO, size, PixelCenter::Integer));
    let mut scaled = DMat3::IDENTITY;
    scaled.x_axis.x = 1.002;
    assert!(new(k, scaled, SIZE).contains("differs from the identity by 4.004e-3"));
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    assert!(new(k, mirror, SIZE).contains("a reflection (determinant -1)"));
    assert!(new(k.transpose(), DMat3::IDENTITY, SIZE).contains("upper triangular"));
    assert!(new(DMat3::ZERO, DMat3::IDENTITY, SIZE).contains("K[2][2] must not be 0"));
    assert!(new(intrinsics_from_focal(0.0, SIZE, PixelCenter::Half), DMat3::IDENTITY, SIZE).contains("not invertible"));
    assert!(
        new(intrinsics_from_focal(-5.0, SIZE, PixelCenter::Half), DMat3::IDENTITY, SIZE)
            .contains("a negative focal length mirrors the image")
    );
    assert!(new(k * f64::NAN, DMat3::IDENTITY, SIZE).contains("must be finite"));
    assert!(new(k, DMat3::IDENTITY, [0, 480]).contains("0 x 480"));
    assert!(new(k, DMat3::IDENTITY, [65_537, 1]).contains("1 to 65536"));
    assert!(new(k, DMat3::IDENTITY, [65_536, 65_536]).contains("limit 268435456"));
    let centre = Camera::new(k, DMat3::IDENTITY, DVec3::new(0.0, f64::INFINITY, 0.0), SIZE, PixelCenter::Half);
    assert!(message(centre).contains("not finite"));

    let matrix = |p| message(Camera::from_matrix(p, SIZE, PixelCenter::Integer));
    let row = [1.0, 2.0, 3.0, 4.0];
    assert!(matrix([row, row.map(|v| 2.0 * v), [0.0, 0.0, 1.0, 0.0]]).contains("has rank 2"));
    assert!(matrix([[0.0; 4]; 3]).contains("has rank 0"));
    assert!(matrix([row, row, row]).contains("has rank 1"));
    let mut not_finite = [row, row, [0.0, 0.0, 0.0, 1.0]];
    not_finite[2][0] = f64::NAN;
    assert!(matrix(not_finite).contains("must be finite"));
}

#[test]
fn points_behind_the_camera_are_not_projected() {
    let k = intrinsics_from_focal(500.0, SIZE, PixelCenter::Integer);
    let camera = Camera::new(k, DMat3::IDENTITY, DVec3::ZERO, SIZE, PixelCenter::Integer).unwrap();
    assert!(camera.project(DVec3::new(0.1, 0.1, 1.0)).1);
    let (pixel, in_front) = camera.project(DVec3::new(0.1, 0.1, -1.0));
    assert!(!in_front && pixel.is_finite());
    let (pixel, in_front) = camera.project(DVec3::new(1.0, 1.0, 0.0));
    assert!(!in_front && !pixel.is_finite());
}
