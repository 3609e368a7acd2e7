//! Worlds converted to bytes and back.

use std::path::Path;
use std::sync::Arc;

use raycam_formats::{Budget, bundle, world_file};
use raycam_scene::{Image, Material, Notice, NoticeCode, Texels, Texture, TextureSampler, TextureSlot, World};

const WORLD: &str = r##"
up = "y"
[[camera]]
size = [64, 48]
fov = 40
location = [3, -4, 2]
target = [0, 0, 0]
distortion = [0.1, 0.02, 0.001, -0.002, 0.003]
[[camera]]
name = "round"
size = [64, 64]
location = [0, -3, 1]
yaw = 90
focal = 20
lens = "fisheye"
distortion = [0.01, 0.002, 0, 0]
[[object]]
name = "box"
box = { size = 1 }
color = "#c83c28"
category = "solid"
[[object]]
name = "lid"
instance_of = "box"
matrix = [[1, 0.5, 0, 0], [0, -1, 0, 2], [0, 0, 1, 0.1], [0, 0, 0, 1]]
[[object]]
vertices = [[0, 0, 0], [0.1, 0, 0], [0, 1e-300, 3]]
triangles = [[0, 1, 2]]
face_colors = [[0.1, 0.2, 0.3]]
[[light]]
type = "bulb"
position = [0, 0, 3]
power = [60, 60, 60]
[render]
samples = 7
ambient_occlusion = 2.5
filter = "blackman-harris"
seed = 9007199254740993
[video]
fps = 10
keyframe = [{ time = 0, object = "box", location = [0, 0, 0] }, { time = 1, object = "box", location = [1, 0, 0] }]
"##;

fn world() -> World {
    let mut world = world_file::parse(WORLD, Path::new("."), Path::new("here.toml"), &Budget::default()).unwrap();
    let image = Arc::new(Image::new(
        "/somewhere/else/brick.png",
        [2, 1],
        Texels::Float(vec![[0.5, 1e9, f32::MIN_POSITIVE, 1.0]; 2]),
    ));
    for mip in [None, Some(raycam_scene::TexelFilter::Linear)] {
        let sampler = TextureSampler { mip, ..TextureSampler::default() };
        let texture = world.add_texture(Texture { image: image.clone(), sampler });
        world.add_material(Material { texture: Some(TextureSlot::plain(texture)), ..Material::default() }).unwrap();
    }
    world.notices.push(Notice::new(NoticeCode::SubstitutedFile, "read from /somewhere/else"));
    world
}

fn read(bytes: &[u8]) -> Result<World, raycam_formats::FormatError> {
    bundle::read(bytes, Path::new("w"), Budget::default())
}

#[test]
fn bundle_round_trip_returns_an_equal_world() {
    let world = world();
    let bytes = bundle::write(&world).unwrap();
    let back = read(&bytes).unwrap();
    assert!(back.notices.is_empty());
    assert_eq!(back.textures[0].image.name, "brick.png");
    assert!(Arc::ptr_eq(&back.textures[0].image, &back.textures[1].image));
    assert_eq!(back.textures[0].image.texels, world.textures[0].image.texels);
    let same = World { notices: world.notices.clone(), textures: world.textures.clone(), ..back.clone() };
    assert_eq!(same, world);
    assert_eq!(bundle::write(&back).unwrap(), bytes);
    // Any change to a world changes its bytes.
    let mut other = world.clone();
    other.lights.truncate(0);
    assert_ne!(bundle::write(&other).unwrap(), bytes);
}

#[test]
fn bundle_read_of_damaged_bytes_never_panics() {
    let bytes = bundle::write(&world()).unwrap();
    for end in 0..bytes.len() {
        assert!(read(&bytes[..end]).is_err(), "the first {end} bytes");
    }
    for place in 0..bytes.len() {
        // Reading damaged bytes must not panic; it need not fail, because a changed byte may only change a colour.
        for flip in [0x01, 0x80, 0xff] {
            let mut changed = bytes.clone();
            changed[place] ^= flip;
            let _ = read(&changed);
        }
    }
}

#[test]
fn bundle_read_errors_name_the_fault() {
    let bytes = bundle::write(&world()).unwrap();
    let text = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    assert!(text(b"solid cube").contains("not a world"));
    let other = [b"raycam world 9.9.9\n", &bytes[19..]].concat();
    assert!(text(&other).contains("the world was written by raycam 9.9.9"));
    let budget = Budget { bytes: 10, ..Budget::default() };
    let refused = bundle::read(&bytes, Path::new("w"), budget).unwrap_err();
    assert!(refused.to_string().contains("budget"));
    // An index that does not exist is detected before rays are traced.
    let mut broken = world();
    broken.objects[0].mesh = 99;
    assert!(text(&bundle::write(&broken).unwrap()).contains("mesh 99"));
}

/// A PNG of a smooth image, which is much smaller than its texels.
fn png(size: [u32; 2]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    let pixels: Vec<u8> = (0..size[0] * size[1]).flat_map(|i| [(i % size[0]) as u8, (i / size[0]) as u8, 7]).collect();
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    bytes
}

#[test]
fn bundle_stores_image_files_instead_of_texels() {
    let file = png([256, 256]);
    let (texture, _) = raycam_formats::decode_texture(file.clone(), Path::new("a/b.png"), &Budget::default()).unwrap();
    let plain = bundle::write(&World::default()).unwrap().len();
    let mut world = World::default();
    for wrap in [raycam_scene::Wrap::Repeat, raycam_scene::Wrap::Clamp] {
        let sampler = TextureSampler { wrap: [wrap; 2], ..TextureSampler::default() };
        world.add_texture(Texture { image: texture.image.clone(), sampler });
    }
    let bytes = bundle::write(&world).unwrap();
    assert!(bytes.len() < plain + file.len() + 400, "{} bytes for a file of {}", bytes.len(), file.len());
    let back = read(&bytes).unwrap();
    assert_eq!(back.textures[0].image.texels, texture.image.texels);
    assert!(Arc::ptr_eq(&back.textures[0].image, &back.textures[1].image));
    assert_eq!(bundle::write(&back).unwrap(), bytes);
    // A second image of the same file in another folder is not stored again; the same file as data is stored again.
    let decode = |bytes: Vec<u8>, name: &str| {
        raycam_formats::decode_texture(bytes, Path::new(name), &Budget::default()).unwrap().0.image
    };
    for (again, name) in [(file.clone(), "c/b.png"), (png([256, 256]), "b.png")] {
        let mut twice = world.clone();
        twice.add_texture(Texture { image: decode(again, name), sampler: TextureSampler::default() });
        let more = bundle::write(&twice).unwrap().len() - bytes.len();
        assert!(more < 200, "{more} bytes for the same file");
    }
    let mut other = world.clone();
    other.add_texture(Texture { image: decode(png([256, 128]), "b.png"), sampler: TextureSampler::default() });
    assert!(bundle::write(&other).unwrap().len() > bytes.len() + 200);
    // Pixels in the bytes of a world are charged to the budget like pixels of a file.
    let small = Budget { pixels: 1000, ..Budget::default() };
    assert!(matches!(bundle::read(&bytes, Path::new("w"), small), Err(raycam_formats::FormatError::Budget { .. })));
    // An image that differs from its file is stored as its texels.
    let changed = Image::new("b.png", texture.image.size, texture.image.texels.clone());
    world.textures = vec![Arc::new(Texture { image: Arc::new(changed), sampler: TextureSampler::default() })];
    assert!(bundle::write(&world).unwrap().len() > 4 * 256 * 256);
}
