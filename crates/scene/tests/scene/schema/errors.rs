//! Errors name the key, its position and the nearest name.

use raycam_scene::SceneError;
use raycam_scene::schema::{self, SpannedValue, Value, WorldFile};

use crate::common::node;
use crate::schema::described::{assert_error, build, camera, object};

#[test]
fn unknown_keys_and_names_get_a_suggestion() {
    assert_error(build(r#"{ "objects": [] }"#), r#"objects: unknown key "objects"; did you mean "object"?"#);
    assert_error(
        build(r#"{ "object": [{ "box": {} }, { "box": {}, "colour": [1, 1, 1] }] }"#),
        r#"object[1].colour: unknown key "colour"; did you mean "color"?"#,
    );
    assert_error(
        object(r#"{ "sphere": { "radios": 1 } }"#),
        r#"sphere.radios: unknown key "radios"; did you mean "radius"?"#,
    );
    assert_error(object(r#"{ "box": {}, "type": "unlitt" }"#), r#"type: unknown name "unlitt"; did you mean "unlit"?"#);
    assert_error(
        build(r#"{ "light": { "type": "torch" } }"#),
        r#"light[0].type: unknown name "torch"; expected one of "sun", "bulb", "point", "spot", "area", "disk", "ies", "projector", "sky", "daylight", "environment""#,
    );
    assert_error(
        build(r#"{ "light": { "type": "sun", "direction": [0, 0, -1], "iradiance": [1, 1, 1] } }"#),
        r#"light[0].iradiance: unknown key "iradiance"; did you mean "irradiance"?"#,
    );
    assert_error(build(r#"{ "up": "x" }"#), r#"up: unknown name "x"; expected one of "z", "y""#);
    assert_error(
        build(r#"{ "object": [{ "box": {}, "name": "table" }, { "instance_of": "tabel" }] }"#),
        r#"object[1].instance_of: no object named "tabel"; the world has 1 object; did you mean "table"?"#,
    );
    let world = camera(r#""name": "left", "focal": 500, "location": [0, 0, 0]"#).unwrap();
    let error = world.find_camera("lefft").unwrap_err().to_string();
    assert_eq!(error, r#"no camera named "lefft"; the world has 1 camera; did you mean "left"?"#);
}

#[test]
fn wrong_types_and_lengths_report_the_expectation() {
    assert_error(
        object(r#"{ "box": { "size": "big" } }"#),
        r#"box.size: "big"; expected a number or a list of 3 numbers"#,
    );
    assert_error(
        object(r#"{ "box": { "size": [1, 2] } }"#),
        "box.size: a list of length 2; expected a number or a list of 3 numbers",
    );
    assert_error(
        object(r#"{ "box": {}, "location": [1, 2, 3, 4] }"#),
        "location: a list of length 4; expected a list of length 3",
    );
    assert_error(
        object(r#"{ "box": {}, "location": [1, 2] }"#),
        "location: a list of length 2; expected a list of length 3",
    );
    assert_error(object(r#"{ "box": {}, "location": [1, 2, "3"] }"#), r#"location[2]: "3"; expected a number"#);
    assert_error(
        object(r#"{ "box": {}, "color": "redd" }"#),
        r##"color: "redd"; expected 3 numbers (linear, 0 to 1), one number (grey), "#rrggbb" (8-bit sRGB) or a name ("red"); did you mean "red"?"##,
    );
    assert_error(
        object(r#"{ "box": {}, "refine": -1 }"#),
        "refine: -1; expected a whole number of levels or a table { levels, scheme }",
    );
    assert_error(object(r#"{ "box": {}, "refine": { "scheme": "loop" } }"#), r#"refine: the key "levels" is missing"#);
    assert_error(object(r#"{ "box": {}, "name": 7 }"#), "name: 7; expected a string");
    assert_error(
        camera(r#""focal": [1, 2, 3], "location": [0, 0, 0]"#),
        "camera[0].focal: a list of length 3; expected a list of length 2",
    );
    assert_error(
        build(r#"{ "camera": { "size": [640, -480] } }"#),
        "camera[0].size[1]: -480; expected a whole number >= 0",
    );
    assert_error(
        build(r#"{ "camera": { "size": [640, 480.5] } }"#),
        "camera[0].size[1]: 480.5; expected a whole number >= 0",
    );
    assert_error(build(r#"{ "light": 5 }"#), "light: 5; expected a list");
    assert_error(build(r#"{ "light": [5] }"#), "light[0]: 5; expected a table");
    assert_error(
        build(r#"{ "light": {} }"#),
        r#"light[0]: the key "type" is missing; expected one of "sun", "bulb", "point", "spot", "area", "disk", "ies", "projector", "sky", "daylight", "environment""#,
    );
    assert_error(
        build(r#"{ "light": { "type": "sky" } }"#),
        "light[0]: a sky without radiance; use radiance, or zenith and horizon, in W/(m² sr)",
    );
    assert_error(
        build(r#"{ "render": { "samples": 0 } }"#),
        "render.samples: 0; expected a whole number from 1 to 16777216",
    );
    assert_error(
        build(r#"{ "render": { "ambient_occlusion": "yes" } }"#),
        r#"render.ambient_occlusion: "yes"; expected true, false or a distance in metres greater than 0"#,
    );
    assert_error(build(r#"[1]"#), "a list; expected a table");
}

#[test]
fn invalid_values_are_reported_with_their_key() {
    assert_error(object(r#"{ "box": {}, "diffuse": 1.5 }"#), "diffuse: 1.5; expected 0 to 1");
    assert_error(object(r#"{ "box": {}, "specular": [0, 0, -1] }"#), "specular: [0.0, 0.0, -1.0]; expected 0 to 1");
    assert_error(
        object(r#"{ "box": {}, "color": [0, 0, 255] }"#),
        "color: [0, 0, 255]; expected linear numbers from 0 to 1 (for bytes, write \"#0000ff\", or in Python numpy.uint8([0, 0, 255]))",
    );
    assert_error(
        object(r#"{ "box": {}, "shininess": -1 }"#),
        "shininess: -1; expected a finite number >= 0, the Phong exponent",
    );
    assert_error(
        object(r#"{ "box": {}, "scale": 0 }"#),
        "scale: [0.0, 0.0, 0.0]; expected finite numbers other than 0",
    );
    assert_error(
        object(r#"{ "box": { "size": [1, 0, 1] } }"#),
        "box: box size [1.0, 0.0, 1.0]; expected finite lengths greater than 0",
    );
    assert_error(
        object(r#"{ "box": {}, "type": "matte", "specular": 0.5 }"#),
        "specular: type = \"matte\" is only diffuse; omit the type for diffuse and specular",
    );
    assert_error(
        object(r#"{ "box": {}, "type": "unlit", "diffuse": 0.5 }"#),
        "diffuse: type = \"unlit\" shows only the base colour and reflects no light",
    );
    assert_error(object(r#"{ "box": {}, "wrap": "clamp" }"#), "wrap: requires \"texture\", which is missing");
    assert_error(
        object(r#"{ "box": {}, "sphere": {} }"#),
        "sphere: cannot be combined with \"box\"; expected only one of the keys for the shape: box, plane, sphere, \
         cylinder, cone, torus, mesh, vertices, instance_of",
    );
    assert_error(
        object("{}"),
        "no shape given; expected one of box, plane, sphere, cylinder, cone, torus, mesh, vertices, instance_of",
    );
    assert_error(object(r#"{ "vertices": [[0, 0, 0]] }"#), "vertices: requires \"triangles\", which is missing");
    assert_error(
        object(r#"{ "vertices": [[0, 0, 0]], "triangles": [[0, 1, 2]] }"#),
        "triangle 0 has corners [0, 1, 2], but the mesh has 1 vertex; expected indices 0 to 0",
    );
    assert_error(
        object(r#"{ "box": {}, "triangles": [[0, 1, 2]] }"#),
        "triangles: requires \"vertices\", which is missing",
    );
    assert_error(
        object(r#"{ "box": {}, "matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]] }"#),
        "matrix: the matrix is singular, so it flattens the object; expected an invertible matrix",
    );
    assert_error(
        object(r#"{ "box": {}, "matrix": [[1, 0, 0, 0], [0, 1, 0, 0]] }"#),
        "matrix: 2 rows of 4 numbers; expected 3 or 4 rows",
    );
    assert_error(
        object(r#"{ "box": {}, "yaw": 5, "matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] }"#),
        "yaw: cannot be combined with \"matrix\", which already contains it; use only one of them",
    );
    assert_error(
        object(r#"{ "box": {}, "normals": [[0, 0, 0]] }"#),
        "normals[0]: [0.0, 0.0, 0.0]; expected a finite direction other than 0",
    );
    assert_error(
        object(r#"{ "mesh": "bunny.ply" }"#),
        "mesh \"bunny.ply\": files are not supported in this world description",
    );
    assert_error(
        build(r#"{ "object": [{ "box": {} }, { "instance_of": "box", "refine": 1 }] }"#),
        "object[1].refine: the mesh belongs to the object of instance_of; set this key for that object",
    );
    let point = |rest: &str| build(&format!(r#"{{ "light": {{ "type": "point", "position": [0, 0, 0], {rest} }} }}"#));
    assert!(
        point(r#""radius": 1"#)
            .unwrap_err()
            .to_string()
            .starts_with("light[0]: a point light without power or intensity")
    );
    assert!(point(r#""power": [1, 1, 1], "intensity": [1, 1, 1]"#).unwrap_err().to_string().contains("both power and"));
    assert_error(
        point(r#""power": [1, 1, -1]"#),
        "light[0]: power is [1.0, 1.0, -1.0]; expected finite red, green and blue >= 0",
    );
    let sun = r#"{ "light": { "type": "sun", "direction": [0, 0, 0], "irradiance": [1, 1, 1] } }"#;
    assert!(build(sun).unwrap_err().to_string().contains("not all 0"));
}

#[test]
fn errors_contain_their_position_in_the_text() {
    let span = |node: &mut SpannedValue, range| node.span = Some(range);
    let mut root = node(r#"{ "light": [{ "type": "sun", "direction": [0, 0, "x"] }] }"#);
    span(&mut root, 0..100);
    let Value::Table(entries) = &mut root.value else { unreachable!() };
    entries[0].key_span = Some(2..7);
    let Value::List(lights) = &mut entries[0].value.value else { unreachable!() };
    span(&mut lights[0], 10..60);
    let Value::Table(light) = &mut lights[0].value else { unreachable!() };
    let direction = light.iter_mut().find(|entry| entry.key == "direction").unwrap();
    direction.key_span = Some(20..29);
    let Value::List(numbers) = &mut direction.value.value else { unreachable!() };
    span(&mut numbers[2], 40..43);
    let error = schema::from_value::<WorldFile>(&root).unwrap_err();
    let SceneError::Schema { path, span, .. } = error else { panic!("{error}") };
    assert_eq!((path.as_str(), span), ("light[0].direction[2]", Some(40..43)));
    assert_eq!(root.span_at("light[0].direction[2]"), Some(40..43));
    assert_eq!(root.span_at("light[0].direction"), Some(20..29));
    assert_eq!(root.span_at("light[0].irradiance"), Some(10..60), "the nearest ancestor");
    assert_eq!(root.span_at(""), Some(0..100));
}

#[test]
fn unknown_keys_list_the_valid_keys() {
    for (key, near) in [("cube", "box"), ("rotation", "roll"), ("colour", "color"), ("zzz", "")] {
        let error = object(&format!(r#"{{ "box": {{}}, "{key}": 1 }}"#)).expect_err("an unknown key").to_string();
        let (said, list) = error.split_once(" (available: ").expect("a list");
        assert!(said.contains(near), "{said}");
        for name in ["box", "mesh", "instance_of", "location", "upright", "color", "diffuse_transmission_color"] {
            assert!(list.split([',', ' ', ')']).any(|word| word == name), "{name} is not in {list}");
        }
    }
}
