use std::io::Cursor;

use ::exr::image::FlatSamples;
use ::exr::image::read::read;
use ::exr::meta::attribute::{AttributeValue, Text};
use ::exr::prelude::{ReadChannels, ReadLayers};
use glam::DVec3;
use raycam_formats::encode::exr::{Layer, LayerSamples, channel_names, encode};
use raycam_scene::{Camera, PixelCenter, Up, camera};

fn layer<'a>(name: &'a str, components: usize, samples: LayerSamples<'a>) -> Layer<'a> {
    Layer { name, components, samples }
}

#[test]
fn exr_channels_have_the_names_that_viewers_expect() {
    let (floats, ids) = (LayerSamples::F32(&[]), LayerSamples::Id(&[]));
    for (name, components, samples, expected) in [
        ("color", 3, floats, "R G B"),
        ("color", 4, floats, "R G B A"),
        ("depth", 1, floats, "depth.Z"),
        ("distance", 1, floats, "distance.Z"),
        ("normal", 3, floats, "normal.X normal.Y normal.Z"),
        ("barycentric", 2, floats, "barycentric.U barycentric.V"),
        ("coverage", 1, floats, "coverage.V"),
        ("instance", 1, ids, "instance.id"),
    ] {
        assert_eq!(channel_names(&layer(name, components, samples)).unwrap().join(" "), expected);
    }
    assert!(channel_names(&layer("normal", 5, floats)).is_err());
}

#[test]
fn exr_files_round_trip_values_and_camera_through_another_reader() {
    let color: Vec<f32> = (0..18).map(|i| i as f32 / 7.0).collect();
    let depth = [1.0, f32::INFINITY, 1e-30, 3.4e38, f32::NAN, -0.0];
    let ids = [0, -1, 16_777_217, i32::MAX, i32::MIN, 5];
    let k = camera::intrinsics_from_focal(800.1, [3, 2], PixelCenter::Half);
    let location = DVec3::new(1.0 / 3.0, 2.0, 3.1);
    let camera = Camera::from_pose(location, 1.0, 2.0, 3.0, Up::Z, k, [3, 2], PixelCenter::Half).unwrap();
    let layers = [
        layer("color", 3, LayerSamples::F16(&color)),
        layer("depth", 1, LayerSamples::F32(&depth)),
        layer("instance", 1, LayerSamples::Id(&ids)),
    ];
    let file = encode([3, 2], &layers, Some(&camera), &[("raycam.seed", "7"), ("who", "Zo\u{eb}")]).unwrap();
    assert_eq!(file, encode([3, 2], &layers, Some(&camera), &[("raycam.seed", "7"), ("who", "Zo\u{eb}")]).unwrap());

    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_buffered(Cursor::new(&file)).unwrap();
    let channels = &image.layer_data.channel_data.list;
    let names: Vec<_> = channels.iter().map(|channel| channel.name.to_string()).collect();
    assert_eq!(names, ["B", "G", "R", "depth.Z", "instance.id"]);
    let FlatSamples::F16(red) = &channels[2].sample_data else { panic!() };
    let expected: Vec<_> = color.iter().step_by(3).map(|&v| half::f16::from_f32(v)).collect();
    assert_eq!(red, &expected);
    let FlatSamples::F32(read_depth) = &channels[3].sample_data else { panic!() };
    assert_eq!(read_depth.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), depth.map(f32::to_bits));
    let FlatSamples::U32(read_ids) = &channels[4].sample_data else { panic!() };
    assert_eq!(read_ids.iter().map(|&v| v.cast_signed()).collect::<Vec<_>>(), ids);

    // The exr crate stores some attributes with the image and others with its only layer.
    let mut attributes = image.attributes.other.clone();
    attributes.extend(image.layer_data.attributes.other.clone());
    let doubles = |name: &str, of: &str| {
        let AttributeValue::Custom { kind, bytes } = &attributes[&Text::from(name)] else { panic!("{name}") };
        assert_eq!(kind, &Text::from(of));
        bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect::<Vec<_>>()
    };
    assert_eq!(doubles("raycam.K", "m33d"), camera.k().transpose().to_cols_array());
    assert_eq!(doubles("raycam.R", "m33d"), camera.r().transpose().to_cols_array());
    assert_eq!(doubles("raycam.C", "v3d"), location.to_array());
    assert_eq!(doubles("raycam.P", "m44d")[..12], *camera.p().as_flattened());
    let string = |name: &str| {
        let AttributeValue::Text(text) = &attributes[&Text::from(name)] else { panic!("{name}") };
        String::from_utf8(text.as_slice().to_vec()).unwrap()
    };
    assert_eq!((string("raycam.pixelCenter"), string("who")), ("half".into(), "Zo\u{eb}".into()));
    assert_eq!(string("raycam.version"), env!("CARGO_PKG_VERSION"));
    assert!(string("raycam.conventions").contains("P = K R [I | -C]"));
}

#[test]
fn large_images_round_trip_through_exr() {
    let (columns, rows) = (257, 131);
    let ids: Vec<i32> = (0..columns * rows).map(|i| i * 7919 % 1000 - 1).collect();
    let file =
        encode([columns as u32, rows as u32], &[layer("triangle", 1, LayerSamples::Id(&ids))], None, &[]).unwrap();
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_buffered(Cursor::new(&file)).unwrap();
    let FlatSamples::U32(found) = &image.layer_data.channel_data.list[0].sample_data else { panic!() };
    assert_eq!(found.iter().map(|&v| v.cast_signed()).collect::<Vec<_>>(), ids);
}

#[test]
fn layers_with_the_wrong_size_are_refused() {
    let six = LayerSamples::F32(&[0.0; 6]);
    for (size, layers, notes, expected) in [
        ([3, 2], vec![layer("depth", 2, six)], None, "has 6 values; expected 3 x 2 x 2"),
        ([3, 0], vec![layer("depth", 1, LayerSamples::F32(&[]))], None, "1 layers of 3 x 0 pixels"),
        ([3, 2], vec![], None, "0 layers"),
        ([3, 2], vec![layer("depth", 1, six), layer("depth", 1, six)], None, "two channels are named depth.Z"),
        ([3, 2], vec![layer("d\u{e9}", 1, six)], None, "expected printable ASCII"),
        (
            [3, 2],
            vec![layer("depth", 1, six)],
            Some(("raycam.version", "0")),
            "the header contains raycam.version twice",
        ),
        ([3, 2], vec![layer("depth", 1, six)], Some(("", "0")), "expected printable ASCII"),
        ([u32::MAX, u32::MAX], vec![layer("depth", 4, six)], None, "has 6 values"),
    ] {
        let notes: Vec<_> = notes.into_iter().collect();
        let error = encode(size, &layers, None, &notes).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}
