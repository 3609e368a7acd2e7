//! Roll, pitch and yaw: rotation axes and order.

use crate::common::Random;
use glam::{DMat3, DVec3};
use raycam_scene::Up;
use raycam_scene::math::rotation::{
    CAMERA_FROM_BODY, object_rotation, rotation_from_rpy, rotation_towards, rpy_from_rotation, world_from_reference,
};

fn distance(a: DMat3, b: DMat3) -> f64 {
    (a - b).to_cols_array().into_iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

#[test]
fn rotations_apply_yaw_pitch_roll_in_this_order() {
    let mut random = Random(1);
    for _ in 0..200 {
        let [roll, pitch, yaw]: [f64; 3] = std::array::from_fn(|_| random.between(-400.0, 400.0));
        let expected = DMat3::from_rotation_z(yaw.to_radians())
            * DMat3::from_rotation_y(pitch.to_radians())
            * DMat3::from_rotation_x(roll.to_radians());
        assert!(distance(rotation_from_rpy(roll, pitch, yaw), expected) < 4e-15);
    }
}

#[test]
fn quarter_turns_are_exact() {
    let quarter = DMat3::from_cols(DVec3::Y, -DVec3::X, DVec3::Z);
    let mut turned = DMat3::IDENTITY;
    for yaw in [0.0, 90.0, 180.0, 270.0, 360.0, 450.0, -270.0] {
        let expected = if yaw == -270.0 { quarter } else { turned };
        assert_eq!(rotation_from_rpy(0.0, 0.0, yaw), expected, "{yaw}");
        turned = quarter * turned;
    }
}

#[test]
fn angles_round_trip_near_gimbal_lock() {
    for pitch in [0.0, 45.0, 89.0, 89.999_999, 90.0, -90.0, -89.999_999_99] {
        for (roll, yaw) in [(0.0, 0.0), (30.0, -70.0), (179.0, 10.0)] {
            let rotation = rotation_from_rpy(roll, pitch, yaw);
            let [r, p, y] = rpy_from_rotation(rotation);
            assert!(distance(rotation_from_rpy(r, p, y), rotation) < 1e-9, "{roll} {pitch} {yaw}: {r} {p} {y}");
            assert!((p - pitch).abs() < 1e-6);
        }
    }
}

#[test]
fn reference_axes_are_right_handed_and_point_up() {
    for up in [Up::Z, Up::Y] {
        let axes = world_from_reference(up);
        assert_eq!(axes.determinant(), 1.0);
        assert_eq!(axes.z_axis, up.axis());
        // Zero angles leave an object unchanged; yaw rotates it about the up axis.
        assert_eq!(object_rotation(0.0, 0.0, 0.0, up), DMat3::IDENTITY);
        assert!(
            distance(object_rotation(0.0, 0.0, 33.0, up), DMat3::from_axis_angle(up.axis(), 33_f64.to_radians()))
                < 1e-15
        );
    }
    assert_eq!(CAMERA_FROM_BODY.determinant(), 1.0);
    assert_eq!(CAMERA_FROM_BODY * DVec3::X, DVec3::Z, "forward");
    assert_eq!(CAMERA_FROM_BODY * DVec3::Y, -DVec3::X, "left");
    assert_eq!(CAMERA_FROM_BODY * DVec3::Z, -DVec3::Y, "up");
}

#[test]
fn facing_a_direction_has_no_roll() {
    let mut random = Random(2);
    for _ in 0..100 {
        let direction = DVec3::from_array(std::array::from_fn(|_| random.between(-3.0, 3.0)));
        let rotation = rotation_towards(direction, DVec3::Z).unwrap();
        assert!((rotation.x_axis - direction.normalize()).length() < 1e-15);
        assert!(rotation.y_axis.z.abs() < 1e-15 && rotation.z_axis.z > 0.0);
        assert!(distance(rotation * rotation.transpose(), DMat3::IDENTITY) < 4e-15);
        assert!(rpy_from_rotation(rotation)[0].abs() < 1e-9);
    }
    assert!(rotation_towards(DVec3::Z * 5.0, DVec3::Z).is_none());
    assert!(rotation_towards(DVec3::ZERO, DVec3::Z).is_none());
    assert!(rotation_towards(DVec3::X, DVec3::NAN).is_none());
}
