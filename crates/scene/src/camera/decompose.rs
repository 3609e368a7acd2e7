//! K, R and C of a camera matrix: RQ decomposition (Hartley and Zisserman, section 6.2.4 and appendix A4.1).

use glam::{DMat3, DVec3, DVec4};

use crate::camera::{Center, parallel};
use crate::error::SceneError;

/// Below this, relative to its operands, a difference is rounding error.
pub const NEGLIGIBLE: f64 = 64.0 * f64::EPSILON;

/// The parts of a camera matrix.
pub struct DecomposedMatrix {
    /// Upper triangular, positive diagonal, `K[2][2] = 1`.
    pub k: DMat3,
    /// camera_from_world, a rotation.
    pub r: DMat3,
    /// The centre.
    pub c: DVec3,
    /// The matrix itself, scaled so that the third row of its left 3x3 part has length 1 and points forward.
    pub p: [[f64; 4]; 3],
    pub center: Center,
}

/// Decomposes `P = s K R [I | -C]` for whatever scale and sign s.
pub fn decompose(p: [[f64; 4]; 3]) -> Result<DecomposedMatrix, SceneError> {
    if !p.as_flattened().iter().all(|v| v.is_finite()) {
        return Err(SceneError::Camera(format!(
            "P = {p:?}: every value must be finite"
        )));
    }
    let largest = p
        .iter()
        .flat_map(|row| &row[..3])
        .fold(0.0, |a: f64, v| a.max(v.abs()));
    if largest == 0.0 {
        return parallel::decompose(p);
    }
    // A power of two, so that scaling rounds nothing; two steps, as 1 / 2^e may overflow where 2^-e/2 twice does not.
    let half = 2.0_f64.powi(-(largest.log2() / 2.0).floor() as i32);
    let scaled = p.map(|row| row.map(|v| v * half * half));
    let [m1, m2, m3] = scaled.map(|row| DVec3::new(row[0], row[1], row[2]));

    // Gram-Schmidt from the third row upwards is RQ; orthogonalising twice keeps R orthonormal whatever the condition.
    let k33 = m3.length();
    if k33 <= f64::EPSILON * m1.length().max(m2.length()) {
        return parallel::decompose(p);
    }
    let r3 = m3 / k33;
    let once = m2 - m2.dot(r3) * r3;
    let across = once - once.dot(r3) * r3;
    if across.length() <= NEGLIGIBLE * m2.length() {
        return parallel::decompose(p);
    }
    let r2 = across.normalize();
    let r1 = r2.cross(r3).normalize();
    let (k11, k22) = (m1.dot(r1), m2.dot(r2));
    if k11.abs() <= NEGLIGIBLE * m1.length() {
        return parallel::decompose(p);
    }
    // sign(det M) = sign(k11), as k22 and k33 are positive and R is a rotation so far. P and -P are the same camera:
    // with -P the rows r3 and r2 change sign and r1 does not.
    let sign = k11.signum();
    let r = DMat3::from_cols(r1, sign * r2, sign * r3).transpose();
    let (k12, k13, k23) = (m1.dot(r2), m1.dot(r3), m2.dot(r3));
    let k = DMat3::from_cols(
        DVec3::new(k11.abs() / k33, 0.0, 0.0),
        DVec3::new(k12 / k33, k22 / k33, 0.0),
        DVec3::new(k13 / k33, k23 / k33, 1.0),
    );
    let p = scaled.map(|row| row.map(|v| v * sign / k33));

    // K t = p4 by back substitution, which is backward stable; C = -Rᵀ t.
    let t3 = p[2][3];
    let t2 = (p[1][3] - k.z_axis.y * t3) / k.y_axis.y;
    let t1 = (p[0][3] - k.y_axis.x * t2 - k.z_axis.x * t3) / k.x_axis.x;
    let c = -(r.transpose() * DVec3::new(t1, t2, t3));
    if !(c.is_finite() && k.is_finite()) {
        return Err(SceneError::Camera(format!(
            "P = {p:?}: its numbers are too far apart to say where its centre is"
        )));
    }
    Ok(DecomposedMatrix {
        k,
        r,
        c,
        p,
        center: Center::Point,
    })
}

/// The numerical rank, by Gram-Schmidt with pivoting on rows of unit length.
pub fn rank(p: [[f64; 4]; 3]) -> usize {
    let mut rows = p.map(|row| {
        let scale = row.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
        if scale == 0.0 {
            DVec4::ZERO
        } else {
            DVec4::from_array(row.map(|v| v / scale)).normalize()
        }
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
