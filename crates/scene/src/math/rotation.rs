//! Orientation: roll, pitch and yaw about ROS REP-103 body axes (x forward, y left, z up), and orientation towards a
//! point.
//!
//! `R_world_from_body = Rz(yaw) Ry(pitch) Rx(roll)`, in degrees, right-handed: positive yaw turns left, positive pitch
//! looks down, positive roll leans right. With all angles zero, the body faces +x in a z-up world and -z in a y-up
//! world.

use glam::{DMat3, DVec3};

use crate::up::Up;

/// Rotation from body axes (x forward, y left, z up) to camera axes (x right, y down, z forward).
pub const CAMERA_FROM_BODY: DMat3 =
    DMat3::from_cols(DVec3::new(0.0, 0.0, 1.0), DVec3::new(-1.0, 0.0, 0.0), DVec3::new(0.0, -1.0, 0.0));

/// Rotation from reference axes, which are the body axes at zero roll, pitch and yaw, to world axes. It is the identity
/// for a z-up world; in a y-up world, forward is -z, left is -x and up is +y.
pub fn world_from_reference(up: Up) -> DMat3 {
    match up {
        Up::Z => DMat3::IDENTITY,
        Up::Y => DMat3::from_cols(-DVec3::Z, -DVec3::X, DVec3::Y),
    }
}

/// `Rz(yaw) Ry(pitch) Rx(roll)` for angles in degrees: the rotation from body axes to reference axes.
pub fn rotation_from_rpy(roll: f64, pitch: f64, yaw: f64) -> DMat3 {
    let [(sr, cr), (sp, cp), (sy, cy)] = [roll, pitch, yaw].map(sin_cos_degrees);
    DMat3::from_cols(
        DVec3::new(cy * cp, sy * cp, -sp),
        DVec3::new(cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
        DVec3::new(cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr),
    )
}

/// Rotation world_from_mesh of an object rotated by angles in degrees about the world's forward, left and up axes. With
/// all angles zero, vertices are unchanged.
pub fn object_rotation(roll: f64, pitch: f64, yaw: f64, up: Up) -> DMat3 {
    let world_from_reference = world_from_reference(up);
    world_from_reference * rotation_from_rpy(roll, pitch, yaw) * world_from_reference.transpose()
}

/// Roll, pitch and yaw of a rotation in degrees: pitch is in -90..=90, roll and yaw are in -180..=180.
///
/// For a direction straight up or down (gimbal lock: pitch is ±90, and only one combination of roll and yaw is
/// determined), roll is 0 and yaw contains the whole rotation; [`rotation_from_rpy`] still recovers the rotation.
pub fn rpy_from_rotation(rotation: DMat3) -> [f64; 3] {
    let (x, y, z) = (rotation.x_axis, rotation.y_axis, rotation.z_axis);
    let cos_pitch = x.x.hypot(x.y);
    let pitch = (-x.z).atan2(cos_pitch);
    let (roll, yaw) = if cos_pitch > 1e-9 { (y.z.atan2(z.z), x.y.atan2(x.x)) } else { (0.0, (-y.x).atan2(y.y)) };
    [roll, pitch, yaw].map(f64::to_degrees)
}

/// Rotation from body axes to world axes, for a body that faces `direction` without roll relative to `up`. `None` if
/// `direction` and `up` are parallel, or if one of them is zero or not finite.
pub fn rotation_towards(direction: DVec3, up: DVec3) -> Option<DMat3> {
    let (forward, up) = (direction.try_normalize()?, up.try_normalize()?);
    let left = up.cross(forward);
    if left.length() < 1e-9 {
        return None;
    }
    let left = left.normalize();
    Some(DMat3::from_cols(forward, left, forward.cross(left).normalize()))
}

/// Sine and cosine of an angle in degrees; exact at multiples of 90 degrees, the most common angles.
fn sin_cos_degrees(angle: f64) -> (f64, f64) {
    let angle = angle % 360.0;
    let quarter = (angle / 90.0).round();
    let (s, c) = (angle - 90.0 * quarter).to_radians().sin_cos();
    match (quarter as i64).rem_euclid(4) {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}
