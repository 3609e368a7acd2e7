//! Meshes: a primitive for each material slot, with its vertex attributes.

use std::sync::Arc;

use glam::Vec3;
use raycam_scene::animation::{DeformableMesh, MorphTarget};
use raycam_scene::{Mesh, NoticeCode};
use serde_json::{Map, Value, json};

use crate::gltf::writer::binary::BufferTarget::Vertices;
use crate::gltf::writer::document::Writer;

/// For each material slot of an object that variants change, the slot and pairs of a variant and its material
/// (`KHR_materials_variants`); all are indices.
pub(super) type SlotVariants = Vec<(usize, Vec<(usize, usize)>)>;

impl Writer<'_> {
    /// Index in the document of the mesh with these materials; written if it does not exist yet.
    pub(super) fn mesh(
        &mut self,
        mesh: &Arc<Mesh>,
        shape: Option<&DeformableMesh>,
        materials: &[usize],
        variants: &SlotVariants,
        weights: &[f32],
    ) -> usize {
        let key = (Arc::as_ptr(mesh), shape.is_some());
        if !self.meshes.primitives.contains_key(&key) {
            let primitives = self.primitives(mesh, shape);
            self.meshes.primitives.insert(key, primitives);
        }
        let mut primitives = Vec::new();
        for (slot, primitive) in self.meshes.primitives[&key].clone() {
            let Value::Object(mut primitive) = primitive else { continue };
            primitive.insert("material".into(), json!(materials[slot]));
            let mappings = variants.iter().find(|(other, _)| *other == slot);
            if let Some((_, pairs)) = mappings {
                let mut by_material: Vec<(usize, Vec<usize>)> = Vec::new();
                for &(variant, material) in pairs {
                    match by_material.iter_mut().find(|(other, _)| *other == material) {
                        Some((_, variants)) => variants.push(variant),
                        None => by_material.push((material, vec![variant])),
                    }
                }
                let mapping =
                    |(material, variants): &(usize, Vec<usize>)| json!({ "material": material, "variants": variants });
                let mappings: Vec<_> = by_material.iter().map(mapping).collect();
                let extension = json!({ "mappings": mappings });
                self.extend(&mut primitive, "KHR_materials_variants", extension);
            }
            primitives.push(Value::from(primitive));
        }
        let mut json = json!({ "primitives": primitives });
        if !weights.is_empty() {
            json["weights"] = crate::gltf::writer::number::shortest_f32s(weights);
        }
        let text = json.to_string();
        if let Some(&known) = self.meshes.meshes.get(&text) {
            return known;
        }
        let index = self.push("meshes", json);
        self.meshes.meshes.insert(text, index);
        index
    }

    fn primitives(&mut self, mesh: &Mesh, shape: Option<&DeformableMesh>) -> Vec<(usize, Value)> {
        let rounding = mesh.vertices.iter().map(|v| (v.as_vec3().as_dvec3() - *v).length());
        let rounding = rounding.fold(0.0, f64::max);
        if rounding > 0.0 {
            let moved = if rounding < 1e-6 { "less than a millionth".into() } else { format!("up to {rounding:.1e}") };
            self.note(
                NoticeCode::ApproximatedValue,
                format!("positions are rounded to float32, which moves them by {moved} of the mesh's unit"),
            );
        }
        let Some(slots) = &mesh.material_slots else {
            let corners = mesh.triangles.as_flattened().to_vec();
            return vec![(0, self.primitive(mesh, shape, corners, None, true))];
        };
        if !slots.is_sorted() {
            let message = "triangles are renumbered material by material";
            self.note(NoticeCode::Renamed, message);
        }
        let mut primitives = Vec::new();
        for slot in 0..mesh.slot_count() {
            let of_slot = |&(_, &other): &(usize, &u16)| usize::from(other) == slot;
            let faces: Vec<usize> = slots.iter().enumerate().filter(of_slot).map(|f| f.0).collect();
            if faces.is_empty() {
                continue;
            }
            let corners = faces.iter().flat_map(|&face| mesh.triangles[face]).collect();
            let whole = mesh.slot_count() == 1;
            primitives.push((slot, self.primitive(mesh, shape, corners, Some(&faces), whole)));
        }
        primitives
    }

    /// JSON of a primitive with the triangles that have these corners. `faces` contains the triangles' indices in the
    /// mesh; `whole` is true if they are all triangles of the mesh.
    fn primitive(
        &mut self,
        mesh: &Mesh,
        shape: Option<&DeformableMesh>,
        corners: Vec<u32>,
        faces: Option<&[usize]>,
        whole: bool,
    ) -> Value {
        let normals = mesh.normals.as_ref();
        let normals = normals.filter(|all| corners.iter().any(|&i| all[i as usize] != [0.0; 3]));
        let flat = normals.is_some_and(|all| corners.iter().any(|&i| all[i as usize] == [0.0; 3]));
        // Flat normals and face colours require separate vertices.
        let apart = flat || mesh.face_colors.is_some();
        let (sources, indices) = match (apart, whole) {
            (true, _) => (corners.clone(), None),
            (_, true) => ((0..mesh.vertices.len() as u32).collect(), Some(corners.clone())),
            (false, false) => compact(&corners, mesh.vertices.len()),
        };
        let count = sources.len();
        let mut attributes = Map::new();
        let positions = gather(&sources, |i| mesh.vertices[i].as_vec3().to_array());
        let position = self.binary.floats(&positions, Vertices, true);
        attributes.insert("POSITION".into(), json!(position));
        let shading = normals.map(|all| shading_normals(all, &sources, &positions, flat));
        if let Some(normals) = &shading {
            let index = self.binary.floats(normals, Vertices, false);
            attributes.insert("NORMAL".into(), json!(index));
        }
        let has_tangents = self.tangents(mesh, &sources, shading.as_ref(), &mut attributes);
        for (set, uvs) in mesh.uvs.iter().chain(&mesh.more_uvs).enumerate() {
            let index = self.binary.floats(&gather(&sources, |i| uvs[i]), Vertices, false);
            attributes.insert(format!("TEXCOORD_{set}"), json!(index));
        }
        let colored = self.colors(mesh, &sources, faces, &mut attributes);
        let mut json = json!({});
        if let Some(shape) = shape {
            self.skin(shape, &sources, &mut attributes);
            let base = [shading.is_some(), has_tangents, mesh.uvs.is_some(), colored];
            let targets: Vec<_> = shape.targets.iter().map(|target| self.target(target, &sources, base)).collect();
            if !targets.is_empty() {
                json["targets"] = targets.into();
            }
        }
        json["attributes"] = attributes.into();
        if let Some(indices) = indices {
            json["indices"] = json!(self.binary.indices(&indices, count));
        }
        json
    }

    /// Writes `TANGENT` if the mesh has tangents and normals; returns true if `TANGENT` was written.
    fn tangents(
        &mut self,
        mesh: &Mesh,
        sources: &[u32],
        normals: Option<&Vec<[f32; 3]>>,
        attributes: &mut Map<String, Value>,
    ) -> bool {
        let tangents = mesh.tangents.as_ref().zip(normals);
        let tangents = tangents.map(|(all, normals)| (gather(sources, |i| all[i]), normals));
        let tangents = tangents.filter(|(all, _)| all.iter().any(|t| t[..3] != [0.0; 3]));
        let Some((tangents, normals)) = tangents else { return false };
        let unit = |([x, y, z, sign], normal): ([f32; 4], &[f32; 3])| {
            let any = Vec3::from_array(*normal).any_orthonormal_vector();
            let [x, y, z] = Vec3::new(x, y, z).normalize_or(any).to_array();
            [x, y, z, if sign < 0.0 { -1.0 } else { 1.0 }]
        };
        let tangents: Vec<_> = tangents.into_iter().zip(normals).map(unit).collect();
        let index = self.binary.floats(&tangents, Vertices, false);
        attributes.insert("TANGENT".into(), json!(index));
        true
    }

    /// Writes `JOINTS_n` and `WEIGHTS_n`.
    fn skin(&mut self, shape: &DeformableMesh, sources: &[u32], attributes: &mut Map<String, Value>) {
        for (set, (joints, weights)) in shape.joints.iter().enumerate() {
            let joints = gather(sources, |i| used(joints[i], weights[i]));
            let index = self.binary.joints(&joints);
            attributes.insert(format!("JOINTS_{set}"), json!(index));
            let weights = gather(sources, |i| weights[i]);
            let index = self.binary.floats(&weights, Vertices, false);
            attributes.insert(format!("WEIGHTS_{set}"), json!(index));
        }
    }

    /// Writes `COLOR_0` if there are vertex or face colours; returns true if `COLOR_0` was written.
    fn colors(
        &mut self,
        mesh: &Mesh,
        sources: &[u32],
        faces: Option<&[usize]>,
        attributes: &mut Map<String, Value>,
    ) -> bool {
        let of_faces = mesh.face_colors.as_ref();
        let of_vertices = mesh.vertex_colors.as_ref();
        let opacities = mesh.vertex_opacities.as_ref();
        if of_faces.is_none() && of_vertices.is_none() && opacities.is_none() {
            return false;
        }
        let colors: Vec<[f32; 3]> = sources
            .iter()
            .enumerate()
            .map(|(corner, &i)| {
                let own = of_vertices.map_or([1.0; 3], |all| all[i as usize]);
                // With face colours, each corner has its own vertex.
                let face = faces.map_or(corner / 3, |faces| faces.get(corner / 3).copied().unwrap_or(0));
                let face = of_faces.map_or([1.0; 3], |all| all[face]);
                std::array::from_fn(|i| own[i] * face[i])
            })
            .collect();
        let index = match opacities {
            Some(opacities) => {
                let with = |([r, g, b], &i): ([f32; 3], &u32)| [r, g, b, opacities[i as usize]];
                let colors: Vec<_> = colors.into_iter().zip(sources).map(with).collect();
                self.binary.floats(&colors, Vertices, false)
            }
            None => self.binary.floats(&colors, Vertices, false),
        };
        attributes.insert("COLOR_0".into(), json!(index));
        true
    }

    fn target(&mut self, target: &MorphTarget, sources: &[u32], [normals, tangents, uvs, colors]: [bool; 4]) -> Value {
        let mut json = Map::new();
        let zero = vec![[0.0; 3]; if target.vertices.is_none() { sources.len() } else { 0 }];
        let moved = match &target.vertices {
            Some(all) => gather(sources, |i| all[i]),
            // glTF requires positions in every morph target.
            None => zero,
        };
        let index = self.binary.floats(&moved, Vertices, true);
        json.insert("POSITION".into(), json!(index));
        let three = [
            ("NORMAL", normals, &target.normals),
            ("TANGENT", tangents, &target.tangents),
            ("COLOR_0", colors, &target.colors),
        ];
        for (name, based, values) in three {
            if let (true, Some(all)) = (based, values) {
                let index = self.binary.floats(&gather(sources, |i| all[i]), Vertices, false);
                json.insert(name.into(), json!(index));
            }
        }
        if let (true, Some(all)) = (uvs, &target.uvs) {
            let index = self.binary.floats(&gather(sources, |i| all[i]), Vertices, false);
            json.insert("TEXCOORD_0".into(), json!(index));
        }
        json.into()
    }
}

/// Unit normals of the vertices. With `flat`, each corner has its own vertex, and zero normals are replaced by the
/// faces' normals.
fn shading_normals(all: &[[f32; 3]], sources: &[u32], positions: &[[f32; 3]], flat: bool) -> Vec<[f32; 3]> {
    let mut normals = gather(sources, |i| all[i]);
    if flat {
        for (corners, normals) in positions.chunks(3).zip(normals.chunks_mut(3)) {
            let [a, b, c] = [0, 1, 2].map(|i| Vec3::from_array(corners[i]));
            let face = (b - a).cross(c - a).normalize_or(Vec3::Z).to_array();
            normals.iter_mut().filter(|n| **n == [0.0; 3]).for_each(|n| *n = face);
        }
    }
    normals.into_iter().map(|n| Vec3::from_array(n).normalize_or(Vec3::Z).to_array()).collect::<Vec<_>>()
}

/// Vertices used by these corners, in order, and the corners as indices into them.
fn compact(corners: &[u32], vertices: usize) -> (Vec<u32>, Option<Vec<u32>>) {
    let mut places = vec![u32::MAX; vertices];
    corners.iter().for_each(|&corner| places[corner as usize] = 0);
    let mut sources = Vec::new();
    for (vertex, place) in places.iter_mut().enumerate().filter(|(_, place)| **place == 0) {
        *place = sources.len() as u32;
        sources.push(vertex as u32);
    }
    let corners = corners.iter().map(|&corner| places[corner as usize]).collect();
    (sources, Some(corners))
}

fn gather<T>(sources: &[u32], of: impl Fn(usize) -> T) -> Vec<T> {
    sources.iter().map(|&i| of(i as usize)).collect()
}

/// Joints without a weight are written as joint 0 (glTF 2.0, 3.7.3.3).
fn used(joints: [u16; 4], weights: [f32; 4]) -> [u16; 4] {
    std::array::from_fn(|i| if weights[i] == 0.0 { 0 } else { joints[i] })
}
