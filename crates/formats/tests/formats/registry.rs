use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use raycam_formats::{Budget, FormatError, decode, extensions, load, read_model};

use crate::gltf;
use crate::support::{data, file, folder, message};

/// A triangle in every format of the table.
fn triangle(extension: &str) -> Vec<u8> {
    let text = match extension {
        "gltf" => return gltf::triangle().into_bytes(),
        "glb" => return gltf::glb(&gltf::triangle(), &[]),
        "toml" => "object = { name = \"a\", vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles = [[0, 1, 2]] }\n",
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
        for name in [format!("a.{extension}"), format!("a.{}", extension.to_uppercase())] {
            let world = load(&file(&name, triangle(extension)), &Budget::default()).unwrap();
            assert_eq!(world.objects.len(), 1, "{name}");
            assert_eq!(world.objects[0].name, "a", "{name}");
            assert_eq!(world.meshes[0].triangles, [[0, 1, 2]], "{name}");
            assert_eq!(world.meshes[0].vertices[2].to_array(), [0.0, 1.0, 0.0], "{name}");
            assert_eq!(world.materials[0].color, [0.8; 3], "{name}");
            assert!(world.notices.is_empty(), "{name}: {:?}", world.notices);
        }
    }
}

#[test]
fn every_format_reports_empty_truncated_and_foreign_files() {
    for extension in extensions() {
        let name = format!("a.{extension}");
        let text = triangle(extension);
        for bytes in [&b""[..], &text[..text.len() * 2 / 3], b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0", &[0; 4096]] {
            // An empty world file is valid and gives an empty world.
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
fn missing_files_and_folders_return_io_errors_of_the_right_kind() {
    for extension in extensions().chain(["png", ""]) {
        let path = folder().join("no").with_extension(extension);
        match load(&path, &Budget::default()).unwrap_err() {
            FormatError::Io { path: found, source } => {
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
fn unknown_formats_list_the_supported_formats() {
    for name in ["a.xyz", "a", "a.obj.bak", ".obj"] {
        let path = file(name, "x");
        let error = message(load(&path, &Budget::default()).unwrap_err(), &path);
        let expected = format!("{name}: unknown file format; supported: .toml, .gltf, .glb, .obj, .ply, .stl, .off, ");
        assert!(error.starts_with(&expected) && error.contains(".usdz") && error.contains("from_trimesh"), "{error}");
    }
    let path = file("a.toml", "# nothing");
    assert!(message(read_model(&path, &Budget::default()).unwrap_err(), &path).contains("expected a mesh file"));
}

#[test]
fn parts_become_objects_with_unique_names() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no leg\nf 1 2 3\no leg\nf 1 2 3\n";
    let world = load(&file("chair.obj", text), &Budget::default()).unwrap();
    let names: Vec<_> = world.objects.iter().map(|object| &object.name[..]).collect();
    assert_eq!(names.len(), 3);
    assert_eq!(names[..2], ["chair", "leg"]);
    assert_ne!(names[2], "leg");
}

#[test]
fn material_libraries_next_to_files_with_relative_paths_are_found() {
    // Relative paths work because the tests run in the folder of the crate.
    let world = load(Path::new("tests/data/concave_polygon.obj"), &Budget::default()).unwrap();
    assert_eq!(world.materials[0].name, "test");
    assert!(world.notices.is_empty(), "{:?}", world.notices);
    assert!(data("concave_polygon.obj").exists());
}

/// A GLB file with a mesh of 120,000 triangles and with every arrangement of accessors in a buffer; `value` is the last
/// coordinate.
fn large_glb(value: f32) -> Vec<u8> {
    let count = 150_000_u32;
    let (mut bytes, mut stride) = (Vec::new(), Vec::new());
    for i in 0..count {
        let place = [i as f32 * 0.5, (i % 97) as f32, if i + 1 == count { value } else { 1.0 }];
        place.iter().for_each(|v: &f32| bytes.extend(v.to_le_bytes()));
        // Each vertex has a normal and texture coordinates, interleaved with 4 unused bytes.
        [0.0, 0.0, 1.0_f32].iter().for_each(|v| stride.extend(v.to_le_bytes()));
        stride.extend([(i % 251) as u8, 7, (i % 250) as u8, 9, 1, 2, 3, 4]);
    }
    let corners = (0..120_000_u32).flat_map(|i| [i, i + 1, (i * 7919) % count]);
    let indices: Vec<u8> = corners.flat_map(u32::to_le_bytes).collect();
    let (at, length) = (bytes.len() + stride.len(), indices.len());
    let json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0, "name": "a"}}],
        "buffers": [{{"byteLength": {}}}],
        "bufferViews": [{{"buffer": 0, "byteLength": {}}}, {{"buffer": 0, "byteOffset": {}, "byteLength": {}, "byteStride": 20}},
          {{"buffer": 0, "byteOffset": {at}, "byteLength": {length}}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": {count}, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}},
          {{"bufferView": 1, "componentType": 5126, "count": {count}, "type": "VEC3"}},
          {{"bufferView": 1, "byteOffset": 12, "componentType": 5123, "normalized": true, "count": {count}, "type": "VEC2"}},
          {{"bufferView": 2, "componentType": 5125, "count": 360000, "type": "SCALAR"}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}}, "indices": 3}}]}}]}}"#,
        at + length,
        bytes.len(),
        bytes.len(),
        stride.len(),
    );
    gltf::glb(&json, &[bytes, stride, indices].concat())
}

/// A binary STL file of 100 000 facets with shared corners, the last of them at `value`.
fn large_stl(value: f32) -> Vec<u8> {
    let count = 100_000_u32;
    let mut bytes = vec![0; 80];
    bytes.extend(count.to_le_bytes());
    for i in 0..count {
        let z = if i + 1 == count { value } else { 0.0 };
        let corners = [[i as f32, 0.0, 0.0], [(i + 1) as f32, 0.0, 0.0], [(i / 2) as f32, 1.0, z]];
        bytes.extend([0; 12]);
        corners.as_flattened().iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

/// A binary PLY file of 200 000 triangles with normals, colours and texture coordinates, the last vertex at `value`.
fn large_ply(value: f32) -> Vec<u8> {
    let (vertices, faces) = (100_000_u32, 200_000_u32);
    let floats = ["x", "y", "z", "nx", "ny", "nz", "s", "t"];
    let floats: String = floats.map(|name| format!("property float {name}\n")).concat();
    let bytes = ["red", "green", "blue"];
    let bytes: String = bytes.map(|name| format!("property uchar {name}\n")).concat();
    let header = format!(
        "ply\nformat binary_big_endian 1.0\nelement vertex {vertices}\n{floats}{bytes}element face {faces}\n\
         property uchar flags\nproperty list ushort int vertex_indices\nend_header\n"
    );
    let mut file = header.into_bytes();
    for i in 0..vertices {
        let x = if i + 1 == vertices { value } else { i as f32 };
        let row = [x, (i % 97) as f32, 1.0, 0.0, 3.0, 4.0, 0.25, (i % 50) as f32 / 50.0];
        file.extend(row.iter().flat_map(|v: &f32| v.to_be_bytes()));
        file.extend([(i % 256) as u8, 7, 200]);
    }
    for i in 0..faces {
        file.extend([9, 0, 3]);
        let corners = [i % vertices, (i + 1) % vertices, (i * 7919) % vertices];
        file.extend(corners.iter().flat_map(|corner| corner.to_be_bytes()));
    }
    file
}

#[test]
fn large_ply_files_with_an_irregular_row_are_read_row_by_row() {
    let whole = large_ply(3.0);
    let at = whole.len() - 15;
    let mut indexed = whole.clone();
    indexed[at + 3..at + 7].copy_from_slice(&7_000_000_i32.to_be_bytes());
    let mut thin = whole.clone();
    thin[at + 2] = 2;
    thin.drain(at + 11..at + 15);
    for (bytes, expected) in [
        (indexed, Err("face 199999: vertex 7000000, but the file has 100000 vertices")),
        (thin, Ok(199_999)),
        ([&whole[..], &[0; 6]].concat(), Ok(200_000)),
    ] {
        let path = file("row.ply", &bytes);
        let read = load(&path, &Budget::default());
        let decoded = decode(bytes, &path, &Budget::default());
        match (read, decoded, expected) {
            (Ok(read), Ok(decoded), Ok(count)) => {
                assert_eq!(read.meshes[0].triangles.len(), count);
                assert_eq!(read.meshes[0], decoded.meshes[0]);
                assert_eq!(read.notices, decoded.notices);
                // The second notice reports an ignored column.
                assert_eq!(read.notices.len(), 2);
            }
            (Err(read), Err(decoded), Err(message)) => {
                assert!(read.to_string().contains(message), "{read}");
                assert_eq!(read.to_string(), decoded.to_string());
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn large_files_give_the_same_model_from_memory_and_disk() {
    for (name, make) in [("a.glb", large_glb as fn(f32) -> Vec<u8>), ("a.stl", large_stl), ("a.ply", large_ply)] {
        let bytes = make(3.0);
        assert!(bytes.len() > 4 << 20);
        let path = file(name, &bytes);
        let read = load(&path, &Budget::default()).unwrap();
        let decoded = decode(bytes, &path, &Budget::default()).unwrap();
        assert!(read.meshes[0].triangles.len() >= 100_000);
        assert_eq!(read.meshes[0], decoded.meshes[0], "{name}");

        let bytes = make(f32::NAN);
        let path = file(name, &bytes);
        let odd = load(&path, &Budget::default()).unwrap();
        assert!(
            odd.notices.iter().any(|notice| notice.to_string().contains("vertex coordinates are not finite")),
            "{:?}",
            odd.notices
        );
        assert!(odd.meshes[0].triangles.len() < read.meshes[0].triangles.len(), "{name}");
        assert!(odd.meshes[0].vertices.iter().all(|vertex| vertex.is_finite()), "{name}");
        let decoded = decode(bytes, &path, &Budget::default()).unwrap();
        assert_eq!((&odd.meshes[0], &odd.notices), (&decoded.meshes[0], &decoded.notices));
    }
}
