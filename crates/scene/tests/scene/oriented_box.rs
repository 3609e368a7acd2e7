//! Oriented boxes compared with closed forms.

use glam::{DAffine3, DMat3, DVec3};
use raycam_scene::mesh::primitive;
use raycam_scene::{Material, Object, World};

fn placed(world_from_mesh: DAffine3) -> raycam_scene::mesh::oriented_box::OrientedBox {
    let mut world = World::default();
    let mesh = primitive::box_([2.0, 4.0, 6.0]).unwrap();
    let material = world.add_material(Material::for_mesh(&mesh)).unwrap();
    let mesh = world.add_mesh(mesh);
    let object = Object::new("", mesh, vec![material], world_from_mesh);
    world.add_object(object).unwrap();
    assert!(world.oriented_box(1).is_none());
    world.oriented_box(0).unwrap()
}

#[test]
fn oriented_box_of_a_rotated_and_scaled_box_is_that_box() {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.3).normalize(), 2.5);
    let shift = DVec3::new(100.0, -7.0, 3.0);
    for scale in [DVec3::ONE, DVec3::new(0.01, 3.0, 500.0), DVec3::new(-1.0, 2.0, 3.0)] {
        let linear = turn * DMat3::from_diagonal(scale);
        let found = placed(DAffine3::from_mat3_translation(linear, shift));
        let size = DVec3::new(2.0, 4.0, 6.0) * scale.abs();
        assert!((found.size / size - DVec3::ONE).length() < 1e-9, "{found:?}");
        assert!((found.center - shift).length() < 1e-9, "{found:?}");
        assert!((found.rotation.determinant() - 1.0).abs() < 1e-12);
        for axis in 0..3 {
            let along = found.rotation.col(axis).dot(turn.col(axis)).abs();
            assert!((along - 1.0).abs() < 1e-9, "{found:?}");
        }
    }
}

#[test]
fn sheared_boxes_are_inside_their_oriented_box() {
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.8, 1.0, 0.0), DVec3::new(0.0, 0.5, 0.6));
    let found = placed(DAffine3::from_mat3(shear));
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for i in 0..8 {
        let sign = |bit: i32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let corner = shear * DVec3::new(sign(0), 2.0 * sign(1), 3.0 * sign(2));
        let local = found.rotation.transpose() * (corner - found.center);
        (low, high) = (low.min(local), high.max(local));
    }
    assert!((high - found.size / 2.0).length() < 1e-9 && (low + found.size / 2.0).length() < 1e-9);
    assert!((found.rotation * found.rotation.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-12));
}
