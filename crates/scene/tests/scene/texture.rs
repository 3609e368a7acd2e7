//! Textures: texels at their centres, interpolation between them, and coordinates outside the image.

use std::sync::Arc;

use crate::common::Random;
use raycam_scene::color::{linear_from_srgb8, srgb_from_linear, srgb8_from_linear};
use raycam_scene::{Image, TexelFilter, Texels, Texture, TextureSampler, Wrap};

fn texture(size: [u32; 2], wrap: Wrap) -> Texture {
    let mut random = Random(u64::from(size[0]));
    let texels = (0..size[0] * size[1]).map(|_| std::array::from_fn(|_| (random.next() * 256.0) as u8));
    Texture::from_srgb8("test", size, texels, [wrap; 2])
}

fn texel(texture: &Texture, index: u32) -> [f32; 3] {
    rgb(texture.image.texels.linear(index as usize))
}

fn rgb([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r, g, b]
}

fn center(i: i64, size: u32) -> f32 {
    ((i as f64 + 0.5) / f64::from(size)) as f32
}

#[test]
fn byte_colours_survive_conversion_to_linear_and_back() {
    for v in 0..=255 {
        assert_eq!(srgb8_from_linear(linear_from_srgb8([v; 3])), [v; 3]);
    }
    assert!((srgb_from_linear(0.5) - 0.735_357).abs() < 1e-6);
}

#[test]
fn lookup_at_a_texel_centre_returns_the_exact_texel() {
    for size in [[1, 1], [2, 3], [5, 7], [640, 480], [1000, 999]] {
        let image = texture(size, Wrap::Repeat);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let found = image.lookup([center(i64::from(x), size[0]), center(i64::from(y), size[1])]);
                let expected = image.image.texels.linear((y * size[0] + x) as usize);
                assert_eq!(found, expected, "texel {x} {y} of {size:?}");
            }
        }
    }
    // In alternating black and white columns, even a small fraction of a neighbouring texel changes the result; the
    // error is largest in wide images.
    let width = 65_536;
    let texels = (0..width).map(|x| [255 * (x % 2) as u8; 3]);
    let stripes = Texture::from_srgb8("", [width, 1], texels, [Wrap::Clamp; 2]);
    for x in 0..width {
        assert_eq!(
            srgb8_from_linear(rgb(stripes.lookup([center(i64::from(x), width), 0.5]))),
            [255 * (x % 2) as u8; 3]
        );
    }
}

#[test]
fn lookups_between_centres_interpolate_linear_values() {
    let texels = [[0; 3], [255; 3], [255; 3], [255; 3]];
    let image = Texture::from_srgb8("", [2, 2], texels, [Wrap::Clamp; 2]);
    assert_eq!(rgb(image.lookup([0.5, 0.25])), [0.5; 3]);
    assert_eq!(rgb(image.lookup([0.375, 0.25])), [0.25; 3]);
    assert_eq!(rgb(image.lookup([0.5, 0.5])), [0.75; 3]);
    assert_eq!(rgb(image.lookup([0.25, 0.5])), [0.5; 3], "row 0 is at the top, v = 0");
}

#[test]
fn wrap_modes_repeat_clamp_and_mirror() {
    // For each wrap mode, the texels at positions -4 to 5 of an image that is 3 texels wide.
    let expected: [(Wrap, [u32; 10]); 3] = [
        (Wrap::Repeat, [2, 0, 1, 2, 0, 1, 2, 0, 1, 2]),
        (Wrap::Clamp, [0, 0, 0, 0, 0, 1, 2, 2, 2, 2]),
        (Wrap::Mirror, [2, 2, 1, 0, 0, 1, 2, 2, 1, 0]),
    ];
    for (wrap, texels) in expected {
        let image = texture([3, 1], wrap);
        for (i, texel) in (-4..6).zip(texels) {
            let found = rgb(image.lookup([center(i, 3), 0.5]));
            assert_eq!(found, self::texel(&image, texel), "{wrap:?} {i}");
        }
    }
    let seam = texture([4, 1], Wrap::Repeat);
    let [first, last] = [0, 3].map(|i| texel(&seam, i));
    assert_eq!(rgb(seam.lookup([0.0, 0.5])), [0, 1, 2].map(|i| last[i] + (first[i] - last[i]) * 0.5));
}

#[test]
fn texture_coordinates_of_any_size_are_wrapped() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let image = texture([3, 2], wrap);
        for v in [f32::MAX, f32::MIN, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e18] {
            let _ = image.lookup([v, -v]);
        }
    }
}

#[test]
fn texel_counts_that_differ_from_the_size_are_refused() {
    texture([3, 2], Wrap::Repeat).validate().unwrap();
    let short = Texture::from_srgb8("", [3, 2], [[0; 3]; 5], [Wrap::Repeat; 2]);
    assert!(short.validate().unwrap_err().to_string().contains("5 texels; expected 3 x 2"));
    let empty = Texture::from_srgb8("", [0, 0], [], [Wrap::Repeat; 2]);
    assert!(empty.validate().is_err());
}

#[test]
fn texels_are_linear_values_with_alpha() {
    let of = |texels: Texels| texels.linear(0);
    let half = linear_from_srgb8([188; 3])[0];
    assert_eq!(of(Texels::Srgb8(vec![[188, 0, 255, 51]])), [half, 0.0, 1.0, 0.2]);
    assert_eq!(of(Texels::Linear8(vec![[51, 0, 255, 51]])), [0.2, 0.0, 1.0, 0.2]);
    assert_eq!(of(Texels::Linear16(vec![[13107, 0, 65535, 13107]])), [0.2, 0.0, 1.0, 0.2]);
    assert_eq!(of(Texels::Float(vec![[1e4, 0.0, 1.0, 0.2]])), [1e4, 0.0, 1.0, 0.2]);
    let mut nearest = texture([3, 1], Wrap::Clamp);
    nearest.sampler.magnification = TexelFilter::Nearest;
    assert_eq!(rgb(nearest.lookup([0.6, 0.5])), texel(&nearest, 1));
    let infinite = Texture {
        image: Arc::new(Image::new("x", [1, 1], Texels::Float(vec![[f32::INFINITY; 4]]))),
        sampler: TextureSampler::default(),
    };
    assert!(infinite.validate().is_err());
}
