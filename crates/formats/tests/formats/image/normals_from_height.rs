use std::f32::consts::TAU;
use std::fs;

use raycam_formats::encode::png::{Samples, encode};
use raycam_formats::{Budget, load, write_gltf};
use raycam_scene::{HeightMap, HeightUnit, Texels, World};

use crate::support::folder;

const SIDE: usize = 64;

/// World with a triangle whose material has this MTL line, next to an image `heights.png`. `height` is a function of
/// the position in the image; positions and heights are in 0..=1.
fn model(line: &str, height: impl Fn(f32, f32) -> f32) -> World {
    let folder = folder();
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";
    fs::write(folder.join("a.obj"), obj).unwrap();
    fs::write(folder.join("a.mtl"), format!("newmtl m\n{line}\n")).unwrap();
    let centre = |i: usize| (i as f32 + 0.5) / SIDE as f32;
    let texels: Vec<u16> =
        (0..SIDE * SIDE).map(|i| (65535.0 * height(centre(i % SIDE), centre(i / SIDE))).round() as u16).collect();
    let png = encode([SIDE as u32; 2], 1, Samples::U16(&texels)).unwrap();
    fs::write(folder.join("heights.png"), png).unwrap();
    load(&folder.join("a.obj"), &Budget::default()).unwrap()
}

/// The height map of the world's only material.
fn heights(model: &World) -> HeightMap {
    assert!(model.materials[0].normal_map.is_none());
    model.materials[0].height_map.unwrap()
}

/// The same world after writing it as glTF and reading it again.
fn through_gltf(model: &World) -> World {
    let file = folder().join("a.glb");
    fs::write(&file, write_gltf(model).unwrap().0).unwrap();
    load(&file, &Budget::default()).unwrap()
}

/// Normals of the normal map that glTF contains in place of the heights, row by row.
fn normals(model: &World) -> Vec<[f32; 3]> {
    let model = through_gltf(model);
    let map = model.materials[0].normal_map.unwrap();
    let texels = &model.textures[map.texture.texture].image.texels;
    assert!(matches!(texels, Texels::Linear16(_)));
    let normal = |i| [0, 1, 2].map(|c: usize| 2.0 * texels.linear(i)[c] - 1.0);
    (0..texels.len()).map(normal).collect()
}

fn assert_near(found: [f32; 3], expected: [f32; 3], at: usize) {
    let length = expected.iter().map(|v| v * v).sum::<f32>().sqrt();
    for (found, expected) in found.into_iter().zip(expected) {
        let expected = expected / length;
        assert!((found - expected).abs() < 1e-4, "{at}: {found} {expected}");
    }
}

#[test]
fn normals_are_tilted_against_the_slope() {
    // The heights are waves with a whole period in each direction: the derivative of a sine is a cosine.
    let step = TAU / SIDE as f32;
    let slope = |i: usize| 0.4 * step.sin() * (step * (i as f32 + 0.5)).cos();
    let across = model("map_Bump -bm 0.5 heights.png", |x, _| 0.5 + 0.4 * (TAU * x).sin());
    assert_eq!((heights(&across).scale, heights(&across).unit), (0.5, HeightUnit::Texel));
    assert_eq!(through_gltf(&across).materials[0].normal_map.unwrap().scale, 0.5);
    for (i, found) in normals(&across).into_iter().enumerate() {
        assert_near(found, [-slope(i % SIDE), 0.0, 1.0], i);
    }
    // Rows go downwards in the image, but green points upwards.
    let down = model("bump heights.png", |_, y| 0.5 + 0.4 * (TAU * y).sin());
    for (i, found) in normals(&down).into_iter().enumerate() {
        assert_near(found, [0.0, slope(i / SIDE), 1.0], i);
    }
}

#[test]
fn normals_at_the_edges_use_the_neighbours_of_the_wrap_mode() {
    let ramp = |x: f32, _: f32| x;
    let step = 1.0 / SIDE as f32;
    let clamped = normals(&model("bump -clamp on heights.png", ramp));
    assert_near(clamped[0], [-0.5 * step, 0.0, 1.0], 0);
    assert_near(clamped[1], [-step, 0.0, 1.0], 1);
    // In a repeated texture, the opposite edge is adjacent.
    let repeated = normals(&model("bump heights.png", ramp));
    assert_near(repeated[0], [-0.5 * (2.0 * step - 1.0), 0.0, 1.0], 0);
}

#[test]
fn one_image_can_be_a_height_map_and_a_colour_texture() {
    let both = model("map_Pr heights.png\nmap_Bump heights.png", |x, _| x);
    assert_eq!((both.textures.len(), heights(&both).scale), (2, 1.0));
    assert!(both.notices.iter().any(|n| n.to_string().contains("a height map")));
}
