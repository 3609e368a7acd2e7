//! Colours and materials in descriptions.

use raycam_scene::color::linear_from_srgb8;
use raycam_scene::{MaterialModel, NoticeCode};

use crate::schema::described::object;

#[test]
fn mesh_colours_are_multiplied_by_the_material_colour() {
    let color = |json: &str| object(json).unwrap().materials[0].color;
    assert_eq!(color(r#"{ "box": {} }"#), [0.8; 3], "the default colour is grey");
    assert_eq!(color(r##"{ "box": {}, "color": "#ff8000" }"##), linear_from_srgb8([255, 128, 0]));
    let faces = format!("[{}]", ["[1, 0, 0]"; 12].join(","));
    assert_eq!(color(&format!(r#"{{ "box": {{}}, "face_colors": {faces} }}"#)), [1.0; 3]);
    assert_eq!(color(&format!(r#"{{ "box": {{}}, "face_colors": {faces}, "color": [0.5, 0.5, 0.5] }}"#)), [0.5; 3]);
    let too_few = object(r#"{ "box": {}, "face_colors": [[1, 0, 0]] }"#).unwrap_err().to_string();
    assert_eq!(too_few, "face_colors has 1 entry; expected one for each of the 12 triangles");
}

#[test]
fn material_keys_override_defaults() {
    let lecture =
        |diffuse, specular: f32, shininess| MaterialModel::Phong { diffuse, specular: [specular; 3], shininess };
    for (keys, expected) in [
        ("", lecture(1.0, 0.0, 32.0)),
        (r#", "specular": 0.2, "diffuse": 0.5, "shininess": 7"#, lecture(0.5, 0.2, 7.0)),
        (r#", "type": "matte""#, lecture(1.0, 0.0, 32.0)),
        (r#", "type": "matte", "diffuse": 0.3"#, lecture(0.3, 0.0, 32.0)),
        (r#", "type": "unlit""#, MaterialModel::Unlit),
    ] {
        let world = object(&format!(r#"{{ "box": {{}} {keys} }}"#)).unwrap();
        assert_eq!(world.materials[0].model, expected, "{keys}");
        assert!(world.notices.is_empty());
    }
    let bright = object(r#"{ "name": "lamp", "box": {}, "color": [1, 1, 1], "specular": 0.5 }"#).unwrap();
    let [notice] = &bright.notices[..] else { panic!("{:?}", bright.notices) };
    assert_eq!(notice.code, NoticeCode::ReflectanceAboveOne);
    assert!(notice.message.contains(r#""lamp""#) && notice.message.contains("1.5"), "{notice}");
}
