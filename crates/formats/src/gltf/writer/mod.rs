//! Worlds as GLB files (glTF 2.0, version 2.0.1): everything that glTF and its ratified extensions can represent.
//! Everything else causes a notice.

mod animation;
mod binary;
mod camera;
pub(crate) mod document;
mod light;
mod material;
mod mesh;
mod node;
mod number;
mod reflectance;
mod texture;
pub(crate) mod transform;
use std::collections::{BTreeMap, BTreeSet};

use raycam_scene::render_options::RenderOptions;
use raycam_scene::{Notice, NoticeCode, Up, World, counted};
use serde_json::{Map, Value, json};

use self::binary::BinaryChunk;
use self::document::{Writer, WrittenMeshes, WrittenTextures};
use crate::error::{FormatError, Result};

/// Returns a GLB file of a world, and notices about everything that glTF cannot represent.
///
/// Up is y in glTF: a z-up world is rotated by a root node above all other nodes. Positions are float32; cameras have
/// no size in pixels, no distortion and a centred principal point; lights are `KHR_lights_punctual`.
///
/// # Errors
/// [`FormatError::Encode`] if the file would be longer than 4 GiB, the maximum of GLB.
pub fn write(world: &World) -> Result<(Vec<u8>, Vec<Notice>)> {
    let mut writer = Writer {
        world,
        binary: BinaryChunk::default(),
        lists: BTreeMap::new(),
        lights: Vec::new(),
        extensions: BTreeSet::new(),
        meshes: WrittenMeshes::default(),
        textures: WrittenTextures::default(),
        light_definition: Vec::new(),
        camera_definition: Vec::new(),
        notices: Vec::new(),
    };
    writer.note_unsupported();
    for material in &world.materials {
        let json = writer.material(material)?;
        writer.push("materials", json);
    }
    let rig = writer.rig();
    let mut roots = writer.nodes(rig.as_deref());
    if world.up == Up::Z && !roots.is_empty() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let up = json!({ "name": "y up", "rotation": [-half, 0.0, 0.0, half], "children": roots });
        roots = vec![writer.push("nodes", up)];
        writer.note(
            NoticeCode::ConvertedUpAxis,
            "up is z, which glTF does not support; a root node rotates the world \
            to y up",
        );
    }
    if let Some(rig) = &rig {
        writer.animations(rig);
    }
    writer.finish(&roots)
}

impl Writer<'_> {
    /// Adds notices about properties of the world that glTF cannot represent.
    fn note_unsupported(&mut self) {
        let world = self.world;
        if world.video.is_some() {
            self.note(NoticeCode::NotWritten, "[video] is omitted: glTF's animations move nodes and have no orbits");
        }
        if world.render != RenderOptions::default() {
            self.note(NoticeCode::NotWritten, "[render] is omitted: glTF has no render settings");
        }
        if world.fog.is_some() {
            self.note(NoticeCode::NotWritten, "the fog is not written: glTF has no fog");
        }
        let hidden = world.objects.iter().filter(|object| !object.visible).count();
        if hidden > 0 {
            self.note(NoticeCode::NotWritten, format!("{} omitted", counted(hidden, "invisible object")));
        }
        let catchers = world.objects.iter().filter(|object| object.shadow_catcher).count();
        if catchers > 0 {
            self.note(
                NoticeCode::NotWritten,
                format!("{} written with an ordinary surface", counted(catchers, "shadow catcher")),
            );
        }
        let backed = world.cameras.iter().filter(|named| named.camera.background().is_some()).count();
        if backed > 0 {
            self.note(NoticeCode::NotWritten, format!("the background of {} is omitted", counted(backed, "camera")));
        }
        if world.objects.iter().any(|object| object.category.is_some()) {
            self.note(NoticeCode::NotWritten, "categories of objects are omitted");
        }
    }

    fn finish(mut self, roots: &[usize]) -> Result<(Vec<u8>, Vec<Notice>)> {
        let generator = format!("raycam {}", env!("CARGO_PKG_VERSION"));
        let mut root = Map::new();
        root.insert("asset".into(), json!({ "version": "2.0", "generator": generator }));
        if !roots.is_empty() {
            root.insert("scene".into(), json!(0));
            root.insert("scenes".into(), json!([{ "nodes": roots }]));
        }
        if !self.lights.is_empty() {
            let lights = json!({ "lights": std::mem::take(&mut self.lights) });
            self.extend(&mut root, "KHR_lights_punctual", lights);
        }
        if !self.world.variants.is_empty() {
            let names = self.world.variants.iter().map(|v| json!({ "name": v.name }));
            let variants = json!({ "variants": names.collect::<Vec<_>>() });
            self.extend(&mut root, "KHR_materials_variants", variants);
        }
        if !self.extensions.is_empty() {
            root.insert("extensionsUsed".into(), json!(self.extensions));
        }
        let (views, accessors, bytes) = self.binary.into_parts();
        if !bytes.is_empty() {
            root.insert("buffers".into(), json!([{ "byteLength": bytes.len() }]));
            root.insert("bufferViews".into(), views.into());
            root.insert("accessors".into(), accessors.into());
        }
        root.retain(|_, value| value.as_array().is_none_or(|list| !list.is_empty()));
        for (key, list) in self.lists {
            root.insert(key.into(), list.into());
        }
        let text = Value::from(root).to_string().into_bytes();
        Ok((container(text, bytes)?, self.notices))
    }
}

/// Returns a GLB file with both chunks, each padded to 4 bytes (chapter 4).
fn container(mut text: Vec<u8>, mut bytes: Vec<u8>) -> Result<Vec<u8>> {
    text.resize(text.len().next_multiple_of(4), b' ');
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut chunks = vec![(*b"JSON", text)];
    if !bytes.is_empty() {
        chunks.push((*b"BIN\0", bytes));
    }
    let total = 12 + chunks.iter().map(|(_, data)| 8 + data.len()).sum::<usize>();
    let length = u32::try_from(total)
        .map_err(|_| FormatError::encode(format!("GLB: the file would have {total} bytes; the maximum is 4 GiB")))?;
    let mut file = Vec::with_capacity(total);
    file.extend(b"glTF");
    file.extend(2_u32.to_le_bytes());
    file.extend(length.to_le_bytes());
    for (kind, data) in chunks {
        // The chunk's length fits into 32 bits, because the length of the whole file fits.
        file.extend((data.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(data);
    }
    Ok(file)
}
