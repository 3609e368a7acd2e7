//! Reciprocity: values are the same if light travels in the opposite direction.

use glam::Vec3;
use raycam_scene::Glass;

use crate::bsdf::dielectric;
use crate::bsdf::tests::*;

#[test]
fn bsdf_values_are_reciprocal() {
    let (lossless, lossy) = all();
    let mut random = Random(5);
    // Coated BSDFs are not reciprocal: a coat dims the layers below by its albedo for the viewing direction only.
    for (name, make) in lossless.iter().chain(&lossy).filter(|(name, _)| !name.starts_with("coated")) {
        for _ in 0..200 {
            let mut direction = || {
                let z = 0.05 + 0.9 * random.next();
                let (sin, cos) = (std::f32::consts::TAU * random.next()).sin_cos();
                let r = (1.0 - z * z).sqrt();
                Vec3::new(r * cos, r * sin, z)
            };
            let (a, b) = (direction(), direction());
            let value = |v: Vec3, l: Vec3| {
                let frame = seen_from(v);
                make(&frame).eval(&frame, l).value / l.z
            };
            let (there, back) = (value(a, b), value(b, a));
            let off = (there - back).abs().max_element();
            assert!(off <= 1e-5 * there.max_element().max(1.0), "{name}: {there} {back}");
        }
    }
}

#[test]
fn refracted_radiance_scales_with_the_squared_index() {
    // f(v, l) in air is f(l, v) in glass over n^2 (E. Veach, 1997, section 5.2).
    let glass = Glass { roughness: 0.5, ..Glass::default() };
    let value = |v: Vec3, l: Vec3, front: bool| {
        let frame = seen_from(v);
        let eta = dielectric::eta_of_side(&glass, front, None, 1.0);
        let scatter = {
            let layers = dielectric::layer_stack(&glass, eta, Vec3::ONE, Some(&EXACT));
            Bsdf::Layered(LayeredBsdf::new(layers, &frame))
        };
        scatter.eval(&frame, l).value.x / l.z.abs()
    };
    let (above, below) = (Vec3::new(0.5, 0.2, 0.8).normalize(), Vec3::new(0.3, 0.2, 0.9).normalize());
    let there = value(above, -below, true);
    let mirror = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
    let back = value(mirror(-below), mirror(above), false);
    assert!(there > 0.0);
    assert!((back / there / 2.25 - 1.0).abs() < 1e-5, "{there} {back}");
}
