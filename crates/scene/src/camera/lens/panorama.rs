//! Panoramas: 360 degrees around the y axis. The image plane is an unrolled cylinder: x is the longitude, `atan2(X,
//! Z)`, in radians; 0 is ahead, positive values are to the right.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

/// Equirectangular panorama: y is the latitude, `atan2(Y, sqrt(X² + Z²))`, in radians, positive downwards: the whole
/// sphere (COLMAP's EQUIRECTANGULAR).
pub fn equirectangular(direction: DVec3) -> Option<DVec2> {
    let around = direction.x.hypot(direction.z);
    let at = DVec2::new(longitude(direction), direction.y.atan2(around));
    (direction != DVec3::ZERO && !at.is_nan()).then_some(at)
}

/// The inverse, for longitudes within ±180 degrees and latitudes within ±90 degrees.
pub fn from_equirectangular(image: DVec2) -> Option<DVec3> {
    if !(image.x.abs() <= PI && image.y.abs() <= FRAC_PI_2) {
        return None;
    }
    let ((sin, cos), (down, around)) = (image.x.sin_cos(), image.y.sin_cos());
    Some(DVec3::new(around * sin, down, around * cos))
}

/// Cylindrical panorama: y is `Y / sqrt(X² + Z²)`, so vertical lines stay straight. All directions are covered except
/// straight up and down.
pub fn cylindrical(direction: DVec3) -> Option<DVec2> {
    let around = direction.x.hypot(direction.z);
    let at = DVec2::new(longitude(direction), direction.y / around);
    (around > 0.0 && at.is_finite()).then_some(at)
}

/// The inverse, for longitudes within ±180 degrees.
pub fn from_cylindrical(image: DVec2) -> Option<DVec3> {
    if !(image.x.abs() <= PI && image.y.is_finite()) {
        return None;
    }
    let (sin, cos) = image.x.sin_cos();
    Some(DVec3::new(sin, image.y, cos))
}

fn longitude(direction: DVec3) -> f64 {
    direction.x.atan2(direction.z)
}
