//! UDIM: an image divided into tiles, one for each unit square of texture coordinates, numbered from 1001 (Foundry,
//! "UDIM").
//!
//! A single tile would be wrong on the faces of all other tiles, so images with several tiles are reported and omitted.

use std::path::Path;

use raycam_scene::{Notice, NoticeCode};

use crate::io::{AssetRoot, reference};

/// Placeholders for the number of a tile.
const WORDS: [&[u8]; 2] = [b"<UDIM>", b"<udim>"];
const FIRST: &[u8] = b"1001";

/// Name of an image, or of its only tile; the reason for the rejection if the image has several tiles.
pub(crate) fn single_image(from: &Path, name: &[u8], assets: &AssetRoot) -> Result<Vec<u8>, String> {
    let word = WORDS.into_iter().find_map(|word| Some((position_of(name, word)?, word.len())));
    let Some((at, length)) = word else { return Ok(name.into()) };
    let tiles = tiles_from(from, name, at, length, 1001, assets);
    match &tiles[..] {
        [] => Err(format!("{:?}: no tile (UDIM) from 1001 to 1099 exists", reference::shown(name))),
        [1001] => Ok(with_tile(name, at, length, 1001)),
        tiles => Err(format!(
            "{:?}: the tiles (UDIM) {} are not supported; bake them into one image",
            reference::shown(name),
            list(tiles)
        )),
    }
}

/// The reason why an image with this name is not read, if it consists of tiles.
pub(crate) fn reason(from: &Path, name: &[u8], assets: &AssetRoot) -> Option<String> {
    single_image(from, name, assets).err()
}

/// Notice about an image `..1001..` next to which other tiles exist.
pub(crate) fn notice(from: &Path, name: &[u8], assets: &AssetRoot) -> Option<Notice> {
    let at = name.windows(4).rposition(|window| window == FIRST)?;
    let tiles = tiles_from(from, name, at, FIRST.len(), 1002, assets);
    let shown = reference::shown(name);
    (!tiles.is_empty()).then(|| {
        let (from, tiles) = (from.display(), list(&tiles));
        let message =
            format!("{from}: {shown:?} is tile 1001 of an image; its other tiles (UDIM) are ignored: {tiles}");
        Notice::new(NoticeCode::FirstOnly, message)
    })
}

fn position_of(name: &[u8], word: &[u8]) -> Option<usize> {
    name.windows(word.len()).position(|window| window == word)
}

/// Numbers of the existing tiles.
fn tiles_from(from: &Path, name: &[u8], at: usize, length: usize, first: u32, assets: &AssetRoot) -> Vec<u32> {
    (first..1100).filter(|&tile| assets.is_file(from, &with_tile(name, at, length, tile))).collect()
}

/// Name in which a tile's number replaces `length` bytes.
fn with_tile(name: &[u8], at: usize, length: usize, tile: u32) -> Vec<u8> {
    [&name[..at], tile.to_string().as_bytes(), &name[at + length..]].concat()
}

fn list(tiles: &[u32]) -> String {
    let more = if tiles.len() > 12 { ", ..." } else { "" };
    let tiles: Vec<String> = tiles.iter().take(12).map(u32::to_string).collect();
    tiles.join(", ") + more
}
