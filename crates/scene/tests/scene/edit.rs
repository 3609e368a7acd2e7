//! Changes in place: indices are updated, and unused parts are removed.

use glam::{DAffine3, DVec3};
use raycam_scene::mesh::primitive;
use raycam_scene::world::Variant;
use raycam_scene::{Light, Material, Object, Texture, TextureSlot, World};

/// Objects a, b and c, each with its own mesh, material and texture; c shows the mesh of a.
fn three() -> World {
    let mut world = World::default();
    for (i, name) in ["a", "b", "c"].into_iter().enumerate() {
        let mesh = world.add_mesh(primitive::sphere(1.0 + i as f64, 0).unwrap());
        let image = raycam_scene::Image::new(name, [1, 1], raycam_scene::Texels::Float(vec![[i as f32; 4]]));
        let texture = world.add_texture(Texture { image: image.into(), sampler: Default::default() });
        let material = Material { texture: Some(TextureSlot::plain(texture)), ..Material::default() };
        let material = world.add_material(material).unwrap();
        let mesh = if name == "c" { 0 } else { mesh };
        world.add_object(Object::new(name, mesh, vec![material], DAffine3::IDENTITY)).unwrap();
    }
    world
}

#[test]
fn indices_are_updated_after_removing_an_object() {
    let mut world = three();
    world.variants.push(Variant { name: "v".into(), materials: vec![(1, 0, 0), (2, 0, 1)] });
    world.remove_object(1).unwrap();
    assert_eq!(world.variants[0].materials, [(1, 0, 1)]);
    let names: Vec<_> = world.objects.iter().map(|object| &object.name[..]).collect();
    assert_eq!(names, ["a", "c"]);
    // The mesh of b is removed, but its material stays because the variant uses it. Parts that were never used stay.
    assert_eq!((world.meshes.len(), world.materials.len(), world.textures.len()), (2, 3, 3));
    assert_eq!(world.objects[1].materials, [2]);
    // After the removal, the name can be used again.
    let again = Object::new("b", 0, vec![0], DAffine3::IDENTITY);
    world.add_object(again).unwrap();
    assert_eq!(world.objects[2].name, "b");
}

#[test]
fn unused_parts_are_removed_with_their_last_user() {
    let mut world = three();
    world.remove_object(0).unwrap();
    assert_eq!((world.meshes.len(), world.materials.len(), world.textures.len()), (3, 2, 2));
    assert_eq!(world.objects[1].materials, [1]);
    let texture = world.materials[1].texture.unwrap().texture;
    assert_eq!(world.textures[texture].image.name, "c");
    world.remove_object(1).unwrap();
    // The mesh that was added for c remains, because no object ever used it.
    assert_eq!((world.meshes.len(), world.materials.len(), world.textures.len()), (2, 1, 1));
}

#[test]
fn missing_objects_and_flat_transforms_are_refused() {
    let mut world = three();
    let before = world.clone();
    let message = world.remove_object(3).unwrap_err().to_string();
    assert_eq!(message, "object 3 does not exist; the world has 3, with indices 0 to 2");
    assert!(world.place_object(0, DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))).is_err());
    assert!(world.set_light(0, Light::uniform_sky([1.0; 3])).is_err());
    assert!(world.remove_light(0).is_err());
    assert_eq!(world, before);
}
