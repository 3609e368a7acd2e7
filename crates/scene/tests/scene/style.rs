//! Material descriptions: a texture for each value, and overrides of a file's materials.

use crate::common::{FakeFiles, node};
use raycam_scene::mesh::primitive;
use raycam_scene::schema::{self, ObjectSpec};
use raycam_scene::{
    Glass, Material, MaterialModel, MeshFile, MeshPart, Principled, SceneError, TexelFilter, Texels, World, Wrap,
};

fn build(json: &str) -> Result<World, SceneError> {
    build_from(json, MeshFile::default())
}

fn build_from(json: &str, model: MeshFile) -> Result<World, SceneError> {
    let mut world = World::default();
    schema::from_value::<ObjectSpec>(&node(json))?.build(&mut world, &mut FakeFiles(model))?;
    Ok(world)
}

fn principled(world: &World) -> &Principled {
    match &world.materials[0].model {
        MaterialModel::Principled(p) => p,
        other => panic!("{other:?}"),
    }
}

fn fails(json: &str, words: &str) {
    let error = build(json).expect_err(words).to_string();
    assert!(error.contains(words), "{error}");
}

#[test]
fn every_material_value_accepts_a_texture() {
    let world = build(
        r#"{ "plane": {}, "type": "principled", "texture": "color.png", "metallic": 0.5, "textures": {
            "roughness": "rough.png",
            "metallic": { "image": [[0, 128], [255, 64]], "channel": "red", "filter": "nearest" },
            "normal": { "image": "n.png", "strength": 0.5, "wrap": ["clamp", "mirror"] },
            "occlusion": "ao.png",
            "emission": "glow.png",
            "sheen_color": [[[0.5, 0.25, 2.0]]],
            "iridescence_thickness": "film.png"
        } }"#,
    )
    .unwrap();
    let (material, p) = (&world.materials[0], principled(&world));
    let texture = |slot: Option<raycam_scene::TextureSlot>| &world.textures[slot.unwrap().texture];
    // Colour textures are sRGB and data textures are linear; the value that a texture multiplies is 1 if it is not
    // given.
    assert!(matches!(texture(material.texture).image.texels, Texels::Srgb8(_)));
    assert_eq!(
        (p.roughness.value, &texture(p.roughness.texture).image.texels),
        (1.0, &Texels::Linear8(vec![[255, 0, 0, 255]]))
    );
    let metallic = texture(p.metallic.texture);
    assert_eq!((p.metallic.value, metallic.image.size), (0.5, [2, 2]));
    assert_eq!(metallic.sampler.magnification, TexelFilter::Nearest);
    assert_eq!(metallic.image.texels, Texels::Linear8([0, 128, 255, 64].map(|v| [v; 4]).into()));
    let normal = material.normal_map.unwrap();
    assert_eq!(normal.scale, 0.5);
    let wrap = world.textures[normal.texture.texture].sampler.wrap;
    assert_eq!(wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(material.occlusion.unwrap().value, 1.0);
    assert_eq!(material.emission.value, [1.0; 3]);
    assert_eq!(
        (p.sheen_color.value, &texture(p.sheen_color.texture).image.texels),
        ([1.0; 3], &Texels::Float(vec![[0.5, 0.25, 1.0, 1.0]])) // the value 2 is clamped
    );
    assert_eq!(p.iridescence_thickness, [0.0, 400.0]);
}

#[test]
fn texture_coordinates_are_transformed_as_in_gltf() {
    let world = build(
        r#"{ "plane": {}, "texture": { "image": "a.png", "repeat": [2, 3], "rotation": 90, "offset": [0.5, 0] } }"#,
    )
    .unwrap();
    let slot = world.materials[0].texture.unwrap();
    // KHR_texture_transform: translation * rotation * scale.
    for (uv, expected) in [([0.0, 0.0], [0.5, 0.0]), ([1.0, 0.0], [0.5, -2.0]), ([0.0, 1.0], [3.5, 0.0])] {
        let found = slot.coordinates(uv);
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-6, "{found:?} {expected:?}");
        }
    }
}

#[test]
fn invalid_material_values_are_refused() {
    fails(
        r#"{ "plane": {}, "textures": { "roughness": "a.png" } }"#,
        "textures.roughness: requires type = \"principled\"",
    );
    fails(r#"{ "plane": {}, "type": "principled", "textures": { "rougness": "a.png" } }"#, "roughness");
    fails(r#"{ "plane": {}, "textures": { "normal": { "image": "a.png", "uv_set": 1 } } }"#, "uv_set 1");
    fails(r#"{ "plane": {}, "texture": { "image": "a.png", "strength": 2 } }"#, "texture.strength");
    fails(r#"{ "plane": {}, "texture": [[0, 256]] }"#, "0 to 255");
    fails(r#"{ "plane": {}, "texture": [[0, 1], [2]] }"#, "row 1 has 1 texels");
    fails(r#"{ "plane": {}, "texture": [[[1, 2, 3, 4, 5]]] }"#, "1 to 4");
    fails(r#"{ "plane": {}, "texture": [] }"#, "0 x 0");
    fails(r#"{ "plane": {}, "texture": { "wrap": "clamp" } }"#, "image");
}

#[test]
fn file_materials_can_be_overridden() {
    let file = |model: MaterialModel| MeshFile {
        parts: vec![MeshPart { name: String::new(), mesh: primitive::plane([1.0, 1.0]).unwrap(), materials: vec![0] }],
        materials: vec![Material { color: [0.5; 3], model, ..Material::default() }],
        ..MeshFile::default()
    };
    let gold = Principled { roughness: 0.25.into(), clearcoat: 1.0.into(), ..Principled::default() };
    let gold = || file(MaterialModel::Principled(Box::new(gold.clone())));
    let world = build_from(r#"{ "mesh": "a.glb", "roughness": 0.75 }"#, gold()).unwrap();
    let p = principled(&world);
    assert_eq!((p.roughness.value, p.clearcoat.value, p.metallic.value), (0.75, 1.0, 1.0));
    assert_eq!(world.materials[0].color, [0.5; 3]);
    // If a type is given, all values that are not given are reset to the type's defaults.
    let world = build_from(r#"{ "mesh": "a.glb", "type": "principled", "roughness": 0.75 }"#, gold()).unwrap();
    let p = principled(&world);
    assert_eq!((p.clearcoat.value, p.metallic.value), (0.0, 0.0));
    let glass = file(MaterialModel::Glass(Glass::default()));
    let world = build_from(r#"{ "mesh": "a.glb", "ior": 1.3 }"#, glass.clone()).unwrap();
    assert!(matches!(&world.materials[0].model, MaterialModel::Glass(g) if g.ior == 1.3));
    let error = build_from(r#"{ "mesh": "a.glb", "metallic": 1 }"#, glass).unwrap_err();
    assert!(error.to_string().starts_with("metallic: no material"), "{error}");
    // A second object that shares the first one's materials can change them for itself; the first object's materials
    // are unchanged.
    let mut world = build_from(r#"{ "mesh": "a.glb", "name": "first" }"#, gold()).unwrap();
    let other = node(r#"{ "instance_of": "first", "roughness": 1.0, "textures": { "normal": "n.png" } }"#);
    let other = schema::from_value::<ObjectSpec>(&other).unwrap();
    let id = other.build(&mut world, &mut FakeFiles(MeshFile::default())).unwrap();
    let changed = &world.materials[world.objects[id].materials[0]];
    assert!(changed.normal_map.is_some());
    assert_eq!(principled(&world).roughness.value, 0.25);
}
