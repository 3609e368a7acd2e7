//! The schema reads what people write, and its errors name the key, its place and the nearest name.

mod common;

use common::{FakeFiles, node};
use glam::DVec3;
use raycam_scene::color::linear_from_srgb8;
use raycam_scene::schema::{self, Entry, Node, ObjectSpec, Value, WorldFile};
use raycam_scene::{
    Files, Light, Material, Model, NoFiles, Part, PixelCenter, Reflectance, SceneError,
    TextureSlot, World, Wrap, primitive,
};

fn build(json: &str) -> Result<World, SceneError> {
    schema::from_node::<WorldFile>(&node(json))?.build(&mut NoFiles)
}

fn object(json: &str) -> Result<World, SceneError> {
    object_with(json, &mut NoFiles)
}

fn object_with(
    json: &str,
    files: &mut impl Files<Error = SceneError>,
) -> Result<World, SceneError> {
    let mut world = World::default();
    schema::from_node::<ObjectSpec>(&node(json))?.build(&mut world, files)?;
    Ok(world)
}

/// A camera's keys, after those that every camera of these tests has.
fn camera(json: &str) -> Result<World, SceneError> {
    build(&format!(
        r#"{{ "camera": {{ "size": [640, 480], {json} }} }}"#
    ))
}

#[track_caller]
fn assert_error(result: Result<World, SceneError>, expected: &str) {
    assert_eq!(result.expect_err("an error").to_string(), expected);
}

#[test]
fn the_example_of_the_guide_is_a_world() {
    let world = build(
        r#"{
            "up": "z",
            "camera": { "size": [640, 480], "focal": 800, "location": [4, -6, 3], "roll": 0, "pitch": 20, "yaw": 125 },
            "object": [{ "name": "box", "box": { "size": [1, 1, 1] }, "color": [0.8, 0.1, 0.1], "diffuse": 0.9,
                         "specular": 0.1 }],
            "light": [{ "type": "sun", "direction": [-1, 1, -2], "irradiance": [3, 3, 3] }],
            "video": { "fps": 24, "seconds": 4, "orbit": { "target": [0, 0, 0.5], "degrees": 360 } }
        }"#,
    )
    .unwrap();
    assert_eq!(world.counts().object_triangles, 12);
    assert_eq!(world.objects[0].name, "box");
    assert_eq!(world.materials[0].color, [0.8, 0.1, 0.1]);
    let expected = Reflectance::Lecture {
        diffuse: 0.9,
        specular: [0.1; 3],
        shininess: 32.0,
    };
    assert_eq!(world.materials[0].reflectance, expected);
    assert_eq!(
        world.lights,
        [Light::Sun {
            direction: [-1.0, 1.0, -2.0],
            irradiance: [3.0; 3],
            angular_diameter: 0.0
        }]
    );
    let [roll, pitch, yaw] = world.cameras[0].camera.roll_pitch_yaw(world.up);
    assert!(roll.abs() < 1e-12 && (pitch - 20.0).abs() < 1e-12 && (yaw - 125.0).abs() < 1e-12);
    assert_eq!(world.video.unwrap().frame_count(), 96);
}

#[test]
fn unknown_keys_and_names_get_the_nearest() {
    assert_error(
        build(r#"{ "objects": [] }"#),
        r#"objects: unknown key "objects"; did you mean "object"?"#,
    );
    assert_error(
        build(r#"{ "object": [{ "box": {} }, { "box": {}, "colour": [1, 1, 1] }] }"#),
        r#"object[1].colour: unknown key "colour"; did you mean "color"?"#,
    );
    assert_error(
        object(r#"{ "sphere": { "radios": 1 } }"#),
        r#"sphere.radios: unknown key "radios"; did you mean "radius"?"#,
    );
    assert_error(
        object(r#"{ "box": {}, "type": "unlitt" }"#),
        r#"type: unknown name "unlitt"; did you mean "unlit"?"#,
    );
    assert_error(
        build(r#"{ "light": { "type": "lamp" } }"#),
        r#"light[0].type: unknown name "lamp"; expected one of "sun", "bulb", "spot", "area", "disk", "ies", "sky", "daylight", "environment""#,
    );
    assert_error(
        build(r#"{ "light": { "type": "sun", "direction": [0, 0, -1], "iradiance": [1, 1, 1] } }"#),
        r#"light[0].iradiance: unknown key "iradiance"; did you mean "irradiance"?"#,
    );
    assert_error(
        build(r#"{ "up": "x" }"#),
        r#"up: unknown name "x"; expected one of "z", "y""#,
    );
    assert_error(
        build(r#"{ "object": [{ "box": {}, "name": "table" }, { "instance_of": "tabel" }] }"#),
        r#"object[1].instance_of: no object "tabel" among 1; did you mean "table"?"#,
    );
    let world = camera(r#""name": "left", "focal": 500, "location": [0, 0, 0]"#).unwrap();
    let error = world.find_camera("lefft").unwrap_err().to_string();
    assert_eq!(error, r#"no camera "lefft" among 1; did you mean "left"?"#);
}

#[test]
fn wrong_types_and_lengths_say_what_was_expected() {
    assert_error(
        object(r#"{ "box": { "size": "big" } }"#),
        r#"box.size: "big": expected a number or a list of 3 numbers"#,
    );
    assert_error(
        object(r#"{ "box": { "size": [1, 2] } }"#),
        "box.size: a list of 2: expected a number or a list of 3 numbers",
    );
    assert_error(
        object(r#"{ "box": {}, "location": [1, 2, 3, 4] }"#),
        "location: a list of 4: expected a list of 3",
    );
    assert_error(
        object(r#"{ "box": {}, "location": [1, 2] }"#),
        "location: a list of 2: expected a list of 3",
    );
    assert_error(
        object(r#"{ "box": {}, "location": [1, 2, "3"] }"#),
        r#"location[2]: "3": expected a number"#,
    );
    assert_error(
        object(r#"{ "box": {}, "color": "red" }"#),
        r##"color: "red": expected a list of 3 numbers (linear, 0..=1) or "#rrggbb" (8-bit sRGB)"##,
    );
    assert_error(
        object(r#"{ "box": {}, "refine": -1 }"#),
        "refine: -1: expected a whole number of levels or a table { levels, scheme }",
    );
    assert_error(
        object(r#"{ "box": {}, "refine": { "scheme": "loop" } }"#),
        r#"refine: the key "levels" is missing"#,
    );
    assert_error(
        object(r#"{ "box": {}, "name": 7 }"#),
        "name: 7: expected a string",
    );
    assert_error(
        camera(r#""focal": [1, 2, 3], "location": [0, 0, 0]"#),
        "camera[0].focal: a list of 3: expected a list of 2",
    );
    assert_error(
        build(r#"{ "camera": { "size": [640, -480] } }"#),
        "camera[0].size[1]: -480: expected a whole number >= 0",
    );
    assert_error(
        build(r#"{ "camera": { "size": [640, 480.5] } }"#),
        "camera[0].size[1]: 480.5: expected a whole number >= 0",
    );
    assert_error(build(r#"{ "light": 5 }"#), "light: 5: expected a list");
    assert_error(
        build(r#"{ "light": [5] }"#),
        r#"light[0]: 5: expected one of "sun", "bulb", "spot", "area", "disk", "ies", "sky", "daylight", "environment""#,
    );
    assert_error(
        build(r#"{ "light": {} }"#),
        r#"light[0]: the key "type" is missing: one of "sun", "bulb", "spot", "area", "disk", "ies", "sky", "daylight", "environment""#,
    );
    assert_error(
        build(r#"{ "light": { "type": "sky" } }"#),
        "light[0]: a sky without radiance: give radiance, or zenith and horizon, in W/(m² sr)",
    );
    assert_error(
        build(r#"{ "render": { "samples": 0 } }"#),
        "render.samples: 0: expected a whole number >= 1",
    );
    assert_error(
        build(r#"{ "render": { "ambient_occlusion": "yes" } }"#),
        r#"render.ambient_occlusion: "yes": expected true, false or a distance in metres"#,
    );
    assert_error(build(r#"[1]"#), "a list: expected a table");
}

#[test]
fn values_that_make_no_sense_name_their_key() {
    assert_error(
        object(r#"{ "box": {}, "diffuse": 1.5 }"#),
        "diffuse: 1.5: expected 0..=1",
    );
    assert_error(
        object(r#"{ "box": {}, "specular": [0, 0, -1] }"#),
        "specular: [0.0, 0.0, -1.0]: expected 0..=1",
    );
    assert_error(
        object(r#"{ "box": {}, "color": [0, 0, 255] }"#),
        "color: [0.0, 0.0, 255.0]: expected 0..=1",
    );
    assert_error(
        object(r#"{ "box": {}, "shininess": -1 }"#),
        "shininess: -1: expected a finite number >= 0, the Phong exponent",
    );
    assert_error(
        object(r#"{ "box": {}, "scale": 0 }"#),
        "scale: [0.0, 0.0, 0.0]: expected finite numbers other than 0",
    );
    assert_error(
        object(r#"{ "box": { "size": [1, 0, 1] } }"#),
        "box: box size [1.0, 0.0, 1.0]: expected finite lengths greater than 0",
    );
    assert_error(
        object(r#"{ "box": {}, "type": "matte", "specular": 0.5 }"#),
        "specular: type = \"matte\" is diffuse alone; leave out the type for diffuse and specular",
    );
    assert_error(
        object(r#"{ "box": {}, "type": "unlit", "diffuse": 0.5 }"#),
        "diffuse: type = \"unlit\" shows the base colour itself and reflects no light",
    );
    assert_error(
        object(r#"{ "box": {}, "wrap": "clamp" }"#),
        "wrap: it goes with \"texture\", which is missing",
    );
    assert_error(
        object(r#"{ "box": {}, "sphere": {} }"#),
        "sphere: \"box\" is given too: expected one shape, of box, plane, sphere, cylinder, cone, torus, mesh, vertices, instance_of",
    );
    assert_error(
        object("{}"),
        "no shape: expected one of box, plane, sphere, cylinder, cone, torus, mesh, vertices, instance_of",
    );
    assert_error(
        object(r#"{ "vertices": [[0, 0, 0]] }"#),
        "vertices: it goes with \"triangles\", which is missing",
    );
    assert_error(
        object(r#"{ "vertices": [[0, 0, 0]], "triangles": [[0, 1, 2]] }"#),
        "triangle 0 has corners [0, 1, 2], but there are 1 vertices: indices are 0..=0",
    );
    assert_error(
        object(r#"{ "box": {}, "triangles": [[0, 1, 2]] }"#),
        "triangles: it goes with \"vertices\", which is missing",
    );
    assert_error(
        object(r#"{ "box": {}, "matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]] }"#),
        "matrix: it is singular: it flattens the object",
    );
    assert_error(
        object(r#"{ "box": {}, "matrix": [[1, 0, 0, 0], [0, 1, 0, 0]] }"#),
        "matrix: 2 rows of 4: expected 3 or 4",
    );
    assert_error(
        object(r#"{ "box": {}, "yaw": 5, "matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] }"#),
        "yaw: \"matrix\" is given too, and says it already: give one of them",
    );
    assert_error(
        object(r#"{ "box": {}, "normals": [[0, 0, 0]] }"#),
        "normals[0]: [0.0, 0.0, 0.0]: expected a direction, not 0, all finite",
    );
    assert_error(
        object(r#"{ "mesh": "bunny.ply" }"#),
        "mesh \"bunny.ply\": files cannot be read here",
    );
    assert_error(
        build(r#"{ "object": [{ "box": {} }, { "instance_of": "box", "refine": 1 }] }"#),
        "object[1].refine: the mesh is that of another object: this belongs there",
    );
    let bulb = |rest: &str| {
        build(&format!(
            r#"{{ "light": {{ "type": "bulb", "position": [0, 0, 0], {rest} }} }}"#
        ))
    };
    assert!(
        bulb(r#""radius": 1"#)
            .unwrap_err()
            .to_string()
            .starts_with("light[0]: a bulb without power or intensity")
    );
    assert!(
        bulb(r#""power": [1, 1, 1], "intensity": [1, 1, 1]"#)
            .unwrap_err()
            .to_string()
            .contains("both power and")
    );
    assert_error(
        bulb(r#""power": [1, 1, -1]"#),
        "light[0]: power [1.0, 1.0, -1.0]: expected red, green, blue that are finite and >= 0",
    );
    let sun = r#"{ "light": { "type": "sun", "direction": [0, 0, 0], "irradiance": [1, 1, 1] } }"#;
    assert!(build(sun).unwrap_err().to_string().contains("not all 0"));
}

#[test]
fn a_camera_has_one_set_of_intrinsics_and_one_pose() {
    let k = r#""K": [[500, 2, 300], [0, 510, 200], [0, 0, 1]]"#;
    let r = r#""R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"#;
    let here = r#""location": [0, 0, 0]"#;
    let world = camera(&format!(
        r#"{k}, {r}, "t": [1, 2, 3], "pixel_center": "half""#
    ))
    .unwrap();
    let built = &world.cameras[0].camera;
    assert_eq!(
        (built.k().y_axis.x, built.c()),
        (2.0, DVec3::new(-1.0, -2.0, -3.0))
    );
    assert_eq!(built.pixel_center(), PixelCenter::Half);
    let world = camera(&format!(
        r#""focal": [500, 400], "skew": 3, "principal_point": [5, 6], {here}"#
    ))
    .unwrap();
    let k_built = world.cameras[0].camera.k();
    assert_eq!(
        k_built.to_cols_array(),
        [500.0, 0.0, 0.0, 3.0, 400.0, 0.0, 5.0, 6.0, 1.0]
    );
    let world = camera(r#""matrix": [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 2]]"#).unwrap();
    assert_eq!(world.cameras[0].camera.c(), -DVec3::Z);
    let world = camera(r#""fov": 60, "location": [0, -5, 0], "target": [0, 0, 0]"#).unwrap();
    assert!((world.cameras[0].camera.forward() - DVec3::Y).length() < 1e-15);

    let fails = |json: &str, expected: &str| assert_error(camera(json), expected);
    fails(
        here,
        "camera[0]: no intrinsics: expected one of focal, fov, K, height, matrix",
    );
    fails(
        &format!(r#""focal": 5, "fov": 5, {here}"#),
        r#"camera[0].fov: "focal" is given too: expected one intrinsics, of focal, fov, K, height, matrix"#,
    );
    fails(
        &format!(r#"{k}, "skew": 1, {here}"#),
        r#"camera[0].skew: "K" is given too, and says it already"#,
    );
    fails(
        r#""focal": 5"#,
        "camera[0]: no pose: expected location with roll, pitch, yaw or target, or R with C or t, or matrix",
    );
    fails(
        &format!(r#"{k}, {r}"#),
        "camera[0]: no position beside R: expected one of C, t",
    );
    fails(
        &format!(r#"{k}, {r}, "C": [0, 0, 0], "yaw": 3"#),
        r#"camera[0].yaw: "R" is given too: expected R with C or t alone"#,
    );
    fails(
        &format!(r#"{k}, "C": [0, 0, 0]"#),
        r#"camera[0].C: it goes with "R", which is missing; with angles or a target it is "location""#,
    );
    fails(
        &format!(r#""focal": 5, {here}, "target": [1, 0, 0], "yaw": 3"#),
        r#"camera[0].yaw: "target" is given too: expected angles or a target"#,
    );
    fails(
        &format!(r#""focal": 5, {here}, "up": [1, 0, 0]"#),
        r#"camera[0].up: it goes with "target", which is missing; with angles, roll leans the camera"#,
    );
    fails(
        &format!(r#""fov": 200, {here}"#),
        "camera[0].fov: a vertical field of view of 200: expected degrees between 0 and 180, both excluded",
    );
    fails(
        r#""matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]]"#,
        "camera[0].matrix: P = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]] has rank 2: a camera matrix has rank 3",
    );
    fails(
        r#""matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]], "fov": 3"#,
        r#"camera[0].fov: "matrix" is given too, and says it already: give one of them"#,
    );
}

#[test]
fn colours_shine_through() {
    let color = |json: &str| object(json).unwrap().materials[0].color;
    assert_eq!(
        color(r#"{ "box": {} }"#),
        [0.8; 3],
        "grey where nothing is said"
    );
    assert_eq!(
        color(r##"{ "box": {}, "color": "#ff8000" }"##),
        linear_from_srgb8([255, 128, 0])
    );
    let faces = format!("[{}]", ["[1, 0, 0]"; 12].join(","));
    assert_eq!(
        color(&format!(r#"{{ "box": {{}}, "face_colors": {faces} }}"#)),
        [1.0; 3]
    );
    assert_eq!(
        color(&format!(
            r#"{{ "box": {{}}, "face_colors": {faces}, "color": [0.5, 0.5, 0.5] }}"#
        )),
        [0.5; 3]
    );
    let too_few = object(r#"{ "box": {}, "face_colors": [[1, 0, 0]] }"#)
        .unwrap_err()
        .to_string();
    assert_eq!(
        too_few,
        "face_colors has 1 entries, expected one for each of the 12 triangles"
    );
}

#[test]
fn materials_follow_what_is_said() {
    let lecture = |diffuse, specular: f32, shininess| Reflectance::Lecture {
        diffuse,
        specular: [specular; 3],
        shininess,
    };
    for (keys, expected) in [
        ("", lecture(1.0, 0.0, 32.0)),
        (
            r#", "specular": 0.2, "diffuse": 0.5, "shininess": 7"#,
            lecture(0.5, 0.2, 7.0),
        ),
        (r#", "type": "matte""#, lecture(1.0, 0.0, 32.0)),
        (
            r#", "type": "matte", "diffuse": 0.3"#,
            lecture(0.3, 0.0, 32.0),
        ),
        (r#", "type": "unlit""#, Reflectance::Unlit),
    ] {
        let world = object(&format!(r#"{{ "box": {{}} {keys} }}"#)).unwrap();
        assert_eq!(world.materials[0].reflectance, expected, "{keys}");
        assert!(world.notices.is_empty());
    }
    let bright =
        object(r#"{ "name": "lamp", "box": {}, "color": [1, 1, 1], "specular": 0.5 }"#).unwrap();
    assert_eq!(
        bright.notices,
        [
            r#"material "lamp" reflects 1.5 of the light that arrives (diffuse * color + specular), more than all of it"#
        ]
    );
}

#[test]
fn objects_stand_where_they_are_put() {
    let place = |json: &str| object(json).unwrap().objects[0].world_from_mesh;
    let corner = DVec3::new(1.0, 2.0, 3.0);
    let turned = place(r#"{ "box": {}, "location": [10, 0, 0], "yaw": 90, "scale": [2, 1, -1] }"#);
    assert!((turned.transform_point3(corner) - DVec3::new(8.0, 2.0, -3.0)).length() < 1e-12);
    let matrix = place(
        r#"{ "box": {}, "matrix": [[1, 0, 0, 5], [0, 0, -1, 6], [0, 1, 0, 7], [0, 0, 0, 1]] }"#,
    );
    assert_eq!(matrix.transform_point3(corner), DVec3::new(6.0, 3.0, 9.0));
    // In a y-up world yaw turns about y, and nothing is turned where no angle is given.
    let world =
        build(r#"{ "up": "y", "object": [{ "box": {} }, { "box": {}, "yaw": 90 }] }"#).unwrap();
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
    assert_eq!(
        world
            .objects
            .iter()
            .map(|o| o.name.as_str())
            .collect::<Vec<_>>(),
        ["stone", "stone-2", "ruby"]
    );
    assert_eq!(world.objects[1].materials, world.objects[0].materials);
    assert_eq!(
        world.materials[world.objects[2].materials[0]].color,
        [1.0, 0.0, 0.0]
    );
    assert_eq!(world.materials[world.objects[2].materials[0]].name, "ruby");
    assert_eq!(world.counts().object_triangles, 3 * 80);
    assert_eq!(world.counts().mesh_triangles, 80);
}

fn model() -> Model {
    let material = |name: &str, texture| Material {
        name: name.into(),
        color: [0.6; 3],
        texture,
        ..Material::default()
    };
    let mut files = FakeFiles(Model::default());
    let texture = files.texture("own.png", [Wrap::Repeat; 2]).unwrap();
    let part = |mesh, materials| Part {
        name: "part".into(),
        mesh,
        materials,
    };
    Model {
        parts: vec![
            part(primitive::plane([1.0; 2]).unwrap(), vec![1]),
            part(primitive::box_([1.0; 3]).unwrap(), vec![0]),
        ],
        materials: vec![
            material("paint", Some(TextureSlot::plain(0))),
            material("chrome", None),
        ],
        textures: vec![texture],
        notices: vec!["repaired".into()],
    }
}

#[test]
fn a_mesh_file_brings_its_materials_and_the_description_overrides_them() {
    let mut files = FakeFiles(model());
    let world = object_with(r#"{ "mesh": "models/toy car.obj" }"#, &mut files).unwrap();
    assert_eq!(world.objects[0].name, "toy car");
    assert_eq!(world.objects[0].materials, [0, 1]);
    assert_eq!(
        (
            world.materials[0].name.as_str(),
            world.materials[1].name.as_str()
        ),
        ("chrome", "paint")
    );
    assert_eq!(
        (world.materials[0].texture, world.materials[1].texture),
        (None, Some(TextureSlot::plain(0)))
    );
    assert_eq!(world.notices, ["repaired"]);

    let styled = object_with(
        r#"{ "mesh": "a.obj", "texture": "b.png", "wrap": ["clamp", "mirror"] }"#,
        &mut files,
    );
    let styled = styled.unwrap();
    assert_eq!(styled.textures[1].sampler.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert!(
        styled
            .materials
            .iter()
            .all(|m| m.texture == Some(TextureSlot::plain(1)) && m.color == [1.0; 3])
    );
    let bare = object_with(
        r#"{ "vertices": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]], "texture": "b.png" }"#,
        &mut files,
    );
    assert_error(
        bare,
        "texture: the mesh has no texture coordinates: give \"uvs\", one for each vertex",
    );
}

#[test]
fn a_failed_object_leaves_the_world_as_it_was() {
    let mut world = object(r#"{ "box": {} }"#).unwrap();
    let before = world.clone();
    for json in [
        r#"{ "sphere": {}, "diffuse": 3 }"#,
        r#"{ "sphere": {}, "scale": 0 }"#,
        r#"{ "sphere": {}, "refine": 20 }"#,
        r#"{ "instance_of": "box", "color": [2, 0, 0] }"#,
        r#"{ "sphere": {}, "texture": "x.png" }"#,
    ] {
        let spec = schema::from_node::<ObjectSpec>(&node(json)).unwrap();
        spec.build(&mut world, &mut NoFiles).unwrap_err();
        assert_eq!(world, before, "{json}");
    }
}

#[test]
fn arrays_are_lists_of_lists_and_null_is_absent() {
    let entry = |key: &str, value| Entry {
        key: key.into(),
        key_span: None,
        node: Node::from(value),
    };
    let vertices = Value::Floats {
        shape: vec![3, 3],
        data: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    };
    let triangles = Value::Integers {
        shape: vec![1, 3],
        data: vec![0, 1, 2],
    };
    let table = |vertices: &Value, triangles: &Value| {
        Node::from(Value::Table(vec![
            entry("vertices", vertices.clone()),
            entry("triangles", triangles.clone()),
            entry("color", Value::Null),
            entry(
                "diffuse",
                Value::Floats {
                    shape: vec![],
                    data: vec![0.5],
                },
            ),
        ]))
    };
    let read = |node: &Node| schema::from_node::<ObjectSpec>(node);
    let spec = read(&table(&vertices, &triangles)).unwrap();
    assert_eq!(spec.vertices.unwrap()[1], [1.0, 0.0, 0.0]);
    assert_eq!(spec.triangles.unwrap(), [[0, 1, 2]]);
    assert_eq!((spec.diffuse, spec.color), (Some(0.5), None));

    let fails = |vertices: Value, triangles: Value, expected: &str| {
        assert_eq!(
            read(&table(&vertices, &triangles)).unwrap_err().to_string(),
            expected
        );
    };
    let flat = Value::Floats {
        shape: vec![9],
        data: vec![0.0; 9],
    };
    fails(
        flat,
        triangles.clone(),
        "vertices[0]: 0: expected a list of 3",
    );
    let wide = Value::Floats {
        shape: vec![2, 4],
        data: vec![0.0; 8],
    };
    fails(
        wide,
        triangles.clone(),
        "vertices[0]: a list of 4: expected a list of 3",
    );
    let short = Value::Floats {
        shape: vec![usize::MAX, 3],
        data: vec![0.0; 8],
    };
    let shape = format!(
        "vertices: an array of shape [{}, 3] with 8 numbers",
        usize::MAX
    );
    fails(short, triangles, &shape);
    let negative = Value::Integers {
        shape: vec![1, 3],
        data: vec![0, 1, -2],
    };
    fails(
        vertices.clone(),
        negative,
        "triangles[0][2]: -2: expected a whole number >= 0",
    );
    // Whole floats are whole numbers, as NumPy makes them by the way.
    let floats = Value::Floats {
        shape: vec![1, 3],
        data: vec![0.0, 1.0, 2.0],
    };
    assert_eq!(
        read(&table(&vertices, &floats)).unwrap().triangles.unwrap(),
        [[0, 1, 2]]
    );
    let empty = Value::Floats {
        shape: vec![0, 3],
        data: vec![],
    };
    assert!(
        read(&table(&empty, &floats))
            .unwrap()
            .vertices
            .unwrap()
            .is_empty()
    );
}

#[test]
fn errors_know_their_place_in_the_text() {
    let span = |node: &mut Node, range| node.span = Some(range);
    let mut root = node(r#"{ "light": [{ "type": "sun", "direction": [0, 0, "x"] }] }"#);
    span(&mut root, 0..100);
    let Value::Table(entries) = &mut root.value else {
        unreachable!()
    };
    entries[0].key_span = Some(2..7);
    let Value::List(lights) = &mut entries[0].node.value else {
        unreachable!()
    };
    span(&mut lights[0], 10..60);
    let Value::Table(light) = &mut lights[0].value else {
        unreachable!()
    };
    let direction = light
        .iter_mut()
        .find(|entry| entry.key == "direction")
        .unwrap();
    direction.key_span = Some(20..29);
    let Value::List(numbers) = &mut direction.node.value else {
        unreachable!()
    };
    span(&mut numbers[2], 40..43);
    let error = schema::from_node::<WorldFile>(&root).unwrap_err();
    let SceneError::Schema { path, span, .. } = error else {
        panic!("{error}")
    };
    assert_eq!(
        (path.as_str(), span),
        ("light[0].direction[2]", Some(40..43))
    );
    assert_eq!(root.span_at("light[0].direction[2]"), Some(40..43));
    assert_eq!(root.span_at("light[0].direction"), Some(20..29));
    assert_eq!(
        root.span_at("light[0].irradiance"),
        Some(10..60),
        "the nearest ancestor"
    );
    assert_eq!(root.span_at(""), Some(0..100));
}

#[test]
fn the_json_schema_names_every_key_and_is_closed() {
    let schema = serde_json::to_value(schema::json_schema()).unwrap();
    assert_eq!(schema["additionalProperties"], false);
    let object = &schema["$defs"]["ObjectSpec"];
    for key in ["box", "instance_of", "type", "wrap", "refine", "matrix"] {
        assert!(
            object["properties"][key]["description"].is_string(),
            "{key}"
        );
    }
    assert_eq!(object["additionalProperties"], false);
    let lights = schema["$defs"]["Light"]["oneOf"].as_array().unwrap();
    let types: Vec<_> = lights
        .iter()
        .map(|light| light["properties"]["type"]["const"].as_str().unwrap())
        .collect();
    assert_eq!(
        types,
        [
            "sun",
            "bulb",
            "spot",
            "area",
            "disk",
            "ies",
            "sky",
            "daylight",
            "environment"
        ]
    );
    assert!(
        lights
            .iter()
            .all(|light| light["additionalProperties"] == false)
    );
    assert_eq!(
        lights[0]["required"],
        serde_json::json!(["type", "direction", "irradiance"])
    );
}
