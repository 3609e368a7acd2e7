//! Cameras with their centre at infinity: affine, orthographic, and any other matrix of rank 3.

use crate::common::{Random, rotation};
use glam::{DMat3, DVec2, DVec3, DVec4};
use raycam_scene::camera::Center;
use raycam_scene::{Camera, Lens, LensModel, PixelCenter};

const SIZE: [u32; 2] = [640, 480];

fn matrix(random: &mut Random) -> [[f64; 4]; 3] {
    [0, 1, 2].map(|_| [0, 1, 2, 3].map(|_| random.between(-5.0, 5.0)))
}

/// Pixel of a point, computed from P.
fn through(p: [[f64; 4]; 3], point: DVec3) -> DVec2 {
    let x = p.map(|row| DVec4::from_array(row).dot(point.extend(1.0)));
    DVec2::new(x[0] / x[2], x[1] / x[2])
}

fn check(p: [[f64; 4]; 3], random: &mut Random) -> Camera {
    let camera = Camera::from_matrix(p, SIZE, PixelCenter::Integer).unwrap();
    assert_eq!(camera.center(), Center::Infinity);
    let forward = camera.forward();
    for row in p {
        assert!(DVec3::new(row[0], row[1], row[2]).dot(forward).abs() < 1e-12);
    }
    let r = camera.r();
    assert!((r.determinant() - 1.0).abs() < 1e-12);
    for _ in 0..100 {
        let point = DVec3::from_array([0, 1, 2].map(|_| random.between(-9.0, 9.0)));
        let expected = through(p, point);
        let (pixel, seen) = camera.project(point);
        let scale = 1.0 + expected.length();
        assert!(seen);
        // Near the plane that maps to infinity, both the pixel and the expected value lose precision.
        assert!((pixel - expected).length() < 1e-9 * scale * scale, "{pixel} {expected}");
        let (origin, direction) = camera.ray(pixel);
        assert!((direction - forward).length() < 1e-14);
        assert!((point - origin).cross(direction).length() < 1e-9 * scale);
        let (back, _) = camera.project(origin - 7.3 * direction);
        assert!((back - pixel).length() < 1e-9 * scale * scale);
    }
    camera
}

#[test]
fn affine_matrices_are_valid_cameras() {
    let mut random = Random(1);
    for scale in [1.0, -3.0, 1e-30] {
        for _ in 0..200 {
            let mut p = matrix(&mut random);
            p[2] = [0.0, 0.0, 0.0, random.between(0.5, 2.0)];
            let p = p.map(|row| row.map(|v| v * scale));
            let scaled = p.map(|row| row.map(|v| v / scale));
            let camera = check(scaled, &mut random);
            assert_eq!(camera.k().row(2), DVec3::Z);
            assert!(camera.k().x_axis.x > 0.0 && camera.k().y_axis.y > 0.0);
            assert_eq!(camera.k().x_axis.y, 0.0);
            assert_eq!(camera.p()[2], [0.0, 0.0, 0.0, 1.0]);
            let same = Camera::from_matrix(p, SIZE, PixelCenter::Integer).unwrap();
            let point = DVec3::new(1.0, 2.0, 3.0);
            let off = same.project(point).0 - camera.project(point).0;
            assert!(off.length() < 1e-10);
        }
    }
}

#[test]
fn matrices_with_a_singular_left_part_are_valid_cameras() {
    let mut random = Random(2);
    for _ in 0..200 {
        let mut p = matrix(&mut random);
        let (a, b) = (random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        let rows = p;
        for (column, value) in p[2].iter_mut().take(3).enumerate() {
            *value = a * rows[0][column] + b * rows[1][column];
        }
        check(p, &mut random);
    }
}

#[test]
fn orthographic_rays_start_on_a_plane() {
    let mut random = Random(3);
    for _ in 0..200 {
        let k = DMat3::from_cols(
            DVec3::new(random.between(10.0, 90.0), 0.0, 0.0),
            DVec3::new(random.between(-3.0, 3.0), 70.0, 0.0),
            DVec3::new(320.0, 240.0, 1.0),
        );
        let (r, c) = (rotation(&mut random), DVec3::new(1e6, -2e6, 3e6));
        let camera = Camera::orthographic(k, r, c, SIZE, PixelCenter::Half).unwrap();
        let pixel = DVec2::new(random.between(0.0, 640.0), random.between(0.0, 480.0));
        let (origin, direction) = camera.ray(pixel);
        assert!((origin - c).dot(direction).abs() < 1e-8);
        for (along, expected) in [(3.0, true), (-3.0, false)] {
            let (back, seen) = camera.project(origin + along * direction);
            assert_eq!(seen, expected);
            assert!((back - pixel).length() < 1e-6);
        }
        let (back, _) = camera.project(c);
        assert!((back - DVec2::new(320.0, 240.0)).length() < 1e-12);
        let p = Camera::from_matrix(camera.p(), SIZE, PixelCenter::Half).unwrap();
        assert!((p.r() - r).to_cols_array().iter().all(|v| v.abs() < 1e-12));
    }
}

#[test]
fn orthographic_camera_with_a_lens_model_returns_an_error() {
    let k = DMat3::from_diagonal(DVec3::new(50.0, 50.0, 1.0));
    let camera = Camera::orthographic(k, DMat3::IDENTITY, DVec3::ZERO, SIZE, PixelCenter::Half).unwrap();
    let lens = Lens::new(LensModel::Fisheye, &[0.0; 4]).unwrap();
    let error = camera.with_lens(lens).unwrap_err();
    assert!(error.to_string().contains("parallel rays"), "{error}");
}

#[test]
fn rays_from_infinity_start_in_front_of_the_world() {
    let p = [[2.0, 0.0, 0.0, 5.0], [0.0, 2.0, 0.0, 6.0], [0.0, 0.0, 0.0, 1.0]];
    let camera = Camera::from_matrix(p, SIZE, PixelCenter::Integer).unwrap();
    let center = DVec3::new(10.0, 20.0, -1e5);
    let before = camera.with_ray_origins_outside(center, 30.0);
    let (origin, direction) = before.ray(DVec2::new(3.0, 4.0));
    assert!((center - origin).dot(direction) > 30.0);
    assert_eq!(origin.z, before.ray_start_depth());
    assert_eq!(origin.truncate(), camera.ray(DVec2::new(3.0, 4.0)).0.truncate());
}
