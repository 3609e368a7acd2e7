//! Conversion of an OBJ file's statements to meshes and materials.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{Mesh, MeshFile, MeshPart};

use crate::error::Result;
use crate::geometry::polygons::Polygons;
use crate::geometry::vertex_dedup::{Corner, NO_INDEX, VertexDeduper};
use crate::io::{AssetRoot, lexer};
use crate::obj::chunk::RunRange;
use crate::obj::materials::Materials;
use crate::obj::parse::Obj;
use crate::obj::vertex_colors;

/// One part for each `o` that has faces, or for each `g` that has faces if the file has no `o`.
pub(crate) fn build(mut obj: Obj, path: &Path, assets: &mut AssetRoot) -> Result<MeshFile> {
    let elements = obj.positions.len() + obj.uvs.len() + obj.normals.len();
    assets.budget.take_elements(path, elements as u64)?;
    let mut model = MeshFile { notices: std::mem::take(&mut obj.notices), ..MeshFile::default() };
    let runs = std::mem::take(&mut obj.runs);
    let ends = runs[1..].iter().map(|run| run.start).chain([obj.polygons.len()]);
    let runs: Vec<RunRange> = (runs.iter().zip(ends))
        .filter(|(run, end)| run.start < *end)
        .map(|(&run, end)| RunRange { run, polygons: run.start..end })
        .collect();
    let materials = Materials::read(&obj, &runs, path, assets, &mut model)?;
    let mut vertices = VertexDeduper::new(obj.positions.len());
    for (name, runs) in group_parts(&obj, runs) {
        let part = build_part(&mut obj, name, &runs, path, assets, &mut vertices, &materials)?;
        model.parts.push(part);
    }
    vertex_colors::settle(&mut model, path);
    Ok(model)
}

/// Name and polygons of each part, in the order of the parts' first faces.
fn group_parts(obj: &Obj, runs: Vec<RunRange>) -> Vec<(String, Vec<RunRange>)> {
    let mut parts: Vec<(String, Vec<RunRange>)> = Vec::new();
    let mut number_of = HashMap::new();
    for range in runs {
        let (key, names) =
            if obj.parts.is_empty() { (range.run.group, &obj.groups) } else { (range.run.part, &obj.parts) };
        let number = *number_of.entry(key).or_insert_with(|| {
            let name = key.map_or(String::new(), |name| lexer::name(&names[name]));
            parts.push((name, Vec::new()));
            parts.len() - 1
        });
        parts[number].1.push(range);
    }
    parts
}

/// Builds the part with this name and these polygons.
pub(crate) fn build_part(
    obj: &mut Obj,
    name: String,
    runs: &[RunRange],
    path: &Path,
    assets: &mut AssetRoot,
    vertices: &mut VertexDeduper,
    materials: &Materials,
) -> Result<MeshPart> {
    let used = used_positions(obj, runs);
    let begin = |vertices: &mut VertexDeduper, positions: usize| {
        vertices.clear();
        match &used {
            None => vertices.reserve(0..positions as u32),
            Some(used) => vertices.reserve(used.iter().copied()),
        }
    };
    if runs.iter().any(|run| run.run.smoothing.is_some_and(|group| group > 0)) {
        begin(vertices, obj.positions.len());
        smooth(&mut obj.polygons, &obj.positions, &mut obj.normals, runs, vertices);
    }
    let any = |has: fn(&Corner) -> bool| {
        let polygons = runs.iter().flat_map(|run| run.polygons.clone());
        polygons.flat_map(|p| obj.polygons.get(p)).any(|c| has(&c))
    };
    let has_uvs = !obj.uvs.is_empty() && any(|c| c.uv != NO_INDEX);
    let has_normals = !obj.normals.is_empty() && any(|c| c.normal != NO_INDEX);
    // Without attributes at corners, the mesh's vertices are the file's vertices.
    let plain = used.is_none() && !has_uvs && !has_normals;
    if !plain {
        begin(vertices, obj.positions.len());
    }
    let vertex_of = |corner: Corner| match plain {
        true => corner.position,
        false => vertices.vertex_of(corner),
    };
    let cut = cut_polygons(obj, runs, has_normals, path, assets, materials, vertex_of)?;
    let mut mesh = Mesh {
        triangles: cut.triangles,
        material_slots: (cut.materials.len() > 1).then_some(cut.slots),
        ..Mesh::default()
    };
    if plain {
        mesh.vertices = std::mem::take(&mut obj.positions);
        mesh.vertex_colors = Some(std::mem::take(&mut obj.colors)).filter(|c| !c.is_empty());
    } else {
        gather_attributes(&mut mesh, obj, &vertices.corner_of, has_uvs, has_normals);
    }
    Ok(MeshPart { name, mesh, materials: cut.materials })
}

/// Indices of the positions that these polygons use, in order; `None` if the polygons are all polygons of the file.
fn used_positions(obj: &Obj, runs: &[RunRange]) -> Option<Vec<u32>> {
    let count: usize = runs.iter().map(|run| run.polygons.len()).sum();
    if count == obj.polygons.len() {
        return None;
    }
    let polygons = runs.iter().flat_map(|run| run.polygons.clone());
    let mut used: Vec<u32> = polygons.flat_map(|p| obj.polygons.get(p)).map(|c| c.position).collect();
    used.sort_unstable();
    used.dedup();
    Some(used)
}

/// Triangles of a part.
struct CutPolygons {
    triangles: Vec<[u32; 3]>,
    /// Index into `materials` for each triangle; empty if all triangles have the same material.
    slots: Vec<u16>,
    /// Indices of the model's materials.
    materials: Vec<usize>,
}

/// Cuts the polygons of a part. With `has_normals`, corners without a normal get the normal of their polygon.
fn cut_polygons(
    obj: &mut Obj,
    runs: &[RunRange],
    has_normals: bool,
    path: &Path,
    assets: &mut AssetRoot,
    materials: &Materials,
    mut vertex_of: impl FnMut(Corner) -> u32,
) -> Result<CutPolygons> {
    let Obj { positions, normals, polygons, .. } = obj;
    let mut cut = CutPolygons {
        triangles: Vec::with_capacity(runs.iter().map(|run| run.polygons.len()).sum()),
        slots: Vec::new(),
        materials: Vec::new(),
    };
    let mut slot_of = HashMap::new();
    // The last polygon that got a normal of its own, and the index of this normal.
    let mut flat = None;
    let several = runs.iter().any(|other| other.run.material != runs[0].run.material);
    let position = |c: Corner| positions[c.position as usize];
    for range in runs {
        let material = range.run.material;
        let material = material.map_or(materials.default_material, |m| materials.named[m]);
        let slot = *slot_of.entry(material).or_insert_with(|| {
            cut.materials.push(material);
            cut.materials.len() - 1
        });
        let triangle = |polygon: usize, mut corners: [Corner; 3]| {
            if has_normals {
                for corner in &mut corners {
                    if corner.normal == NO_INDEX || normals[corner.normal as usize] == [0.0; 3] {
                        let (known, normal) = flat.unwrap_or((usize::MAX, NO_INDEX));
                        corner.normal = if known == polygon { normal } else { normals.len() as u32 };
                        if known != polygon {
                            normals.push(flat_normal(polygons.get(polygon).map(position)));
                            flat = Some((polygon, corner.normal));
                        }
                    }
                }
            }
            cut.triangles.push(corners.map(&mut vertex_of));
            cut.slots.extend(several.then_some(slot as u16));
        };
        let range = range.polygons.clone();
        polygons.triangles(range, path, &mut assets.budget, position, triangle)?;
    }
    Ok(cut)
}

/// Sets the attributes of a mesh from its vertices' corners.
fn gather_attributes(mesh: &mut Mesh, obj: &Obj, corners: &[Corner], has_uvs: bool, has_normals: bool) {
    let position = |c: &Corner| obj.positions[c.position as usize];
    mesh.vertices = corners.iter().map(position).collect();
    if has_uvs {
        let uv = |c: &Corner| obj.uvs.get(c.uv as usize).copied().unwrap_or([0.0; 2]);
        mesh.uvs = Some(corners.iter().map(uv).collect());
    }
    if has_normals {
        let normal = |c: &Corner| obj.normals.get(c.normal as usize).copied().unwrap_or([0.0, 0.0, 1.0]);
        mesh.normals = Some(corners.iter().map(normal).collect());
    }
    if !obj.colors.is_empty() {
        let color = |c: &Corner| obj.colors[c.position as usize];
        mesh.vertex_colors = Some(corners.iter().map(color).collect());
    }
}

/// Gives corners without a normal the normal of their smoothing group: the angle-weighted mean of the normals of the
/// group's polygons that meet there (Thuermer and Wuethrich, 1998).
pub(crate) fn smooth(
    polygons: &mut Polygons,
    positions: &[DVec3],
    normals: &mut Vec<[f32; 3]>,
    runs: &[RunRange],
    sites: &mut VertexDeduper,
) {
    let first = normals.len();
    let mut sums: Vec<DVec3> = Vec::new();
    for RunRange { run, polygons: range } in runs {
        let Some(group) = run.smoothing.filter(|&group| group > 0) else { continue };
        for polygon in range.clone() {
            let range = polygons.range(polygon);
            let corners: Vec<Corner> = polygons.get(polygon).collect();
            if corners.iter().all(|corner| corner.normal != NO_INDEX) {
                continue;
            }
            let at: Vec<DVec3> = corners.iter().map(|c| positions[c.position as usize]).collect();
            if !at.iter().all(|point| point.is_finite()) {
                continue;
            }
            let normal = DVec3::from(flat_normal(at.iter().copied()).map(f64::from));
            for (i, corner) in corners.iter().enumerate() {
                let [before, after] = [at.len() - 1, 1].map(|step| at[(i + step) % at.len()] - at[i]);
                let site = sites.vertex_of(Corner { position: corner.position, uv: group, normal: 0 });
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
    normals.extend(sums.iter().map(|sum| sum.normalize_or_zero().as_vec3().to_array()));
}

/// Direction of a polygon's area vector; up if the area is zero.
fn flat_normal(mut corners: impl Iterator<Item = DVec3>) -> [f32; 3] {
    let origin = corners.next().unwrap_or_default();
    let (mut area, mut before) = (DVec3::ZERO, DVec3::ZERO);
    for corner in corners {
        area += before.cross(corner - origin);
        before = corner - origin;
    }
    area.try_normalize().unwrap_or(DVec3::Z).as_vec3().to_array()
}
