//! Intrinsic matrix K.

use glam::{DMat3, DVec3};

use crate::camera::pixel_center::PixelCenter;
use crate::camera::validate::format_matrix;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;

/// Returns intrinsics with square pixels for a vertical field of view in degrees; the principal point is the image
/// centre.
///
/// # Errors
/// [`SceneError::Camera`] if the field of view is not between 0 and 180 degrees.
pub fn intrinsics_from_fov(fov_vertical: f64, size: [u32; 2], pixel_center: PixelCenter) -> Result<DMat3> {
    if !(fov_vertical > 0.0 && fov_vertical < 180.0) {
        return Err(SceneError::Camera(ErrorCode::OutOfRange.message(format!(
            "the vertical field of view is {fov_vertical}; expected degrees greater than 0 and less than 180"
        ))));
    }
    let focal = f64::from(size[1]) / 2.0 / (fov_vertical.to_radians() / 2.0).tan();
    Ok(intrinsics_from_focal(focal, size, pixel_center))
}

/// Returns intrinsics with square pixels for a focal length in pixels; the principal point is the image centre.
pub fn intrinsics_from_focal(focal: f64, size: [u32; 2], pixel_center: PixelCenter) -> DMat3 {
    let [cx, cy] = size.map(|side| f64::from(side) / 2.0 - 0.5 + pixel_center.offset());
    DMat3::from_cols(DVec3::new(focal, 0.0, 0.0), DVec3::new(0.0, focal, 0.0), DVec3::new(cx, cy, 1.0))
}

/// Returns the intrinsics of parallel rays from half the width and height of their view, in world units.
pub fn intrinsics_from_extent(half: [f64; 2], size: [u32; 2], pixel_center: PixelCenter) -> DMat3 {
    let mut k = intrinsics_from_focal(1.0, size, pixel_center);
    k.x_axis.x = f64::from(size[0]) / (2.0 * half[0]);
    k.y_axis.y = f64::from(size[1]) / (2.0 * half[1]);
    k
}

/// Returns `k` divided by `k[2][2]`; an error if the result is not an intrinsic matrix.
pub fn validated_intrinsics(k: DMat3) -> Result<DMat3> {
    let fail = |message: String| {
        Err(SceneError::Camera(ErrorCode::InvalidMatrix.message(format!("K = {}: {message}", format_matrix(k)))))
    };
    if !k.is_finite() {
        return fail("every value must be finite".into());
    }
    let below = [k.x_axis.y, k.x_axis.z, k.y_axis.z].into_iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    if below > 1e-12 * k.z_axis.z.abs() {
        return fail("K must be upper triangular, [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]; is it transposed?".into());
    }
    if k.z_axis.z == 0.0 || !(k * (1.0 / k.z_axis.z)).is_finite() {
        return fail("K[2][2] must not be 0; expected 1 for K in pixels".into());
    }
    let s = k.z_axis.z;
    let (fx, fy) = (k.x_axis.x / s, k.y_axis.y / s);
    if fx == 0.0 || fy == 0.0 {
        return fail(format!("focal lengths must be greater than 0, got {fx} and {fy}; K is not invertible"));
    }
    if fx < 0.0 || fy < 0.0 {
        return fail(format!(
            "focal lengths must be greater than 0, got {fx} and {fy}; a negative focal length mirrors the image and \
             contradicts the viewing direction in R, so turn the axes of R instead"
        ));
    }
    Ok(DMat3::from_cols(
        DVec3::new(fx, 0.0, 0.0),
        DVec3::new(k.y_axis.x / s, fy, 0.0),
        DVec3::new(k.z_axis.x / s, k.z_axis.y / s, 1.0),
    ))
}
