//! Textures that exceed their memory: equal values from the temporary file, for any limit.

use std::sync::Arc;

use crate::common::Random;
use raycam_scene::texture::{PageInStats, TextureCache};
use raycam_scene::{Image, NoticeCode, SceneError, TexelFilter, Texels, Texture, TextureSampler, World, Wrap};

/// Noise in every texel format.
fn images(size: [u32; 2]) -> Vec<Arc<Image>> {
    let mut random = Random(u64::from(size[0] * 1000 + size[1]));
    let count = size[0] * size[1];
    let mut small =
        || -> Vec<[u8; 4]> { (0..count).map(|_| std::array::from_fn(|_| (random.next() * 256.0) as u8)).collect() };
    let (srgb, linear) = (small(), small());
    let wide = (0..count).map(|_| std::array::from_fn(|_| (random.next() * 65536.0) as u16)).collect();
    let float = (0..count).map(|_| std::array::from_fn(|_| (random.next() * 2000.0 - 1000.0) as f32)).collect();
    let kinds = [Texels::Srgb8(srgb), Texels::Linear8(linear), Texels::Linear16(wide), Texels::Float(float)];
    let image = |texels| Arc::new(Image::new("noise", size, texels));
    kinds.into_iter().map(image).collect()
}

fn paged(memory: &Arc<TextureCache>, image: &Image) -> Arc<Image> {
    let paged = Arc::new(memory.page_out(image).unwrap());
    assert!(matches!(paged.texels, Texels::Paged(_)));
    paged
}

/// Points inside and outside the image, mainly at the borders of tiles.
fn points(size: [u32; 2]) -> Vec<[f32; 2]> {
    let mut random = Random(7);
    let mut points: Vec<[f32; 2]> =
        (0..200).map(|_| std::array::from_fn(|_| (random.next() * 4.0 - 2.0) as f32)).collect();
    for border in [0, 64, 128, 192] {
        for offset in [-1.0, -0.5, -0.1, 0.0, 0.3, 0.5] {
            let at = (f64::from(border) + offset) / f64::from(size[0]);
            points.push([at as f32, 0.4]);
            points.push([0.6, ((f64::from(border) + offset) / f64::from(size[1])) as f32]);
            points.push([at as f32 - 1.0, at as f32 + 1.0]);
        }
    }
    points.push([f32::NAN, f32::INFINITY]);
    points
}

fn bits(texel: [f32; 4]) -> [u32; 4] {
    texel.map(f32::to_bits)
}

#[test]
fn memory_limit_does_not_change_lookups() {
    for size in [[1, 1], [63, 65], [64, 64], [130, 67], [3, 200], [257, 129]] {
        let points = points(size);
        for image in images(size) {
            // The memory limits are large enough for no tile, for one tile, for a few tiles, and for all tiles.
            for limit in [1, 20_000, 140_000, 1 << 30] {
                let memory = Arc::new(TextureCache::new(limit));
                let paged = paged(&memory, &image);
                let levels = image.mip_map().into_iter().zip(paged.mip_map());
                assert_eq!(image.mip_map().len(), paged.mip_map().len());
                for (level, (here, there)) in levels.enumerate() {
                    assert_eq!(here.size, there.size);
                    assert_eq!(here.texels.len(), there.texels.len());
                    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                        for magnification in [TexelFilter::Linear, TexelFilter::Nearest] {
                            let sampler =
                                TextureSampler { wrap: [wrap; 2], magnification, ..TextureSampler::default() };
                            let [a, b] = [&here, &there].map(|image| Texture { image: image.clone(), sampler });
                            for &uv in &points {
                                let (a, b) = (bits(a.lookup(uv)), bits(b.lookup(uv)));
                                assert_eq!(a, b, "{size:?} level {level} {wrap:?} at {uv:?}");
                            }
                        }
                    }
                    assert_eq!(*there.texels.in_memory().unwrap(), here.texels);
                }
                memory.check().unwrap();
            }
        }
    }
}

#[test]
fn threads_share_tiles_and_read_equal_values() {
    let image = images([300, 500]).remove(0);
    let memory = Arc::new(TextureCache::new(100_000));
    let paged = paged(&memory, &image);
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let (image, paged) = (&image, &paged);
            scope.spawn(move || {
                let mut random = Random(thread);
                for _ in 0..20_000 {
                    let index = (random.next() * 150_000.0) as usize;
                    assert_eq!(paged.texels.linear(index), image.texels.linear(index));
                }
            });
        }
    });
    // The memory holds six of forty tiles of 16 KiB: most of the 80,000 lookups do not find their tile in memory, but
    // some do.
    let PageInStats { tiles, bytes } = memory.page_in_stats();
    assert!((20_000..75_000).contains(&tiles), "{tiles}");
    assert!(bytes > tiles * 8_000 && bytes <= tiles * 16_384);
    let whole = Arc::new(TextureCache::new(1 << 20));
    let paged = self::paged(&whole, &image);
    for i in 0..150_000 {
        assert_eq!(paged.texels.linear(i), image.texels.linear(i));
    }
    assert_eq!(whole.page_in_stats().tiles, 40, "5 x 8 tiles, each read once");
    assert_eq!(whole.page_in_stats().bytes, 300 * 500 * 4);
}

#[test]
fn textures_are_paged_only_above_the_limit() {
    let image = |seed: u32| {
        let texels = vec![[seed as u8; 4]; 64 * 64];
        Arc::new(Image::new(format!("{seed}"), [64, 64], Texels::Linear8(texels)))
    };
    // An image has 64 x 64 texels of 4 bytes; its mip levels have 32 x 32 + ... + 1 texels of 8 bytes.
    let each = 64 * 64 * 4 + 1365 * 8;
    let memory = Arc::new(TextureCache::new(3 * each));
    let mut world = World { texture_cache: Some(memory.clone()), ..World::default() };
    let is_paged = |image: &Image| matches!(image.texels, Texels::Paged(_));
    for seed in 0..3 {
        let given = image(seed);
        let kept = memory.insert(given.clone()).unwrap();
        assert!(Arc::ptr_eq(&given, &kept) && !memory.is_exceeded());
        // Two textures share each image.
        for wrap in [Wrap::Repeat, Wrap::Clamp] {
            world.add_texture(Texture {
                image: kept.clone(),
                sampler: TextureSampler { wrap: [wrap; 2], ..TextureSampler::default() },
            });
        }
        world.page_textures().unwrap();
        assert!(world.notices.is_empty());
        world.check_textures_in_memory().unwrap();
    }
    let before = world.clone();
    let fourth = memory.insert(image(3)).unwrap();
    assert!(is_paged(&fourth) && memory.is_exceeded());
    world.add_texture(Texture { image: fourth, sampler: TextureSampler::default() });
    world.page_textures().unwrap();
    world.page_textures().unwrap();
    assert_eq!(world.notices.len(), 1, "{:?}", world.notices);
    assert_eq!(world.notices[0].code, NoticeCode::ExceededTextureMemory);
    assert!(world.textures.iter().all(|texture| is_paged(&texture.image)));
    for pair in world.textures[..6].chunks(2) {
        assert!(Arc::ptr_eq(&pair[0].image, &pair[1].image));
    }
    for (old, new) in before.textures.iter().zip(&world.textures) {
        assert_eq!(old.sampler, new.sampler);
        assert_eq!(old.lookup([0.3, 0.7]), new.lookup([0.3, 0.7]));
    }
    let refused = world.check_textures_in_memory().unwrap_err().to_string();
    assert!(refused.contains("106.7 KiB"), "{refused}");
}

#[test]
fn texture_memory_can_be_set_on_an_existing_world() {
    let mut world = World::default();
    for image in images([70, 70]) {
        world.add_texture(Texture { image, sampler: TextureSampler::default() });
    }
    let wide = world.clone().with_texture_cache(TextureCache::new(1 << 20));
    assert_eq!(wide.unwrap().textures, world.textures);
    let tight = world.clone().with_texture_cache(TextureCache::new(1000));
    let tight = tight.unwrap();
    // Data textures are unchanged.
    let [a, b] = [&world, &tight].map(|world| serde_json::to_string(&world.textures[0].image));
    assert_eq!(a.unwrap(), b.unwrap());
    assert_ne!(tight.textures[0].image, world.textures[0].image);
}

#[test]
fn missing_temporary_folders_are_reported_with_a_remedy() {
    let folder = std::env::temp_dir().join("raycam-there-is-no-such-folder");
    let memory = Arc::new(TextureCache::in_folder(10, &folder));
    let error = memory.insert(images([8, 8]).remove(0)).unwrap_err();
    let SceneError::Storage { path, number, message } = &error else {
        panic!("{error:?}");
    };
    assert_eq!(*path, folder);
    assert!(number.is_some());
    assert!(message.contains("TMPDIR") && message.contains("texture_memory"), "{message}");
    // A storage error is unchanged by `in_context`, because it is not a fault in the description.
    assert_eq!(error.clone().in_context("object[0].texture"), error);
}

#[test]
fn empty_images_are_refused() {
    let memory = Arc::new(TextureCache::new(10));
    let image = Arc::new(Image::new("", [1, 1], Texels::Float(vec![[f32::NAN; 4]])));
    assert!(memory.insert(image).is_err());
}
