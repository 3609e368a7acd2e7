//! Lenses: project and ray as inverses, and no projection beyond the angle up to which a model is one-to-one.

use crate::common::Random;
use glam::{DMat3, DVec2, DVec3};
use raycam_scene::{Camera, Lens, LensModel, PixelCenter};

/// Lenses with every valid number of coefficients: calibrations of real cameras, and some lenses with stronger
/// distortion.
const LENSES: [(LensModel, &[f64]); 27] = [
    (LensModel::OpenCv, &[-0.28, 0.07, 2e-4, 2e-5]),
    (LensModel::OpenCv, &[-0.26637, -0.038589, 1.7832e-3, -2.8122e-4, 0.23839]),
    (LensModel::OpenCv, &[0.3, 0.2, -1e-3, 2e-3, 0.1]),
    (LensModel::OpenCv, &[4.2, 1.9, 1e-4, -2e-4, 0.05, 4.5, 3.4, 0.4]),
    (LensModel::OpenCv, &[-0.2, 0.05, 1e-3, -1e-3, 0.0, 0.01, 0.0, 0.0, 2e-3, -1e-3, -3e-3, 1e-3]),
    (LensModel::OpenCv, &[-0.2, 0.05, 1e-3, -1e-3, 0.0, 0.01, 0.0, 0.0, 2e-3, -1e-3, -3e-3, 1e-3, 0.05, -0.08]),
    (LensModel::Fisheye, &[0.0, 0.0, 0.0, 0.0]),
    (LensModel::Fisheye, &[-0.0116, 0.05399, -0.07543, 0.03666]),
    (LensModel::ThinPrismFisheye, &[-0.03, 0.01, 1e-3, -2e-3, -0.002, 1e-4, 3e-3, -1e-3]),
    (LensModel::RadTanThinPrismFisheye, &[0.24, -0.19, 0.06, -0.006, 2e-4, 0.0, 4e-4, -3e-4, 1e-3, -1e-4, 2e-4, 1e-4]),
    (LensModel::Fov, &[0.9]),
    (LensModel::Fov, &[2.5]),
    (LensModel::Division, &[0.3]),
    (LensModel::Division, &[-0.4]),
    (LensModel::Omni, &[0.0]),
    (LensModel::Omni, &[0.7]),
    (LensModel::Omni, &[1.0]),
    (LensModel::Omni, &[2.2]),
    (LensModel::Omni, &[1.3, -0.2, 0.05, 1e-3, -2e-3]),
    (LensModel::Omni, &[0.8, 0.1, 0.02, -1e-3, 2e-3]),
    (LensModel::Eucm, &[0.4, 1.2]),
    (LensModel::Eucm, &[0.63, 1.04]),
    (LensModel::DoubleSphere, &[-0.2, 0.59]),
    (LensModel::DoubleSphere, &[0.3, 0.4]),
    (LensModel::DoubleSphere, &[-0.27, 0.55]),
    (LensModel::Equirectangular, &[]),
    (LensModel::Cylindrical, &[]),
];

fn camera(model: LensModel, coefficients: &[f64]) -> Camera {
    let k = DMat3::from_cols(DVec3::new(460.0, 0.0, 0.0), DVec3::new(3.0, 440.0, 0.0), DVec3::new(330.0, 235.0, 1.0));
    let r = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_x(-1.1);
    let c = DVec3::new(1.0, -2.0, 0.5);
    Camera::new(k, r, c, [640, 480], PixelCenter::Integer)
        .unwrap()
        .with_lens(Lens::new(model, coefficients).unwrap())
        .unwrap()
}

#[test]
fn pixel_rays_project_back_to_their_pixel() {
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
            assert!((back - pixel).length() < 1e-9, "{coefficients:?} {pixel} {back}");
        }
        assert!(valid > 500, "{coefficients:?}: {valid} of 5000");
    }
}

#[test]
fn coefficient_names_match_the_longest_accepted_list() {
    for model in LensModel::ALL {
        let longest = (0..20).filter(|&count| Lens::new(model, &vec![1e-3; count]).is_ok()).max();
        assert_eq!(longest, Some(model.coefficient_names().len()), "{model:?}");
    }
}

#[test]
fn projected_points_lie_on_the_ray_of_their_pixel() {
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
                // Near the angle at which the radius stops growing, a pixel hardly determines the angle to the axis.
                assert!(off < 1e-6, "{coefficients:?} {local} {off}");
            }
        }
    }
}

/// A model is one-to-one up to its maximum angle: the radius along a meridian increases up to the end, and two
/// directions have different pixels.
#[test]
fn radii_increase_up_to_the_maximum_angle() {
    for (model, coefficients) in LENSES {
        // With a tilted sensor, image points on one side are closer to the axis, so the radii are not compared.
        if model.is_panorama() || coefficients.len() == 14 {
            continue;
        }
        let lens = Lens::new(model, coefficients).unwrap();
        for turn in 0..8 {
            let around = DVec2::from_angle(f64::from(turn) * 0.785);
            let (mut last, mut ended) = (0.0, false);
            for step in 1..1000 {
                let (sin, cos) = (std::f64::consts::PI * f64::from(step) / 1000.0).sin_cos();
                match lens.distort((sin * around).extend(cos)) {
                    None => ended = true,
                    Some(image) => {
                        assert!(
                            !ended,
                            "{model:?} {coefficients:?}: a point beyond the lens's maximum angle is projected"
                        );
                        assert!(image.length() > last, "{model:?} {coefficients:?} {step}");
                        last = image.length();
                    }
                }
            }
        }
    }
}

/// The maximum angles stated in the papers.
#[test]
fn wide_lens_models_end_at_the_angles_of_their_papers() {
    let end = |model, coefficients: &[f64]| {
        let lens = Lens::new(model, coefficients).unwrap();
        let sees = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            lens.distort(DVec3::new(sin, 0.0, cos)).is_some()
        };
        let (mut low, mut high) = (0.1, std::f64::consts::PI);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if sees(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    };
    // Mei's model: cos θ > -min(ξ, 1 / ξ).
    assert!((end(LensModel::Omni, &[0.7]) - (-0.7_f64).acos()).abs() < 1e-9);
    assert!((end(LensModel::Omni, &[2.0]) - (-0.5_f64).acos()).abs() < 1e-9);
    // The second sphere's angle φ ends at cos φ = -w1, and the direction with this φ is the last one in the valid
    // region. Usenko's bound (equations 43 to 45), z > -w2 d, uses the point of the second sphere as if it were on the
    // first, and therefore ends slightly earlier.
    let (xi, alpha) = (-0.2_f64, 0.59);
    let w1 = (1.0 - alpha) / alpha;
    let w2 = (w1 + xi) / (2.0 * w1 * xi + xi * xi + 1.0).sqrt();
    let last = -xi * (1.0 - w1 * w1) - w1 * (1.0 - xi * xi * (1.0 - w1 * w1)).sqrt();
    let found = end(LensModel::DoubleSphere, &[xi, alpha]);
    assert!((found - last.acos()).abs() < 1e-9);
    assert!(found > (-w2).acos() && found < (-w2).acos() + 0.05);
    // Usenko's equation 24 for the enhanced unified model with β = 1.
    let (alpha, w) = (0.63, 0.37 / 0.63_f64);
    assert!((end(LensModel::Eucm, &[alpha, 1.0]) - (-w).acos()).abs() < 1e-9);
}

#[test]
fn colmap_models_round_trip() {
    let params = [500.0, 510.0, 320.0, 240.0];
    let (k, lens) = raycam_scene::camera::lens_from_colmap("PINHOLE", &params).unwrap();
    assert_eq!((k.x_axis.x, k.z_axis.y, lens), (500.0, 240.0, Lens::Pinhole));
    let (_, simple) = raycam_scene::camera::lens_from_colmap("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, 0.1]).unwrap();
    assert_eq!(simple, Lens::new(LensModel::OpenCv, &[0.1, 0.0, 0.0, 0.0]).unwrap());
    for wrong in ["OPENVC", "pinhole"] {
        let error = raycam_scene::camera::lens_from_colmap(wrong, &params).unwrap_err();
        assert!(error.to_string().contains("did you mean"), "{error}");
    }
    assert!(raycam_scene::camera::lens_from_colmap("FOV", &params).is_err());
    let ds = Lens::new(LensModel::DoubleSphere, &[0.1, 0.5]).unwrap();
    assert!(raycam_scene::camera::colmap_from_lens(k, &ds).is_err());
}

#[test]
fn lenses_end_where_their_model_folds_over() {
    // r (1 - 0.4 r²) increases up to r = sqrt(1 / 1.2), where it is 2/3 r.
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
fn fisheye_cameras_project_points_behind_them() {
    let camera = camera(LensModel::Fisheye, &[0.0; 4]);
    let behind = DVec3::new(0.0, 1.0, -1.0);
    let (pixel, seen) = camera.project(camera.c() + camera.r().transpose() * behind);
    assert!(seen);
    let radius = (pixel.y - 235.0) / 440.0;
    assert!((radius - 3.0 * std::f64::consts::FRAC_PI_4).abs() < 1e-13);
}

#[test]
fn zero_distortion_equals_a_pinhole() {
    let lens = Lens::new(LensModel::OpenCv, &[0.0; 5]).unwrap();
    assert_eq!(lens, Lens::Pinhole);
    for (model, wrong) in [
        (LensModel::OpenCv, &[0.1; 3][..]),
        (LensModel::OpenCv, &[0.1; 6]),
        (LensModel::Fisheye, &[0.1; 5]),
        (LensModel::OpenCv, &[f64::NAN; 4]),
        (LensModel::OpenCv, &[2.0; 14]),
        (LensModel::ThinPrismFisheye, &[0.0; 7]),
        (LensModel::RadTanThinPrismFisheye, &[0.0; 13]),
        (LensModel::Fov, &[0.0]),
        (LensModel::Fov, &[3.2]),
        (LensModel::Division, &[]),
        (LensModel::Omni, &[-1.0]),
        (LensModel::Omni, &[1.0, 0.0]),
        (LensModel::Eucm, &[1.1, 1.0]),
        (LensModel::Eucm, &[0.5, 0.0]),
        (LensModel::DoubleSphere, &[0.0, -0.1]),
        (LensModel::DoubleSphere, &[-1.0, 0.5]),
        (LensModel::Equirectangular, &[0.0]),
    ] {
        assert!(Lens::new(model, wrong).is_err(), "{wrong:?}");
    }
}
