use raycam_formats::{Budget, load, read_model};

use crate::support::{area, data, error, mesh, model, mutations, truncations, vector_area};

const FACES: [[[f32; 3]; 3]; 4] = [
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-0.0, 0.0, 1.0]],
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
];

fn binary(count: u32) -> Vec<u8> {
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    for face in FACES {
        bytes.extend([0; 12]);
        face.as_flattened().iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([0x34, 0x92]);
    }
    bytes
}

fn ascii(name: &str) -> String {
    let mut text = format!("solid {name}\n");
    for [a, b, c] in FACES {
        let [a, b, c] = [a, b, c].map(|[x, y, z]| format!("    vertex {x} {y:e} {z}\n"));
        text += &format!("  facet normal 0 nan 0\n   outer loop\n{a}{b}{c}   endloop\n  endfacet\n");
    }
    text + &format!("endsolid {name}\n")
}

#[test]
fn both_kinds_hold_the_same_welded_solid() {
    let one = mesh("a.stl", binary(4));
    assert_eq!((one.vertices.len(), one.triangles.len()), (4, 4));
    assert!(vector_area(&one).length() < 1e-15 && (area(&one) - (1.5 + 0.75_f64.sqrt())).abs() < 1e-12);
    assert_eq!(mesh("a.STL", ascii("a")), one);
    assert_eq!(mesh("a.stl", ascii("").to_uppercase().replace('\n', "\r\n")), one);
}

#[test]
fn each_solid_is_a_part() {
    let two = ascii("first one") + &ascii("") + "solid nothing\nendsolid nothing\n";
    let parts = model("a.stl", two).parts;
    assert_eq!(parts.iter().map(|part| &part.name[..]).collect::<Vec<_>>(), ["first one", ""]);
    let world = load(&data("multibody.stl"), &Budget::default()).unwrap();
    assert_eq!(world.objects.len(), 2);
    let triangle = read_model(&data("triangle_with_empty_solid.stl"), &Budget::default()).unwrap();
    assert_eq!(triangle.parts.len(), 1);
}

#[test]
fn the_length_is_trusted_over_the_number() {
    for count in [0, u32::MAX, 2] {
        let model = model("a.stl", binary(count));
        assert_eq!(model.parts[0].mesh.triangles.len(), 4);
        assert!(model.notices[0].contains(&format!("{count} facets declared, 4 found and used")));
    }
    let padded = model("a.stl", [&binary(4)[..], &[0; 7]].concat());
    assert_eq!(padded.parts[0].mesh.triangles.len(), 4);
    assert!(padded.notices[0].contains("7 bytes after the last facet are not used"), "{:?}", padded.notices);
    assert_eq!(error("a.stl", binary(5)), "a.stl: byte 284: 5 facets declared, but the file ends after 4");
}

#[test]
fn bad_files_are_told_with_line_or_byte() {
    let text = ascii("a");
    for (from, to, expected) in [
        ("vertex 0 0e0 0", "vertex 0 inf 0", "a.stl:4: vertex \"0 inf 0\": expected three finite numbers"),
        ("vertex 0 0e0 0", "vertex 0 0", "a.stl:4: vertex \"0 0\": expected three finite numbers"),
        ("vertex 0 0e0 0", "vertex 0 0 0 0", "a.stl:4: vertex: \"0\" after three numbers"),
        ("    vertex 0 0e0 0\n", "", "a.stl:6: expected vertex (a facet has three), found \"endloop\""),
        ("outer loop", "inner loop", "a.stl:3: expected outer loop, found \"inner loop\""),
        ("endsolid", "endsol", "a.stl:30: expected facet or endsolid, found \"endsol a\""),
    ] {
        assert_eq!(error("a.stl", text.replacen(from, to, 1)), expected);
    }
    let mut bytes = binary(4);
    bytes[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(error("a.stl", bytes), "a.stl: byte 134: facet 1 has a corner that is not finite");
    assert_eq!(error("a.stl", "solid a\nendsolid a\n"), "a.stl: no facets: nothing to see");
    assert_eq!(error("a.stl", [0; 84]), "a.stl: no facets: nothing to see");
    let short = "a.stl: neither \"solid\" nor the 84 bytes before the facets of a binary STL file";
    assert_eq!((error("a.stl", ""), error("a.stl", "hello")), (short.into(), short.into()));
}

#[test]
fn damage_is_never_silent_and_never_fatal() {
    truncations("a.stl", &binary(4), |_| false);
    truncations("a.stl", ascii("tetrahedron").as_bytes(), |_| false);
    mutations("a.stl", &binary(4), 20_000);
    mutations("a.stl", ascii("a").as_bytes(), 20_000);
}
