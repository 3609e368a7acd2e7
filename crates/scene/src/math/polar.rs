//! Polar decomposition: a linear map as a rotation after a stretch.

use glam::DMat3;

/// Returns the rotation and the stretch (symmetric, positive definite) whose product, in this order, is a matrix;
/// `None` if the matrix mirrors or flattens. Newton's iteration (N. Higham, "Computing the Polar Decomposition—with
/// Applications", 1986).
pub fn polar(matrix: DMat3) -> Option<(DMat3, DMat3)> {
    const MOST_STEPS: usize = 100;
    let determinant = matrix.determinant();
    if !(determinant > 0.0 && determinant.is_finite()) {
        return None;
    }
    let mut rotation = matrix * determinant.cbrt().recip();
    for _ in 0..MOST_STEPS {
        let next = (rotation + rotation.inverse().transpose()) * 0.5;
        let change = (next - rotation).to_cols_array().into_iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        rotation = next;
        if change <= 1e-15 || change.is_nan() {
            break;
        }
    }
    let stretch = rotation.transpose() * matrix;
    let stretch = (stretch + stretch.transpose()) * 0.5;
    (rotation.is_finite() && stretch.is_finite()).then_some((rotation, stretch))
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;

    #[test]
    fn polar_decomposition_recovers_rotation_and_stretch() {
        let turned = |axis: DVec3, angle: f64| DMat3::from_quat(DQuat::from_axis_angle(axis.normalize(), angle));
        for (i, scale) in [DVec3::ONE, DVec3::new(2.0, 0.1, 7.0), DVec3::new(1e-6, 1e-6, 3e-6)].into_iter().enumerate()
        {
            let rotation = turned(DVec3::new(1.0, -2.0, 0.5), 0.7 + i as f64);
            let axes = turned(DVec3::new(0.3, 1.0, 2.0), 1.9);
            let stretch = axes * DMat3::from_diagonal(scale) * axes.transpose();
            let (found, stretched) = polar(rotation * stretch).unwrap();
            assert!((found - rotation).to_cols_array().iter().all(|v| v.abs() < 1e-12), "{found}");
            let size = scale.max_element();
            assert!((stretched - stretch).to_cols_array().iter().all(|v| v.abs() < 1e-12 * size), "{stretched}");
        }
        assert!(polar(DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0))).is_none());
        assert!(polar(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0))).is_none());
    }
}
