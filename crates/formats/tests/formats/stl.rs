use raycam_formats::{Budget, load, read_model};
use raycam_scene::{MeshFile, NoticeCode};

use crate::support::{area, data, error, mesh, model, mutations, texts, truncations, vector_area};

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
        bytes.extend([0; 2]);
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
fn text_and_binary_stl_give_the_same_welded_solid() {
    let one = mesh("a.stl", binary(4));
    assert_eq!((one.vertices.len(), one.triangles.len()), (4, 4));
    assert!(vector_area(&one).length() < 1e-15 && (area(&one) - (1.5 + 0.75_f64.sqrt())).abs() < 1e-12);
    assert_eq!(mesh("a.STL", ascii("a")), one);
    assert_eq!(mesh("a.stl", ascii("").to_uppercase().replace('\n', "\r\n")), one);
}

#[test]
fn each_solid_becomes_a_part() {
    let two = ascii("first one") + &ascii("") + "solid nothing\nendsolid nothing\n";
    let parts = model("a.stl", two).parts;
    assert_eq!(parts.iter().map(|part| &part.name[..]).collect::<Vec<_>>(), ["first one", ""]);
    let world = load(&data("multibody.stl"), &Budget::default()).unwrap();
    assert_eq!(world.objects.len(), 2);
    let triangle = read_model(&data("triangle_with_empty_solid.stl"), &Budget::default()).unwrap();
    assert_eq!(triangle.parts.len(), 1);
}

#[test]
fn file_length_has_priority_over_the_facet_count() {
    for count in [0, u32::MAX, 2] {
        let model = model("a.stl", binary(count));
        assert_eq!(model.parts[0].mesh.triangles.len(), 4);
        assert!(
            model.notices[0]
                .to_string()
                .contains(&format!("the header declares {count} facets; all 4 facets of the file are used"))
        );
    }
    let padded = model("a.stl", [&binary(4)[..], &[0; 7]].concat());
    assert_eq!(padded.parts[0].mesh.triangles.len(), 4);
    assert!(padded.notices[0].to_string().contains("7 bytes after the last facet ignored"), "{:?}", padded.notices);
    assert_eq!(error("a.stl", binary(5)), "a.stl: byte 284: the header declares 5 facets, but the file ends after 4");
}

#[test]
fn stl_errors_contain_line_or_byte() {
    let text = ascii("a");
    for (from, to, expected) in [
        ("vertex 0 0e0 0", "vertex 0 0", "a.stl:4: vertex \"0 0\"; expected three numbers"),
        ("vertex 0 0e0 0", "vertex 0 0 0 0", "a.stl:4: vertex: unexpected \"0\" after the three numbers"),
        ("    vertex 0 0e0 0\n", "", "a.stl:6: expected vertex (a facet has three), found \"endloop\""),
    ] {
        assert_eq!(error("a.stl", text.replacen(from, to, 1)), expected);
    }
    let mut bytes = binary(4);
    bytes[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let left = model("a.stl", bytes);
    assert_eq!(left.parts[0].mesh.triangles.len(), 3);
    assert_eq!(texts(&left.notices), ["a.stl: 1 face omitted: vertex coordinates are not finite"]);
    let left = model("a.stl", text.replacen("vertex 0 0e0 0", "vertex 0 inf 0", 1));
    assert_eq!((left.parts[0].mesh.triangles.len(), left.notices.len()), (3, 1));
    assert_eq!(error("a.stl", "solid a\nendsolid a\n"), "a.stl: no facets; there is nothing to render");
    assert_eq!(error("a.stl", [0; 84]), "a.stl: no facets; there is nothing to render");
    let short = "a.stl: neither \"solid\" nor the 84 bytes that precede the facets of a binary STL file";
    assert_eq!(error("a.stl", "hello"), short);
}

/// Each case replaces a text in a file; the notices must have these codes and lines.
#[test]
fn stl_text_with_irregular_lines_is_read_with_a_notice() {
    use NoticeCode::{IgnoredKey, InvalidFile, TruncatedData};
    let whole = mesh("a.stl", ascii("a"));
    type Noticed = [(NoticeCode, &'static str)];
    let cases: [(&str, &str, &Noticed); 19] = [
        ("endloop", "end loop", &[]),
        ("endfacet", "END FACET", &[]),
        ("endsolid a", "endsolida", &[]),
        ("endsolid a", "end solid a", &[]),
        ("endsolid a", "end", &[(IgnoredKey, "30"), (TruncatedData, "30")]),
        ("solid a\n", "solid\nsolid a\n", &[(InvalidFile, "2")]),
        ("endsolid a\n", "", &[(TruncatedData, "29")]),
        ("endsolid", "endsol", &[(IgnoredKey, "30"), (TruncatedData, "30")]),
        ("endsolid a\n", "endsolid a\nendsolid a\n", &[(InvalidFile, "31")]),
        ("  facet", "  color 0.5 0.5 0.5\n  facet", &[(IgnoredKey, "2")]),
        ("   endloop", "    color 1 0 0\n   endloop", &[(IgnoredKey, "7")]),
        ("    vertex 0 0e0 0", "    attribute 3\n    vertex 0 0e0 0", &[(IgnoredKey, "4")]),
        ("solid a\n", "", &[(InvalidFile, "1")]),
        ("solid a\n  facet", "solid a facet", &[(InvalidFile, "2")]),
        ("   outer loop\n", "", &[(InvalidFile, "3")]),
        ("   endloop\n", "", &[(InvalidFile, "7")]),
        ("  endfacet\n", "", &[(InvalidFile, "8")]),
        ("   outer loop\n", "   outer loop\n   outer loop\n", &[(InvalidFile, "4")]),
        ("outer loop", "inner loop", &[(IgnoredKey, "3"), (InvalidFile, "4")]),
    ];
    for (from, to, expected) in cases {
        let model = model("a.stl", ascii("a").replacen(from, to, 1));
        let parts: Vec<_> = model.parts.iter().map(|part| &part.mesh).collect();
        assert_eq!(parts, [&whole], "{from:?} {to:?}");
        let found: Vec<_> = model.notices.iter().map(|notice| (notice.code, &notice.subjects[0][..])).collect();
        let expected: Vec<_> = expected.iter().map(|(code, line)| (*code, format!("a.stl:{line}"))).collect();
        let expected: Vec<_> = expected.iter().map(|(code, place)| (*code, &place[..])).collect();
        assert_eq!(found, expected, "{from:?} {to:?}");
    }
    let every = model("a.stl", ascii("a").replace("   endloop\n", "").replace("   outer loop\n", ""));
    assert_eq!((&every.parts[0].mesh, every.notices.len(), every.notices[0].count), (&whole, 2, 4));
}

#[test]
fn stl_text_with_a_missing_vertex_is_refused() {
    for text in
        [ascii("a").replacen("    vertex 0 0e0 0\n", "    vertx 0 0 0\n", 1), ascii("a").replacen("vertex", "", 3)]
    {
        assert!(error("a.stl", &text).contains("expected vertex"), "{text}");
    }
}

#[test]
fn damaged_stl_files_cause_an_error_or_a_notice() {
    truncations("a.stl", &binary(4), |_| false);
    truncations("a.stl", ascii("tetrahedron").as_bytes(), |_| false);
    mutations("a.stl", &binary(4), 20_000);
    mutations("a.stl", ascii("a").as_bytes(), 20_000);
}

/// The tetrahedron with these two bytes after its facets and this text in its header.
fn colored(header: &str, attributes: [u16; 4]) -> (Option<Vec<[f32; 3]>>, Vec<String>) {
    let model = with_attributes(header, attributes);
    (model.parts[0].mesh.face_colors.clone(), texts(&model.notices))
}

fn with_attributes(header: &str, attributes: [u16; 4]) -> MeshFile {
    let mut bytes = binary(4);
    bytes[..80].fill(b' ');
    bytes[..header.len().min(80)].copy_from_slice(header.as_bytes());
    for (facet, attribute) in attributes.into_iter().enumerate() {
        bytes[84 + 50 * facet + 48..][..2].copy_from_slice(&attribute.to_le_bytes());
    }
    model("a.stl", bytes)
}

#[test]
fn facet_colours_of_viscam_and_magics_are_read() {
    let (red, green, blue) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    // VisCAM files: bit 15 marks a colour, with red in the high bits; facets without bit 15 are grey.
    let (colors, notices) = colored("viscam", [0xfc00, 0x83e0, 0x801f, 0]);
    assert_eq!(colors.unwrap(), [red, green, blue, [0.8; 3]]);
    assert_eq!(notices, ["a.stl: 1 facet shown in grey: no colour"]);
    // Magics files: red is in the low bits, and bit 15 selects the colour of the whole object.
    let header = "COLOR=\u{0}\u{7f}\u{0}\u{7f},MATERIAL=";
    let (colors, notices) = colored(header, [0x001f, 0x03e0, 0x7c00, 0x8000]);
    let whole = ((0x7f as f64 / 255.0 + 0.055) / 1.055).powf(2.4) as f32;
    let colors = colors.unwrap();
    assert_eq!(colors[..3], [red, green, blue]);
    assert!((colors[3][1] - whole).abs() < 1e-6 && colors[3][0] == 0.0, "{colors:?}");
    assert_eq!(notices, ["a.stl: the transparency of the header's colour is ignored"]);
    // Other values of the two bytes are not colours.
    let (colors, notices) = colored("other", [1, 0, 2, 0]);
    assert_eq!(colors, None);
    assert_eq!(notices, ["a.stl: the attribute bytes of 2 facets are not colours and are ignored"]);
}

#[test]
fn a_header_colour_without_facet_colours_is_the_base_colour() {
    let whole = ((0x7f as f64 / 255.0 + 0.055) / 1.055).powf(2.4) as f32;
    // Some programs write a space instead of the alpha value.
    for (header, notices) in [
        ("COLOR=\u{0}\u{7f}\u{0}\u{7f},MATERIAL=", &["a.stl: the transparency of the header's colour is ignored"][..]),
        ("COLOR=\u{0}\u{7f}\u{0} MATERIAL=\u{7f}\u{7f}\u{7f} ", &[]),
    ] {
        let model = with_attributes(header, [0; 4]);
        assert_eq!(model.parts[0].mesh.face_colors, None);
        let color = model.materials[0].color;
        assert!(color[0] == 0.0 && (color[1] - whole).abs() < 1e-6 && color[2] == 0.0, "{color:?}");
        assert_eq!(texts(&model.notices), notices);
    }
}

#[test]
fn stl_text_may_begin_with_comments() {
    let one = mesh("a.stl", ascii("a"));
    for head in ["# exported by hand\n\n", "; one\n// two\n", "\u{feff}#\r\n"] {
        assert_eq!(mesh("a.stl", head.to_owned() + &ascii("a")), one, "{head:?}");
    }
    let between = ascii("a").replacen("  facet", "# the first\n  facet", 1);
    assert_eq!(mesh("a.stl", between), one);
}

#[test]
fn stl_vertices_with_commas_and_fortran_exponents_are_read() {
    let whole = mesh("a.stl", ascii("a"));
    let corners = |replace: &dyn Fn(&str) -> String| {
        let lines = ascii("a");
        let of = |line: &str| match line.trim().strip_prefix("vertex ") {
            Some(rest) => format!("vertex {}", replace(rest)),
            None => line.to_owned(),
        };
        lines.lines().map(of).collect::<Vec<_>>().join("\n")
    };
    let float = |rest: &str, point: &str| {
        rest.split(' ').map(|word| format!("{}{point}0", word.replace("e0", ""))).collect::<Vec<_>>()
    };
    type Replacement<'a> = &'a dyn Fn(&str) -> String;
    let cases: [(&str, Replacement); 6] = [
        ("commas as separators", &|rest| rest.replace(' ', ", ")),
        ("commas as separators", &|rest| rest.replace(' ', ",")),
        ("semicolons", &|rest| rest.replace(' ', ";")),
        ("decimal commas", &|rest| float(rest, ",").join(" ")),
        ("decimal commas", &|rest| float(rest, ",").join("; ")),
        ("", &|rest| float(rest, ".").join("D+00 ") + "d0"),
    ];
    for (expected, replace) in cases {
        let found = model("a.stl", corners(replace));
        assert_eq!(found.parts[0].mesh, whole, "{}", corners(replace));
        let notices = texts(&found.notices);
        assert_eq!(notices.len(), usize::from(!expected.is_empty()), "{notices:?}");
        assert!(notices.iter().all(|notice| notice.contains(expected)), "{notices:?}");
    }
    // The numbers may be 1.5 and 2.5, or 1, 5, 2 and 5.
    for ambiguous in ["1,5,2,5", "1,000.5 0 0", "1,5 2", "0, 0"] {
        let text = ascii("a").replacen("vertex 0 0e0 0", &format!("vertex {ambiguous}"), 1);
        assert!(error("a.stl", text).contains("expected three numbers"), "{ambiguous}");
    }
}

#[test]
fn stl_facets_with_more_than_three_vertices_are_divided() {
    let facet = |corners: &[&str]| {
        let vertices: String = corners.iter().map(|corner| format!("vertex {corner}\n")).collect();
        format!("solid a\nfacet normal 0 0 1\nouter loop\n{vertices}endloop\nendfacet\nendsolid a\n")
    };
    // A square of side 2, and an arrow whose area is 1.
    for (corners, area_expected) in
        [(["0 0 0", "2 0 0", "2 2 0", "0 2 0"], 4.0), (["0 0 0", "1 1 0", "2 0 0", "1 2 0"], 1.0)]
    {
        let found = model("a.stl", facet(&corners));
        let mesh = &found.parts[0].mesh;
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 2));
        assert!((area(mesh) - area_expected).abs() < 1e-12, "{corners:?}");
        assert!((vector_area(mesh).z - area_expected).abs() < 1e-12);
        assert_eq!((found.notices.len(), found.notices[0].code), (1, NoticeCode::InvalidFile));
    }
}
