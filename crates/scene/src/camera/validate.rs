//! Validation of image sizes, rotations and camera matrices.

use glam::{DMat3, DVec3, DVec4};

use crate::camera::center::Center;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;

/// Maximum width and height.
pub const MAX_SIDE: u32 = 65_536;
/// Maximum number of pixels in an image.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Computes the 3x4 camera matrix from K, R and C.
pub fn camera_matrix(k: DMat3, r: DMat3, c: DVec3, center: Center) -> Result<[[f64; 4]; 3]> {
    let t = -(r * c);
    // The pose is [R | t]; for parallel rays, its last row is 0 0 0 1.
    let pose = [0, 1, 2].map(|i| match (center, i) {
        (Center::Plane | Center::Infinity, 2) => DVec4::W,
        _ => r.row(i).extend(t[i]),
    });
    let p = [0, 1, 2].map(|i| {
        let row = k.row(i);
        (row.x * pose[0] + row.y * pose[1] + row.z * pose[2]).to_array()
    });
    if !p.as_flattened().iter().all(|v| v.is_finite()) {
        return Err(SceneError::camera("K R [I | -C] overflows; use smaller values for K or the camera centre"));
    }
    Ok(p)
}

/// Checks the size of an image.
pub fn check_size(size: [u32; 2]) -> Result<()> {
    let [width, height] = size;
    if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
        return Err(SceneError::Camera(
            ErrorCode::OutOfRange
                .message(format!("image size {width} x {height}; expected 1 to {MAX_SIDE} columns and rows")),
        ));
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(SceneError::Camera(
            ErrorCode::TooLarge
                .message(format!("image too large: {width} x {height} pixels, limit {MAX_PIXELS}; use a smaller size")),
        ));
    }
    Ok(())
}

/// Maximum difference in any entry between a matrix and the nearest rotation at which the matrix is accepted as a
/// rotation.
pub const ROTATION_TOLERANCE: f64 = 1e-3;

/// Returns the rotation nearest to `m` (its orthogonal polar factor), and the largest difference between their
/// entries. For the transpose of `m`, the result is the transposed rotation and the same difference.
///
/// # Errors
/// Returns the reason if `m` differs from a rotation by more than [`ROTATION_TOLERANCE`].
pub fn nearest_rotation(m: DMat3) -> std::result::Result<(DMat3, f64), String> {
    if !m.is_finite() {
        return Err("every value must be finite".into());
    }
    let off = orthogonality_error(m);
    let refused = |nearest: String| {
        Err(format!(
            "not a rotation: R R\u{1d40} differs from the identity by {off:.3e}{nearest} (at most \
             {ROTATION_TOLERANCE} per entry is accepted), and the determinant of R is {:.6}",
            m.determinant()
        ))
    };
    if off > 0.1 {
        return refused(String::new());
    }
    if m.determinant() < 0.0 {
        return Err(
            "a reflection (determinant -1), which changes the handedness; expected a rotation, so check the axes' signs"
                .into(),
        );
    }
    if off <= 1e-14 {
        return Ok((m, 0.0));
    }
    // Newton-Schulz iteration towards the orthogonal polar factor; every step squares the error.
    let step = |r: DMat3| r * (DMat3::IDENTITY * 3.0 - r.transpose() * r) * 0.5;
    let steps = if off <= 1e-6 { 3 } else { 6 };
    let rotation = (0..steps).fold(m, |r, _| step(r));
    let difference = (m - rotation).to_cols_array().into_iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    if difference > ROTATION_TOLERANCE {
        return refused(format!(", and R from the nearest rotation by {difference:.3e}"));
    }
    Ok((rotation, difference))
}

/// Rotation nearest to `r`, which must be within [`ROTATION_TOLERANCE`] of a rotation.
pub fn validated_rotation(r: DMat3) -> Result<DMat3> {
    let rotation = nearest_rotation(r);
    rotation.map(|(r, _)| r).map_err(|message| {
        SceneError::Camera(ErrorCode::NotARotation.message(format!("R = {}: {message}", format_matrix(r))))
    })
}

/// Largest entry of `|R Rᵀ - I|`.
fn orthogonality_error(r: DMat3) -> f64 {
    let e = r * r.transpose() - DMat3::IDENTITY;
    e.to_cols_array().into_iter().fold(0.0, |a: f64, v| a.max(v.abs()))
}

/// Formats a matrix for messages.
pub fn format_matrix(m: DMat3) -> String {
    let row = |i| {
        let v = m.row(i);
        format!("[{}, {}, {}]", v.x, v.y, v.z)
    };
    format!("[{}, {}, {}]", row(0), row(1), row(2))
}
