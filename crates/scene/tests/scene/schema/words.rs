//! Words that people bring from elsewhere, and the old names of ours.

use raycam_scene::schema::json_schema;
use raycam_scene::{Light, NoticeCode};

use crate::schema::described::{assert_error, build, object};

fn light(kind: &str, keys: &str) -> String {
    format!(r#"{{ "light": {{ "type": "{kind}", {keys} }} }}"#)
}

#[test]
fn types_of_lights_have_our_names() {
    for (theirs, ours) in [
        ("directional", "sun"),
        ("hdri", "environment"),
        ("omni", "point"),
        ("rectangle", "area"),
        ("Preetham", "daylight"),
    ] {
        let found = build(&light(theirs, r#""radiance": 1"#)).unwrap_err().to_string();
        let named = format!("light[0].type: unknown name {theirs:?}; here it is called {ours:?}");
        let near = format!("light[0].type: unknown name {theirs:?}; did you mean {ours:?}?");
        assert!(found.starts_with(&named) || found.starts_with(&near), "{found}");
    }
}

#[test]
fn keys_and_types_of_objects_have_our_names() {
    assert_error(object(r#"{ "cube": {} }"#), r#"cube: unknown key "cube"; here it is called "box""#);
    assert_error(
        object(r#"{ "box": {}, "position": [0, 0, 0] }"#),
        r#"position: unknown key "position"; here it is called "location""#,
    );
    assert_error(
        object(r#"{ "box": {}, "rotation": [0, 0, 0] }"#),
        r#"rotation: unknown key "rotation"; here it is called "roll", "pitch" or "yaw""#,
    );
    assert_error(
        object(r#"{ "box": {}, "type": "diffuse" }"#),
        r#"type: unknown name "diffuse"; here it is called "matte""#,
    );
}

#[test]
fn keys_of_lights_and_renders_have_our_names() {
    assert_error(
        build(&light("point", r#""location": [0, 0, 0]"#)),
        r#"light[0].location: unknown key "location"; here it is called "position""#,
    );
    assert_error(
        build(&light("sun", r#""direction": [0, 0, -1], "color": [1, 1, 1]"#)),
        r#"light[0].color: unknown key "color"; here it is called "irradiance""#,
    );
    assert_error(
        build(r#"{ "render": { "spp": 16 } }"#),
        r#"render.spp: unknown key "spp"; here it is called "samples""#,
    );
}

#[test]
fn a_bulb_is_a_point_light() {
    let keys = r#""position": [0, 0, 1], "power": [1, 1, 1]"#;
    let [bulb, point] = ["bulb", "point"].map(|kind| build(&light(kind, keys)).unwrap());
    assert_eq!(bulb.lights, point.lights);
    assert!(bulb.notices.is_empty());
    assert!(matches!(point.lights[..], [Light::Point { .. }]));
    assert_eq!(point.lights[0].type_name(), "point");
}

#[test]
fn old_names_of_options_are_understood_with_a_notice() {
    let old = build(r#"{ "render": { "noise": 0.01, "time": 2 } }"#).unwrap();
    let new = build(r#"{ "render": { "noise_threshold": 0.01, "time_limit": 2 } }"#).unwrap();
    assert_eq!(old.render, new.render);
    assert!(new.notices.is_empty());
    assert!(old.notices.iter().all(|notice| notice.code == NoticeCode::Renamed));
    for ((old_name, name), notice) in [("noise", "noise_threshold"), ("time", "time_limit")].iter().zip(&old.notices) {
        assert!(notice.message.contains(old_name) && notice.message.contains(name), "{notice}");
    }
}

#[test]
fn an_option_has_one_of_its_names() {
    assert_error(
        build(r#"{ "render": { "time": 2, "time_limit": 2 } }"#),
        r#"render.time: "time_limit" is given too, its name today: give one of them"#,
    );
    assert_error(
        build(r#"{ "render": { "noise": -1 } }"#),
        "render.noise_threshold: -1: expected a number greater than 0",
    );
}

#[test]
fn no_error_and_no_schema_proposes_an_old_name() {
    assert_error(
        build(r#"{ "render": { "nois": 1 } }"#),
        r#"render.nois: unknown key "nois"; did you mean "noise_threshold"?"#,
    );
    let schema = serde_json::to_string(&json_schema()).unwrap();
    assert!(schema.contains(r#""noise_threshold""#) && schema.contains(r#""const":"point""#));
    assert!(!schema.contains(r#""noise""#) && !schema.contains(r#""const":"bulb""#));
}
