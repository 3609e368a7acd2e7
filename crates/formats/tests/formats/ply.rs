use std::fs;

use raycam_formats::encode::png;
use raycam_formats::{Budget, read_model};
use raycam_scene::NoticeCode;

use crate::support::{
    area, data, error, folder, mesh, message, model, mutations, rgb, texts, truncations, vector_area,
};

const HEADER: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                      element face 1\nproperty list uchar int vertex_indices\nend_header\n";

fn ascii(rows: &str) -> String {
    format!("ply\nformat ascii 1.0\n{HEADER}{rows}")
}

/// A tetrahedron with every kind of property, in all three forms.
fn tetrahedron(form: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat {form} 1.0\ncomment made by hand\nobj_info none\nelement thing 2\nproperty list ushort double values\n\
         property char tag\nelement vertex 4\nproperty double z\nproperty uchar red\nproperty short quality\n\
         property float32 x\nproperty float y\nproperty uint8 green\nproperty uchar blue\nelement face 4\n\
         property int32 flags\nproperty list uint8 uint vertex_index\nproperty list uchar short more\nend_header\n"
    );
    let points = [[0.0, 0.0, 0.0_f64], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let colors = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [188, 188, 188_u8]];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2_u32]];
    if form == "ascii" {
        let mut text = header + "2 0.5 1.5 -3\n0 7\n";
        for (p, c) in points.iter().zip(colors) {
            text += &format!("{} {} -2 {} {} {} {}\n", p[2], c[0], p[0], p[1], c[1], c[2]);
        }
        for f in faces {
            text += &format!("-9 3 {} {} {} 1 -4\n", f[0], f[1], f[2]);
        }
        return text.into_bytes();
    }
    let big = form == "binary_big_endian";
    let mut bytes = header.into_bytes();
    let mut put = |value: &[u8]| {
        if big {
            bytes.extend(value.iter().rev());
        } else {
            bytes.extend(value);
        }
    };
    put(&2_u16.to_le_bytes());
    put(&0.5_f64.to_le_bytes());
    put(&1.5_f64.to_le_bytes());
    put(&(-3_i8).to_le_bytes());
    put(&0_u16.to_le_bytes());
    put(&7_i8.to_le_bytes());
    for (p, c) in points.iter().zip(colors) {
        put(&p[2].to_le_bytes());
        put(&[c[0]]);
        put(&(-2_i16).to_le_bytes());
        put(&(p[0] as f32).to_le_bytes());
        put(&(p[1] as f32).to_le_bytes());
        put(&[c[1]]);
        put(&[c[2]]);
    }
    for f in faces {
        put(&(-9_i32).to_le_bytes());
        put(&[3]);
        f.iter().for_each(|v| put(&v.to_le_bytes()));
        put(&[1]);
        put(&(-4_i16).to_le_bytes());
    }
    bytes
}

#[test]
fn text_and_both_binary_forms_give_the_same_model() {
    let one = mesh("a.ply", tetrahedron("ascii"));
    assert_eq!((one.vertices.len(), one.triangles.len()), (4, 4));
    assert!(vector_area(&one).length() < 1e-15);
    let colors = one.vertex_colors.as_ref().unwrap();
    assert_eq!(colors[1], [0.0, 1.0, 0.0]);
    assert!((colors[3][0] - 0.502886).abs() < 1e-5);
    for form in ["binary_little_endian", "binary_big_endian"] {
        assert_eq!(mesh("a.ply", tetrahedron(form)), one);
    }
}

#[test]
fn ply_vertices_keep_every_digit() {
    let mesh = mesh("a.ply", ascii("0.1 0.2 0.3\n1 0 0\n0 1 0\n0 0 1e-9\n3 0 1 2\n"));
    assert_eq!(mesh.vertices[0].to_array(), [0.1, 0.2, 0.3]);
}

#[test]
fn polygons_become_triangles_with_their_colours() {
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
                element face 3\nproperty list uchar int vertex_indices\nproperty float red\nproperty float green\n\
                property float blue\nend_header\n0 0 0\n2 0 0\n2 2 0\n1 0.5 0\n0 2 0\n2 0 1 0 0 0\n5 0 1 2 3 4 0.25 0.5 1\n3 0 1 2 0 0 0\n";
    let mesh = mesh("a.ply", text);
    assert_eq!(mesh.triangles.len(), 4);
    assert_eq!(mesh.face_colors.as_ref().unwrap()[2..], [[0.25, 0.5, 1.0], [0.0; 3]]);
    // The area of the arrow, counted once, plus the area of the triangle.
    assert!((area(&mesh) - (2.5 + 2.0)).abs() < 1e-12, "{}", area(&mesh));
}

/// A binary file with four vertices of a square and faces with these corners; each face has a property before its list
/// and one after it.
fn square(big: bool, length: &str, index: &str, faces: &[&[i32]]) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property double z\nproperty uchar tag\nelement face {}\nproperty short before\n\
         property list {length} {index} vertex_indices\nproperty char after\nend_header\n",
        faces.len()
    )
    .into_bytes();
    let mut put = |value: &[u8]| {
        if big {
            bytes.extend(value.iter().rev());
        } else {
            bytes.extend(value);
        }
    };
    for [x, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0_f32]] {
        put(&x.to_le_bytes());
        put(&y.to_le_bytes());
        put(&0.5_f64.to_le_bytes());
        put(&[9]);
    }
    for face in faces {
        put(&3_i16.to_le_bytes());
        match length {
            "uchar" => put(&[face.len() as u8]),
            _ => put(&(face.len() as u32).to_le_bytes()),
        }
        for &corner in *face {
            match index {
                "short" => put(&(corner as i16).to_le_bytes()),
                _ => put(&corner.to_le_bytes()),
            }
        }
        put(&[7]);
    }
    bytes
}

#[test]
fn number_types_do_not_change_faces() {
    let two: [&[i32]; 2] = [&[0, 1, 2], &[2, 3, 0]];
    for big in [false, true] {
        for length in ["uchar", "int", "uint"] {
            for index in ["int", "uint", "short"] {
                let triangles = mesh("a.ply", square(big, length, index, &two));
                assert_eq!(triangles.triangles, [[0, 1, 2], [2, 3, 0]]);
                assert_eq!(triangles.vertices[2].to_array(), [1.0, 1.0, 0.5]);
                let polygon = mesh("a.ply", square(big, length, index, &[&[0, 1, 2, 3]]));
                assert_eq!(polygon.triangles, [[0, 1, 2], [0, 2, 3]]);
                let wrong = error("a.ply", square(big, length, index, &[two[0], &[2, -4, 0]]));
                let named = if index == "uint" { "4294967292" } else { "-4" };
                let expected = format!("face 1: vertex {named}, but the file has 4 vertices");
                assert!(wrong.contains(&expected), "{wrong}");
                let faces: [&[i32]; 4] = [two[0], &[2, 3], &[1], two[1]];
                let thin = model("a.ply", square(big, length, index, &faces));
                assert_eq!(thin.parts[0].mesh.triangles, triangles.triangles);
                let said = &thin.notices[0].message;
                let expected = "2 faces omitted: fewer than 3 corners, the first in the row";
                assert!(said.contains(expected), "{said}");
            }
        }
    }
    let bytes = square(false, "uchar", "int", &two);
    truncations("a.ply", &bytes, |_| false);
    mutations("a.ply", &bytes, 3000);
}

#[test]
fn triangle_strips_have_consistent_orientation_and_restart() {
    let text = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
                element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
                0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n2 1 0\n10 0 2 1 3 -1 2 4 3 5 5\n";
    let mesh = mesh("a.ply", text);
    assert_eq!(mesh.triangles, [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]]);
    assert_eq!((area(&mesh), vector_area(&mesh).z), (2.0, 2.0));
}

#[test]
fn texture_coordinates_have_their_origin_at_the_top() {
    let model = read_model(&data("multi.ply"), &Budget::default()).unwrap();
    let mesh = &model.parts[0].mesh;
    assert_eq!(mesh.uvs.as_deref(), Some(&[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]][..]));
    assert_eq!(mesh.vertex_colors.as_ref().unwrap()[0], [1.0, 0.0, 0.0]);
}

#[test]
fn corners_may_have_separate_texture_coordinates_and_an_image() {
    let folder = folder();
    let image = png::encode([1, 1], 3, png::Samples::U8(&[1, 2, 3])).unwrap();
    fs::write(folder.join("my image.png"), image).unwrap();
    let text = "ply\nformat ascii 1.0\ncomment TextureFile my image.png\nelement vertex 4\nproperty float x\n\
                property float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\n\
                property list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n\
                3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0.5 0 1 1 0 1\n";
    let path = folder.join("a.ply");
    fs::write(&path, text).unwrap();
    let model = read_model(&path, &Budget::default()).unwrap();
    let mesh = &model.parts[0].mesh;
    // Vertex 0 has two different texture coordinates, and vertex 2 has one.
    assert_eq!(mesh.vertices.len(), 5);
    let uvs = mesh.uvs.as_ref().unwrap();
    assert_eq!(
        mesh.triangles.concat().iter().map(|&v| uvs[v as usize]).collect::<Vec<_>>(),
        [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.5, 1.0], [1.0, 0.0], [0.0, 0.0]]
    );
    assert_eq!(rgb(&model.textures[model.materials[0].texture.unwrap().texture]), [[1, 2, 3]]);
}

#[test]
fn headers_may_have_any_line_ends() {
    let binary = tetrahedron("binary_little_endian");
    let end = binary.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let plain = mesh("a.ply", &binary);
    for line_end in ["\r\n", "\r"] {
        let header = String::from_utf8_lossy(&binary[..end]).replace('\n', line_end);
        assert_eq!(mesh("a.ply", [header.as_bytes(), &binary[end..]].concat()), plain);
    }
    for (name, triangles) in [("cube_binary_header_with_RN_newline.ply", 12), ("delim_test.ply", 12)] {
        let model = read_model(&data(name), &Budget::default()).unwrap();
        assert_eq!(model.parts[0].mesh.triangles.len(), triangles, "{name}");
    }
}

#[test]
fn values_beyond_the_declared_columns_are_ignored_with_a_notice() {
    let points = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
    let (plain, long) = (points.join("\n"), points.join(" 7\n"));
    let plain = model("a.ply", ascii(&format!("{plain}\n3 0 1 2\n")));
    let long = model("a.ply", ascii(&format!("{long}\n3 0 1 2 9 1 1\n")));
    assert_eq!(long.parts[0].mesh, plain.parts[0].mesh);
    let expected = "a.ply: values beyond those that the header declares are ignored in 4 rows, the first in line 10";
    assert_eq!((plain.notices.len(), texts(&long.notices)), (0, vec![expected.to_owned()]));
}

#[test]
fn ply_errors_contain_line_or_byte() {
    let rows = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    for (text, expected) in [
        (
            ascii(&format!("{rows}3 0 1 4\n")),
            "a.ply:14: face 0: vertex 4, but the file has 4 vertices (numbered from 0)",
        ),
        (
            ascii(&format!("{rows}3 0 1 -1\n")),
            "a.ply:14: face 0: vertex -1, but the file has 4 vertices (numbered from 0)",
        ),
        (ascii(&format!("{rows}3 0 1 1.5\n")), "a.ply:14: \"1.5\" is not a whole number"),
        (ascii(&format!("{rows}2 0 1   \n")), "a.ply: no faces, only 4 vertices; there is nothing to render"),
        (ascii(&format!("{rows}3 0 1\n")), "a.ply:14: the row has fewer values than the header declares"),
        (
            ascii("0 0 0\n\n1 nan 0\n0 1 0\n0 0 1\n3 0 1 2\n"),
            "a.ply: all faces have vertices that are not finite; there is nothing to render",
        ),
        (
            ascii(rows),
            "a.ply:13: the file ends before the rows that its header declares: it is truncated, or the header declares too many rows",
        ),
        (ascii("").replace("face 1", "face 0") + rows, "a.ply: no faces, only 4 vertices; there is nothing to render"),
        (
            ascii(rows).replace("vertex 4", "vertex 99999999999"),
            "a.ply: element vertex has 99999999999 rows of at least 6 bytes, but 24 bytes follow the header",
        ),
        (ascii(rows).replace("property float x", "property float w"), "a.ply: element vertex has no x, y and z"),
        (
            ascii(rows).replace("property float x", "property float"),
            "a.ply:4: incomplete property; expected property TYPE NAME or property list TYPE TYPE NAME",
        ),
        (
            ascii(rows).replace("ascii 1.0", "text 1.0"),
            "a.ply:2: unknown format; expected the line \"format ascii 1.0\", or binary_little_endian or binary_big_endian instead of ascii",
        ),
        (
            ascii(rows).replace("element vertex 4", "element vertex"),
            "a.ply:3: incomplete element; expected element NAME COUNT",
        ),
        ("plywood".into(), "a.ply:1: not a PLY file"),
        ("ply\nformat ascii 1.0\n".into(), "a.ply:3: end_header is missing"),
        (
            "ply\nelement empty 5\nformat ascii 1.0\nend_header\n".into(),
            "a.ply: element empty has 5 rows of at least 0 bytes, but 0 bytes follow the header",
        ),
    ] {
        assert_eq!(error("a.ply", &text), expected, "{text}");
    }
    let binary = tetrahedron("binary_little_endian");
    let cut = &binary[..binary.len() - 5];
    assert!(error("a.ply", cut).contains("ends before the rows that its header declares: it is truncated"));
    let path = data("crash.ply");
    assert!(message(read_model(&path, &Budget::default()).unwrap_err(), &path).starts_with("crash.ply:"));
}

/// Reads a text PLY file with a triangle whose vertices have these colours, in a number type. Returns the linear
/// colours, and the texts of the notices.
fn colored(kind: &str, rows: [&str; 3]) -> (Vec<[f32; 3]>, Vec<String>) {
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         property {kind} red\nproperty {kind} green\nproperty {kind} blue\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n0 0 0 {}\n1 0 0 {}\n0 1 0 {}\n3 0 1 2\n",
        rows[0], rows[1], rows[2]
    );
    let model = model("a.ply", text);
    (model.parts[0].mesh.vertex_colors.clone().unwrap_or_default(), texts(&model.notices))
}

#[test]
fn colours_of_every_range_are_read_or_clamped() {
    let bytes = colored("uchar", ["255 0 0", "0 188 0", "51 102 204"]);
    assert!(bytes.1.is_empty(), "{:?}", bytes.1);
    for (kind, scale, said) in [
        ("ushort", 1, "ushort colours are treated as 0 to 255, because none is greater than 255"),
        ("ushort", 257, ""),
        ("float", 1, "floating-point colours are treated as 0 to 255, because some are greater than 1"),
        ("int", 1, ""),
        ("int", 257, "colours are treated as 0 to 65535, because some are greater than 255"),
    ] {
        let row = |[r, g, b]: [u32; 3]| format!("{} {} {}", scale * r, scale * g, scale * b);
        let rows = [row([255, 0, 0]), row([0, 188, 0]), row([51, 102, 204])];
        let (colors, notices) = colored(kind, [&rows[0], &rows[1], &rows[2]]);
        for (a, b) in colors.as_flattened().iter().zip(bytes.0.as_flattened()) {
            assert!((a - b).abs() < 1e-6, "{kind} {scale}: {colors:?}");
        }
        assert!(notices.len() == usize::from(!said.is_empty()), "{notices:?}");
        assert!(notices.iter().all(|notice| notice.contains(said)), "{notices:?}");
    }
    let (nearly, notices) = colored("float", ["1.0000001 0 0", "-0.5 1 0", "nan 0.25 1"]);
    assert_eq!(nearly, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.25, 1.0]]);
    assert_eq!(notices, ["a.ply: vertices: colour values outside 0 to 1 are clamped (3 values)"]);
    let (unknown, notices) = colored("float", ["1e6 0 0", "0 0 0", "0 0 0"]);
    assert!(unknown.is_empty());
    assert_eq!(notices, ["a.ply: vertices: the colours are ignored, because their range is unknown"]);
}

#[test]
fn coloured_faces_of_binary_files_equal_those_of_text_files() {
    let header = |format: &str, faces: usize| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty uchar flags\nproperty list uchar int vertex_indices\nproperty uchar red\n\
             property uchar green\nproperty uchar blue\nproperty uchar alpha\nend_header\n"
        )
    };
    let positions = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let faces: [(&[i32], [u8; 4]); 3] =
        [(&[0, 1, 2], [255, 0, 9, 255]), (&[0, 2, 3], [7, 130, 0, 200]), (&[0, 1, 2, 3], [1, 2, 3, 255])];
    for count in [2, 3] {
        let mut binary = header("binary_little_endian", count).into_bytes();
        let mut text = header("ascii", count);
        binary.extend(positions.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        for [x, y, z] in positions {
            text += &format!("{x} {y} {z}\n");
        }
        for (corners, color) in &faces[..count] {
            binary.extend([4, corners.len() as u8]);
            binary.extend(corners.iter().flat_map(|corner| corner.to_le_bytes()));
            binary.extend(color);
            let words: Vec<String> = corners.iter().map(i32::to_string).collect();
            let [r, g, b, alpha] = color;
            text += &format!("4 {} {} {r} {g} {b} {alpha}\n", corners.len(), words.join(" "));
        }
        let (binary, text) = (model("a.ply", binary), model("a.ply", text));
        let (mesh, expected) = (&binary.parts[0].mesh, &text.parts[0].mesh);
        assert_eq!(mesh.face_colors.as_ref().map(Vec::len), Some([2, 4][count - 2]));
        assert_eq!((&mesh.face_colors, &mesh.triangles), (&expected.face_colors, &expected.triangles));
        assert_eq!(texts(&binary.notices), texts(&text.notices));
        assert!(texts(&text.notices)[0].contains("transparency"), "{:?}", texts(&text.notices));
    }
}

#[test]
fn only_one_of_two_sources_of_colour_is_used() {
    let text = |vertices: [&str; 3], face: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n\
             property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
             end_header\n0 0 0 {}\n1 0 0 {}\n0 1 0 {}\n3 0 1 2 {face}\n3 2 1 0 1 2 3\n",
            vertices[0], vertices[1], vertices[2]
        )
    };
    let both = model("a.ply", text(["200 120 40", "0 0 0", "9 9 9"], "200 120 40"));
    let mesh = &both.parts[0].mesh;
    assert!(mesh.vertex_colors.is_some() && mesh.face_colors.is_none());
    assert_eq!(texts(&both.notices), ["a.ply: the mesh has vertex and face colours; only the vertex colours are used"]);
    let faces = model("a.ply", text(["255 255 255"; 3], "200 120 40"));
    let mesh = &faces.parts[0].mesh;
    assert!(mesh.vertex_colors.is_none() && mesh.face_colors.is_some());
    assert_eq!(texts(&faces.notices), ["a.ply: the mesh has vertex and face colours; only the face colours are used"]);
}

#[test]
fn each_image_becomes_a_separate_material() {
    let folder = folder();
    for (name, value) in [("my model_A.png", 1), ("B.png", 2)] {
        fs::write(folder.join(name), png::encode([1, 1], 3, png::Samples::U8(&[value; 3])).unwrap()).unwrap();
    }
    let text = "ply\nformat ascii 1.0\ncomment TextureFile <this>_A.png\ncomment TextureFile B.png\n\
                element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
                property uchar green\nproperty uchar blue\nelement face 3\nproperty list uchar int vertex_indices\n\
                property list uchar float texcoord\nproperty int texnumber\nend_header\n\
                0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 255 0 0\n0 1 0 255 0 0\n\
                4 0 1 2 3 8 0 0 1 0 1 1 0 1 1\n3 0 1 2 6 0 0 1 0 1 1 0\n3 2 1 0 6 0 0 1 0 1 1 7\n";
    let path = folder.join("my model.ply");
    fs::write(&path, text).unwrap();
    let model = read_model(&path, &Budget::default()).unwrap();
    let mesh = &model.parts[0].mesh;
    assert_eq!(mesh.material_slots.as_deref(), Some(&[1, 1, 0, 2][..]));
    let shown = |slot: usize| {
        let texture = model.materials[model.parts[0].materials[slot]].texture;
        texture.map(|texture| rgb(&model.textures[texture.texture]))
    };
    assert_eq!([shown(0), shown(1), shown(2)], [Some(vec![[1; 3]]), Some(vec![[2; 3]]), None]);
    // Only the corners of the face without an image keep their colours.
    let colors = mesh.vertex_colors.as_ref().unwrap();
    let of = |triangle: usize| mesh.triangles[triangle].map(|vertex| colors[vertex as usize]);
    assert_eq!((of(0), of(2), of(3)), ([[1.0; 3]; 3], [[1.0; 3]; 3], [[1.0, 0.0, 0.0]; 3]));
    for said in ["1 face shown without an image, because", "colours are ignored on faces with an image (3 faces)"] {
        assert!(model.notices.iter().any(|notice| notice.to_string().contains(said)), "{:?}", model.notices);
    }
    mesh.validate().unwrap();
}

#[test]
fn ignored_properties_are_listed() {
    let text = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\n\
                property float y\nproperty float z\nproperty uint rgb\nproperty float intensity\nproperty uchar red\n\
                element face 1\nproperty list uchar int vertex_indices\nproperty int flags\nelement edge 1\n\
                property int a\nend_header\n0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2 4\n5\n";
    let notices = model("a.ply", text).notices;
    let expected = "a.ply: unused elements and properties ignored: vertex rgb (packed colours), vertex intensity, vertex red, face flags, \
                    element edge (1 row)";
    assert_eq!(notices[1].message, expected);
    assert!(
        notices[0].to_string().contains("images are ignored, because the mesh has no texture coordinates"),
        "{notices:?}"
    );
}

#[test]
fn normals_without_a_direction_are_replaced_by_face_normals() {
    let text = |unused: &str, used: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             property float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n\
             0 0 0 {used}\n1 0 0 1 0 0\n0 1 0 1 0 0\n5 5 5 {unused}\n3 0 1 2\n"
        )
    };
    let unused = model("a.ply", text("0 0 0", "1 0 0"));
    assert_eq!(unused.parts[0].mesh.normals.as_ref().unwrap()[..3], [[1.0, 0.0, 0.0]; 3]);
    assert!(unused.notices.is_empty(), "{:?}", unused.notices);
    for zero in ["0 0 0", "nan 0 0"] {
        let used = model("a.ply", text("0 0 0", zero));
        assert_eq!(used.parts[0].mesh.normals.as_ref().unwrap()[..2], [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
        assert_eq!(texts(&used.notices), ["a.ply: 1 normal replaced by the faces' normals: no direction"]);
    }
}

#[test]
fn unused_vertices_that_are_not_finite_have_no_effect() {
    let model = model("a.ply", ascii("0 0 0\n1 0 0\n0 1 0\nnan 0 inf\n3 0 1 2\n"));
    assert_eq!(area(&model.parts[0].mesh), 0.5);
    assert_eq!(texts(&model.notices), ["a.ply: 1 unused vertex with coordinates that are not finite"]);
}

#[test]
fn damaged_ply_files_cause_an_error_or_a_notice() {
    for form in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let bytes = tetrahedron(form);
        truncations("a.ply", &bytes, |_| false);
        mutations("a.ply", &bytes, 20_000);
    }
    let extra = [&tetrahedron("binary_big_endian")[..], b"more"].concat();
    assert!(model("a.ply", extra).notices[0].to_string().contains("4 bytes after the last row ignored"));
}

const TRIANGLE: &str = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

fn triangle_header(format: &str, list: &str, comment: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\n{comment}element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list {list} vertex_indices\nend_header\n"
    )
}

#[test]
fn unknown_header_lines_cause_a_notice() {
    let expected = mesh("a.ply", triangle_header("ascii", "uchar int", "") + TRIANGLE);
    let odd = model("a.ply", triangle_header("ascii", "uchar int", "Created by a scanner\n") + TRIANGLE);
    assert_eq!(odd.parts[0].mesh, expected);
    let found: Vec<_> = odd.notices.iter().map(|notice| (notice.code, &notice.subjects[..])).collect();
    assert_eq!(found, [(NoticeCode::IgnoredKey, &["a.ply:3".to_owned()][..])]);
}

#[test]
fn lists_of_every_number_type_are_read() {
    let expected = mesh("a.ply", triangle_header("ascii", "uchar int", "") + TRIANGLE);
    for list in
        ["int64 int64", "uint64 uint64", "float float", "double double", "uchar float", "float int", "char long"]
    {
        let model = model("a.ply", triangle_header("ascii", list, "") + TRIANGLE);
        assert_eq!(model.parts[0].mesh, expected, "{list}");
        let codes: Vec<_> = model.notices.iter().map(|notice| notice.code).collect();
        assert_eq!(codes, [NoticeCode::AssumedConvention][..usize::from(list.contains("long"))], "{list}");
    }
    for big in [false, true] {
        let format = if big { "binary_big_endian" } else { "binary_little_endian" };
        let encode = |kind: &str, value: u8| {
            let mut bytes = match kind {
                "uchar" => vec![value],
                "int" => i32::from(value).to_le_bytes().to_vec(),
                "int64" | "uint64" => u64::from(value).to_le_bytes().to_vec(),
                "float" => f32::from(value).to_le_bytes().to_vec(),
                _ => f64::from(value).to_le_bytes().to_vec(),
            };
            if big {
                bytes.reverse();
            }
            bytes
        };
        for length in ["uchar", "int64", "uint64", "float", "double"] {
            for item in ["int", "int64", "uint64", "float", "double"] {
                let mut bytes = triangle_header(format, &format!("{length} {item}"), "").into_bytes();
                for value in [0, 0, 0, 1, 0, 0, 0, 1, 0] {
                    bytes.extend(encode("float", value));
                }
                bytes.extend(encode(length, 3));
                bytes.extend([0, 1, 2].into_iter().flat_map(|index| encode(item, index)));
                assert_eq!(mesh("a.ply", &bytes), expected, "{format} {length} {item}");
                truncations("a.ply", &bytes, |_| false);
            }
        }
    }
    let odd = error("a.ply", triangle_header("ascii", "float int", "") + &TRIANGLE.replace("3 0 1 2", "3.5 0 1 2"));
    assert!(odd.contains("a.ply:13") && odd.contains("3.5"), "{odd}");
    let huge = error("a.ply", triangle_header("ascii", "int64 int", "") + &TRIANGLE.replace("3 0 1 2", "9e18 0 1 2"));
    assert!(huge.contains("a.ply:13"), "{huge}");
}

#[test]
fn other_versions_are_read_as_version_one_with_a_notice() {
    let header = triangle_header("ascii", "uchar int", "");
    let expected = mesh("a.ply", header.clone() + TRIANGLE);
    for format in ["ascii 1.1", "ascii 2.0", "ascii"] {
        let odd = model("a.ply", header.replace("ascii 1.0", format) + TRIANGLE);
        assert_eq!(odd.parts[0].mesh, expected);
        let found: Vec<_> = odd.notices.iter().map(|notice| (notice.code, &notice.subjects[..])).collect();
        assert_eq!(found, [(NoticeCode::InvalidFile, &["a.ply:2".to_owned()][..])], "{format}");
    }
    let upper = model("a.ply", header.replace("ascii 1.0", "ASCII 1.0") + TRIANGLE);
    assert_eq!((&upper.parts[0].mesh, upper.notices.len()), (&expected, 0));
}
