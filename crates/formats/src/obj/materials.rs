//! Materials and textures of an OBJ file.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use raycam_scene::{Material, Mesh, MeshFile, Notice, NoticeCode, Texels, Texture, TextureSlot};

use crate::error::Result;
use crate::image::merge_alpha;
use crate::io::{AssetRoot, lexer, reference};
use crate::obj::chunk::RunRange;
use crate::obj::library::Library;
use crate::obj::mtl::MtlMaterial;
use crate::obj::mtl_map::{MapRole, MtlMap};
use crate::obj::parse::Obj;
use raycam_scene::ColorUse;

/// Materials that faces use.
pub(crate) struct Materials {
    /// For each `usemtl` name, the index into the model's materials.
    pub(crate) named: Vec<usize>,
    /// Index of the material of faces without `usemtl`.
    pub(crate) default_material: usize,
}

impl Materials {
    pub(crate) fn read(
        obj: &Obj,
        runs: &[RunRange],
        path: &Path,
        assets: &mut AssetRoot,
        model: &mut MeshFile,
    ) -> Result<Self> {
        let library = Library::read(obj, path, assets, &mut model.notices)?;
        let unnamed = match runs.iter().all(|range| range.run.material.is_none()) {
            true => library.only(path, &mut model.notices),
            false => None,
        };
        let mut materials = Self { named: vec![usize::MAX; obj.materials.len()], default_material: usize::MAX };
        let mut textures = HashMap::new();
        let (mut undefined, mut differing) = (Vec::new(), Vec::new());
        for RunRange { run, .. } in runs {
            let number = match run.material {
                Some(name) => &mut materials.named[name],
                None => &mut materials.default_material,
            };
            if *number != usize::MAX {
                continue;
            }
            *number = model.materials.len();
            let name = run.material.map(|name| &obj.materials[name][..]);
            let found = name.and_then(|name| library.find_material(name)).or(unnamed.map(|found| (found, false)));
            let material = match found {
                Some(((library, material), other_case)) => {
                    differing.extend(name.filter(|_| other_case));
                    let slots = slots(library, material, &mut textures, assets, model)?;
                    material.material(library, &slots, &mut model.notices)
                }
                None => {
                    undefined.extend(name.filter(|name| !name.is_empty()));
                    let name = lexer::name(name.unwrap_or_default());
                    // A name without a definition gets the default material of a mesh with or without vertex colours.
                    let colors = (!obj.colors.is_empty()).then(Vec::new);
                    let plain = Material::for_mesh(&Mesh { vertex_colors: colors, ..Mesh::default() });
                    Material { name, ..plain }
                }
            };
            model.materials.push(material);
        }
        let lists = [
            (NoticeCode::MissingValue, "materials without a definition get a default material", undefined),
            (
                NoticeCode::SubstitutedFile,
                "materials found by their names in different upper and lower case",
                differing,
            ),
        ];
        for (code, what, names) in lists {
            if !names.is_empty() {
                let more = if names.len() > 12 { ", ..." } else { "" };
                let names: Vec<_> = names.into_iter().take(12).map(lexer::name).collect();
                model
                    .notices
                    .push(Notice::new(code, format!("{}: {what}: {}{more}", path.display(), names.join(", "))));
            }
        }
        Ok(materials)
    }
}

/// True for a height map: all channels of every texel are equal, which is never the case in a normal map.
fn is_height_map(texels: &Texels) -> Result<bool> {
    Ok(match &*texels.in_memory()? {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => texels.iter().all(|t| t[0] == t[1] && t[1] == t[2]),
        Texels::Linear16(texels) => texels.iter().all(|t| t[0] == t[1] && t[1] == t[2]),
        Texels::Float(texels) => texels.iter().all(|t| t[0] == t[1] && t[1] == t[2]),
        Texels::Paged(_) => false, // not reached: the texels are in memory
    })
}

/// Textures that have been created, by colour file, opacity file, clamping and use.
type TexturesByKey = HashMap<(Vec<u8>, Option<Vec<u8>>, bool, ImageUse), Option<usize>>;

/// Use of an image.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum ImageUse {
    Color,
    Data,
    /// Normals or heights.
    Normals,
}

/// Roles and textures of a material's maps, with their strengths.
fn slots(
    library: &Path,
    material: &MtlMaterial,
    known: &mut TexturesByKey,
    assets: &mut AssetRoot,
    model: &mut MeshFile,
) -> Result<Vec<(MapRole, TextureSlot, f32)>> {
    let mut slots = Vec::new();
    let last = |role| material.maps.iter().rev().find(|map| map.role == role);
    let color = last(MapRole::Color);
    // Opacity is stored in the colour image's alpha: a separate opacity image is merged into it.
    let mut opacity = last(MapRole::Opacity).filter(|map| color.is_none_or(|c| c.file != map.file));
    if let (Some(own), Some(color)) = (opacity, color)
        && !own.same_placement(color)
    {
        model.notices.push(Notice::new(
            NoticeCode::IgnoredTransparency,
            format!(
                "{}:{}: map_d is ignored, because its options differ from map_Kd's (-s, -o, -clamp); use the same \
                 options",
                library.display(),
                own.line
            ),
        ));
        opacity = None;
    }
    for map in &material.maps {
        let in_color = map.role == MapRole::Opacity && color.is_some_and(|c| c.file != map.file);
        // The last map of each role is used.
        if in_color || !last(map.role).is_some_and(|last| std::ptr::eq(last, map)) {
            continue;
        }
        let cut = opacity.filter(|_| matches!(map.role, MapRole::Color | MapRole::Opacity));
        let texture = match cut {
            Some(own) => with_alpha(library, color, own, known, assets, model)?,
            None => image(library, map, known, assets, model)?,
        };
        let Some(texture) = texture else { continue };
        let slot = TextureSlot { image_from_mesh: map.image_from_mesh, ..TextureSlot::plain(texture) };
        let is_height = map.role == MapRole::Normal && is_height_map(&model.textures[texture].image.texels)?;
        slots.push((if is_height { MapRole::Height } else { map.role }, slot, map.strength));
        if cut.is_some() {
            slots.extend([MapRole::Color, MapRole::Opacity].map(|role| (role, slot, 1.0)));
        }
    }
    Ok(slots)
}

/// Texture of a map's image without an opacity image.
fn image(
    library: &Path,
    map: &MtlMap,
    known: &mut TexturesByKey,
    assets: &mut AssetRoot,
    model: &mut MeshFile,
) -> Result<Option<usize>> {
    let used = match map.role {
        MapRole::Color | MapRole::Emission | MapRole::Opacity => ImageUse::Color,
        MapRole::Normal => ImageUse::Normals,
        _ => ImageUse::Data,
    };
    let key = (map.file.clone(), None, map.clamp, used);
    if let Some(known) = known.get(&key) {
        return Ok(*known);
    }
    let color_use = match used {
        ImageUse::Color => ColorUse::Color,
        _ => ColorUse::Data,
    };
    let texture = map.texture(library, color_use, assets, &mut model.notices)?;
    if let Some(heights) = &texture
        && used == ImageUse::Normals
        && is_height_map(&heights.image.texels)?
    {
        model.notices.push(Notice::new(
            NoticeCode::AssumedConvention,
            format!(
                "{}:{}: {:?} is a height map without a unit; the height of white above black is assumed to \
                 be one texel width; set it with height_scale, in metres",
                library.display(),
                map.line,
                reference::shown(&map.file)
            ),
        ));
    }
    let index = texture.map(|texture| {
        model.textures.push(texture);
        model.textures.len() - 1
    });
    Ok(*known.entry(key).or_insert(index))
}

/// Texture with the colours of one image (white without an image) and the opacity of another image. If the opacity
/// cannot be read, the texture contains the colours unchanged.
fn with_alpha(
    library: &Path,
    color: Option<&MtlMap>,
    opacity: &MtlMap,
    known: &mut TexturesByKey,
    assets: &mut AssetRoot,
    model: &mut MeshFile,
) -> Result<Option<usize>> {
    let file = color.map_or(Vec::new(), |map| map.file.clone());
    let key = (file, Some(opacity.file.clone()), opacity.clamp, ImageUse::Color);
    if let Some(known) = known.get(&key) {
        return Ok(*known);
    }
    let notices = &mut model.notices;
    let alpha = opacity.texture(library, ColorUse::Data, assets, notices)?;
    let color = color.map(|map| map.texture(library, ColorUse::Color, assets, notices)).transpose()?.flatten();
    let texture = match alpha {
        Some(alpha) => {
            let image = merge_alpha::merge_alpha(color.as_ref(), &alpha, &mut assets.budget)?;
            Some(Texture { image: assets.store_texture(Arc::new(image))?, sampler: alpha.sampler })
        }
        None => color,
    };
    let index = texture.map(|texture| {
        model.textures.push(texture);
        model.textures.len() - 1
    });
    Ok(*known.entry(key).or_insert(index))
}
