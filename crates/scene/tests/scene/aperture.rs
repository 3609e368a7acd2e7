//! The opening of a lens, and its light falloff.

use glam::{DMat3, DVec2, DVec3};
use raycam_scene::camera::{Aperture, Vignetting};
use raycam_scene::{Camera, Lens, LensModel, PixelCenter};

fn camera() -> Camera {
    let k = DMat3::from_cols(DVec3::new(200.0, 0.0, 0.0), DVec3::new(0.0, 200.0, 0.0), DVec3::new(100.0, 80.0, 1.0));
    Camera::new(k, DMat3::IDENTITY, DVec3::ZERO, [201, 161], PixelCenter::Integer).unwrap()
}

fn grid() -> impl Iterator<Item = [f64; 2]> {
    (0..40).flat_map(|i| (0..40).map(move |j| [i, j].map(|v| (f64::from(v) + 0.5) / 40.0)))
}

#[test]
fn points_in_focus_have_the_same_pixel_through_the_whole_aperture() {
    let aperture = Aperture::new(0.3, 4.0, 0, 0.0).unwrap();
    let flat = camera().with_aperture(Some(aperture)).unwrap();
    let pixel = DVec2::new(180.0, 10.0);
    let chief = flat.ray(pixel).1;
    for numbers in grid() {
        let sample = flat.generate_ray(pixel, numbers, 0.5);
        assert!(sample.origin.z == 0.0 && sample.origin.length() <= 0.3);
        let t = (4.0 - sample.origin.z) / sample.direction.z;
        let meets = sample.origin + t * sample.direction;
        assert!((meets - chief * (4.0 / chief.z)).length() < 1e-12);
    }
    // A fisheye is focused at a distance instead of a depth, and its opening faces the light, which may come from
    // behind the camera.
    let lens = Lens::new(LensModel::Fisheye, &[0.0; 4]).unwrap();
    let round = flat.with_lens(lens).unwrap();
    for pixel in [DVec2::new(100.0, 80.0), DVec2::new(-250.0, 90.0)] {
        let chief = round.ray(pixel).1;
        for numbers in grid() {
            let sample = round.generate_ray(pixel, numbers, 0.5);
            assert!(sample.origin.dot(chief).abs() < 1e-14 && sample.origin.length() <= 0.3);
            let off = (4.0 * chief - sample.origin).cross(sample.direction);
            assert!(off.length() < 1e-12);
        }
    }
}

#[test]
fn aperture_samples_are_uniformly_distributed() {
    for (blades, expected) in [(0, 0.5), (3, 0.25), (6, 5.0 / 12.0)] {
        // The mean squared radius is R²/2 for a disc and R² (2 + cos(2π/n)) / 6 for a polygon.
        let formula = if blades == 0 { 0.5 } else { (2.0 + (std::f64::consts::TAU / f64::from(blades)).cos()) / 6.0 };
        assert!((formula - expected).abs() < 1e-12);
        let aperture = Aperture::new(1.0, 4.0, blades, 15.0).unwrap();
        let camera = camera().with_aperture(Some(aperture)).unwrap();
        let (mut square, mut mean, mut far) = (0.0, DVec3::ZERO, 0.0_f64);
        for numbers in grid() {
            let origin = camera.generate_ray(DVec2::new(100.0, 80.0), numbers, 0.5).origin;
            square += origin.length_squared() / 1600.0;
            mean += origin / 1600.0;
            far = far.max(origin.length());
        }
        assert!((square - expected).abs() < 2e-3, "{blades} {square}");
        assert!(mean.length() < 1e-2 && far <= 1.0);
    }
    // One corner of the polygon is at the angle `rotation`.
    let aperture = Aperture::new(1.0, 4.0, 3, 90.0).unwrap();
    let camera = camera().with_aperture(Some(aperture)).unwrap();
    let corner = camera.generate_ray(DVec2::new(100.0, 80.0), [0.0, 1.0], 0.5).origin;
    assert!((corner - DVec3::Y).length() < 1e-12);
}

#[test]
fn invalid_apertures_are_refused() {
    for (radius, focus, blades, rotation) in [
        (-0.1, 1.0, 0, 0.0),
        (0.1, 0.0, 0, 0.0),
        (0.1, f64::INFINITY, 0, 0.0),
        (0.1, 1.0, 2, 0.0),
        (0.1, 1.0, 65, 0.0),
        (0.1, 1.0, 6, f64::NAN),
    ] {
        assert!(Aperture::new(radius, focus, blades, rotation).is_err());
    }
}

#[test]
fn vignetting_follows_cos4_and_the_polynomial() {
    let vignetting = |cos4, polynomial: &[f64]| {
        let polynomial = polynomial.to_vec();
        camera().with_vignetting(Some(Vignetting { cos4, polynomial })).unwrap()
    };
    let pixel = DVec2::new(200.0, 155.0);
    let s: f64 = (0.5_f64).powi(2) + (75.0 / 200.0_f64).powi(2);
    assert_eq!(camera().vignetting_factor(pixel), 1.0);
    let cosine = 1.0 / (1.0 + s).sqrt();
    assert!((vignetting(true, &[]).vignetting_factor(pixel) - cosine.powi(4)).abs() < 1e-14);
    let expected = 1.0 - 0.5 * s + 0.2 * s * s;
    assert!((vignetting(false, &[-0.5, 0.2]).vignetting_factor(pixel) - expected).abs() < 1e-14);
    assert!((vignetting(true, &[-0.5, 0.2]).vignetting_factor(pixel) - expected * cosine.powi(4)).abs() < 1e-14);
    assert_eq!(vignetting(false, &[-9.0]).vignetting_factor(pixel), 0.0);
    let wrong = Vignetting { cos4: false, polynomial: vec![f64::NAN] };
    assert!(camera().with_vignetting(Some(wrong)).is_err());
}
