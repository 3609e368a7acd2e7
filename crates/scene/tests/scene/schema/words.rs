//! Terms of other programs: rejected, with raycam's term as a hint.

use crate::schema::described::{assert_error, build, object};

fn light(kind: &str, keys: &str) -> String {
    format!(r#"{{ "light": {{ "type": "{kind}", {keys} }} }}"#)
}

#[test]
fn light_types_of_other_programs_are_refused_with_raycams_names() {
    for (theirs, ours) in [
        ("directional", "sun"),
        ("hdri", "environment"),
        ("omni", "point"),
        ("rectangle", "area"),
        ("Preetham", "daylight"),
    ] {
        let found = build(&light(theirs, r#""radiance": 1"#)).unwrap_err().to_string();
        let expected = format!("light[0].type: unknown name {theirs:?}; did you mean {ours:?}?");
        assert!(found.starts_with(&expected), "{found}");
    }
}

#[test]
fn object_keys_of_other_programs_are_refused_with_raycams_names() {
    assert_error(object(r#"{ "cube": {} }"#), r#"cube: unknown key "cube"; did you mean "box"?"#);
    assert_error(
        object(r#"{ "box": {}, "position": [0, 0, 0] }"#),
        r#"position: unknown key "position"; did you mean "location"?"#,
    );
    assert_error(
        object(r#"{ "box": {}, "rotation": [0, 0, 0] }"#),
        r#"rotation: unknown key "rotation"; did you mean "roll", "pitch" or "yaw"?"#,
    );
    assert_error(
        object(r#"{ "box": {}, "type": "diffuse" }"#),
        r#"type: unknown name "diffuse"; did you mean "matte"?"#,
    );
}

#[test]
fn light_and_render_keys_of_other_programs_are_refused_with_raycams_names() {
    assert_error(
        build(&light("point", r#""location": [0, 0, 0]"#)),
        r#"light[0].location: unknown key "location"; did you mean "position"?"#,
    );
    assert_error(
        build(&light("sun", r#""direction": [0, 0, -1], "color": [1, 1, 1]"#)),
        r#"light[0].color: unknown key "color"; did you mean "irradiance"?"#,
    );
    assert_error(build(r#"{ "render": { "spp": 16 } }"#), r#"render.spp: unknown key "spp"; did you mean "samples"?"#);
}
