mod mtl;

use raycam_formats::{Budget, read_model};

use crate::support::{area, data, error, mesh, message, model, mutations, texts, truncations, vector_area};

const CUBE: &str = "\
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 4 1 5 8\n";

#[test]
fn cube_of_squares_is_a_closed_mesh() {
    let mesh = mesh("cube.obj", CUBE);
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (8, 12));
    assert_eq!((area(&mesh), vector_area(&mesh).length()), (6.0, 0.0));
    assert!(mesh.uvs.is_none() && mesh.normals.is_none() && mesh.vertex_colors.is_none());
}

#[test]
fn obj_coordinates_are_the_nearest_float64() {
    let mesh = mesh("a.obj", "v 0.1 -1e-7 123456789.1234567\nv +.5 5. 0\nv 1 0 0 1.0\nf 1 2 3\n");
    assert_eq!(mesh.vertices[0].to_array(), [0.1, -1e-7, 123456789.1234567]);
    assert_eq!(mesh.vertices[1].to_array(), [0.5, 5.0, 0.0]);
}

#[test]
fn every_form_of_corner_index_is_read() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 2\n";
    for face in ["1/1/1 2/2/1 3/3/1", "-3/-3/-1 -2/-2/-1 -1/-1/-1", "1/-3/1 2/2/-1 -1/3/1 # end"] {
        let mesh = mesh("a.obj", format!("{text}f {face}\n"));
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        // The origin of texture coordinates is at the bottom left in the file and at the top left in the mesh.
        assert_eq!(mesh.uvs.unwrap(), [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
        assert_eq!(mesh.normals.unwrap(), [[0.0, 0.0, 1.0]; 3]);
    }
    for face in ["1 2 3", "1// 2// 3//", "1/ 2/ 3/"] {
        let mesh = mesh("a.obj", format!("{text}f {face}\n"));
        assert!(mesh.uvs.is_none() && mesh.normals.is_none());
    }
    let mesh = mesh("a.obj", format!("{text}f 1//1 2//1 3//1\n"));
    assert!(mesh.uvs.is_none() && mesh.normals.is_some());
}

#[test]
fn faces_may_come_before_their_vertices() {
    assert_eq!(mesh("a.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").triangles, [[0, 1, 2]]);
}

#[test]
fn vertices_are_repeated_only_at_seams() {
    let mesh = mesh(
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\n\
         f 1/1 2/2 3/3\nf 1/5 3/3 4/4\n",
    );
    assert_eq!(mesh.vertices.len(), 5);
    assert_eq!(mesh.triangles, [[0, 1, 2], [4, 2, 3]]);
    assert_eq!(mesh.vertices[4], mesh.vertices[0]);
    assert_eq!(mesh.uvs.unwrap()[4], [0.5, 0.5]);
}

#[test]
fn many_seams_at_one_vertex_are_read_fast_and_correctly() {
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    (0..20_000).for_each(|i| text += &format!("vt {i} 0\n"));
    (1..=20_000).for_each(|i| text += &format!("f 1/{i} 2/{i} 3/{i}\nf 1/{i} 2/{i} 3/{i}\n"));
    let mesh = mesh("a.obj", text);
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (60_000, 40_000));
    let uvs = mesh.uvs.unwrap();
    for (i, pair) in mesh.triangles.chunks(2).enumerate() {
        assert_eq!(pair[0], pair[1]);
        assert!(pair[0].iter().all(|&v| uvs[v as usize][0] == i as f32));
    }
}

#[test]
fn concave_polygons_keep_their_shape() {
    let model = read_model(&data("concave_polygon.obj"), &Budget::default()).unwrap();
    let mesh = &model.parts[0].mesh;
    assert_eq!(mesh.triangles.len(), 64);
    // If no triangles overlap, their total area is the length of the vector area.
    assert!((area(mesh) - vector_area(mesh).length()).abs() < 1e-12, "{}", area(mesh));
    assert_eq!(model.materials[0].name, "test");
    assert_eq!(model.materials[0].color, [0.141176, 0.184314, 0.411765]);
}

#[test]
fn o_starts_a_part_and_usemtl_a_material_slot() {
    let model = model(
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nv 6 5 5\nv 5 6 5\no first part\ng x\nusemtl red\nf 1 2 3\nusemtl blue\n\
         f 3 2 1\no empty\no second\nf 4 5 6\n",
    );
    let names: Vec<_> = model.parts.iter().map(|part| &part.name[..]).collect();
    assert_eq!(names, ["first part", "second"]);
    assert_eq!(model.materials.iter().map(|m| &m.name[..]).collect::<Vec<_>>(), ["red", "blue"]);
    assert_eq!(model.parts[0].mesh.material_slots.as_deref(), Some(&[0, 1][..]));
    assert_eq!((&model.parts[0].materials[..], &model.parts[1].materials[..]), (&[0, 1][..], &[1][..]));
    // Each part contains only its own vertices.
    assert_eq!(model.parts[0].mesh.vertices.len(), 3);
    assert_eq!(model.parts[1].mesh.vertices[0].to_array(), [5.0; 3]);
    assert!(model.notices.iter().any(|n| n.to_string().contains("red, blue")), "{:?}", model.notices);
}

#[test]
fn vertex_colours_are_read_as_srgb() {
    let mesh = mesh("a.obj", "v 0 0 0 1 0.5 0\nv 1 0 0 0 0 0 1\nv 0 1 0\nf 1 2 3\n");
    let colors = mesh.vertex_colors.unwrap();
    assert!((colors[0][1] - 0.214041).abs() < 1e-5);
    assert_eq!((colors[0][0], colors[1], colors[2]), (1.0, [0.0; 3], [1.0; 3]));
    let model = read_model(&data("nancolor.obj"), &Budget::default()).unwrap();
    assert!(model.parts[0].mesh.vertex_colors.is_none());
    assert!(model.notices[0].to_string().contains(":7: a vertex colour is outside 0 to 1"), "{:?}", model.notices);
}

#[test]
fn corners_without_normals_are_flat_next_to_smooth_corners() {
    let mesh =
        mesh("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 0 0\nvn 0 0 0\nf 1//1 2//1 3//1\nf 1 2 3\nf 1//2 2//1 3//1\n");
    let normals = mesh.normals.unwrap();
    let of = |t: usize| mesh.triangles[t].map(|v| normals[v as usize]);
    assert_eq!(of(0), [[1.0, 0.0, 0.0]; 3]);
    assert_eq!(of(1), [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(of(2)[0], [0.0, 0.0, 1.0]);
}

#[test]
fn continued_lines_and_all_line_ends_are_read() {
    let text = "# a comment that ends in \\\nv 0 0 0\nv 1 0 \\\n 0\nv 0 1 0\nf 1 \\\n2 \\\n  3\n";
    for ends in ["\n", "\r\n", "\r"] {
        assert_eq!(mesh("a.obj", text.replace('\n', ends)).triangles, [[0, 1, 2]]);
    }
    let longline = read_model(&data("box_longline.obj"), &Budget::default()).unwrap();
    assert_eq!(longline.parts[0].mesh.vertices.len(), 8);
}

#[test]
fn ignored_statements_are_listed_once() {
    let model = read_model(&data("testmixed.obj"), &Budget::default()).unwrap();
    assert_eq!(model.parts[0].mesh.triangles.len(), 12);
    assert!(
        model.notices[0].to_string().contains("ignored: l (lines) (line 15), p (points) (line 23)"),
        "{:?}",
        model.notices
    );
    let skipped = model_notices("curv2 1 2\ncurv2 3 4\n");
    assert_eq!(skipped, "a.obj: unsupported statements ignored: curv2 (line 5)");
}

#[test]
fn smoothing_groups_create_normals() {
    // Three sides of a cube that share a corner: the first two are in one smoothing group, the third is in a second
    // group. A fourth face is in no group.
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 -1\nv 1 1 -1\nv 0 1 -1\n\
        s 1\nf 1 2 3 4\nf 2 5 6 3\ns 2\nf 4 3 6 7\ns off\nf 3 2 1\n";
    let mesh = mesh("a.obj", text);
    let normals = mesh.normals.unwrap();
    let at = |position: [f64; 3]| {
        let mut found: Vec<[f32; 3]> = (mesh.vertices.iter().zip(&normals))
            .filter(|(vertex, _)| vertex.to_array() == position)
            .map(|(_, &normal)| normal)
            .collect();
        found.sort_by(|a, b| a.partial_cmp(b).unwrap());
        found
    };
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The third side and the face without a group are flat; normals are averaged between the first two sides.
    assert_eq!(at([1.0, 1.0, -1.0]), [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
    assert_eq!(at([0.0, 0.0, 0.0]), [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]);
    let corner = at([1.0, 1.0, 0.0]);
    assert_eq!(corner.len(), 3, "{corner:?}");
    let expected = [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [half, 0.0, half]];
    for (found, expected) in corner.iter().flatten().zip(expected.as_flattened()) {
        assert!((found - expected).abs() < 1e-6, "{corner:?}");
    }
    // Without smoothing groups, nothing is smooth; the file's own normals have priority.
    let bare = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    assert_eq!(self::mesh("a.obj", format!("{bare}f 1 2 3\n")).normals, None);
    let given = self::mesh("a.obj", format!("{bare}vn 1 0 0\ns 1\nf 1//1 2//1 3//1\n"));
    assert_eq!(given.normals.unwrap(), [[1.0, 0.0, 0.0]; 3]);
    let odd = model("a.obj", format!("{bare}s round\nf 1 2 3\ns 1.5\nf 1 2 3\n")).notices;
    assert_eq!(texts(&odd), ["a.obj:4, 6: s \"round\" is treated as off; expected a smoothing group or off"]);
}

#[test]
fn groups_become_parts_if_there_are_no_objects() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\ng left arm\nf 1 2 4\ng body\nf 1 3 4\n\
        g left arm\nf 2 3 4\n";
    let names = |text: &str| -> Vec<(String, usize)> {
        let parts = model("a.obj", text).parts.into_iter();
        parts.map(|part| (part.name, part.mesh.triangles.len())).collect()
    };
    let expected = [("", 1), ("left arm", 2), ("body", 1)];
    assert_eq!(names(text), expected.map(|(name, count)| (name.to_owned(), count)));
    let objects = text.replacen("f 1 2 3", "o all\nf 1 2 3", 1);
    assert_eq!(names(&objects), [("all".to_owned(), 4)]);
}

fn model_notices(extra: &str) -> String {
    model("a.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{extra}"))
        .notices
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn faces_with_one_or_two_corners_are_skipped() {
    // The indices count backwards: the skipped faces must not shift the indices of other faces.
    let thin = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\n";
    let read = model("a.obj", format!("{thin}f -4\nf -4 -3 -2\nf -2/-1 -1/-1\nf\nf 2 4 -2\n"));
    assert_eq!(read.parts[0].mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(read.parts[0].mesh.uvs, None);
    assert_eq!(
        read.notices[0].message.rsplit('/').next().unwrap(),
        "a.obj: 3 faces omitted: fewer than 3 corners, the first in line 6"
    );
    // The skipped faces are distributed over many pieces of the file, which are read separately.
    let row = "f 1 2 3\nf 1 2\n# 0123456789 0123456789 0123456789 0123456789\n";
    let long = model("a.obj", format!("{thin}{}", row.repeat(40_000)));
    assert_eq!(long.parts[0].mesh.triangles.len(), 40_000);
    assert!(long.notices[0].to_string().ends_with("40000 faces omitted: fewer than 3 corners, the first in line 7"));
}

#[test]
fn indices_of_missing_attributes_are_reported_and_ignored() {
    let four = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    let plain = model("a.obj", format!("{four}s 1\nf 1 2 3\nf 3 2 4\n"));
    let read = model("a.obj", format!("{four}s 1\nf 1/1/1 2/2/2 3/3/3\nf 3/3/3 2/2/2 4/9/9\n"));
    assert_eq!(read.parts[0].mesh, plain.parts[0].mesh);
    assert_eq!(
        texts(&read.notices),
        [
            "a.obj:7: f: texture coordinate 9, but the file has no texture coordinates; the model is shown without them",
            "a.obj:7: f: normal 9, but the file has no normals; the model is shown without them",
        ]
    );
    // If texture coordinates are missing, the normals are kept.
    let normals = format!("{four}vn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n");
    let read = model("a.obj", normals);
    assert_eq!(read.parts[0].mesh.normals, Some(vec![[0.0, 0.0, 1.0]; 4]));
    assert_eq!(read.parts[0].mesh.uvs, None);
    assert_eq!(read.notices.len(), 1);
}

#[test]
fn obj_errors_contain_line_and_index() {
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, expected) in [
        ("f 1 2 4\n", "a.obj:4: f: vertex 4, but the file has 3 vertices"),
        ("f 1 2 99999999999999999999\n", "a.obj:4: f: \"99999999999999999999\" is not an index"),
        ("f 1 2 5000000000\n", "a.obj:4: f: vertex 5000000000, but the file has 3 vertices"),
        ("f 1 2 -4\n", "a.obj:4: f: vertex -4, but the number of vertex statements before this line is 3"),
        ("f 0 1 2\n", "a.obj:4: f: vertex index 0; expected indices from 1"),
        ("f 1/2 2/1 3/1\nvt 0 0\n", "a.obj:4: f: texture coordinate 2, but the file has 1 texture coordinate"),
        ("f 1//2 2//1 3//1\nvn 0 0 1\n", "a.obj:4: f: normal 2, but the file has 1 normal"),
        ("f 1 2\n", "a.obj: no faces (f), only 3 vertices; there is nothing to render"),
        ("f 1 9\n", "a.obj:4: f: vertex 9, but the file has 3 vertices"),
        ("f 1 -9\n", "a.obj:4: f: vertex -9, but the number of vertex statements before this line is 3"),
        ("f 1 2 3/1/1/1\n", "a.obj:4: f: corner \"3/1/1/1\" has more than 3 indices"),
        ("f 1 2 x\n", "a.obj:4: f: \"x\" is not an index"),
        ("f /1 /1 /1\nvt 0 0\n", "a.obj:4: f: corner \"/1\" has no vertex"),
        ("v 1,5 0 0\n", "a.obj:4: v: \"1,5\" is not a number; use a decimal point instead of a comma"),
        ("v nan 0 0\nf 1 2 4\n", "a.obj: all faces have vertices that are not finite; there is nothing to render"),
        ("v 1 2\n", "a.obj:4: v has 2 numbers; expected 3, or 6 with a colour"),
        ("vt\n", "a.obj:4: vt has 0 numbers; expected 1"),
        ("vn 1 2\n", "a.obj:4: vn has 2 numbers; expected 3"),
        ("", "a.obj: no faces (f), only 3 vertices; there is nothing to render"),
    ] {
        assert_eq!(error("a.obj", format!("{three}{text}")), expected, "{text:?}");
    }
    let path = data("malformed.obj");
    let error = message(read_model(&path, &Budget::default()).unwrap_err(), &path);
    assert!(error.starts_with("malformed.obj:28: f: vertex index 0"), "{error}");
}

#[test]
fn damaged_obj_files_cause_an_error_or_a_notice() {
    let text = format!("{CUBE}o two\nvt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1 4/2/1 5/1/1\n");
    // The file may end unnoticed after any complete statement, because the format contains no counts. Faces with fewer
    // than three corners cause a notice.
    truncations("a.obj", text.as_bytes(), |length| {
        let last = text[..length].rsplit('\n').next().unwrap();
        last.is_empty() || !last.starts_with("f ") || last.split_whitespace().count() > 3
    });
    mutations("a.obj", text.as_bytes(), 20_000);
    for entry in std::fs::read_dir(data("fuzz")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().unwrap() == "obj" {
            let _ = read_model(&path, &Budget::default());
            mutations("a.obj", &std::fs::read(&path).unwrap(), 2000);
        }
    }
}

#[test]
fn faces_with_infinite_vertices_are_omitted() {
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for odd in ["nan 0 0", "0 1e999 0", "0 0 -1.#IND"] {
        // The vertex that is not finite is first unused, then used by a triangle and by a square.
        let unused = model("a.obj", format!("{three}v {odd}\nf 1 2 3\n"));
        assert_eq!(area(&unused.parts[0].mesh), 0.5);
        let expected = "a.obj: 1 unused vertex with coordinates that are not finite";
        assert_eq!(texts(&unused.notices), [expected]);
        let used = model("a.obj", format!("{three}v {odd}\nv 1 1 0\nf 1 2 3\nf 1 2 4\nf 1 2 4 5\nf 2 5 3\n"));
        assert_eq!(area(&used.parts[0].mesh), 1.0, "{odd}");
        assert_eq!(texts(&used.notices), ["a.obj: 2 faces omitted: vertex coordinates are not finite"]);
    }
}

#[test]
fn attributes_that_are_not_finite_are_ignored() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nvt 0.25 inf\nvt 0.5 0.5\nvn -1.#IND 0 0\nvn 1 0 0\n\
                f 1/1/1 2/2/2 3/3/1\n";
    let model = model("a.obj", text);
    let mesh = &model.parts[0].mesh;
    assert_eq!(mesh.uvs.as_deref(), Some(&[[0.0, 1.0], [0.0, 1.0], [0.5, 0.5]][..]));
    assert_eq!(mesh.normals.as_deref(), Some(&[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]][..]));
    let [uvs, normals] = &texts(&model.notices)[..] else { panic!("{:?}", model.notices) };
    assert!(uvs.starts_with("a.obj:4, 5: vt NaN 0 is not finite; treated as 0 0"), "{uvs}");
    assert!(normals.starts_with("a.obj:7: vn contains numbers that are not finite"), "{normals}");
}

#[test]
fn vertex_colours_as_fractions_bytes_or_hexadecimal_are_read_or_clamped() {
    let colors = |rows: [&str; 3]| {
        let [a, b, c] = rows;
        let model = model("a.obj", format!("v 0 0 0 {a}\nv 1 0 0 {b}\nv 0 1 0 {c}\nf 1 2 3\n"));
        (model.parts[0].mesh.vertex_colors.clone().unwrap(), texts(&model.notices).join("\n"))
    };
    let unit = colors(["0.2 0.4 0.8", "1 1 1", "0 0 0"]);
    let bytes = colors(["51 102 204", "255 255 255", "0 0 0"]);
    for (a, b) in unit.0.as_flattened().iter().zip(bytes.0.as_flattened()) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    assert!(unit.1.is_empty() && bytes.1.contains("treated as 0 to 255"), "{} {}", unit.1, bytes.1);
    let nearly = colors(["1.0000001 0 0", "-0.001 1 0", "0 0 1"]);
    assert_eq!(nearly.0, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert!(nearly.1.contains(":1: a vertex colour is outside 0 to 1; all vertex colours"), "{}", nearly.1);
    // ZBrush writes colours in hexadecimal after a mask.
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let painted = model("a.obj", format!("{three}#MRGB ffff0000ff00ff00\n#MRGB ff0000ff\nf 1 2 3\n"));
    let primary = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(painted.parts[0].mesh.vertex_colors.as_deref(), Some(&primary[..]));
    assert!(painted.notices.is_empty(), "{:?}", painted.notices);
    let short = model("a.obj", format!("{three}#MRGB ffff0000\nf 1 2 3\n"));
    assert_eq!(
        texts(&short.notices),
        ["a.obj: colours in #MRGB comments are ignored: 1 colour for 3 vertices; expected one per vertex"]
    );
}

#[test]
fn only_one_of_two_sources_of_colour_is_used() {
    let folder = crate::support::folder();
    let path = folder.join("a.obj");
    let png = raycam_formats::encode::png::encode([1, 1], 3, raycam_formats::encode::png::Samples::U8(&[9; 3]));
    std::fs::write(folder.join("a.png"), png.unwrap()).unwrap();
    std::fs::write(folder.join("a.mtl"), "newmtl kd\nKd 0.5 0.25 0\nKs 0.1\nnewmtl map\nmap_Kd a.png\n").unwrap();
    let head = "mtllib a.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nv 9 9 9\nv 9 9 8\nv 9 8 9\n";
    let read = |faces: &str| {
        std::fs::write(&path, format!("{head}{faces}")).unwrap();
        read_model(&path, &Budget::default()).unwrap()
    };
    let told = |model: &raycam_scene::MeshFile, words: &str| {
        model.notices.iter().any(|notice| notice.to_string().contains(words))
    };
    // Vertex colours have priority over Kd; Kd is used for parts without them.
    let kd = read("o a\nusemtl kd\nf 1 2 3\no b\nusemtl kd\nf 4 5 6\n");
    assert!(told(&kd, "vertex colours replace Kd and Ks of 1 material"), "{:?}", kd.notices);
    let color = |part: usize| kd.materials[kd.parts[part].materials[0]].color;
    assert_eq!((color(0), color(1)), ([1.0; 3], [0.5, 0.25, 0.0]));
    assert_eq!(kd.parts[0].mesh.vertex_colors.as_deref(), Some(&[[1.0, 0.0, 0.0]; 3][..]));
    assert_eq!(kd.parts[1].mesh.vertex_colors, None);
    // An image has priority over vertex colours, also if a vertex belongs to both.
    let map = read("usemtl map\nf 1 2 3\n");
    assert!(told(&map, "vertex colours are ignored on faces with an image (1 face)"), "{:?}", map.notices);
    assert_eq!(map.parts[0].mesh.vertex_colors, None);
    let both = read("usemtl map\nf 1 2 3\nusemtl kd\nf 3 2 1\n");
    let mesh = &both.parts[0].mesh;
    let colors = mesh.vertex_colors.as_ref().unwrap();
    let of = |triangle: usize| mesh.triangles[triangle].map(|vertex| colors[vertex as usize]);
    assert_eq!((of(0), of(1)), ([[1.0; 3]; 3], [[1.0, 0.0, 0.0]; 3]));
    mesh.validate().unwrap();
}
