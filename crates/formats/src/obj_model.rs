//! From the statements of an OBJ file to the meshes and materials they mean.

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::DVec3;
use raycam_scene::{Material, Mesh, Model, Part, Wrap};

use crate::companion;
use crate::corners::{Corner, NONE, Vertices};
use crate::error::FormatError;
use crate::folder::Folder;
use crate::mtl::{self, Map, MtlMaterial};
use crate::obj::{Obj, Run};

/// One part for each `o` that has faces.
pub(crate) fn build(mut obj: Obj, path: &Path, folder: &mut Folder) -> Result<Model, FormatError> {
    let elements = obj.positions.len() + obj.uvs.len() + obj.normals.len();
    folder.budget.take_elements(path, elements as u64)?;
    obj.runs.push(Run {
        start: obj.polygons.len(),
        part: None,
        material: None,
    });

    let mut model = Model {
        notices: std::mem::take(&mut obj.notices),
        ..Model::default()
    };
    let materials = Materials::read(&obj, path, folder, &mut model)?;
    let mut vertices = Vertices::new(obj.positions.len());
    let mut runs = 0;
    while runs + 1 < obj.runs.len() {
        let same = obj.runs[runs..obj.runs.len() - 1]
            .iter()
            .take_while(|r| r.part == obj.runs[runs].part);
        let end = runs + same.count();
        let [start, stop] = [runs, end].map(|run| obj.runs[run].start);
        if start < stop {
            vertices.clear();
            if stop - start == obj.polygons.len() {
                vertices.reserve(0..obj.positions.len() as u32);
            } else {
                let mut used: Vec<u32> = (start..stop)
                    .flat_map(|p| obj.polygons.get(p))
                    .map(|c| c.position)
                    .collect();
                used.sort_unstable();
                vertices.reserve(used.into_iter());
            }
            let part = part(&mut obj, runs..end, path, folder, &mut vertices, &materials)?;
            model.parts.push(part);
        }
        runs = end;
    }
    Ok(model)
}

/// The polygons of some runs, which are all those of one part.
fn part(
    obj: &mut Obj,
    runs: Range<usize>,
    path: &Path,
    folder: &mut Folder,
    vertices: &mut Vertices,
    materials: &Materials,
) -> Result<Part, FormatError> {
    let range = obj.runs[runs.start].start..obj.runs[runs.end].start;
    let any = |has: fn(&Corner) -> bool| range.clone().flat_map(|p| obj.polygons.get(p)).any(has);
    let (has_uvs, has_normals) = (any(|c| c.uv != NONE), any(|c| c.normal != NONE));

    let Obj {
        positions,
        colors,
        uvs,
        normals,
        polygons,
        runs: all_runs,
        parts,
        ..
    } = obj;
    let mut mesh = Mesh::default();
    let (mut slots, mut slot_of, mut used) = (Vec::new(), HashMap::new(), Vec::new());
    let (mut run, mut slot) = (runs.start, None);
    let mut flat = None;
    let position = |c: Corner| positions[c.position as usize];
    polygons.triangles(
        range,
        path,
        &mut folder.budget,
        position,
        |polygon, mut corners| {
            while run + 1 < runs.end && all_runs[run + 1].start <= polygon {
                run += 1;
                slot = None;
            }
            let slot = *slot.get_or_insert_with(|| {
                let material = all_runs[run]
                    .material
                    .map_or(materials.none, |m| materials.named[m]);
                *slot_of.entry(material).or_insert_with(|| {
                    used.push(material);
                    used.len() - 1
                })
            });
            if has_normals {
                for corner in &mut corners {
                    if corner.normal == NONE || normals[corner.normal as usize] == [0.0; 3] {
                        // Flat there: a corner of this polygon alone.
                        let (known, normal) = flat.unwrap_or((usize::MAX, NONE));
                        corner.normal = if known == polygon {
                            normal
                        } else {
                            normals.len() as u32
                        };
                        if known != polygon {
                            normals.push(flat_normal(
                                polygons.get(polygon).iter().map(|&c| position(c)),
                            ));
                            flat = Some((polygon, corner.normal));
                        }
                    }
                }
            }
            mesh.triangles
                .push(corners.map(|corner| vertices.vertex(corner)));
            slots.push(slot as u16);
        },
    )?;

    let made_of = &vertices.made_of;
    mesh.vertices = made_of.iter().map(|&c| position(c)).collect();
    if has_uvs {
        let uv = |c: &Corner| uvs.get(c.uv as usize).copied().unwrap_or([0.0; 2]);
        mesh.uvs = Some(made_of.iter().map(uv).collect());
    }
    if has_normals {
        let normal = |c: &Corner| {
            normals
                .get(c.normal as usize)
                .copied()
                .unwrap_or([0.0, 0.0, 1.0])
        };
        mesh.normals = Some(made_of.iter().map(normal).collect());
    }
    if !colors.is_empty() {
        mesh.vertex_colors = Some(
            made_of
                .iter()
                .map(|c| colors[c.position as usize])
                .collect(),
        );
    }
    if used.len() > 1 {
        mesh.material_slots = Some(slots);
    }
    let name = all_runs[runs.start]
        .part
        .map_or(String::new(), |part| parts[part].clone());
    Ok(Part {
        name,
        mesh,
        materials: used,
    })
}

/// The direction of a polygon's area vector; up where it has none.
fn flat_normal(mut corners: impl Iterator<Item = DVec3>) -> [f32; 3] {
    let origin = corners.next().unwrap_or_default();
    let (mut area, mut before) = (DVec3::ZERO, DVec3::ZERO);
    for corner in corners {
        area += before.cross(corner - origin);
        before = corner - origin;
    }
    area.try_normalize()
        .unwrap_or(DVec3::Z)
        .as_vec3()
        .to_array()
}

/// The materials that faces use.
struct Materials {
    /// For each `usemtl` name, the index into the model's materials.
    named: Vec<usize>,
    /// That of faces without `usemtl`.
    none: usize,
}

impl Materials {
    fn read(
        obj: &Obj,
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
        let mut textures: HashMap<Map, Option<usize>> = HashMap::new();
        let mut undefined = Vec::new();
        for runs in obj
            .runs
            .windows(2)
            .filter(|runs| runs[0].start < runs[1].start)
        {
            let number = match runs[0].material {
                Some(name) => &mut materials.named[name],
                None => &mut materials.none,
            };
            if *number != usize::MAX {
                continue;
            }
            *number = model.materials.len();
            let name = runs[0].material.map(|name| obj.materials[name].as_str());
            match name.and_then(|name| defined.get(name)) {
                Some((library, material)) => {
                    let texture = match &material.map {
                        Some(map) => match textures.get(map) {
                            Some(known) => *known,
                            None => {
                                let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
                                let texture =
                                    companion::texture(library, &map.file, wrap, folder, model)?;
                                *textures.entry(map.clone()).or_insert(texture)
                            }
                        },
                        None => None,
                    };
                    let material = material.material(library, texture, &mut model.notices);
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
