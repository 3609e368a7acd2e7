//! Cameras that move while their shutter is open.

use crate::common::{Random, rotation};
use glam::{DMat3, DVec2, DVec3};
use raycam_scene::camera::{Pose, ReadoutDirection, ShutterMotion};
use raycam_scene::{Camera, Lens, LensModel, PixelCenter};

const SIZE: [u32; 2] = [640, 480];

fn still() -> Camera {
    let k = DMat3::from_cols(DVec3::new(500.0, 0.0, 0.0), DVec3::new(2.0, 510.0, 0.0), DVec3::new(320.0, 240.0, 1.0));
    Camera::new(k, DMat3::IDENTITY, DVec3::ZERO, SIZE, PixelCenter::Integer).unwrap()
}

fn poses(turn: f64) -> Vec<(f64, Pose)> {
    let end = Pose { r: DMat3::from_rotation_y(turn), c: DVec3::new(0.3, -0.1, 0.5) };
    let start = Pose { r: DMat3::IDENTITY, c: DVec3::ZERO };
    vec![(0.0, start), (0.04, end)]
}

#[test]
fn poses_are_interpolated_at_constant_speed() {
    let motion = ShutterMotion::new(0.0, 0.04, ReadoutDirection::Down, poses(0.8)).unwrap();
    for s in [0.0, 0.25, 0.5, 0.9, 1.0] {
        let pose = motion.pose_at(0.04 * s);
        let expected = DMat3::from_rotation_y(0.8 * s);
        assert!((pose.r - expected).to_cols_array().iter().all(|v| v.abs() < 1e-14));
        assert!((pose.c - s * DVec3::new(0.3, -0.1, 0.5)).length() < 1e-15);
    }
    assert_eq!(motion.pose_at(-1.0), motion.pose_at(0.0));
    assert_eq!(motion.pose_at(9.0), motion.pose_at(0.04));
    let camera = still().with_motion(motion.clone()).unwrap();
    assert_eq!((camera.r(), camera.c()), (motion.mid_exposure_pose().r, motion.mid_exposure_pose().c));
}

#[test]
fn rolling_shutter_rows_use_the_pose_at_their_time() {
    for (direction, line) in [
        (ReadoutDirection::Down, (100.0 + 0.5) / 480.0),
        (ReadoutDirection::Up, 1.0 - (100.0 + 0.5) / 480.0),
        (ReadoutDirection::Right, (30.0 + 0.5) / 640.0),
        (ReadoutDirection::Left, 1.0 - (30.0 + 0.5) / 640.0),
    ] {
        let motion = ShutterMotion::new(0.01, 0.03, direction, poses(0.2)).unwrap();
        let camera = still().with_motion(motion.clone()).unwrap();
        let pose = motion.pose_at(line * 0.03 + 0.005);
        let there = still().at_pose(pose.r, pose.c).unwrap();
        let pixel = DVec2::new(30.0, 100.0);
        let ((origin, ray), (there_origin, there_ray)) = (camera.ray(pixel), there.ray(pixel));
        assert!((origin - there_origin).length() + (ray - there_ray).length() < 1e-14);
        let early = camera.generate_ray(pixel, [0.5; 2], 0.0);
        assert!((early.origin - motion.pose_at(line * 0.03).c).length() < 1e-14);
    }
}

#[test]
fn project_finds_the_row_that_shows_a_point() {
    let fisheye = Lens::new(LensModel::Fisheye, &[0.0; 4]).unwrap();
    for (turn, lens) in [(0.2, Lens::Pinhole), (-1.0, Lens::Pinhole), (0.5, fisheye)] {
        for direction in [ReadoutDirection::Down, ReadoutDirection::Up, ReadoutDirection::Right, ReadoutDirection::Left]
        {
            let motion = ShutterMotion::new(0.01, 0.03, direction, poses(turn)).unwrap();
            let camera = still().with_lens(lens.clone()).unwrap().with_motion(motion).unwrap();
            let mut random = Random(7);
            for _ in 0..500 {
                let pixel = DVec2::new(random.between(0.0, 639.0), random.between(0.0, 479.0));
                let (origin, ray) = camera.ray(pixel);
                let (found, seen) = camera.project(origin + random.between(2.0, 40.0) * ray);
                assert!(seen);
                // If a camera rotates against the readout direction, it may show a point twice; either pixel is valid.
                if (found - pixel).length() > 1e-8 {
                    let again = camera.ray(found);
                    assert!(turn < 0.0 || direction != ReadoutDirection::Down, "{found} {pixel} {again:?}");
                }
            }
        }
    }
}

#[test]
fn moved_cameras_keep_their_motion() {
    let mut random = Random(9);
    let motion = ShutterMotion::new(0.01, 0.03, ReadoutDirection::Down, poses(0.3)).unwrap();
    let camera = still().with_motion(motion).unwrap();
    let r = rotation(&mut random);
    let there = camera.at_pose(r, DVec3::new(5.0, 6.0, 7.0)).unwrap();
    // Relative to the camera's pose in the middle of the motion, the rays are unchanged.
    for pixel in [DVec2::new(3.0, 9.0), DVec2::new(600.0, 400.0)] {
        let (a, b) = (camera.ray(pixel), there.ray(pixel));
        let local =
            |camera: &Camera, (origin, ray): (DVec3, DVec3)| (camera.r() * (origin - camera.c()), camera.r() * ray);
        let (a, b) = (local(&camera, a), local(&there, b));
        assert!((a.0 - b.0).length() + (a.1 - b.1).length() < 1e-13);
    }
}

#[test]
fn invalid_motions_are_refused() {
    let pose = poses(0.1)[0].1;
    let fails = |exposure, readout, poses| ShutterMotion::new(exposure, readout, ReadoutDirection::Down, poses);
    assert!(fails(-1.0, 0.0, poses(0.1)).is_err());
    assert!(fails(0.0, f64::NAN, poses(0.1)).is_err());
    assert!(fails(0.0, 0.1, vec![]).is_err());
    assert!(fails(0.0, 0.1, vec![(1.0, pose), (1.0, pose)]).is_err());
    let skewed = Pose { r: DMat3::from_diagonal(DVec3::new(1.0, 2.0, 1.0)), ..pose };
    let motion = fails(0.0, 0.1, vec![(0.0, pose), (1.0, skewed)]).unwrap();
    assert!(still().with_motion(motion).is_err());
}
