//! The materials and textures of an OBJ file.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use raycam_scene::{Material, Mesh, Model, Texels, TextureSlot, Wrap};

use crate::companion;
use crate::error::FormatError;
use crate::folder::Folder;
use crate::image::ColorUse;
use crate::mtl::{self, MtlMaterial};
use crate::mtl_map::Role;
use crate::obj::Obj;
use crate::obj_model::Stretch;

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
            let Some(source) = companion::file(path, library, folder, &mut model.notices)? else {
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

/// Images that have been read: by file, clamped or not, as colours or not.
type Known = HashMap<(String, bool, bool), Option<usize>>;

/// The textures of a material's maps, with their strengths.
fn slots(
    library: &Path,
    material: &MtlMaterial,
    known: &mut Known,
    folder: &mut Folder,
    model: &mut Model,
) -> Result<Vec<(Role, TextureSlot, f32)>, FormatError> {
    let mut slots = Vec::new();
    for map in &material.maps {
        let place = format!("{}:{}", library.display(), map.line);
        if map.role == Role::Opacity {
            // There is one place for opacity: the alpha of the colour's image.
            let color = material.maps.iter().find(|other| other.role == Role::Color);
            if color.is_none_or(|color| color.file != map.file) {
                model.notices.push(format!(
                    "{place}: map_d is used where it is the image of map_Kd, with its alpha"
                ));
                continue;
            }
        }
        let color = matches!(map.role, Role::Color | Role::Emission | Role::Opacity);
        let key = (map.file.clone(), map.clamp, color);
        let texture = match known.get(&key) {
            Some(known) => *known,
            None => {
                let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
                let color_use = if color {
                    ColorUse::Color
                } else {
                    ColorUse::Data
                };
                let texture =
                    companion::texture(library, &map.file, wrap, color_use, folder, model)?;
                *known.entry(key).or_insert(texture)
            }
        };
        let Some(texture) = texture else {
            continue;
        };
        if map.role == Role::Normal && is_grey(&model.textures[texture].image.texels)? {
            model.notices.push(format!(
                "{place}: {:?} is a map of heights, which are not used; expected normals",
                map.file
            ));
            continue;
        }
        let slot = TextureSlot {
            image_from_mesh: map.image_from_mesh,
            ..TextureSlot::plain(texture)
        };
        slots.push((map.role, slot, map.strength));
    }
    Ok(slots)
}

/// Whether all channels of every texel are equal.
fn is_grey(texels: &Texels) -> Result<bool, FormatError> {
    Ok(match &*texels.in_memory()? {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => {
            texels.iter().all(|t| t[0] == t[1] && t[1] == t[2])
        }
        Texels::Linear16(texels) => texels.iter().all(|t| t[0] == t[1] && t[1] == t[2]),
        Texels::Float(texels) => texels.iter().all(|t| t[0] == t[1] && t[1] == t[2]),
        Texels::Paged(_) => false, // is in memory here
    })
}
