//! Colour of a black body, by its temperature.

use glam::DVec3;

use crate::color::Rgb;

/// Temperatures whose colour is defined here, in kelvin.
pub(crate) const TEMPERATURES: std::ops::RangeInclusive<f64> = 1000.0..=40_000.0;

/// Second radiation constant h c / k, in nm K.
const SECOND_RADIATION_CONSTANT: f64 = 1.438_776_877e7;

/// Linear Rec. 709 colour of a black body, scaled to luminance 1. Negative components (below about 1900 K, outside the
/// Rec. 709 gamut) are set to 0 first.
///
/// Planck's law, and the CIE 1931 colour matching functions as fitted by C. Wyman, P. Sloan and P. Shirley, "Simple
/// Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2013.
pub(crate) fn blackbody_color(kelvin: f64) -> Rgb {
    let xyz: DVec3 = (380..=780).map(f64::from).map(|nm| matching_functions(nm) * planck(nm, kelvin)).sum();
    let rgb = rec709_from_xyz(xyz / xyz.y).max(DVec3::ZERO);
    (rgb / rgb.dot(LUMINANCE)).as_vec3().to_array()
}

/// Weights of linear Rec. 709 red, green and blue in the luminance.
const LUMINANCE: DVec3 = DVec3::new(0.212_639, 0.715_169, 0.072_192);

/// Radiance of a black body at a wavelength, up to a constant factor.
fn planck(nm: f64, kelvin: f64) -> f64 {
    (nm / 560.0).powi(-5) / (SECOND_RADIATION_CONSTANT / (nm * kelvin)).exp_m1()
}

/// The colour matching functions x, y and z at a wavelength.
fn matching_functions(nm: f64) -> DVec3 {
    let lobe = |height: f64, center: f64, below: f64, above: f64| {
        let width = if nm < center { below } else { above };
        height * (-0.5 * ((nm - center) * width).powi(2)).exp()
    };
    DVec3::new(
        lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) - lobe(0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    )
}

/// Linear Rec. 709 of a colour in CIE XYZ; the white point is D65.
fn rec709_from_xyz(xyz: DVec3) -> DVec3 {
    DVec3::new(
        DVec3::new(3.240_970, -1.537_383, -0.498_611).dot(xyz),
        DVec3::new(-0.969_244, 1.875_968, 0.041_555).dot(xyz),
        DVec3::new(0.055_630, -0.203_977, 1.056_972).dot(xyz),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE 1931 x and y of a linear Rec. 709 colour.
    fn chromaticity(rgb: Rgb) -> [f64; 2] {
        let [r, g, b] = rgb.map(f64::from);
        let xyz = DVec3::new(
            0.412_391 * r + 0.357_584 * g + 0.180_481 * b,
            0.212_639 * r + 0.715_169 * g + 0.072_192 * b,
            0.019_331 * r + 0.119_195 * g + 0.950_532 * b,
        );
        let sum = xyz.element_sum();
        [xyz.x / sum, xyz.y / sum]
    }

    #[test]
    fn blackbody_colors_have_published_chromaticities() {
        // CIE standard illuminant A is a black body of 2856 K; the other values are from G. Wyszecki and W. S. Stiles,
        // "Color Science", 2nd edition, table 1(3.11).
        let published = [
            (2856.0, [0.447_57, 0.407_45]),
            (2500.0, [0.4770, 0.4137]),
            (4000.0, [0.3805, 0.3768]),
            (5000.0, [0.3451, 0.3516]),
            (6500.0, [0.3135, 0.3237]),
            (10_000.0, [0.2807, 0.2884]),
        ];
        for (kelvin, expected) in published {
            let found = chromaticity(blackbody_color(kelvin));
            let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 3e-3, "{kelvin}: {found:?}, expected {expected:?}");
        }
    }

    #[test]
    fn blackbody_colors_have_luminance_one() {
        for kelvin in [1000.0, 1900.0, 6500.0, 40_000.0] {
            let rgb = blackbody_color(kelvin);
            let luminance = DVec3::from(rgb.map(f64::from)).dot(LUMINANCE);
            assert!((luminance - 1.0).abs() < 1e-6, "{kelvin}: {rgb:?}");
            assert!(rgb.iter().all(|value| *value >= 0.0));
        }
        let [warm, cold] = [2000.0, 20_000.0].map(blackbody_color);
        assert!(warm[0] > warm[1] && warm[1] > warm[2] && cold[2] > cold[1] && cold[1] > cold[0]);
    }
}
