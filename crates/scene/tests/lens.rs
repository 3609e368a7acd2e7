//! Lenses: project and ray as inverses, and nothing where a model folds over.

mod common;

use common::Random;
use glam::{DMat3, DVec2, DVec3};
use raycam_scene::{Camera, Lens, LensModel, PixelCenter};

/// Every number of coefficients; calibrations of real cameras and some stronger ones.
const LENSES: [(LensModel, &[f64]); 8] = [
    (LensModel::OpenCv, &[-0.28, 0.07, 2e-4, 2e-5]),
    (
        LensModel::OpenCv,
        &[-0.26637, -0.038589, 1.7832e-3, -2.8122e-4, 0.23839],
    ),
    (LensModel::OpenCv, &[0.3, 0.2, -1e-3, 2e-3, 0.1]),
    (
        LensModel::OpenCv,
        &[4.2, 1.9, 1e-4, -2e-4, 0.05, 4.5, 3.4, 0.4],
    ),
    (
        LensModel::OpenCv,
        &[
            -0.2, 0.05, 1e-3, -1e-3, 0.0, 0.01, 0.0, 0.0, 2e-3, -1e-3, -3e-3, 1e-3,
        ],
    ),
    (
        LensModel::OpenCv,
        &[
            -0.2, 0.05, 1e-3, -1e-3, 0.0, 0.01, 0.0, 0.0, 2e-3, -1e-3, -3e-3, 1e-3, 0.05, -0.08,
        ],
    ),
    (LensModel::Fisheye, &[0.0, 0.0, 0.0, 0.0]),
    (LensModel::Fisheye, &[-0.0116, 0.05399, -0.07543, 0.03666]),
];

fn camera(model: LensModel, coefficients: &[f64]) -> Camera {
    let k = DMat3::from_cols(
        DVec3::new(460.0, 0.0, 0.0),
        DVec3::new(3.0, 440.0, 0.0),
        DVec3::new(330.0, 235.0, 1.0),
    );
    let r = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_x(-1.1);
    let c = DVec3::new(1.0, -2.0, 0.5);
    Camera::new(k, r, c, [640, 480], PixelCenter::Integer)
        .unwrap()
        .with_lens(Lens::new(model, coefficients).unwrap())
}

#[test]
fn the_ray_of_a_pixel_projects_to_it() {
    for (model, coefficients) in LENSES {
        let camera = camera(model, coefficients);
        let mut random = Random(5);
        let mut valid = 0;
        for _ in 0..5000 {
            let pixel = DVec2::new(random.between(-300.0, 940.0), random.between(-300.0, 780.0));
            let (origin, direction) = camera.ray(pixel);
            if direction.is_nan() {
                continue;
            }
            valid += 1;
            assert!((direction.length() - 1.0).abs() < 1e-14);
            let (back, seen) = camera.project(origin + random.between(0.1, 50.0) * direction);
            assert!(seen, "{coefficients:?} {pixel}");
            assert!(
                (back - pixel).length() < 1e-9,
                "{coefficients:?} {pixel} {back}"
            );
        }
        assert!(valid > 1000, "{coefficients:?}: {valid} of 5000");
    }
}

#[test]
fn what_has_a_pixel_has_its_ray() {
    for (model, coefficients) in LENSES {
        let camera = camera(model, coefficients);
        let mut random = Random(6);
        for _ in 0..5000 {
            let across = DVec2::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0));
            let local = across.extend(random.between(-1.0, 3.0));
            let (pixel, seen) = camera.project(camera.c() + camera.r().transpose() * local);
            assert_eq!(seen, !pixel.is_nan());
            if seen {
                let direction = camera.r() * camera.ray(pixel).1;
                let off = (direction - local.normalize()).length();
                // Near the fold a pixel hardly says how far from the axis the direction is.
                assert!(off < 1e-6, "{coefficients:?} {local} {off}");
            }
        }
    }
}

#[test]
fn a_lens_ends_where_its_model_folds_over() {
    // r (1 - 0.4 r²) grows up to r = sqrt(1 / 1.2), where it is 2/3 r.
    let camera = camera(LensModel::OpenCv, &[-0.4, 0.0, 0.0, 0.0]);
    let fold = (1.0_f64 / 1.2).sqrt();
    let at = |r: f64| camera.c() + camera.r().transpose() * DVec3::new(0.0, r, 1.0);
    assert!(camera.project(at(0.999_999 * fold)).1);
    assert!(!camera.project(at(1.000_001 * fold)).1);
    let pixel = |r: f64| {
        let image = camera.k() * DVec3::new(0.0, r, 1.0);
        camera.ray(image.truncate()).1
    };
    assert!(!pixel(0.999_999 * 2.0 / 3.0 * fold).is_nan());
    assert!(pixel(1.000_001 * 2.0 / 3.0 * fold).is_nan());
}

#[test]
fn a_fisheye_sees_behind_itself() {
    let camera = camera(LensModel::Fisheye, &[0.0; 4]);
    let behind = DVec3::new(0.0, 1.0, -1.0);
    let (pixel, seen) = camera.project(camera.c() + camera.r().transpose() * behind);
    assert!(seen);
    let radius = (pixel.y - 235.0) / 440.0;
    assert!((radius - 3.0 * std::f64::consts::FRAC_PI_4).abs() < 1e-13);
}

#[test]
fn no_lens_changes_nothing() {
    let lens = Lens::new(LensModel::OpenCv, &[0.0; 5]).unwrap();
    assert_eq!(lens, Lens::Pinhole);
    for (model, wrong) in [
        (LensModel::OpenCv, &[0.1; 3][..]),
        (LensModel::OpenCv, &[0.1; 6]),
        (LensModel::Fisheye, &[0.1; 5]),
        (LensModel::OpenCv, &[f64::NAN; 4]),
        (LensModel::OpenCv, &[2.0; 14]),
    ] {
        assert!(Lens::new(model, wrong).is_err(), "{wrong:?}");
    }
}
