//! The materials and textures of an OBJ file.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use raycam_scene::{Files, Material, Mesh, Model, Texture, TextureSlot};

use crate::error::FormatError;
use crate::image::ColorUse;
use crate::image::merge_alpha;
use crate::image::normals_from_height;
use crate::io::asset_root::Folder;
use crate::io::optional_asset;
use crate::obj::Obj;
use crate::obj::build::Stretch;
use crate::obj::mtl::{self, MtlMaterial};
use crate::obj::mtl_map::{Map, Role};

/// The materials that faces use.
pub(crate) struct Materials {
    /// For each `usemtl` name, the index into the model's materials.
    pub(crate) named: Vec<usize>,
    /// That of faces without `usemtl`.
    pub(crate) none: usize,
}

impl Materials {
    pub(crate) fn read(
        obj: &Obj,
        runs: &[Stretch],
        path: &Path,
        folder: &mut Folder,
        model: &mut Model,
    ) -> Result<Self, FormatError> {
        let mut defined: HashMap<String, (PathBuf, MtlMaterial)> = HashMap::new();
        for library in &obj.libraries {
            let Some(source) = optional_asset::file(path, library, folder, &mut model.notices)?
            else {
                continue;
            };
            for material in mtl::parse(&source.path, &source.bytes, &mut model.notices)? {
                defined.insert(material.name.clone(), (source.path.clone(), material));
            }
        }
        let mut materials = Self {
            named: vec![usize::MAX; obj.materials.len()],
            none: usize::MAX,
        };
        let mut textures = HashMap::new();
        let mut undefined = Vec::new();
        for Stretch { run, .. } in runs {
            let number = match run.material {
                Some(name) => &mut materials.named[name],
                None => &mut materials.none,
            };
            if *number != usize::MAX {
                continue;
            }
            *number = model.materials.len();
            let name = run.material.map(|name| obj.materials[name].as_str());
            match name.and_then(|name| defined.get(name)) {
                Some((library, material)) => {
                    let slots = slots(library, material, &mut textures, folder, model)?;
                    let material = material.material(library, &slots, &mut model.notices);
                    model.materials.push(material);
                }
                None => {
                    undefined.extend(name.filter(|name| !name.is_empty()));
                    let name = name.unwrap_or_default().to_owned();
                    // What a mesh with or without colours looks like when nothing else is said.
                    let colors = (!obj.colors.is_empty()).then(Vec::new);
                    let plain = Material::plain(&Mesh {
                        vertex_colors: colors,
                        ..Mesh::default()
                    });
                    model.materials.push(Material { name, ..plain });
                }
            }
        }
        if !undefined.is_empty() {
            let more = if undefined.len() > 12 { ", ..." } else { "" };
            undefined.truncate(12);
            model.notices.push(format!(
                "{}: materials without a definition are plain: {}{more}",
                path.display(),
                undefined.join(", ")
            ));
        }
        Ok(materials)
    }
}

/// Textures that have been made: of which file, with the opacity of which other, clamped or not, and as what.
type Known = HashMap<(String, Option<String>, bool, Use), Option<usize>>;

/// What an image is read as.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Use {
    Color,
    Data,
    /// Normals, or heights that become some.
    Normals,
}

/// The textures of a material's maps, with their strengths.
fn slots(
    library: &Path,
    material: &MtlMaterial,
    known: &mut Known,
    folder: &mut Folder,
    model: &mut Model,
) -> Result<Vec<(Role, TextureSlot, f32)>, FormatError> {
    let mut slots = Vec::new();
    let last = |role| material.maps.iter().rev().find(|map| map.role == role);
    let color = last(Role::Color);
    // There is one place for opacity, the alpha of the colours' image: that of an image of its own is put there.
    let mut opacity = last(Role::Opacity).filter(|map| color.is_none_or(|c| c.file != map.file));
    if let (Some(own), Some(color)) = (opacity, color)
        && !own.lies_as(color)
    {
        model.notices.push(format!(
            "{}:{}: map_d is not used: it is laid on otherwise than map_Kd (-s, -o, -clamp), expected the same",
            library.display(),
            own.line
        ));
        opacity = None;
    }
    for map in &material.maps {
        let in_color = map.role == Role::Opacity && color.is_some_and(|c| c.file != map.file);
        // The last of each role counts.
        if in_color || !last(map.role).is_some_and(|last| std::ptr::eq(last, map)) {
            continue;
        }
        let cut = opacity.filter(|_| matches!(map.role, Role::Color | Role::Opacity));
        let texture = match cut {
            Some(own) => cut_out(library, color, own, known, folder, model)?,
            None => image(library, map, known, folder, model)?,
        };
        let Some(texture) = texture else {
            continue;
        };
        let slot = TextureSlot {
            image_from_mesh: map.image_from_mesh,
            ..TextureSlot::plain(texture)
        };
        slots.push((map.role, slot, map.strength));
        if cut.is_some() {
            slots.extend([Role::Color, Role::Opacity].map(|role| (role, slot, 1.0)));
        }
    }
    Ok(slots)
}

/// The texture of a map's image alone.
fn image(
    library: &Path,
    map: &Map,
    known: &mut Known,
    folder: &mut Folder,
    model: &mut Model,
) -> Result<Option<usize>, FormatError> {
    let used = match map.role {
        Role::Color | Role::Emission | Role::Opacity => Use::Color,
        Role::Normal => Use::Normals,
        _ => Use::Data,
    };
    let key = (map.file.clone(), None, map.clamp, used);
    if let Some(known) = known.get(&key) {
        return Ok(*known);
    }
    let color_use = match used {
        Use::Color => ColorUse::Color,
        _ => ColorUse::Data,
    };
    let mut texture = map.texture(library, color_use, folder, &mut model.notices)?;
    if let Some(heights) = &mut texture
        && used == Use::Normals
        && normals_from_height::is_heights(&heights.image.texels)?
    {
        model.notices.push(format!(
            "{}:{}: {:?} is a map of heights: made into normals, white a texel's width above black",
            library.display(),
            map.line,
            map.file
        ));
        let normals = normals_from_height::normals(heights, &mut folder.budget)?;
        heights.image = folder.keep(Arc::new(normals))?;
    }
    let index = texture.map(|texture| {
        model.textures.push(texture);
        model.textures.len() - 1
    });
    Ok(*known.entry(key).or_insert(index))
}

/// The texture of these colours, or of white, with the opacity of another image; without it where that cannot be read.
fn cut_out(
    library: &Path,
    color: Option<&Map>,
    opacity: &Map,
    known: &mut Known,
    folder: &mut Folder,
    model: &mut Model,
) -> Result<Option<usize>, FormatError> {
    let file = color.map_or(String::new(), |map| map.file.clone());
    let key = (file, Some(opacity.file.clone()), opacity.clamp, Use::Color);
    if let Some(known) = known.get(&key) {
        return Ok(*known);
    }
    let notices = &mut model.notices;
    let alpha = opacity.texture(library, ColorUse::Data, folder, notices)?;
    let color = match color {
        Some(map) => map.texture(library, ColorUse::Color, folder, notices)?,
        None => None,
    };
    let texture = match alpha {
        Some(alpha) => {
            let image = merge_alpha::cut_out(color.as_ref(), &alpha, &mut folder.budget)?;
            Some(Texture {
                image: folder.keep(Arc::new(image))?,
                sampler: alpha.sampler,
            })
        }
        None => color,
    };
    let index = texture.map(|texture| {
        model.textures.push(texture);
        model.textures.len() - 1
    });
    Ok(*known.entry(key).or_insert(index))
}
