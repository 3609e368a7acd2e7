//! Transforms of nodes: translation * rotation * scale (3.5.3).

use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde_json::{Map, Value, json};

/// Keys of a node placed by translation, rotation and scale, without default values.
pub(crate) fn parts(translation: DVec3, rotation: DQuat, scale: DVec3) -> Map<String, Value> {
    let mut keys = Map::new();
    let rotation = DQuat::from_array(rotation.to_array().map(round_noise));
    let scale = DVec3::from_array(scale.to_array().map(round_noise));
    if translation != DVec3::ZERO {
        keys.insert("translation".into(), json!(translation.to_array()));
    }
    if rotation != DQuat::IDENTITY {
        keys.insert("rotation".into(), json!(rotation.to_array()));
    }
    if scale != DVec3::ONE {
        keys.insert("scale".into(), json!(scale.to_array()));
    }
    keys
}

/// Rounds a number to 13 decimals, because decomposing a matrix makes the last digits inaccurate.
fn round_noise(value: f64) -> f64 {
    const DIGITS: f64 = 1e13;
    let rounded = (value * DIGITS).round() / DIGITS;
    if value.abs() < 100.0 { rounded + 0.0 } else { value }
}

/// Keys of nodes, the outermost first, that together represent any invertible transform. One node is sufficient unless
/// the transform shears; a shear requires two nodes, M = U S Vᵀ. The outer node contains the translation, the rotation
/// U and the scale S; the inner node contains the rotation Vᵀ.
pub(crate) fn nodes(transform: DAffine3) -> Vec<Map<String, Value>> {
    let m = transform.matrix3;
    let scale = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
    let off = |a: DVec3, b: DVec3| a.dot(b).abs() > 1e-7 * a.length() * b.length();
    if !(off(m.x_axis, m.y_axis) || off(m.y_axis, m.z_axis) || off(m.z_axis, m.x_axis)) {
        let scale = scale * DVec3::new(m.determinant().signum(), 1.0, 1.0);
        let rotation = DMat3::from_cols(m.x_axis / scale.x, m.y_axis / scale.y, m.z_axis / scale.z);
        return vec![parts(transform.translation, quaternion_of(rotation), scale)];
    }
    let (v, squares) = eigenvectors(m.transpose() * m);
    let scale = DVec3::new(squares.x.sqrt(), squares.y.sqrt(), squares.z.sqrt());
    let scale = scale * DVec3::new(m.determinant().signum(), 1.0, 1.0);
    let u = m * v * DMat3::from_diagonal(scale.recip());
    vec![
        parts(transform.translation, quaternion_of(u), scale),
        parts(DVec3::ZERO, quaternion_of(v.transpose()), DVec3::ONE),
    ]
}

/// Quaternion of a rotation; exact for the identity.
pub(crate) fn quaternion_of(rotation: DMat3) -> DQuat {
    if rotation == DMat3::IDENTITY {
        return DQuat::IDENTITY;
    }
    DQuat::from_mat3(&rotation).normalize()
}

/// Rotation whose columns are the eigenvectors of a symmetric matrix, and the eigenvalues: Jacobi's method (G. Golub
/// and C. Van Loan, "Matrix Computations", 2013, section 8.5).
fn eigenvectors(mut a: DMat3) -> (DMat3, DVec3) {
    let mut v = DMat3::IDENTITY;
    for _sweep in 0..32 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let apq = a.col(q)[p];
            if apq == 0.0 {
                continue;
            }
            let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * apq);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let cos = t.hypot(1.0).recip();
            let sin = t * cos;
            let mut r = DMat3::IDENTITY;
            r.col_mut(p)[p] = cos;
            r.col_mut(q)[q] = cos;
            r.col_mut(q)[p] = sin;
            r.col_mut(p)[q] = -sin;
            a = r.transpose() * a * r;
            v *= r;
        }
    }
    (v, DVec3::new(a.x_axis.x, a.y_axis.y, a.z_axis.z))
}
