//! K, R and C of a camera matrix: RQ decomposition (Hartley and Zisserman, section 6.2.4 and appendix A4.1).

use glam::{DMat3, DVec3, DVec4};

use crate::camera::center::Center;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;

/// Maximum difference, relative to its operands, that is treated as a rounding error.
const NEGLIGIBLE: f64 = 64.0 * f64::EPSILON;

/// Parts of a camera matrix.
pub struct DecomposedMatrix {
    /// Intrinsics: upper triangular, with a positive diagonal and `K[2][2] = 1`.
    pub k: DMat3,
    /// Rotation camera_from_world.
    pub r: DMat3,
    /// Centre of projection.
    pub c: DVec3,
    /// The matrix, scaled so that the third row of its left 3x3 part has length 1 and points forward.
    pub p: [[f64; 4]; 3],
    pub center: Center,
}

/// Decomposes `P = s K R [I | -C]` for any scale and sign s.
pub fn decompose(p: [[f64; 4]; 3]) -> Result<DecomposedMatrix> {
    if !p.as_flattened().iter().all(|v| v.is_finite()) {
        return Err(SceneError::Camera(
            ErrorCode::InvalidMatrix.message(format!("P = {p:?} is not finite; every value must be finite")),
        ));
    }
    let largest = p.iter().flat_map(|row| &row[..3]).fold(0.0, |a: f64, v| a.max(v.abs()));
    if largest == 0.0 {
        return decompose_parallel(p);
    }
    // Scaling by a power of two causes no rounding. The matrix is multiplied twice by 2^(-e/2), because 2^-e may
    // overflow.
    let half = 2.0_f64.powi(-(largest.log2() / 2.0).floor() as i32);
    let scaled = p.map(|row| row.map(|v| v * half * half));
    let [m1, m2, m3] = scaled.map(|row| DVec3::new(row[0], row[1], row[2]));

    // Gram-Schmidt from the third row upwards is an RQ decomposition; orthogonalising twice keeps R orthonormal for any
    // condition number.
    let k33 = m3.length();
    if k33 <= f64::EPSILON * m1.length().max(m2.length()) {
        return decompose_parallel(p);
    }
    let r3 = m3 / k33;
    let once = m2 - m2.dot(r3) * r3;
    let across = once - once.dot(r3) * r3;
    if across.length() <= NEGLIGIBLE * m2.length() {
        return decompose_parallel(p);
    }
    let r2 = across.normalize();
    let r1 = r2.cross(r3).normalize();
    let (k11, k22) = (m1.dot(r1), m2.dot(r2));
    if k11.abs() <= NEGLIGIBLE * m1.length() {
        return decompose_parallel(p);
    }
    // sign(det M) = sign(k11), because k22 and k33 are positive and R is a rotation at this point. P and -P describe
    // the same camera: for -P the rows r3 and r2 change sign and r1 does not.
    let sign = k11.signum();
    let r = DMat3::from_cols(r1, sign * r2, sign * r3).transpose();
    let (k12, k13, k23) = (m1.dot(r2), m1.dot(r3), m2.dot(r3));
    let k = DMat3::from_cols(
        DVec3::new(k11.abs() / k33, 0.0, 0.0),
        DVec3::new(k12 / k33, k22 / k33, 0.0),
        DVec3::new(k13 / k33, k23 / k33, 1.0),
    );
    let p = scaled.map(|row| row.map(|v| v * sign / k33));

    // K t = p4 is solved by back substitution, which is backward stable; C = -Rᵀ t.
    let t3 = p[2][3];
    let t2 = (p[1][3] - k.z_axis.y * t3) / k.y_axis.y;
    let t1 = (p[0][3] - k.y_axis.x * t2 - k.z_axis.x * t3) / k.x_axis.x;
    let c = -(r.transpose() * DVec3::new(t1, t2, t3));
    if !(c.is_finite() && k.is_finite()) {
        return Err(SceneError::Camera(
            ErrorCode::InvalidMatrix
                .message(format!("P = {p:?}: its numbers differ too much in size to compute its centre")),
        ));
    }
    Ok(DecomposedMatrix { k, r, c, p, center: Center::Point })
}

/// Decomposes `P = H [r1 0; r2 0; 0 0 0 1]`. Here d = r1 x r2 is the null vector of P's left 3x3 part M, and H is a
/// homography of the image plane. For an affine camera, H is K: upper triangular with positive focal lengths.
fn decompose_parallel(p: [[f64; 4]; 3]) -> Result<DecomposedMatrix> {
    let rank = numerical_rank(p);
    if rank < 3 {
        return Err(SceneError::Camera(
            ErrorCode::InvalidMatrix.message(format!("P = {p:?} has rank {rank}; a camera matrix must have rank 3")),
        ));
    }
    let [m1, m2, m3] = p.map(|row| DVec3::new(row[0], row[1], row[2]));
    let p4 = DVec3::from_array(p.map(|row| row[3]));
    let affine = m3.length() <= NEGLIGIBLE * m1.length().max(m2.length());
    if affine {
        let scale = p4.z;
        let (m1, m2, p4) = (m1 / scale, m2 / scale, p4 / scale);
        // The following is the RQ decomposition of a finite camera, without the steps for the third row.
        let b = m2.length();
        let r2 = m2 / b;
        let once = m1 - m1.dot(r2) * r2;
        let r1 = (once - once.dot(r2) * r2).normalize();
        let k = DMat3::from_cols(DVec3::new(m1.dot(r1), 0.0, 0.0), DVec3::new(m1.dot(r2), b, 0.0), p4);
        return decomposed_parallel(p, k, r1, r2, scale);
    }
    // The null vector is perpendicular to all rows, so the largest cross product of two rows is used.
    let unit = |v: DVec3| v.try_normalize().unwrap_or_default();
    let (u1, u2, u3) = (unit(m1), unit(m2), unit(m3));
    let crosses = [u2.cross(u3), u3.cross(u1), u1.cross(u2)];
    let largest = crosses.into_iter().fold(DVec3::ZERO, |a, b| if b.length() > a.length() { b } else { a });
    let forward = unit(largest);
    let r1 = forward.any_orthonormal_vector();
    let r2 = forward.cross(r1);
    let m = DMat3::from_cols(m1, m2, m3).transpose();
    let h = DMat3::from_cols(m * r1, m * r2, p4);
    // At the point that H⁻¹ assigns to pixel (0, 0), the image is mirrored if the determinants have different signs.
    let at = h.inverse() * DVec3::Z;
    let w = h.row(2).dot(at) / at.z;
    let mirrored = h.determinant() / (w * w * w) < 0.0;
    let (r1, h) = if mirrored { (-r1, h * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))) } else { (r1, h) };
    decomposed_parallel(p, h * (1.0 / m3.length()), r1, r2, m3.length())
}

fn decomposed_parallel(p: [[f64; 4]; 3], k: DMat3, r1: DVec3, r2: DVec3, scale: f64) -> Result<DecomposedMatrix> {
    let r = DMat3::from_cols(r1, r2, r1.cross(r2)).transpose();
    if !(k.is_finite() && k.determinant() != 0.0 && r.is_finite()) {
        return Err(SceneError::Camera(ErrorCode::InvalidMatrix.message(format!(
            "P = {p:?}: its centre is at infinity, and its numbers differ too much in size to compute the direction"
        ))));
    }
    Ok(DecomposedMatrix { k, r, c: DVec3::ZERO, p: p.map(|row| row.map(|v| v / scale)), center: Center::Infinity })
}

/// The numerical rank of the matrix, by Gram-Schmidt orthogonalisation with pivoting on rows of unit length.
fn numerical_rank(p: [[f64; 4]; 3]) -> usize {
    let mut rows = p.map(|row| {
        let scale = row.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
        if scale == 0.0 { DVec4::ZERO } else { DVec4::from_array(row.map(|v| v / scale)).normalize() }
    });
    for rank in 0..3 {
        let mut longest = rank;
        for i in rank..3 {
            if rows[i].length() > rows[longest].length() {
                longest = i;
            }
        }
        if rows[longest].length() <= NEGLIGIBLE {
            return rank;
        }
        rows.swap(rank, longest);
        let axis = rows[rank].normalize();
        for row in &mut rows[rank + 1..] {
            *row -= row.dot(axis) * axis;
        }
    }
    3
}
