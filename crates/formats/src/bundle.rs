//! Worlds as bytes for other processes and machines, with the exact data that images are rendered from.
//!
//! The first line names the format and the version of raycam; the world follows in [MessagePack](https://msgpack.org).
//! Images are stored as their original files if these are smaller than the texels. Equal worlds give equal bytes, even
//! if their files were in different folders, so the hash of the bytes identifies the world. Each version of raycam
//! reads only its own bytes.

use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use raycam_scene::{ErrorCode, FileRef, Image, Light, Texture, TextureCache, World};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::image::decode_image;
use raycam_scene::ColorUse;

const MAGIC: &str = "raycam world ";
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Returns the bytes of a world. Its notices, which concern its source files, are not included.
///
/// # Errors
/// [`FormatError::Encode`] if there is not enough memory; [`FormatError::Scene`] if textures exceed their memory,
/// because the bytes contain all of them.
pub fn write(world: &World) -> Result<Vec<u8>> {
    world.check_textures_in_memory()?;
    let textures = share_equal_files(&world.textures);
    let world = World { notices: Vec::new(), textures, ..world.clone() };
    let mut count = ByteCount(0);
    serialize(&world, &mut count)?;
    let mut bytes = Vec::new();
    // The size is known before writing, because a growing vector would end the process if memory ran out.
    bytes.try_reserve_exact(count.0).map_err(|_| {
        FormatError::encode(format!("the world is too large to write: it requires {} bytes of memory", count.0))
    })?;
    serialize(&world, &mut bytes)?;
    Ok(bytes)
}

/// Returns the textures with one image for all images that were decoded from equal files with the same name.
fn share_equal_files(textures: &[Arc<Texture>]) -> Vec<Arc<Texture>> {
    let mut known: HashMap<(&[u8], &str, bool), &Arc<Image>> = HashMap::new();
    let shared = textures.iter().map(|texture| {
        let Some(encoded) = &texture.image.encoded else { return texture.clone() };
        let name = texture.image.name.rsplit(['/', '\\']).next().unwrap_or_default();
        let first = *known.entry((&encoded.bytes.0, name, encoded.is_data)).or_insert(&texture.image);
        match Arc::ptr_eq(first, &texture.image) {
            true => texture.clone(),
            false => Arc::new(Texture { image: first.clone(), sampler: texture.sampler }),
        }
    });
    shared.collect()
}

fn serialize(world: &World, mut to: impl Write) -> Result<()> {
    let failed = |error: &dyn std::fmt::Display| FormatError::encode(format!("the world cannot be written: {error}"));
    writeln!(to, "{MAGIC}{VERSION}").map_err(|error| failed(&error))?;
    // Fields are stored by name, because fields with default values are omitted.
    let mut writer = rmp_serde::Serializer::new(to).with_struct_map();
    serde::Serialize::serialize(world, &mut writer).map_err(|error| failed(&error))
}

/// A writer that only counts the bytes.
struct ByteCount(usize);

impl Write for ByteCount {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Decodes the images whose files are stored in the bytes of a world; textures that shared an image still share it.
fn decode_images(world: &mut World, path: &Path, budget: &mut Budget) -> Result<()> {
    let mut known: HashMap<*const Image, Arc<Image>> = HashMap::new();
    let mut decoded = |image: &Arc<Image>| -> Result<Option<Arc<Image>>> {
        let Some(encoded) = image.encoded.as_ref().filter(|_| image.texels.is_empty()) else { return Ok(None) };
        if let Some(known) = known.get(&Arc::as_ptr(image)) {
            return Ok(Some(known.clone()));
        }
        let color_use = if encoded.is_data { ColorUse::Data } else { ColorUse::Color };
        let name = Path::new(&image.name);
        let found = decode_image(&encoded.bytes.0, name, color_use, budget, &mut Vec::new())?;
        if found.size != image.size {
            let message =
                format!("damaged file: image {:?} has {:?} pixels; expected {:?}", image.name, found.size, image.size);
            return Err(FormatError::whole(path, ErrorCode::DamagedData.message(message)));
        }
        let found = Arc::new(Image { name: image.name.clone(), ..found });
        known.insert(Arc::as_ptr(image), found.clone());
        Ok(Some(found))
    };
    for texture in &mut world.textures {
        if let Some(image) = decoded(&texture.image)? {
            *texture = Arc::new(Texture { image, sampler: texture.sampler });
        }
    }
    for light in &mut world.lights {
        if let Light::Environment { image: FileRef { content: Some(image), .. }, .. }
        | Light::Projector { image: FileRef { content: Some(image), .. }, .. } = light
            && let Some(found) = decoded(image)?
        {
            *image = found;
        }
    }
    Ok(())
}

/// Reads the world in the bytes of a file, which is called `path` in errors. The world is validated like a world that
/// is built from a description.
///
/// # Errors
/// [`FormatError`] for more bytes than the budget allows, for bytes that are not a world of this version, and for an
/// invalid world.
pub fn read(bytes: &[u8], path: &Path, mut budget: Budget) -> Result<World> {
    let wrong = |code: ErrorCode, message: String| FormatError::whole(path, code.message(message));
    budget.take_bytes(path, bytes.len() as u64)?;
    let Some(rest) = bytes.strip_prefix(MAGIC.as_bytes()) else {
        return Err(wrong(ErrorCode::WrongFormat, "the bytes are not a world written by raycam".into()));
    };
    let version = rest.split(|&byte| byte == b'\n').next().unwrap_or(rest);
    if version != VERSION.as_bytes() {
        let version = String::from_utf8_lossy(&version[..version.len().min(20)]);
        let message = format!("the world was written by raycam {version}; version {VERSION} reads only its own worlds");
        return Err(FormatError::unsupported(path, message));
    }
    let data = rest.get(version.len() + 1..).unwrap_or_default();
    let mut reader = rmp_serde::Deserializer::from_read_ref(data);
    let mut world: World = serde::Deserialize::deserialize(&mut reader)
        .map_err(|error| wrong(ErrorCode::DamagedData, format!("damaged file: {error}")))?;
    decode_images(&mut world, path, &mut budget)?;
    let bounded = |world: World| match budget.texture_memory {
        Some(limit) => world.with_texture_cache(TextureCache::new(limit)),
        None => Ok(world),
    };
    world.validated().and_then(bounded).map_err(|source| FormatError::Scene { path: Some(path.into()), source })
}
