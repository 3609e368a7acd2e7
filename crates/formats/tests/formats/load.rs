use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use raycam_formats::{Budget, FormatError, extensions, load, read_model};

use crate::common::{data, file, folder, message};
use crate::gltf;

/// A triangle in every format of the table.
fn triangle(extension: &str) -> Vec<u8> {
    let text = match extension {
        "gltf" => return gltf::triangle().into_bytes(),
        "glb" => return gltf::glb(&gltf::triangle(), &[]),
        "toml" => {
            "object = { name = \"a\", vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles = [[0, 1, 2]] }\n"
        }
        "obj" => "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "ply" => {
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty int x\nproperty int y\nproperty int z\nelement face 1\n\
             property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
        }
        "stl" => {
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
             endsolid\n"
        }
        "off" => "OFF\n3 1 3\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        other => panic!("no sample of {other}"),
    };
    text.into()
}

#[test]
fn every_format_gives_the_same_world() {
    for extension in extensions() {
        for name in [
            format!("a.{extension}"),
            format!("a.{}", extension.to_uppercase()),
        ] {
            let world = load(&file(&name, triangle(extension)), &Budget::default()).unwrap();
            assert_eq!(world.objects.len(), 1, "{name}");
            assert_eq!(world.objects[0].name, "a", "{name}");
            assert_eq!(world.meshes[0].triangles, [[0, 1, 2]], "{name}");
            assert_eq!(
                world.meshes[0].vertices[2].to_array(),
                [0.0, 1.0, 0.0],
                "{name}"
            );
            assert_eq!(world.materials[0].color, [0.8; 3], "{name}");
            assert!(world.notices.is_empty(), "{name}: {:?}", world.notices);
        }
    }
}

#[test]
fn every_format_tells_empty_cut_and_foreign_files() {
    for extension in extensions() {
        let name = format!("a.{extension}");
        let text = triangle(extension);
        for bytes in [
            &b""[..],
            &text[..text.len() * 2 / 3],
            b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0",
            &[0; 4096],
        ] {
            // An empty world file is a world without anything.
            if extension == "toml" && bytes.is_empty() {
                continue;
            }
            let path = file(&name, bytes);
            let error = message(load(&path, &Budget::default()).unwrap_err(), &path);
            assert!(error.starts_with(&name), "{error}");
        }
    }
}

#[test]
fn missing_files_and_folders_are_io_errors_of_that_kind() {
    for extension in extensions().chain(["png", ""]) {
        let path = folder().join("no").with_extension(extension);
        match load(&path, &Budget::default()).unwrap_err() {
            FormatError::Io {
                path: found,
                source,
            } => {
                assert_eq!((found, source.kind()), (path, ErrorKind::NotFound));
            }
            other => panic!("{extension}: {other}"),
        }
    }
    let path = folder().join("a.obj");
    fs::create_dir(&path).unwrap();
    match load(&path, &Budget::default()).unwrap_err() {
        FormatError::Io { source, .. } => assert_eq!(source.kind(), ErrorKind::IsADirectory),
        other => panic!("{other}"),
    }
}

#[test]
fn an_unknown_kind_lists_the_known_ones() {
    for name in ["a.xyz", "a", "a.obj.bak", ".obj"] {
        let path = file(name, "x");
        let error = message(load(&path, &Budget::default()).unwrap_err(), &path);
        assert_eq!(
            error,
            format!(
                "{name}: unknown kind of file; known are .toml, .gltf, .glb, .obj, .ply, .stl, .off"
            )
        );
    }
    let path = file("a.toml", "");
    assert!(
        message(read_model(&path, &Budget::default()).unwrap_err(), &path)
            .contains("expected a mesh file")
    );
}

#[test]
fn parts_become_objects_with_names_of_their_own() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no leg\nf 1 2 3\no leg\nf 1 2 3\n";
    let world = load(&file("chair.obj", text), &Budget::default()).unwrap();
    let names: Vec<_> = world
        .objects
        .iter()
        .map(|object| &object.name[..])
        .collect();
    assert_eq!(names.len(), 3);
    assert_eq!(names[..2], ["chair", "leg"]);
    assert_ne!(names[2], "leg");
}

#[test]
fn files_are_found_from_the_current_folder_too() {
    // The tests run in the folder of the crate.
    let world = load(
        Path::new("tests/data/concave_polygon.obj"),
        &Budget::default(),
    )
    .unwrap();
    assert_eq!(world.materials[0].name, "test");
    assert!(world.notices.is_empty(), "{:?}", world.notices);
    assert!(data("concave_polygon.obj").exists());
}
