//! Writes the corpora for readers of files that raycam can write or build from text, to fuzz/corpus/TARGET/.

use std::fs;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_calibration::{CameraRecord, Pose, Rotation};
use raycam_formats::{Budget, bundle, world_file};
use raycam_scene::PixelCenter;
use targets::{BETWEEN, container};

const WORLD: &str = r##"
up = "y"
[camera]
size = [64, 48]
fov = 40
location = [3, -4, 2]
target = [0, 0, 0]
distortion = [0.1, 0.02, 0.001, -0.002, 0.003]
[[object]]
name = "box"
box = { size = 1 }
color = "#c83c28"
[[object]]
name = "lid"
instance_of = "box"
matrix = [[1, 0.5, 0, 0], [0, -1, 0, 2], [0, 0, 1, 0.1], [0, 0, 0, 1]]
[[object]]
vertices = [[0, 0, 0], [0.1, 0, 0], [0, 0, 3]]
triangles = [[0, 1, 2]]
face_colors = [[0.1, 0.2, 0.3]]
type = "principled"
metallic = 0.5
[[light]]
type = "bulb"
position = [0, 0, 3]
power = [60, 60, 60]
[video]
fps = 10
keyframe = [{ time = 0, object = "box", location = [0, 0, 0] }, { time = 1, object = "box", location = [1, 0, 0] }]
"##;

const PROFILE: &str = "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 1000 1 3 2 1 2 0.1 0.1 0.1\n1 1 50\n0 45 90\n0 90\n\
    100 50 0\n90 40 10\n";

const MATERIALS: &str = "newmtl a\nKd 0.8 0.1 0.1\nKs 1 1 1\nNs 20\nNi 1.5\nd 0.5\nillum 7\nTf 1 0.5 0.5\nKe 1 2 3\n\
    newmtl b\nPr 0.3\nPm 1\nPs 0.1 0.2 0.3\nPc 0.5\nPcr 0.1\naniso 0.2\nanisor 0.3\nmap_Kd -s 2 2 -o 0.5 -clamp on a.png\n\
    norm -bm 0.3 b c.png\nmap_d -imfchan m d.png\nTr 0.3\nrefl -type sphere a.png\n";

const GLTF: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}], "nodes": [
{"mesh": 0, "skin": 0, "translation": [1, 2, 3], "rotation": [0, 0, 0, 1], "scale": [1, -1, 1], "children": [3], "weights": [0.5]},
{"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
{"extensions": {"KHR_lights_punctual": {"light": 0}, "KHR_node_visibility": {"visible": true}}}, {"name": "joint"}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 0, "TANGENT": 3, "TEXCOORD_0": 1, "COLOR_0": 3,
"JOINTS_0": 4, "WEIGHTS_0": 3}, "indices": 2, "material": 0, "mode": 4, "targets": [{"POSITION": 5}]}], "weights": [0]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
{"bufferView": 0, "byteOffset": 0, "componentType": 5123, "normalized": true, "count": 3, "type": "VEC2"},
{"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
{"bufferView": 0, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4"},
{"bufferView": 0, "componentType": 5121, "count": 3, "type": "VEC4"},
{"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {"count": 1, "indices": {"bufferView": 1, "componentType": 5123},
"values": {"bufferView": 0}}}, {"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR"}],
"bufferViews": [{"buffer": 0, "byteLength": 36, "byteStride": 12}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
"buffers": [{"byteLength": 44}],
"materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.8, 0.8, 1], "baseColorTexture": {"index": 0,
"extensions": {"KHR_texture_transform": {"offset": [0, 1], "rotation": 1, "scale": [2, 2], "texCoord": 1}}}, "metallicFactor": 0},
"normalTexture": {"index": 0, "scale": 0.5}, "alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": true, "extensions":
{"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.4}, "KHR_materials_clearcoat":
{"clearcoatFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2}, "KHR_materials_unlit": {}}}],
"textures": [{"source": 0, "sampler": 0, "extensions": {"KHR_texture_basisu": {"source": 0}}}],
"samplers": [{"wrapS": 33071, "magFilter": 9728, "minFilter": 9987}], "images": [{"bufferView": 0, "mimeType": "image/png"}],
"cameras": [{"type": "perspective", "perspective": {"yfov": 0.6, "znear": 0.1, "aspectRatio": 1.5}}],
"skins": [{"joints": [3], "skeleton": 3}], "extensionsUsed": ["KHR_lights_punctual"],
"animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}, {"sampler": 0, "target":
{"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/0/scale"}}}}],
"samplers": [{"input": 6, "output": 0, "interpolation": "LINEAR"}]}],
"extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "color": [1, 1, 1], "intensity": 3, "range": 4,
"spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}]}, "KHR_materials_variants": {"variants": [{"name": "a"}]}}}"#;

/// Writes one seed file.
fn add(target: &str, name: &str, bytes: &[u8]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("corpus")
        .join(target);
    fs::create_dir_all(&folder).expect("a folder for the corpus");
    fs::write(folder.join(name), bytes).expect("room for a seed");
}

/// A camera that every format can express.
fn record() -> CameraRecord {
    let mut record = CameraRecord::new("7", PixelCenter::Integer);
    let k = [
        DVec3::new(500.1, 0.0, 0.0),
        DVec3::new(0.0, 500.1, 0.0),
        DVec3::new(319.5, 239.5, 1.0),
    ];
    (record.size, record.k) = (Some([640, 480]), Some(DMat3::from_cols(k[0], k[1], k[2])));
    let rotation = Rotation::Quaternion([0.5, 0.1, -0.7, 0.2]);
    record.pose = Some(Pose::camera_from_world(
        rotation,
        DVec3::new(0.1, -2.3, 4.7),
    ));
    record
}

/// glTF documents: complete, without images, and without images and the texture extension, so that some seeds are
/// readable worlds.
fn documents() -> Vec<String> {
    let bare = GLTF.replace(
        "\"images\": [{\"bufferView\": 0, \"mimeType\": \"image/png\"}],\n",
        "",
    );
    let untextured = bare.replace(
        ", \"extensions\": {\"KHR_texture_basisu\": {\"source\": 0}}",
        "",
    );
    vec![GLTF.into(), bare, untextured]
}

/// Returns the first byte of an input of `named_cameras`, which selects the format.
fn pick(format: &str) -> u8 {
    let place = raycam_calibration::formats().position(|name| name == format);
    place.expect("a format") as u8
}

/// Files in formats that raycam reads but does not write.
const READ: [(&str, &str); 10] = [
    ("bundler", "# Bundle file v0.3\n1 0\n500 -0.1 0.02\n1 0 0\n0 1 0\n0 0 1\n1 2 3\n"),
    ("middlebury", "cam0=[500 0 32; 0 500 24; 0 0 1]\ncam1=[500 0 33; 0 500 24; 0 0 1]\ndoffs=1\nbaseline=193\n\
        width=64\nheight=48\nndisp=10\n"),
    ("mvsnet", "extrinsic\n1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n\nintrinsic\n500 0 32\n0 500 24\n0 0 1\n\n1 0.1\n"),
    ("pmvs", "CONTOUR\n500 0 32 16\n0 500 24 12\n0 0 1 3\n"),
    ("metashape", "<document><chunk><sensors><sensor id='0' type='frame'><resolution width='64' height='48'/>\
        <calibration class='adjusted'><f>500</f><k1>0.1</k1></calibration></sensor></sensors><cameras><camera id='0' \
        sensor_id='0' label='a'><transform>1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1</transform></camera></cameras></chunk></document>"),
    ("realitycapture", "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\na.jpg,1,2,3,10,20,30,28,0.01,-0.01,\
        0.1,0.02,0,0,0,0\n"),
    ("alicevision", r#"{"version": ["1", "2", "11"], "views": [{"viewId": "1", "poseId": "1", "intrinsicId": "2",
        "path": "a.jpg"}], "intrinsics": [{"intrinsicId": "2", "width": "64", "height": "48", "sensorWidth": "36",
        "focalLength": "50", "type": "pinhole", "distortionType": "brown", "distortionParams": ["0.1", "0", "0", "0", "0"]}],
        "poses": [{"poseId": "1", "pose": {"transform": {"rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "center": [1, 2, 3]}}}]}"#),
    ("opensfm", r#"[{"cameras": {"c": {"projection_type": "brown", "width": 64, "height": 48, "focal_x": 0.8, "focal_y": 0.8,
        "c_x": 0, "c_y": 0, "k1": 0.1}}, "shots": {"a": {"camera": "c", "rotation": [0.1, 0.2, 0.3],
        "translation": [1, 2, 3]}}}]"#),
    ("poses", "[[[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]]"),
    ("orb-slam", "Camera:\n  setup: monocular\n  model: fisheye\n  fx: 500\n  fy: 500\n  cx: 32\n  cy: 24\n  k1: 0.1\n\
        \x20 cols: 64\n  rows: 48\n"),
];

fn main() {
    let folder = Path::new("/nonexistent");
    let world = world_file::parse(WORLD, folder, Path::new("seed.toml"), &Budget::default())
        .expect("a world");
    let bytes = bundle::write(&world).expect("its bytes");
    let line = bytes.iter().position(|&b| b == b'\n').expect("a line") + 1;
    add("bundle", "world", &bytes[line..]);
    add("world", "world", WORLD.as_bytes());
    add("ies", "profile", PROFILE.as_bytes());
    add("mtl", "materials", MATERIALS.as_bytes());
    let binary: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .chain([0, 0, 1, 0, 2, 0, 0, 0])
        .collect();
    for (i, document) in documents().iter().enumerate() {
        let name = format!("document{i}");
        add(
            "gltf",
            &name,
            &[document.as_bytes(), BETWEEN, &binary].concat(),
        );
        add("glb", &name, &container(document.as_bytes(), &binary));
    }
    for format in raycam_calibration::written_formats() {
        let written = raycam_calibration::write(&[record()], Path::new("out"), format)
            .expect("what every format holds");
        let target = match format {
            "blender" => "nerf".into(),
            "orb-slam" | "camodocal" | "3dgs" | "poses" | "euroc" | "blender-splits"
            | "tum-intrinsics" => "any_cameras".into(),
            format => format.replace('-', "_"),
        };
        let order = ["cameras", "images", "rigs", "frames"];
        let mut files: Vec<_> = (written.files.iter())
            .filter_map(|(name, bytes)| {
                let place = order.iter().position(|start| name.starts_with(start));
                (place.is_some() || name.is_empty()).then_some((place, &bytes[..]))
            })
            .collect();
        files.sort_by_key(|&(place, _)| place);
        let files: Vec<&[u8]> = files.into_iter().map(|(_, bytes)| bytes).collect();
        add(&target, format, &files.join(BETWEEN));
        if let [file] = files[..] {
            add("named_cameras", format, &[&[pick(format)][..], file].concat());
        }
    }
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/calibration/tests/data/samples");
    for folder in fs::read_dir(samples).expect("samples").flatten() {
        let format = folder.file_name().into_string().expect("a format");
        for file in fs::read_dir(folder.path()).expect("samples").flatten() {
            let bytes = fs::read(file.path()).expect("a sample");
            let name = format!("{format}-{}", file.file_name().to_string_lossy());
            add("named_cameras", &name, &[&[pick(&format)][..], &bytes].concat());
            add("any_cameras", &name, &bytes);
        }
    }
    for (format, text) in READ {
        add("named_cameras", &format!("{format}-read"), &[&[pick(format)][..], text.as_bytes()].concat());
        add("any_cameras", &format!("{format}-read"), text.as_bytes());
    }
}
