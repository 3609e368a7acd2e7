//! Changes of single material slots in descriptions.

use raycam_scene::mesh::primitive;
use raycam_scene::schema::{self, ObjectSpec};
use raycam_scene::{ErrorCode, Material, MaterialModel, MeshFile, MeshPart, SceneError, TextureSlot, World};

use crate::common::{FakeFiles, node};
use crate::schema::described::object_with;

/// A file with the materials "chrome" of a box and "paint" of a plane.
fn car() -> FakeFiles {
    let material = |name: &str| Material { name: name.into(), color: [0.6; 3], ..Material::default() };
    let part = |mesh, materials| MeshPart { name: "part".into(), mesh, materials };
    FakeFiles(MeshFile {
        parts: vec![
            part(primitive::box_([1.0; 3]).unwrap(), vec![0]),
            part(primitive::plane([1.0; 2]).unwrap(), vec![1]),
        ],
        materials: vec![material("chrome"), material("paint")],
        ..MeshFile::default()
    })
}

fn change(world: &mut World, json: &str) -> Result<(), SceneError> {
    schema::from_value::<ObjectSpec>(&node(json))?.change(world, 0, &mut car())
}

fn material(world: &World, slot: usize) -> &Material {
    &world.materials[world.objects[0].materials[slot]]
}

#[test]
fn slots_by_name_and_number_change_only_their_material() {
    let json = r##"{ "mesh": "car.obj", "emission": 2, "slots": {
        "paint": { "type": "principled", "roughness": 0.25, "texture": "a.png", "textures": { "roughness": "b.png" } },
        "0": { "color": [1, 0, 0], "texture": "c.png" } } }"##;
    let world = object_with(json, &mut car()).unwrap();
    let (chrome, paint) = (material(&world, 0), material(&world, 1));
    assert_eq!((chrome.color, chrome.texture), ([1.0, 0.0, 0.0], Some(TextureSlot::plain(0))));
    assert!(matches!(chrome.model, MaterialModel::Phong { .. }));
    assert_eq!((paint.color, paint.texture), ([1.0; 3], Some(TextureSlot::plain(1))));
    let MaterialModel::Principled(model) = &paint.model else { panic!("principled") };
    assert_eq!((model.roughness.value, model.roughness.texture.map(|slot| slot.texture)), (0.25, Some(2)));
    assert_eq!((chrome.emission.value, paint.emission.value), ([2.0; 3], [2.0; 3]));
    assert_eq!(world.textures.len(), 3);
}

#[test]
fn changed_slot_keeps_the_materials_of_other_slots_and_objects() {
    let mut world = object_with(r#"{ "mesh": "car.obj" }"#, &mut car()).unwrap();
    let spec: ObjectSpec = schema::from_value(&node(r#"{ "instance_of": "car" }"#)).unwrap();
    spec.build(&mut world, &mut car()).unwrap();
    let before = world.clone();
    change(&mut world, r#"{ "slots": { "paint": { "color": [0, 0, 1] } } }"#).unwrap();
    assert_eq!(material(&world, 0), material(&before, 0));
    assert_eq!(*material(&world, 1), Material { color: [0.0, 0.0, 1.0], ..material(&before, 1).clone() });
    let theirs = |world: &World| world.objects[1].materials.iter().map(|&i| world.materials[i].clone()).collect();
    let (now, then): (Vec<Material>, Vec<Material>) = (theirs(&world), theirs(&before));
    assert_eq!(now, then);
}

#[test]
fn slots_with_a_common_material_change_separately() {
    let mut world = object_with(r#"{ "mesh": "car.obj" }"#, &mut car()).unwrap();
    world.objects[0].materials = vec![0, 0, 0];
    change(&mut world, r#"{ "slots": { "1": { "color": [0, 1, 0] } } }"#).unwrap();
    let colors = [0, 1, 2].map(|slot| material(&world, slot).color);
    assert_eq!(colors, [[0.6; 3], [0.0, 1.0, 0.0], [0.6; 3]]);
    assert_eq!(world.objects[0].materials[0], world.objects[0].materials[2], "one material for equal slots");
}

#[test]
fn slots_that_do_not_exist_and_keys_of_objects_are_refused() {
    let mut world = object_with(r#"{ "mesh": "car.obj" }"#, &mut car()).unwrap();
    let before = world.clone();
    for (json, code, path) in [
        (r#"{ "slots": { "2": { "color": [1, 0, 0] } } }"#, ErrorCode::UnknownName, "slots.2"),
        (r#"{ "slots": { "pain": { "color": [1, 0, 0] } } }"#, ErrorCode::UnknownName, "slots.pain"),
        (r#"{ "slots": { "paint": { "yaw": 20 } } }"#, ErrorCode::ConflictingValues, "slots.paint.yaw"),
        (r#"{ "slots": { "paint": { "name": "x" } } }"#, ErrorCode::ConflictingValues, "slots.paint.name"),
        (r#"{ "slots": { "paint": { "box": {} } } }"#, ErrorCode::ConflictingValues, "slots.paint.box"),
        (r#"{ "slots": { "paint": { "slots": {} } } }"#, ErrorCode::ConflictingValues, "slots.paint.slots"),
        (
            r#"{ "slots": { "1": { "opacity": 1 }, "paint": { "opacity": 1 } } }"#,
            ErrorCode::ConflictingValues,
            "slots.paint",
        ),
        (r#"{ "slots": { "paint": { "opacity": 2 } } }"#, ErrorCode::OutOfRange, "slots.paint.opacity"),
        (r#"{ "slots": { "paint": { "metallic": 1 } } }"#, ErrorCode::ConflictingValues, "slots.paint.metallic"),
    ] {
        let error = change(&mut world, json).unwrap_err();
        assert_eq!(error.code(), code, "{json}: {error}");
        assert!(matches!(&error, SceneError::Schema { path: given, .. } if given == path), "{json}: {error:?}");
        assert_eq!(world, before, "{json}");
    }
}

#[test]
fn unknown_key_of_a_slot_lists_only_material_keys() {
    let mut world = object_with(r#"{ "mesh": "car.obj" }"#, &mut car()).unwrap();
    let error = change(&mut world, r#"{ "slots": { "paint": { "colr": [1, 0, 0] } } }"#).unwrap_err();
    assert_eq!(error.code(), ErrorCode::UnknownKey);
    assert!(matches!(&error, SceneError::Schema { path, .. } if path == "slots.paint.colr"), "{error:?}");
    let text = error.to_string();
    assert!(text.contains("roughness") && !text.contains("sphere") && !text.contains("slots,"), "{text}");
}
