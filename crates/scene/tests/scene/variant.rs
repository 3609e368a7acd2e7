//! Material variants of a world.

use glam::DAffine3;
use raycam_scene::mesh::primitive;
use raycam_scene::world::Variant;
use raycam_scene::{Material, Object, World};

#[test]
fn variants_change_only_materials() {
    let mut world = World::default();
    let mesh = world.add_mesh(primitive::plane([1.0; 2]).unwrap());
    for _ in 0..2 {
        world.add_material(Material::default()).unwrap();
    }
    let object = Object::new("a", mesh, vec![0], DAffine3::IDENTITY);
    world.add_object(object).unwrap();
    world.variants.push(Variant { name: "night".into(), materials: vec![(0, 0, 1)] });
    let night = world.with_variant("night").unwrap();
    assert_eq!(night.objects[0].materials, [1]);
    assert_eq!((world.objects[0].materials[0], &night.meshes), (0, &world.meshes));
    let error = world.with_variant("nigth").unwrap_err().to_string();
    assert_eq!(error, "no variant named \"nigth\"; the world has 1 variant; did you mean \"night\"?");
}
