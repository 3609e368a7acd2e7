//! Cameras whose centre lies at infinity: all rays are parallel (Hartley and Zisserman, section 6.3).

use glam::{DMat3, DVec2, DVec3};

use crate::camera::decompose::{DecomposedMatrix, NEGLIGIBLE, rank};
use crate::camera::intrinsics::validated_intrinsics;
use crate::camera::validate::{camera_matrix, check_size, validated_rotation};
use crate::camera::{Camera, Center, PixelCenter};
use crate::error::SceneError;

impl Camera {
    /// An orthographic camera: parallel rays along the third row of `r` (camera_from_world), from the plane through `c`.
    /// `k` is upper triangular with focal lengths > 0, in pixels per unit of the world, and its principal point is the
    /// pixel of `c`.
    ///
    /// # Errors
    /// Those of [`Camera::new`].
    pub fn orthographic(
        k: DMat3,
        r: DMat3,
        c: DVec3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        check_size(size)?;
        let (k, r) = (validated_intrinsics(k)?, validated_rotation(r)?);
        if !c.is_finite() {
            return Err(SceneError::Camera(format!(
                "the location {c} is not finite"
            )));
        }
        let p = camera_matrix(k, r, c, Center::Plane)?;
        Ok(Self::from_parts(
            k,
            r,
            c,
            p,
            size,
            pixel_center,
            Center::Plane,
        ))
    }
}

/// Decomposes `P = H [r1 0; r2 0; 0 0 0 1]`, where d = r1 x r2 is the null vector of its left 3x3 part M and H a
/// homography of the image plane; for an affine camera H is upper triangular with positive focal lengths, and K.
pub fn decompose(p: [[f64; 4]; 3]) -> Result<DecomposedMatrix, SceneError> {
    let rank = rank(p);
    if rank < 3 {
        return Err(SceneError::Camera(format!(
            "P = {p:?} has rank {rank}: a camera matrix has rank 3"
        )));
    }
    let [m1, m2, m3] = p.map(|row| DVec3::new(row[0], row[1], row[2]));
    let p4 = DVec3::from_array(p.map(|row| row[3]));
    let affine = m3.length() <= NEGLIGIBLE * m1.length().max(m2.length());
    if affine {
        let scale = p4.z;
        let (m1, m2, p4) = (m1 / scale, m2 / scale, p4 / scale);
        // As RQ of a finite camera, without its third row.
        let b = m2.length();
        let r2 = m2 / b;
        let once = m1 - m1.dot(r2) * r2;
        let r1 = (once - once.dot(r2) * r2).normalize();
        let k = DMat3::from_cols(
            DVec3::new(m1.dot(r1), 0.0, 0.0),
            DVec3::new(m1.dot(r2), b, 0.0),
            p4,
        );
        return decomposed(p, k, r1, r2, scale);
    }
    // The null vector is at right angles to all rows: their largest cross product.
    let unit = |v: DVec3| v.try_normalize().unwrap_or_default();
    let (u1, u2, u3) = (unit(m1), unit(m2), unit(m3));
    let crosses = [u2.cross(u3), u3.cross(u1), u1.cross(u2)];
    let largest =
        crosses.into_iter().fold(
            DVec3::ZERO,
            |a, b| if b.length() > a.length() { b } else { a },
        );
    let forward = unit(largest);
    let r1 = forward.any_orthonormal_vector();
    let r2 = forward.cross(r1);
    let m = DMat3::from_cols(m1, m2, m3).transpose();
    let h = DMat3::from_cols(m * r1, m * r2, p4);
    // At the point that H⁻¹ gives the pixel (0, 0) the image is mirrored where the determinants disagree.
    let at = h.inverse() * DVec3::Z;
    let w = h.row(2).dot(at) / at.z;
    let mirrored = h.determinant() / (w * w * w) < 0.0;
    let (r1, h) = if mirrored {
        (-r1, h * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)))
    } else {
        (r1, h)
    };
    decomposed(p, h * (1.0 / m3.length()), r1, r2, m3.length())
}

fn decomposed(
    p: [[f64; 4]; 3],
    k: DMat3,
    r1: DVec3,
    r2: DVec3,
    scale: f64,
) -> Result<DecomposedMatrix, SceneError> {
    let r = DMat3::from_cols(r1, r2, r1.cross(r2)).transpose();
    if !(k.is_finite() && k.determinant() != 0.0 && r.is_finite()) {
        return Err(SceneError::Camera(format!(
            "P = {p:?} has its centre at infinity, and its numbers are too far apart to say where"
        )));
    }
    Ok(DecomposedMatrix {
        k,
        r,
        c: DVec3::ZERO,
        p: p.map(|row| row.map(|v| v / scale)),
        center: Center::Infinity,
    })
}

/// A point of the image plane of parallel rays, in units of the world, from its pixel.
pub fn plane_from_pixel(k: DMat3, pixel: DVec2) -> DVec2 {
    let at = k.inverse() * pixel.extend(1.0);
    at.truncate() / at.z
}
