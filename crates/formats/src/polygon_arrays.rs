//! Meshes, objects and materials that another process passes: flat arrays, and an MTL file with its images in a folder.
//! The arrays are fully validated.

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use raycam_scene::color::Rgb;
use raycam_scene::{ErrorCode, MeshFile, MeshPart, Object, World};

use crate::error::{FormatError, Result};
use crate::geometry::polygons::Polygons;
use crate::geometry::vertex_dedup::{Corner, NO_INDEX, VertexDeduper};
use crate::io::AssetRoot;
use crate::obj::build::{build_part, smooth};
use crate::obj::chunk::{RunRange, StateRun};
use crate::obj::materials::Materials;
use crate::obj::mtl::MtlMaterial;
use crate::obj::parse::Obj;

/// Polygon meshes and the objects that show them. All arrays contain one mesh (or object) after the other.
pub struct PolygonArrays<'a> {
    /// For each mesh: the numbers of its points, colours, texture coordinates, normals and polygons, and 1 if it is
    /// smooth.
    pub meshes: &'a [[u64; 6]],
    /// Mesh coordinates of the points.
    pub points: &'a [[f64; 3]],
    /// Linear colours of a mesh: one per point, one per corner, or none.
    pub colors: &'a [Rgb],
    /// Texture coordinates, whose origin is at the top left.
    pub uvs: &'a [[f32; 2]],
    /// Normals of any length.
    pub normals: &'a [[f32; 3]],
    /// For each polygon: the number of its corners (at least 3), and its material slot.
    pub polygons: &'a [[u32; 2]],
    /// For each corner: the indices of its point, texture coordinates and normal in the mesh; `u32::MAX` if missing.
    pub corners: &'a [[u32; 3]],
    /// Names of the objects.
    pub names: Vec<String>,
    /// Mesh of each object.
    pub object_meshes: &'a [u32],
    /// Materials of each object's slots, as indices into `materials`.
    pub object_materials: &'a [u32],
    /// Rows of the objects' 3 x 4 matrices `world_from_mesh`.
    pub object_matrices: &'a [[f64; 12]],
    /// Names of the materials in the MTL file.
    pub materials: Vec<String>,
    /// Red, green, blue (linear) and opacity of further materials, whose indices follow the indices of `materials`.
    pub plain_materials: &'a [[f32; 4]],
}

/// Name of the MTL file in the folder.
const LIBRARY: &str = "materials.mtl";

impl PolygonArrays<'_> {
    /// Adds the meshes and objects to a world. The MTL file and its images are read from `folder`.
    ///
    /// # Errors
    /// Inconsistent arrays, and the errors of materials and images.
    pub fn add_to(&self, world: &mut World, folder: &Path, assets: &mut AssetRoot) -> Result<()> {
        let mut model = self.read(folder, assets)?;
        let scene = |source| FormatError::Scene { path: Some(folder.into()), source };
        let [first_texture, first_material, first_mesh] =
            [world.textures.len(), world.materials.len(), world.meshes.len()];
        world.notices.append(&mut model.notices);
        for texture in model.textures {
            world.add_texture(texture);
        }
        for mut material in model.materials {
            material.texture_slots_mut().for_each(|slot| slot.texture += first_texture);
            world.add_material(material).map_err(scene)?;
        }
        let slots: Vec<Vec<usize>> = model.parts.iter().map(|part| part.materials.clone()).collect();
        for part in model.parts {
            world.add_mesh(part.mesh);
        }
        self.each_object(folder, &slots, |name, mesh, materials, world_from_mesh| {
            let materials = materials.map(|material| first_material + material).collect();
            let object = Object::new(name, first_mesh + mesh, materials, world_from_mesh);
            world.add_object(object).map(drop).map_err(scene)
        })
    }

    /// Returns all objects as the parts of one model, in world coordinates.
    ///
    /// # Errors
    /// Same as [`Self::add_to`].
    pub fn merge(&self, folder: &Path, assets: &mut AssetRoot) -> Result<MeshFile> {
        let mut model = self.read(folder, assets)?;
        let meshes = std::mem::take(&mut model.parts);
        let slots: Vec<Vec<usize>> = meshes.iter().map(|part| part.materials.clone()).collect();
        self.each_object(folder, &slots, |name, mesh, materials, world_from_mesh| {
            let mesh = &meshes[mesh].mesh;
            let elements = mesh.vertices.len() + 3 * mesh.triangles.len();
            assets.budget.take_elements(folder, elements as u64)?;
            let mesh = mesh.transformed(world_from_mesh);
            model.parts.push(MeshPart { name: name.into(), mesh, materials: materials.collect() });
            Ok(())
        })?;
        model.notices.append(&mut assets.drain_notices());
        Ok(model)
    }

    /// Reads all meshes as parts of one model, and all materials. The material indices of a part are its slot indices.
    fn read(&self, folder: &Path, assets: &mut AssetRoot) -> Result<MeshFile> {
        let mut model = MeshFile::default();
        assets.uses_alpha_as_written = true;
        self.read_materials(&folder.join(LIBRARY), assets, &mut model)?;
        let mut rest = Rest {
            points: self.points,
            colors: self.colors,
            uvs: self.uvs,
            normals: self.normals,
            polygons: self.polygons,
            corners: self.corners,
        };
        for counts in self.meshes {
            let obj = rest.next_mesh(*counts).ok_or_else(|| contradiction(folder, "a mesh"))?;
            model.parts.push(build_mesh(obj, folder, assets)?);
        }
        Ok(model)
    }

    fn read_materials(&self, library: &Path, assets: &mut AssetRoot, model: &mut MeshFile) -> Result<()> {
        if !self.materials.is_empty() {
            self.read_library(library, assets, model)?;
        }
        for (number, &[r, g, b, opacity]) in self.plain_materials.iter().enumerate() {
            let material = MtlMaterial::plain(format!("color_{number}").as_bytes(), [r, g, b], opacity);
            model.materials.push(material.material(library, &[], &mut model.notices));
        }
        Ok(())
    }

    fn read_library(&self, library: &Path, assets: &mut AssetRoot, model: &mut MeshFile) -> Result<()> {
        let names = Obj {
            materials: self.materials.iter().map(|name| name.clone().into_bytes()).collect(),
            libraries: vec![LIBRARY.into()],
            ..Obj::default()
        };
        let run = |material| StateRun { material: Some(material), ..StateRun::default() };
        let runs: Vec<_> =
            (0..self.materials.len()).map(|material| RunRange { run: run(material), polygons: 0..0 }).collect();
        Materials::read(&names, &runs, library, assets, model).map(drop)
    }

    /// Calls `add` with the name, mesh, materials and `world_from_mesh` of each object.
    fn each_object(
        &self,
        folder: &Path,
        slots: &[Vec<usize>],
        mut add: impl FnMut(&str, usize, &mut dyn Iterator<Item = usize>, DAffine3) -> Result<()>,
    ) -> Result<()> {
        let mut rest = self.object_materials;
        if self.names.len() != self.object_meshes.len() || self.names.len() != self.object_matrices.len() {
            return Err(contradiction(folder, "the objects"));
        }
        for ((name, mesh), rows) in self.names.iter().zip(self.object_meshes).zip(self.object_matrices) {
            let wrong = || contradiction(folder, "an object");
            let used = slots.get(*mesh as usize).ok_or_else(wrong)?;
            let count = used.iter().max().map_or(0, |slot| slot + 1);
            let own = take(&mut rest, count as u64).ok_or_else(wrong)?;
            if own.iter().any(|material| *material as usize >= self.materials.len() + self.plain_materials.len()) {
                return Err(wrong());
            }
            add(name, *mesh as usize, &mut used.iter().map(|slot| own[*slot] as usize), affine(rows))?;
        }
        Ok(())
    }
}

/// Rest of the arrays after the meshes that have been read.
struct Rest<'a> {
    points: &'a [[f64; 3]],
    colors: &'a [Rgb],
    uvs: &'a [[f32; 2]],
    normals: &'a [[f32; 3]],
    polygons: &'a [[u32; 2]],
    corners: &'a [[u32; 3]],
}

impl Rest<'_> {
    /// Next mesh in the form of an OBJ file, with its material slots as materials; `None` if its arrays are
    /// inconsistent.
    fn next_mesh(&mut self, [points, colors, uvs, normals, polygons, smooth]: [u64; 6]) -> Option<Obj> {
        let points = take(&mut self.points, points)?;
        let colors = take(&mut self.colors, colors)?;
        let uvs = take(&mut self.uvs, uvs)?;
        let normals = take(&mut self.normals, normals)?;
        let rows = take(&mut self.polygons, polygons)?;
        let uv_of = unique_rows(uvs.iter().map(|uv| uv.map(f32::to_bits)));
        let normal_of = unique_rows(normals.iter().map(|normal| normal.map(f32::to_bits)));
        let mut obj = Obj {
            positions: points.iter().map(|point| DVec3::from_array(*point)).collect(),
            colors: colors.to_vec(),
            uvs: uvs.to_vec(),
            normals: normals
                .iter()
                .map(|n| DVec3::from(n.map(f64::from)).normalize_or_zero().as_vec3().into())
                .collect(),
            ..Obj::default()
        };
        let known = |index: u32, rows: &[u32]| match index {
            NO_INDEX => Some(NO_INDEX),
            index => rows.get(index as usize).copied(),
        };
        let mut polygons = Polygons::default();
        for (number, [count, slot]) in rows.iter().enumerate() {
            for &[position, uv, normal] in take(&mut self.corners, u64::from(*count))? {
                points.get(position as usize)?;
                let (uv, normal) = (known(uv, &uv_of)?, known(normal, &normal_of)?);
                polygons.push_corner(Corner { position, uv, normal });
            }
            if !polygons.end_face() {
                return None;
            }
            let material = Some(usize::from(u16::try_from(*slot).ok()?));
            if obj.runs.last().is_none_or(|run: &StateRun| run.material != material) {
                let smoothing = Some(u32::from(smooth == 1));
                obj.runs.push(StateRun { start: number, material, smoothing, ..StateRun::default() });
            }
        }
        let fits = colors.is_empty() || [points.len(), polygons.corner_count()].contains(&colors.len());
        obj.polygons = polygons;
        (fits && !rows.is_empty()).then_some(obj)
    }
}

/// Mesh of polygons, with its material slots as materials.
fn build_mesh(mut obj: Obj, path: &Path, assets: &mut AssetRoot) -> Result<MeshPart> {
    let elements = obj.positions.len() + obj.uvs.len() + obj.normals.len();
    assets.budget.take_elements(path, elements as u64)?;
    if obj.colors.iter().all(|color| *color == [1.0; 3]) {
        obj.colors = Vec::new();
    }
    let ends = obj.runs[1..].iter().map(|run| run.start).chain([obj.polygons.len()]);
    let mut runs: Vec<_> =
        obj.runs.iter().zip(ends).map(|(&run, end)| RunRange { run, polygons: run.start..end }).collect();
    if !obj.colors.is_empty() && obj.colors.len() != obj.positions.len() {
        split_corners(&mut obj, &mut runs);
    }
    let slots = 1 + runs.iter().filter_map(|range| range.run.material).max().unwrap_or(0);
    let materials = Materials { named: (0..slots).collect(), default_material: 0 };
    let mut vertices = VertexDeduper::new(obj.positions.len());
    let part = build_part(&mut obj, String::new(), &runs, path, assets, &mut vertices, &materials)?;
    part.mesh.validate().map_err(|source| FormatError::Scene { path: Some(path.into()), source })?;
    Ok(part)
}

/// Gives each corner a separate point, because it has a separate colour; a smooth surface keeps its shading.
fn split_corners(obj: &mut Obj, runs: &mut [RunRange]) {
    let mut sites = VertexDeduper::new(obj.positions.len());
    sites.reserve(0..obj.positions.len() as u32);
    smooth(&mut obj.polygons, &obj.positions, &mut obj.normals, runs, &mut sites);
    runs.iter_mut().for_each(|range| range.run.smoothing = None);
    let mut positions = Vec::with_capacity(obj.polygons.corner_count());
    for corner in 0..obj.polygons.corner_count() {
        obj.polygons.edit_corner(corner, |own| {
            positions.push(obj.positions[own.position as usize]);
            own.position = corner as u32;
        });
    }
    obj.positions = positions;
}

/// For each row: the index of the first equal row.
fn unique_rows<const N: usize>(rows: impl ExactSizeIterator<Item = [u32; N]>) -> Vec<u32> {
    let mut first = HashMap::with_capacity(rows.len());
    rows.enumerate().map(|(number, row)| *first.entry(row).or_insert(number as u32)).collect()
}

/// Removes and returns the first elements of a slice; `None` if the slice has fewer elements.
fn take<'a, T>(rest: &mut &'a [T], count: u64) -> Option<&'a [T]> {
    let (taken, left) = rest.split_at_checked(usize::try_from(count).ok()?)?;
    *rest = left;
    Some(taken)
}

fn affine(&[a, b, c, x, d, e, f, y, g, h, i, z]: &[f64; 12]) -> DAffine3 {
    let linear = DMat3::from_cols_array(&[a, d, g, b, e, h, c, f, i]);
    DAffine3::from_mat3_translation(linear, DVec3::new(x, y, z))
}

fn contradiction(path: &Path, what: &str) -> FormatError {
    FormatError::whole(path, ErrorCode::WrongShape.message(format!("the arrays of {what} are inconsistent")))
}
