//! glTF: containers, resources, accessors and primitives. The files are created by the tests.

use raycam_formats::{Budget, load};
use raycam_scene::{MaterialModel, Up, World};

use crate::support::{file, folder, message};

/// A document with a triangle named "a", whose 36 bytes of corners are in a data URI.
pub fn triangle() -> String {
    document(&corners_uri(), "")
}

/// Three corners in base64.
pub fn corners_uri() -> String {
    let corners = [[0.0_f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    format!("data:application/octet-stream;base64,{}", base64(&bytes))
}

/// Bytes in base64, by a simple slow method.
pub fn base64(bytes: &[u8]) -> String {
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let at = |i: usize| u32::from(*group.get(i).unwrap_or(&0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for i in 0..4 {
            let digit = alphabet[(bits >> (18 - 6 * i) & 63) as usize] as char;
            text.push(if i <= group.len() { digit } else { '=' });
        }
    }
    text
}

/// A document with a triangle whose corners are at a URI; `more` is added to the document's top level.
pub fn document(uri: &str, more: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"name": "a", "mesh": 0}}],
"meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "material": 0}}]}}],
"materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [0.8, 0.8, 0.8, 1], "metallicFactor": 0}}}}],
"accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}}],
"bufferViews": [{{"buffer": 0, "byteLength": 36}}],
"buffers": [{{"uri": "{uri}", "byteLength": 36}}]{more}}}"#
    )
}

/// GLB file with a document and its binary chunk.
pub fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut chunks = Vec::new();
    for (kind, bytes, pad) in [(b"JSON", json.as_bytes(), b' '), (b"BIN\0", binary, 0)] {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), pad);
        if !bytes.is_empty() {
            chunks.extend((bytes.len() as u32).to_le_bytes());
            chunks.extend(kind);
            chunks.extend(bytes);
        }
    }
    let length = 12 + chunks.len() as u32;
    [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes(), &chunks].concat()
}

pub fn world(json: &str) -> World {
    load(&file("a.gltf", json), &Budget::default()).unwrap_or_else(|error| panic!("{error}"))
}

pub fn error(bytes: impl AsRef<[u8]>) -> String {
    let path = file("a.gltf", bytes);
    message(load(&path, &Budget::default()).unwrap_err(), &path)
}

#[test]
fn gltf_document_becomes_a_world_with_y_up() {
    let world = world(&triangle());
    assert_eq!(world.up, Up::Y);
    assert!(matches!(world.materials[0].model, MaterialModel::Principled(_)));
    assert!(!world.materials[0].double_sided);
}

#[test]
fn buffers_are_read_from_the_glb_chunk_from_files_and_from_data_uris() {
    let corners: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let expected = world(&triangle()).meshes;
    let chunk = document("", "").replace(r#""uri": "", "#, "");
    let path = file("b.glb", glb(&chunk, &corners));
    assert_eq!(load(&path, &Budget::default()).unwrap().meshes, expected);
    let path = file("a.gltf", document("my%20corners.bin", ""));
    std::fs::write(path.with_file_name("my corners.bin"), &corners).unwrap();
    assert_eq!(load(&path, &Budget::default()).unwrap().meshes, expected);
}

#[test]
fn files_outside_the_folder_are_not_opened() {
    let outside = folder();
    std::fs::write(outside.join("a.bin"), [0; 36]).unwrap();
    let absolute = outside.join("a.bin").display().to_string();
    let name = outside.file_name().unwrap().to_string_lossy().into_owned();
    for uri in [
        &absolute,
        &format!("../{name}/a.bin"),
        &format!("%2e%2e/{name}/a.bin"),
        &format!("x/..%2F..%2f{name}/a.bin"),
        "file:///etc/passwd",
        "http://example.com/a.bin",
        r"..\\a.bin",
        "C:/a.bin",
        "a%00.bin",
        "%FF%00.bin",
        "",
    ] {
        let told = error(document(uri, ""));
        let expected = ["outside", "out of the folder", "relative", "expected", "UTF-8"];
        assert!(expected.iter().any(|words| told.contains(words)), "{uri}: {told}");
    }
}

#[test]
fn gltf_errors_name_the_place_in_the_document() {
    let text = triangle();
    for (from, to, expected) in [
        (r#""count": 3"#, r#""count": "3""#, "accessors[0].count: string \"3\"; expected a whole number of at least 0"),
        (r#""count": 3"#, r#""count": -3"#, "accessors[0].count: invalid value"),
        (r#""count": 3, "#, "", "accessors[0]: missing field `count`"),
        (r#""count": 3"#, r#""count": 4"#, "accessors[0]: 4 elements of 12 bytes"),
        (r#""count": 3"#, r#""count": 4000000000000000000"#, "(ACCESSOR_TOO_LONG)"),
        (r#""count": 3"#, r#""count": 0"#, "accessors[0].count: 0"),
        ("5126", "5124", "accessors[0].componentType: 5124"),
        ("VEC3", "VEC5", "accessors[0].type: \"VEC5\""),
        (
            r#""POSITION": 0"#,
            r#""POSITION": 1"#,
            "meshes[0].primitives[0].attributes.POSITION: accessors[1] does not exist; the length of accessors is 1",
        ),
        (
            r#""mesh": 0"#,
            r#""mesh": 7"#,
            "nodes[0].mesh: meshes[7] does not exist; the length of meshes is 1 (UNRESOLVED_REFERENCE)",
        ),
        (r#""mesh": 0"#, r#""mesh": 0, "children": [0]"#, "nodes[0] belongs to a loop of nodes (NODE_LOOP)"),
        (r#""byteLength": 36}]}"#, r#""byteLength": 37}]}"#, "buffers[0].byteLength: 37 declared"),
        (r#""byteLength": 36}],"#, r#""byteLength": 37}],"#, "bufferViews[0]: 37 bytes from offset 0"),
        (r#""2.0""#, r#""1.0""#, "asset.version \"1.0\""),
        ("base64,A", "base64,!", "buffers[0].uri: invalid base64"),
    ] {
        assert!(text.contains(from), "{from}");
        let told = error(text.replacen(from, to, 1));
        assert!(told.contains(expected), "{from} -> {to}: {told}");
    }
}

#[test]
fn unknown_extensions_are_refused_if_required() {
    let used = r#", "extensionsUsed": ["X_y"]"#;
    let notices = world(&document(&corners_uri(), used)).notices;
    assert!(notices[0].to_string().contains("X_y is not supported"), "{notices:?}");
    let required = r#", "extensionsUsed": ["X_y"], "extensionsRequired": ["X_y"]"#;
    assert!(
        error(document(&corners_uri(), required))
            .contains("extensionsRequired: X_y is not supported (UNSUPPORTED_EXTENSION)")
    );
}

#[test]
fn decompression_bombs_are_refused() {
    let zeros = triangle().replace(r#""bufferView": 0, "#, "").replace(r#""count": 3"#, r#""count": 4000000000"#);
    assert!(error(zeros).contains("accessors[0]: decoding requires 48000000000 bytes"));
    let deep = format!("{}0{}", r#"{"extras":"#.repeat(90_000), "}".repeat(90_000));
    assert!(error(deep).contains("asset: missing"));
    for key in ["nodes", "materials"] {
        let empty = vec!["{}"; 100_000].join(",");
        let json = format!(r#"{{"asset": {{"version": "2.0"}}, "{key}": [{empty}]}}"#);
        assert!(error(json).contains("the JSON: decoding requires 70001400 bytes"));
    }
    let long = (0..100_000).map(|i| format!(r#"{{"children": [{}]}}"#, i + 1)).collect::<Vec<_>>().join(",");
    let chain = triangle().replace(r#"{"name": "a", "mesh": 0}"#, &format!(r#"{long}, {{"mesh": 0}}"#));
    assert_eq!(world(&chain).objects.len(), 1);
    let many =
        (0..20_000).map(|_| r#"{"primitives": [{"attributes": {"POSITION": 0}}]}"#).collect::<Vec<_>>().join(",");
    let nodes = (0..20_000).map(|i| format!(r#"{{"mesh": {i}}}"#)).collect::<Vec<_>>().join(",");
    let roots = (0..20_000).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    let shared = triangle()
        .replace(r#"{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}"#, &many)
        .replace(r#"{"name": "a", "mesh": 0}"#, &nodes)
        .replace(r#""nodes": [0]"#, &format!(r#""nodes": [{roots}]"#));
    assert_eq!(world(&shared).objects.len(), 20_000);
}

/// A triangle that slides by 4 along x in 2 seconds, while its second corner is morphed by 1 along z.
fn moving() -> String {
    let floats = |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let mut bytes = floats(&[0.0, 2.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 1.0]);
    bytes.extend(floats(&[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]));
    let more = r#", "animations": [{"name": "slide", "channels": [
{"sampler": 0, "target": {"node": 0, "path": "translation"}}, {"sampler": 1, "target": {"node": 0, "path": "weights"}}],
"samplers": [{"input": 1, "output": 2}, {"input": 1, "output": 3}]}]}"#;
    let accessor = |offset: usize, count: usize, kind: &str| {
        format!(
            r#", {{"bufferView": 1, "byteOffset": {offset}, "componentType": 5126, "count": {count}, "type": "{kind}", "min": [0], "max": [0]}}"#
        )
    };
    let accessors =
        accessor(0, 2, "SCALAR") + &accessor(8, 2, "VEC3") + &accessor(32, 2, "SCALAR") + &accessor(40, 3, "VEC3");
    let buffer = format!(r#", {{"uri": "data:;base64,{}", "byteLength": {}}}]"#, base64(&bytes), bytes.len());
    let text = triangle();
    let text = text.replace(r#""max": [1, 1, 0]}]"#, &format!(r#""max": [1, 1, 0]}}{accessors}]"#));
    let text = text.replace(
        r#""byteLength": 36}],"#,
        &format!(r#""byteLength": 36}}, {{"buffer": 1, "byteLength": {}}}],"#, bytes.len()),
    );
    let text = text.replace(r#""material": 0}"#, r#""material": 0, "targets": [{"POSITION": 4}]}"#);
    text.replace(r#""byteLength": 36}]}"#, &format!(r#""byteLength": 36}}{buffer}{more}"#))
}

#[test]
fn animations_move_nodes_and_meshes() {
    let world = world(&moving());
    let still = world.animated_at(0, 0.0).unwrap();
    assert_eq!(world.node_tree.as_ref().unwrap().animations[0].duration(), 2.0);
    let half = world.animated_at(world.find_animation("slide").unwrap(), 1.0).unwrap();
    assert_eq!(half.objects[0].world_from_mesh.translation.x, 2.0);
    let corner = |world: &World| world.meshes[world.objects[0].mesh].vertices[1].z;
    assert_eq!((corner(&still), corner(&half)), (0.0, 0.5));
    assert!(std::sync::Arc::ptr_eq(&world.meshes[0], &still.meshes[0]));
    let over = half.animated_at(0, 9.0).unwrap();
    assert_eq!((over.objects[0].world_from_mesh.translation.x, corner(&over)), (4.0, 1.0));
    assert!(world.find_animation("slid").unwrap_err().to_string().contains("did you mean \"slide\""));
    assert!(world.animated_at(1, 0.0).is_err());
}

#[test]
fn common_exporter_faults_are_read_as_intended() {
    // The text chunk ends in zeros.
    let json = triangle();
    let mut bytes = glb(&format!("{json}   "), &[]);
    let end = bytes.iter().rposition(|&b| b == b'}').unwrap() + 1;
    bytes[end..].fill(0);
    let path = file("a.glb", &bytes);
    assert_eq!(load(&path, &Budget::default()).unwrap().objects.len(), 1);
    // The error reports the version, and not the parts of the document that are different in that version.
    let old = r#"{"asset": {"version": "1.0"}, "scenes": {"a": {}}, "nodes": {}}"#;
    assert!(error(old).contains(r#"asset.version "1.0" is not supported (UNKNOWN_ASSET_MAJOR_VERSION)"#));
    let draft = r#"{"asset": {"version": 0.8}, "accessors": {"a": {}}}"#;
    assert!(error(draft).contains("asset.version \"0.8\" is not supported (UNKNOWN_ASSET_MAJOR_VERSION)"));
}

#[test]
fn invalid_strides_are_reported_and_used() {
    let places = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for (stride, gap, said) in [
        (0, 0, "byteStride: 0 is read as no stride (VALUE_NOT_IN_RANGE)"),
        (14, 2, "byteStride: 14; expected a multiple of 4 from 4 to 252 (VALUE_NOT_IN_RANGE)"),
        (256, 244, "byteStride: 256; expected a multiple of 4 from 4 to 252 (VALUE_NOT_IN_RANGE)"),
    ] {
        let mut bytes = Vec::new();
        for place in places {
            place.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
            bytes.resize(bytes.len() + gap, 7);
        }
        let folder = folder();
        std::fs::create_dir(folder.join("sub")).unwrap();
        std::fs::write(folder.join("sub/a.bin"), &bytes).unwrap();
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
            "buffers": [{{"byteLength": {0}, "uri": "sub\\a.bin"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": {0}, "byteStride": {stride}}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}]}}"#,
            bytes.len()
        );
        let path = folder.join("a.gltf");
        std::fs::write(&path, json).unwrap();
        let world = load(&path, &Budget::default()).unwrap();
        let found: Vec<_> = world.meshes[0].vertices.iter().map(|v| v.as_vec3().to_array()).collect();
        assert_eq!(found, places);
        assert!(world.notices[0].to_string().contains(said), "{:?}", world.notices);
    }
}

#[test]
fn unreadable_images_are_omitted() {
    let png = raycam_formats::encode::png::encode([8, 8], 1, raycam_formats::encode::png::Samples::U8(&[9; 64]));
    let png = png.unwrap();
    let textured = |uri: &str| {
        let more = format!(r#", "images": [{{"uri": "{uri}"}}], "textures": [{{"source": 0}}]"#);
        let info = r#""baseColorTexture": {"index": 0}, "baseColorFactor""#;
        document(&corners_uri(), &more).replace(r#""baseColorFactor""#, info)
    };
    let cut = format!("data:image/png;base64,{}", base64(&png[..png.len() / 2]));
    for (uri, said) in [
        ("gone.png", "No such file"),
        ("../gone.png", "it is outside the folder"),
        (&cut, "images[0]: omitted:"),
        ("data:image/png;base64,AAAA", "unknown image format"),
        ("data:,version https://git-lfs.github.com/spec/v1", "git lfs pull"),
    ] {
        let world = world(&textured(uri));
        assert_eq!((world.objects.len(), world.materials[0].texture), (1, None), "{uri}");
        assert!(world.notices.iter().any(|notice| notice.to_string().contains(said)), "{uri}: {:?}", world.notices);
    }
    let whole = world(&textured(&format!("data:image/png;base64,{}", base64(&png))));
    assert!(whole.materials[0].texture.is_some(), "{:?}", whole.notices);
    // The JSON of a GLB file may begin with a byte order mark.
    let marked = glb(&format!("\u{feff}{}", document("", "").replace(r#""uri": "", "#, "")), &[0; 36]);
    load(&file("a.glb", marked), &Budget::default()).unwrap();
}
