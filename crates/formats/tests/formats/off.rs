use std::path::Path;

use raycam_formats::{Budget, decode_model, read_model};

use crate::support::{area, data, error, mesh, message, model, mutations, texts, truncations};

const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

#[test]
fn off_counts_may_be_on_any_line() {
    let expected = mesh("a.off", format!("OFF\n4 1 4\n{SQUARE}4 0 1 2 3\n"));
    assert_eq!(expected.triangles, [[0, 1, 2], [0, 2, 3]]);
    for head in ["OFF 4 1 4", "# first\n\nOFF # kind\n# counts\n4 1", "4 1 0", "\u{feff}OFF\r\n4 1 0\r"] {
        assert_eq!(mesh("a.off", format!("{head}\n{SQUARE}\n4 0 1 2 3 # a face\n")), expected, "{head}");
    }
}

#[test]
fn vertices_have_normals_colours_and_texture_coordinates_in_this_order() {
    let mesh = mesh(
        "a.off",
        "STCNOFF\n3 1 0\n0 0 0 0 0 2 255 0 0 255 0 0\n1 0 0 0 0 1 0 188 0 255 1 0\n0 1 0 0 0 1 0 0 0 255 0 1\n3 0 1 2\n",
    );
    assert_eq!(mesh.normals.unwrap(), [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(mesh.uvs.unwrap(), [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    let colors = mesh.vertex_colors.unwrap();
    assert_eq!(colors[0], [1.0, 0.0, 0.0]);
    assert!((colors[1][1] - 0.502886).abs() < 1e-5);
}

#[test]
fn whole_colours_are_srgb_and_fractions_linear() {
    let colors = |rows: &str| mesh("a.off", format!("OFF\n4 2 0\n{SQUARE}{rows}")).face_colors.unwrap();
    assert_eq!(colors("3 0 1 2 255 0 0\n3 0 2 3 0 1 0\n")[0], [1.0, 0.0, 0.0]);
    assert!(colors("3 0 1 2 255 0 0\n3 0 2 3 0 1 0\n")[1][1] < 0.001);
    assert_eq!(colors("3 0 1 2 0.5 0 0\n3 0 2 3 0 1 0\n"), [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(colors("3 0 1 2 1 0 0\n3 0 2 3 0 1 0\n"), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let some = model("a.off", format!("OFF\n4 2 0\n{SQUARE}3 0 1 2 1.0 0 0 0.5\n3 0 2 3 7\n"));
    assert_eq!(some.parts[0].mesh.face_colors.as_ref().unwrap()[1], [1.0; 3]);
    let notices = texts(&some.notices).join("\n");
    assert!(
        notices.contains("1 face shown in white: colour map indices are not supported")
            && notices.contains("transparency of 1 face"),
        "{notices}"
    );
    let cube = read_model(&data("comments.off"), &Budget::default()).unwrap();
    let mesh = &cube.parts[0].mesh;
    assert_eq!((mesh.triangles.len(), mesh.face_colors.as_ref().unwrap()[2]), (12, [0.3, 0.4, 0.0]));
    assert!((area(mesh) - 32.0).abs() < 1e-4);
}

#[test]
fn faces_with_one_or_two_corners_are_skipped() {
    let file = format!("OFF\n4 4 0\n{SQUARE}2 0 1 9 9 9\n3 0 1 2 255 0 0\n1 3\n3 0 2 3 0 0 255\n");
    let read = model("a.off", file);
    let mesh = &read.parts[0].mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let colors = mesh.face_colors.as_deref().unwrap();
    assert_eq!(colors, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert!(read.notices[0].to_string().ends_with("2 faces omitted: fewer than 3 corners, the first in line 7"));
}

#[test]
fn faces_with_more_than_a_million_corners_are_refused() {
    // The polygon has far more corners than the step limit allows, and one corner fewer or more than the maximum.
    let error = |corners: usize| {
        let indices: String = (0..corners).map(|i| format!(" {}", i % 4)).collect();
        let file = format!("OFF\n4 1 0\n{SQUARE}{corners}{indices}\n");
        let budget = Budget { steps: 1, ..Budget::default() };
        let read = decode_model(file.into(), Path::new("a.off"), &budget);
        read.unwrap_err().to_string()
    };
    let expected = "a.off: a face has 1048577 corners; the maximum is 1048576";
    assert_eq!(error((1 << 20) + 1), expected);
    let fewer = error(1 << 20);
    assert!(fewer.contains("steps"), "{fewer}");
}

#[test]
fn numbers_may_follow_the_header_word_and_faces_may_span_lines() {
    let plain = model("a.off", format!("OFF\n4 2 0\n{SQUARE}3 0 1 2\n3 0 2 3\n"));
    assert_eq!(plain.parts[0].mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    for text in [
        format!("OFF4 2 0\n{SQUARE}3 0 1 2\n3 0 2 3\n"),
        format!("  OFF4 2 0 # ModelNet\n{SQUARE}3 0 1 2\n3 0 2 3\n"),
        format!("OFF\n4 2 0\n{SQUARE}3 0\n\n1 # one\n2\n3\n0 2 3\n"),
    ] {
        let read = model("a.off", text.clone());
        assert_eq!(read.parts[0].mesh, plain.parts[0].mesh, "{text}");
        assert_eq!(read.notices, plain.notices, "{text}");
    }
}

#[test]
fn off_errors_contain_the_line() {
    for (text, expected) in [
        (
            "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 4\n",
            "a.off:7: face 0: vertex \"4\", but the file has 4 vertices (numbered from 0)",
        ),
        (
            "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 -1\n",
            "a.off:7: face 0: vertex \"-1\", but the file has 4 vertices (numbered from 0)",
        ),
        ("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1\n", "a.off:7: face 0 ends after 2 of 3 corners"),
        (
            "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 1\n",
            "a.off: no faces, only 4 vertices; there is nothing to render",
        ),
        (
            "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 9\n",
            "a.off:7: face 0: vertex \"9\", but the file has 4 vertices (numbered from 0)",
        ),
        (
            "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n-3 0 1 2\n",
            "a.off:7: face 0: expected the number of corners, a whole number >= 0",
        ),
        (
            "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n99999999999 0 1\n",
            "a.off:7: face 0 ends after 2 of 99999999999 corners",
        ),
        ("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n# last\n0 1 0\n", "a.off:7: the file ends after 0 of 1 faces"),
        (
            "OFF\n4 1 0\n0 0 0\n1 inf 0\n1 1 0\n0 1 0\n3 0 1 2\n",
            "a.off: all faces have vertices that are not finite; there is nothing to render",
        ),
        ("OFF\n4 1 0\n0 0 0\n1 0\n1 1 0\n0 1 0\n3 0 1 2\n", "a.off:4: vertex 1: expected 3 numbers"),
        ("OFF\n4 0 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n", "a.off: no faces, only 4 vertices; there is nothing to render"),
        ("OFF\nmany\n", "a.off:2: expected the numbers of vertices, faces and edges"),
        ("OFF\n", "a.off:1: the numbers of vertices and faces are missing"),
        (
            "4OFF\n1 1 0\n",
            "a.off: \"4OFF\": unsupported kind of OFF file; expected three dimensions (OFF, COFF, NOFF, STOFF or a combination)",
        ),
        ("OFF BINARY\n", "a.off: binary OFF is not supported; save the file as text"),
        ("PLY\n", "a.off:1: \"PLY\": not an OFF file"),
        ("OFFS 3 1 0\n", "a.off:1: \"OFFS\": not an OFF file"),
        ("", "a.off: the file is empty; its download or export may be incomplete"),
    ] {
        assert_eq!(error("a.off", text), expected, "{text}");
    }
    for (name, expected) in [
        ("OutOfMemory.off", "OutOfMemory.off:2: 353535235358 vertices and 6 faces declared, but only 289 bytes follow"),
        ("invalid.off", "invalid.off:8: face 1: vertex \"20\", but the file has 3 vertices (numbered from 0)"),
    ] {
        let path = data(name);
        assert_eq!(message(read_model(&path, &Budget::default()).unwrap_err(), &path), expected);
    }
}

#[test]
fn colours_outside_the_specified_range_cause_notices() {
    for (color, expected, said) in [
        ("300 0 0", None, "all face colours are ignored, because the largest value is 300; expected 0 to 255"),
        ("255.0 0 0", Some([1.0, 0.0, 0.0]), "contain fractions up to 255 and are read as 0 to 255"),
        ("1.001 0 0.5", Some([1.0, 0.0, 0.5]), "contain values up to 1.001, which are clamped to 1"),
        ("-1 1 0", Some([0.0, 1.0, 0.0]), "face colours that are negative or not finite"),
    ] {
        let model = model("a.off", format!("OFF\n4 1 0\n{SQUARE}3 0 1 2 {color}\n"));
        assert_eq!(model.parts[0].mesh.face_colors.as_ref().map(|colors| colors[0]), expected, "{color}");
        assert!(model.notices[0].to_string().contains(said), "{:?}", model.notices);
    }
}

#[test]
fn only_one_of_two_sources_of_colour_is_used() {
    let vertices = SQUARE.replace('\n', " 9 8 7 255\n").replacen("9 8 7", "1 2 3", 1);
    let model = model("a.off", format!("COFF\n4 1 0\n{vertices}4 0 1 2 3 200 120 40\n"));
    let mesh = &model.parts[0].mesh;
    assert!(mesh.vertex_colors.is_some() && mesh.face_colors.is_none());
    assert_eq!(
        texts(&model.notices),
        ["a.off: the mesh has vertex and face colours; only the vertex colours are used"]
    );
}

#[test]
fn damaged_off_files_cause_an_error_or_a_notice() {
    let text = format!("COFF\n4 2 0\n{}3 0 1 2 0.25 0.5 1 1\n3 0 2 3\n", SQUARE.replace('\n', " 1 2 3 4\n"));
    truncations("a.off", text.as_bytes(), |_| false);
    mutations("a.off", text.as_bytes(), 20_000);
}
