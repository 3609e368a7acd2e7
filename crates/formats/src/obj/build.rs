//! From the statements of an OBJ file to the meshes and materials they mean.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{Mesh, MeshFile, MeshPart};

use crate::error::FormatError;
use crate::geometry::polygons::Polygons;
use crate::geometry::vertex_dedup::{Corner, NO_INDEX, VertexDeduper};
use crate::io::asset_root::AssetRoot;
use crate::obj::Obj;
use crate::obj::chunk::StateRun;
use crate::obj::materials::Materials;

/// One part for each `o` that has faces, or for each `g` where there is no `o`.
pub(crate) fn build(
    mut obj: Obj,
    path: &Path,
    assets: &mut AssetRoot,
) -> Result<MeshFile, FormatError> {
    let elements = obj.positions.len() + obj.uvs.len() + obj.normals.len();
    assets.budget.take_elements(path, elements as u64)?;
    let mut model = MeshFile {
        notices: std::mem::take(&mut obj.notices),
        ..MeshFile::default()
    };
    let runs = std::mem::take(&mut obj.runs);
    let ends = runs[1..]
        .iter()
        .map(|run| run.start)
        .chain([obj.polygons.len()]);
    let runs: Vec<RunRange> = (runs.iter().zip(ends))
        .filter(|(run, end)| run.start < *end)
        .map(|(&run, end)| RunRange {
            run,
            polygons: run.start..end,
        })
        .collect();
    let materials = Materials::read(&obj, &runs, path, assets, &mut model)?;
    let mut vertices = VertexDeduper::new(obj.positions.len());
    for (name, runs) in group_parts(&obj, runs) {
        let part = build_part(
            &mut obj,
            name,
            &runs,
            path,
            assets,
            &mut vertices,
            &materials,
        )?;
        model.parts.push(part);
    }
    Ok(model)
}

/// Polygons to which the same applies; at least one.
pub(crate) struct RunRange {
    pub(crate) run: StateRun,
    polygons: Range<usize>,
}

/// The name of each part and what belongs to it, in the order of their first faces.
fn group_parts(obj: &Obj, runs: Vec<RunRange>) -> Vec<(String, Vec<RunRange>)> {
    let mut parts: Vec<(String, Vec<RunRange>)> = Vec::new();
    let mut number_of = HashMap::new();
    for range in runs {
        let (key, names) = if obj.parts.is_empty() {
            (range.run.group, &obj.groups)
        } else {
            (range.run.part, &obj.parts)
        };
        let number = *number_of.entry(key).or_insert_with(|| {
            let name = key.map_or(String::new(), |name| names[name].clone());
            parts.push((name, Vec::new()));
            parts.len() - 1
        });
        parts[number].1.push(range);
    }
    parts
}

/// The part of this name and these polygons.
fn build_part(
    obj: &mut Obj,
    name: String,
    runs: &[RunRange],
    path: &Path,
    assets: &mut AssetRoot,
    vertices: &mut VertexDeduper,
    materials: &Materials,
) -> Result<MeshPart, FormatError> {
    let count: usize = runs.iter().map(|run| run.polygons.len()).sum();
    let used = if count == obj.polygons.len() {
        None
    } else {
        let polygons = runs.iter().flat_map(|run| run.polygons.clone());
        let mut used: Vec<u32> = polygons
            .flat_map(|p| obj.polygons.get(p))
            .map(|c| c.position)
            .collect();
        used.sort_unstable();
        used.dedup();
        Some(used)
    };
    let begin = |vertices: &mut VertexDeduper| {
        vertices.clear();
        match &used {
            None => vertices.reserve(0..obj.positions.len() as u32),
            Some(used) => vertices.reserve(used.iter().copied()),
        }
    };
    if runs
        .iter()
        .any(|run| run.run.smoothing.is_some_and(|group| group > 0))
    {
        begin(vertices);
        smooth(
            &mut obj.polygons,
            &obj.positions,
            &mut obj.normals,
            runs,
            vertices,
        );
    }
    let any = |has: fn(&Corner) -> bool| {
        let polygons = runs.iter().flat_map(|run| run.polygons.clone());
        polygons.flat_map(|p| obj.polygons.get(p)).any(|c| has(&c))
    };
    let has_uvs = !obj.uvs.is_empty() && any(|c| c.uv != NO_INDEX);
    let has_normals = !obj.normals.is_empty() && any(|c| c.normal != NO_INDEX);
    // The file's vertices are the mesh's: nothing is there that could differ between their corners.
    let plain = used.is_none() && !has_uvs && !has_normals;
    if !plain {
        begin(vertices);
    }

    let Obj {
        positions,
        colors,
        uvs,
        normals,
        polygons,
        ..
    } = obj;
    let mut mesh = Mesh::default();
    let (mut slots, mut slot_of, mut used) = (Vec::new(), HashMap::new(), Vec::new());
    let mut flat = None;
    mesh.triangles.reserve(count);
    let several = runs
        .iter()
        .any(|other| other.run.material != runs[0].run.material);
    let position = |c: Corner| positions[c.position as usize];
    for range in runs {
        let material = range.run.material;
        let material = material.map_or(materials.default_material, |m| materials.named[m]);
        let slot = *slot_of.entry(material).or_insert_with(|| {
            used.push(material);
            used.len() - 1
        });
        let range = range.polygons.clone();
        let triangle = |polygon: usize, mut corners: [Corner; 3]| {
            if has_normals {
                for corner in &mut corners {
                    if corner.normal == NO_INDEX || normals[corner.normal as usize] == [0.0; 3] {
                        // Flat there: a corner of this polygon alone.
                        let (known, normal) = flat.unwrap_or((usize::MAX, NO_INDEX));
                        corner.normal = if known == polygon {
                            normal
                        } else {
                            normals.len() as u32
                        };
                        if known != polygon {
                            normals.push(flat_normal(polygons.get(polygon).map(position)));
                            flat = Some((polygon, corner.normal));
                        }
                    }
                }
            }
            mesh.triangles.push(if plain {
                corners.map(|corner| corner.position)
            } else {
                corners.map(|corner| vertices.vertex_of(corner))
            });
            slots.extend(several.then_some(slot as u16));
        };
        polygons.triangles(range, path, &mut assets.budget, position, triangle)?;
    }

    let materials = used;
    if materials.len() > 1 {
        mesh.material_slots = Some(slots);
    }
    if plain {
        mesh.vertices = std::mem::take(positions);
        mesh.vertex_colors = Some(std::mem::take(colors)).filter(|colors| !colors.is_empty());
        return Ok(MeshPart {
            name,
            mesh,
            materials,
        });
    }
    let corner_of = &vertices.corner_of;
    mesh.vertices = corner_of.iter().map(|&c| position(c)).collect();
    if has_uvs {
        let uv = |c: &Corner| uvs.get(c.uv as usize).copied().unwrap_or([0.0; 2]);
        mesh.uvs = Some(corner_of.iter().map(uv).collect());
    }
    if has_normals {
        let normal = |c: &Corner| {
            let normal = normals.get(c.normal as usize).copied();
            normal.unwrap_or([0.0, 0.0, 1.0])
        };
        mesh.normals = Some(corner_of.iter().map(normal).collect());
    }
    if !colors.is_empty() {
        let color = |c: &Corner| colors[c.position as usize];
        mesh.vertex_colors = Some(corner_of.iter().map(color).collect());
    }
    Ok(MeshPart {
        name,
        mesh,
        materials,
    })
}

/// Gives corners without a normal that of their smoothing group: the mean of the normals of its polygons that meet there,
/// weighted by their angles (Thuermer and Wuethrich, 1998).
fn smooth(
    polygons: &mut Polygons,
    positions: &[DVec3],
    normals: &mut Vec<[f32; 3]>,
    runs: &[RunRange],
    sites: &mut VertexDeduper,
) {
    let first = normals.len();
    let mut sums: Vec<DVec3> = Vec::new();
    for RunRange {
        run,
        polygons: range,
    } in runs
    {
        let Some(group) = run.smoothing.filter(|&group| group > 0) else {
            continue;
        };
        for polygon in range.clone() {
            let range = polygons.range(polygon);
            let corners: Vec<Corner> = polygons.get(polygon).collect();
            if corners.iter().all(|corner| corner.normal != NO_INDEX) {
                continue;
            }
            let at: Vec<DVec3> = corners
                .iter()
                .map(|c| positions[c.position as usize])
                .collect();
            let normal = DVec3::from(flat_normal(at.iter().copied()).map(f64::from));
            for (i, corner) in corners.iter().enumerate() {
                let [before, after] =
                    [at.len() - 1, 1].map(|step| at[(i + step) % at.len()] - at[i]);
                let site = sites.vertex_of(Corner {
                    position: corner.position,
                    uv: group,
                    normal: 0,
                });
                if sums.len() <= site as usize {
                    sums.resize(site as usize + 1, DVec3::ZERO);
                }
                if before != DVec3::ZERO && after != DVec3::ZERO {
                    sums[site as usize] += normal * before.angle_between(after);
                }
                if corner.normal == NO_INDEX {
                    let normal = (first + site as usize) as u32;
                    polygons.edit_corner(range.start + i, |corner| corner.normal = normal);
                }
            }
        }
    }
    normals.extend(
        sums.iter()
            .map(|sum| sum.normalize_or_zero().as_vec3().to_array()),
    );
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
