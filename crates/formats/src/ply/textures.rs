//! Images of a PLY file: one material for each image, selected by the property `texnumber` of the faces.

use std::path::Path;

use raycam_scene::{Material, MeshFile, Notice, NoticeCode, TextureSlot, Wrap, counted};

use crate::error::Result;
use crate::geometry::colors;
use crate::image::texture;
use crate::io::AssetRoot;
use raycam_scene::ColorUse;

/// Maximum number of images in one file.
const MAX_IMAGES: usize = 4096;

/// Adds the images named in the header to a model of one part. `numbers` contains the image number of each triangle;
/// without it, all triangles have the first image.
pub(crate) fn add(
    path: &Path,
    names: &[Vec<u8>],
    numbers: Option<Vec<i64>>,
    assets: &mut AssetRoot,
    model: &mut MeshFile,
) -> Result<()> {
    let shown = path.display();
    let used = match &numbers {
        Some(_) => names.len().min(MAX_IMAGES),
        None => names.len().min(1),
    };
    if used < names.len() {
        let reason = if numbers.is_some() { "" } else { ", because faces have no texnumber" };
        model.notices.push(Notice::new(
            NoticeCode::FirstOnly,
            format!("{shown}: the file has {} images; images after number {used} are ignored{reason}", names.len()),
        ));
    }
    if used == 0 {
        return Ok(());
    }
    let plain = model.materials[0].clone();
    let mut materials = Vec::new();
    for name in &names[..used] {
        let name = with_stem(name, path);
        let texture =
            texture::optional_texture(path, &name, Wrap::Repeat, ColorUse::Color, assets, &mut model.notices)?;
        let mut material = plain.clone();
        if let Some(texture) = texture {
            material.texture = Some(TextureSlot::plain(model.textures.len()));
            material.color = [1.0; 3];
            model.textures.push(texture);
        }
        materials.push(material);
    }
    let part = &mut model.parts[0];
    if let Some(numbers) = numbers {
        let slot = |number: &i64| usize::try_from(*number).ok().filter(|number| *number < used).unwrap_or(used);
        let slots: Vec<usize> = numbers.iter().map(slot).collect();
        let without = slots.iter().filter(|slot| **slot == used).count();
        if without > 0 {
            model.notices.push(Notice::new(
                NoticeCode::ReplacedValue,
                format!(
                    "{shown}: {} shown without an image, because texnumber refers to no image",
                    counted(without, "face")
                ),
            ));
            materials.push(plain);
        }
        if materials.len() > 1 {
            part.mesh.material_slots = Some(slots.into_iter().map(|slot| slot as u16).collect());
        }
    }
    part.materials = (0..materials.len()).collect();
    let textured: Vec<bool> = materials.iter().map(|material: &Material| material.texture.is_some()).collect();
    let hidden = colors::hide_below_images(&mut part.mesh, &textured);
    if hidden > 0 {
        model.notices.push(Notice::new(
            NoticeCode::IgnoredColors,
            format!("{shown}: colours are ignored on faces with an image ({})", counted(hidden, "face")),
        ));
    }
    model.materials = materials;
    Ok(())
}

/// Name of an image in which `<this>` represents the file's name without its extension, as in MeshLab.
fn with_stem(name: &[u8], path: &Path) -> Vec<u8> {
    const THIS: &[u8] = b"<this>";
    let Some(at) = name.windows(THIS.len()).position(|window| window.eq_ignore_ascii_case(THIS)) else {
        return name.into();
    };
    let stem = path.file_stem().unwrap_or_default().as_encoded_bytes();
    [&name[..at], stem, &name[at + THIS.len()..]].concat()
}
