//! Textures: texels at their centres, what lies between them, and what lies beyond the image.

mod common;

use common::Random;
use raycam_scene::color::{linear_from_srgb8, srgb_from_linear, srgb8_from_linear};
use raycam_scene::{Texture, Wrap};

fn texture(size: [u32; 2], wrap: Wrap) -> Texture {
    let mut random = Random(u64::from(size[0]));
    let texels = (0..size[0] * size[1])
        .map(|_| std::array::from_fn(|_| (random.next() * 256.0) as u8))
        .collect();
    Texture {
        name: "test".into(),
        size,
        texels,
        wrap: [wrap; 2],
    }
}

fn center(i: i64, size: u32) -> f32 {
    ((i as f64 + 0.5) / f64::from(size)) as f32
}

#[test]
fn every_8_bit_colour_survives_linear_light() {
    for v in 0..=255 {
        assert_eq!(srgb8_from_linear(linear_from_srgb8([v; 3])), [v; 3]);
    }
    assert!((srgb_from_linear(0.5) - 0.735_357).abs() < 1e-6);
}

#[test]
fn a_texel_at_its_centre_comes_back_byte_for_byte() {
    for size in [[1, 1], [2, 3], [5, 7], [640, 480], [1000, 999]] {
        let image = texture(size, Wrap::Repeat);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let found =
                    image.lookup([center(i64::from(x), size[0]), center(i64::from(y), size[1])]);
                let texel = image.texels[(y * size[0] + x) as usize];
                assert_eq!(found, linear_from_srgb8(texel), "texel {x} {y} of {size:?}");
            }
        }
    }
    // Black beside white shows the smallest share of a neighbour, in the widest images most.
    let width = 65_536;
    let texels = (0..width).map(|x| [255 * (x % 2) as u8; 3]).collect();
    let stripes = Texture {
        name: String::new(),
        size: [width, 1],
        texels,
        wrap: [Wrap::Clamp; 2],
    };
    for x in 0..width {
        assert_eq!(
            srgb8_from_linear(stripes.lookup([center(i64::from(x), width), 0.5])),
            [255 * (x % 2) as u8; 3]
        );
    }
}

#[test]
fn between_centres_linear_values_are_mixed() {
    let image = Texture {
        name: String::new(),
        size: [2, 2],
        texels: vec![[0; 3], [255; 3], [255; 3], [255; 3]],
        wrap: [Wrap::Clamp; 2],
    };
    assert_eq!(image.lookup([0.5, 0.25]), [0.5; 3]);
    assert_eq!(image.lookup([0.375, 0.25]), [0.25; 3]);
    assert_eq!(image.lookup([0.5, 0.5]), [0.75; 3]);
    assert_eq!(
        image.lookup([0.25, 0.5]),
        [0.5; 3],
        "row 0 is at the top, v = 0"
    );
}

#[test]
fn wrapping() {
    // Texel numbers beyond the image, for a width of 3.
    let expected: [(Wrap, [u32; 10]); 3] = [
        (Wrap::Repeat, [2, 0, 1, 2, 0, 1, 2, 0, 1, 2]),
        (Wrap::Clamp, [0, 0, 0, 0, 0, 1, 2, 2, 2, 2]),
        (Wrap::Mirror, [2, 2, 1, 0, 0, 1, 2, 2, 1, 0]),
    ];
    for (wrap, texels) in expected {
        let image = texture([3, 1], wrap);
        for (i, texel) in (-4..6).zip(texels) {
            let expected = linear_from_srgb8(image.texels[texel as usize]);
            assert_eq!(image.lookup([center(i, 3), 0.5]), expected, "{wrap:?} {i}");
        }
    }
    let seam = texture([4, 1], Wrap::Repeat);
    let [first, last] = [0, 3].map(|i| linear_from_srgb8(seam.texels[i]));
    assert_eq!(
        seam.lookup([0.0, 0.5]),
        [0, 1, 2].map(|i| last[i] + (first[i] - last[i]) * 0.5)
    );
}

#[test]
fn no_coordinate_is_too_large() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let image = texture([3, 2], wrap);
        for v in [
            f32::MAX,
            f32::MIN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            1e18,
        ] {
            let _ = image.lookup([v, -v]);
        }
    }
}

#[test]
fn texels_and_size_must_agree() {
    let mut image = texture([3, 2], Wrap::Repeat);
    image.validate().unwrap();
    image.texels.pop();
    assert!(
        image
            .validate()
            .unwrap_err()
            .to_string()
            .contains("5 texels, expected 3 x 2")
    );
    let empty = Texture {
        name: String::new(),
        size: [0, 0],
        texels: vec![],
        wrap: [Wrap::Repeat; 2],
    };
    assert!(empty.validate().is_err());
}
