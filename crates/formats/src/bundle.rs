//! Worlds as bytes for other processes and machines: everything that pictures are made from, exactly.
//!
//! A line that says what it is and which version wrote it, then the world in [MessagePack](https://msgpack.org). The same
//! world gives the same bytes, wherever its files were: their hash names the world. Another version of raycam may have
//! other worlds, so it reads only its own.

use std::path::Path;

use raycam_scene::{TextureCache, World};

use crate::budget::Budget;
use crate::error::{FormatError, Result};

const MAGIC: &str = "raycam world ";
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The bytes of a world. Its notices, which tell of the files it came from, stay behind.
///
/// # Errors
/// [`FormatError::Encode`] where memory runs out; [`FormatError::Scene`] where textures exceed their memory, since the
/// bytes hold all of them.
pub fn write(world: &World) -> Result<Vec<u8>> {
    world.check_textures_in_memory()?;
    let mut bytes = format!("{MAGIC}{VERSION}\n").into_bytes();
    let world = World { notices: Vec::new(), ..world.clone() };
    // By name, since some fields are left out where they say nothing.
    let mut writer = rmp_serde::Serializer::new(&mut bytes).with_struct_map();
    serde::Serialize::serialize(&world, &mut writer)
        .map_err(|error| FormatError::encode(format!("this world cannot be written: {error}")))?;
    Ok(bytes)
}

/// The world in the bytes of a file called `path` in errors, checked as one that is built by hand.
///
/// # Errors
/// [`FormatError`]: more bytes than the budget allows, no world of this version, or one that cannot be.
pub fn read(bytes: &[u8], path: &Path, mut budget: Budget) -> Result<World> {
    let wrong = |message: String| FormatError::whole(path, message);
    budget.take_bytes(path, bytes.len() as u64)?;
    let Some(rest) = bytes.strip_prefix(MAGIC.as_bytes()) else {
        return Err(wrong("these are not the bytes of a world".into()));
    };
    let version = rest.split(|&byte| byte == b'\n').next().unwrap_or(rest);
    if version != VERSION.as_bytes() {
        let version = String::from_utf8_lossy(&version[..version.len().min(20)]);
        let message = format!("a world of raycam {version}; this is {VERSION}, and reads only its own");
        return Err(FormatError::unsupported(path, message));
    }
    let data = rest.get(version.len() + 1..).unwrap_or_default();
    let mut reader = rmp_serde::Deserializer::from_read_ref(data);
    let world: World =
        serde::Deserialize::deserialize(&mut reader).map_err(|error| wrong(format!("damaged: {error}")))?;
    let bounded = |world: World| match budget.texture_memory {
        Some(limit) => world.with_texture_cache(TextureCache::new(limit)),
        None => Ok(world),
    };
    world.validated().and_then(bounded).map_err(|source| FormatError::Scene { path: Some(path.into()), source })
}
