//! Objects in descriptions: placement, shared meshes, and the contents of files.

use glam::DVec3;
use raycam_scene::mesh::primitive;
use raycam_scene::schema::{self, ObjectSpec};
use raycam_scene::{
    AssetLoader, ColorUse, Material, MeshFile, MeshPart, NoAssets, Notice, NoticeCode, TextureSlot, Wrap,
};

use crate::common::{FakeFiles, node};
use crate::schema::described::{assert_error, build, object, object_with};

#[test]
fn objects_are_placed_by_their_transform() {
    let place = |json: &str| object(json).unwrap().objects[0].world_from_mesh;
    let corner = DVec3::new(1.0, 2.0, 3.0);
    let turned = place(r#"{ "box": {}, "location": [10, 0, 0], "yaw": 90, "scale": [2, 1, -1] }"#);
    assert!((turned.transform_point3(corner) - DVec3::new(8.0, 2.0, -3.0)).length() < 1e-12);
    let matrix = place(r#"{ "box": {}, "matrix": [[1, 0, 0, 5], [0, 0, -1, 6], [0, 1, 0, 7], [0, 0, 0, 1]] }"#);
    assert_eq!(matrix.transform_point3(corner), DVec3::new(6.0, 3.0, 9.0));
    // In a y-up world, yaw rotates about y; an object without angles is not rotated.
    let world = build(r#"{ "up": "y", "object": [{ "box": {} }, { "box": {}, "yaw": 90 }] }"#).unwrap();
    assert_eq!(world.objects[0].world_from_mesh, glam::DAffine3::IDENTITY);
    let turned = world.objects[1].world_from_mesh.transform_point3(-DVec3::Z);
    assert!((turned + DVec3::X).length() < 1e-15, "forward becomes left");
}

#[test]
fn instances_share_their_mesh() {
    let world = build(
        r#"{ "object": [
            { "name": "stone", "sphere": { "radius": 2, "level": 1 }, "color": [0.5, 0.5, 0.5] },
            { "instance_of": "stone", "location": [5, 0, 0] },
            { "instance_of": "stone", "scale": [-1, 1, 1], "color": [1, 0, 0], "name": "ruby" }
        ] }"#,
    )
    .unwrap();
    assert_eq!(world.meshes.len(), 1);
    assert_eq!(world.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["stone", "stone-2", "ruby"]);
    assert_eq!(world.objects[1].materials, world.objects[0].materials);
    assert_eq!(world.materials[world.objects[2].materials[0]].color, [1.0, 0.0, 0.0]);
    assert_eq!(world.materials[world.objects[2].materials[0]].name, "ruby");
    assert_eq!(world.stats().object_triangles, 3 * 80);
    assert_eq!(world.stats().mesh_triangles, 80);
}

fn model() -> MeshFile {
    let material =
        |name: &str, texture| Material { name: name.into(), color: [0.6; 3], texture, ..Material::default() };
    let mut files = FakeFiles(MeshFile::default());
    let texture = files.texture("own.png", [Wrap::Repeat; 2], ColorUse::Color).unwrap();
    let part = |mesh, materials| MeshPart { name: "part".into(), mesh, materials };
    MeshFile {
        parts: vec![
            part(primitive::plane([1.0; 2]).unwrap(), vec![1]),
            part(primitive::box_([1.0; 3]).unwrap(), vec![0]),
        ],
        materials: vec![material("paint", Some(TextureSlot::plain(0))), material("chrome", None)],
        textures: vec![texture],
        notices: vec![Notice::new(NoticeCode::DroppedGeometry, "repaired")],
        up: None,
    }
}

#[test]
fn materials_of_mesh_files_are_used_unless_the_object_overrides_them() {
    let mut files = FakeFiles(model());
    let world = object_with(r#"{ "mesh": "models/toy car.obj" }"#, &mut files).unwrap();
    assert_eq!(world.objects[0].name, "toy car");
    assert_eq!(world.objects[0].materials, [0, 1]);
    assert_eq!((world.materials[0].name.as_str(), world.materials[1].name.as_str()), ("chrome", "paint"));
    assert_eq!((world.materials[0].texture, world.materials[1].texture), (None, Some(TextureSlot::plain(0))));
    assert_eq!(world.notices, [Notice::new(NoticeCode::DroppedGeometry, "repaired")]);

    let styled = object_with(r#"{ "mesh": "a.obj", "texture": "b.png", "wrap": ["clamp", "mirror"] }"#, &mut files);
    let styled = styled.unwrap();
    assert_eq!(styled.textures[1].sampler.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert!(styled.materials.iter().all(|m| m.texture == Some(TextureSlot::plain(1)) && m.color == [1.0; 3]));
    let bare = object_with(
        r#"{ "vertices": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]], "texture": "b.png" }"#,
        &mut files,
    );
    assert_error(bare, "texture: the mesh has no texture coordinates; add \"uvs\", one per vertex");
}

#[test]
fn failed_objects_leave_the_world_unchanged() {
    let mut world = object(r#"{ "box": {} }"#).unwrap();
    let before = world.clone();
    for json in [
        r#"{ "sphere": {}, "diffuse": 3 }"#,
        r#"{ "sphere": {}, "scale": 0 }"#,
        r#"{ "sphere": {}, "refine": 20 }"#,
        r#"{ "instance_of": "box", "color": [2.5, 0, 0] }"#,
        r#"{ "sphere": {}, "texture": "x.png" }"#,
    ] {
        let spec = schema::from_value::<ObjectSpec>(&node(json)).unwrap();
        spec.build(&mut world, &mut NoAssets).unwrap_err();
        assert_eq!(world, before, "{json}");
    }
}
