//! The schema reads descriptions, and its errors name the key, its position and the nearest name.

mod camera;
mod described;
mod errors;
mod material_slots;
mod object;
mod style;
mod words;

use raycam_scene::schema::{self, Entry, ObjectSpec, SpannedValue, Value};
use raycam_scene::{Light, MaterialModel};

use described::build;

#[test]
fn guide_example_is_a_valid_world() {
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
    assert_eq!(world.stats().object_triangles, 12);
    assert_eq!(world.objects[0].name, "box");
    assert_eq!(world.materials[0].color, [0.8, 0.1, 0.1]);
    let expected = MaterialModel::Phong { diffuse: 0.9, specular: [0.1; 3], shininess: 32.0 };
    assert_eq!(world.materials[0].model, expected);
    assert_eq!(
        world.lights,
        [Light::Sun { direction: [-1.0, 1.0, -2.0], irradiance: [3.0; 3], angular_diameter: 0.0 }]
    );
    let [roll, pitch, yaw] = world.cameras[0].camera.roll_pitch_yaw(world.up);
    assert!(roll.abs() < 1e-12 && (pitch - 20.0).abs() < 1e-12 && (yaw - 125.0).abs() < 1e-12);
    assert_eq!(world.video.unwrap().frame_count(), 96);
}

#[test]
fn arrays_equal_lists_of_lists_and_null_means_absent() {
    let floats = |shape, data| Value::Floats { shape, data };
    let integers = |shape, data| Value::Integers { shape, data };
    let entry = |key: &str, value| Entry { key: key.into(), key_span: None, value: SpannedValue::from(value) };
    let vertices = floats(vec![3, 3], vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let triangles = integers(vec![1, 3], vec![0, 1, 2]);
    let table = |vertices: &Value, triangles: &Value| {
        SpannedValue::from(Value::Table(vec![
            entry("vertices", vertices.clone()),
            entry("triangles", triangles.clone()),
            entry("color", Value::Null),
            entry("diffuse", floats(vec![], vec![0.5])),
        ]))
    };
    let read = |node: &SpannedValue| schema::from_value::<ObjectSpec>(node);
    let spec = read(&table(&vertices, &triangles)).unwrap();
    assert_eq!(spec.vertices.unwrap()[1], [1.0, 0.0, 0.0]);
    assert_eq!(spec.triangles.unwrap(), [[0, 1, 2]]);
    assert_eq!((spec.diffuse, spec.color), (Some(0.5), None));

    let fails = |vertices: Value, triangles: Value, expected: &str| {
        assert_eq!(read(&table(&vertices, &triangles)).unwrap_err().to_string(), expected);
    };
    let flat = floats(vec![9], vec![0.0; 9]);
    fails(flat, triangles.clone(), "vertices[0]: 0; expected a list of length 3");
    let wide = floats(vec![2, 4], vec![0.0; 8]);
    fails(wide, triangles.clone(), "vertices[0]: a list of length 4; expected a list of length 3");
    let short = floats(vec![usize::MAX, 3], vec![0.0; 8]);
    let shape =
        format!("vertices: 8 numbers for the array shape [{}, 3]; expected as many as the shape's product", usize::MAX);
    fails(short, triangles, &shape);
    let negative = integers(vec![1, 3], vec![0, 1, -2]);
    fails(vertices.clone(), negative, "triangles[0][2]: -2; expected a whole number >= 0");
    // Whole floats count as whole numbers, because NumPy often produces them.
    let whole = floats(vec![1, 3], vec![0.0, 1.0, 2.0]);
    assert_eq!(read(&table(&vertices, &whole)).unwrap().triangles.unwrap(), [[0, 1, 2]]);
    let empty = floats(vec![0, 3], vec![]);
    assert!(read(&table(&empty, &whole)).unwrap().vertices.unwrap().is_empty());
}

#[test]
fn json_schema_names_every_key_and_allows_no_others() {
    let schema = serde_json::to_value(schema::json_schema()).unwrap();
    assert_eq!(schema["additionalProperties"], false);
    let object = &schema["$defs"]["ObjectSpec"];
    for key in ["box", "instance_of", "type", "wrap", "refine", "matrix"] {
        assert!(object["properties"][key]["description"].is_string(), "{key}");
    }
    assert_eq!(object["additionalProperties"], false);
    let lights = schema["$defs"]["Light"]["oneOf"].as_array().unwrap();
    let types: Vec<_> = lights.iter().map(|light| light["properties"]["type"]["const"].as_str().unwrap()).collect();
    assert_eq!(types, ["sun", "point", "spot", "area", "disk", "ies", "projector", "sky", "daylight", "environment"]);
    assert!(lights.iter().all(|light| light["additionalProperties"] == false));
    assert_eq!(lights[0]["required"], serde_json::json!(["type", "direction"]));
}
