//! Meshes: indexed triangles in float64, with attributes of corners and faces.

pub(crate) mod edge_refinement;
pub mod oriented_box;
pub mod primitive;
pub mod subdivide;
pub mod surface;
pub(crate) mod topology;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::color::Rgb;
use crate::counted::counted;
use crate::error::{Result, SceneError};

/// Indexed triangles in mesh-local coordinates. Vertices are used exactly as given.
///
/// Per-vertex arrays have the length of `vertices`, per-triangle arrays the length of `triangles`; absent arrays are
/// `None`.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Mesh {
    /// Corner positions.
    pub vertices: Vec<DVec3>,
    /// Corner indices, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Unit shading normals per vertex. A zero normal means that the triangle's own normal is used.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates per vertex; v = 0 is the top row of the image, as in glTF.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Further texture coordinates per vertex: sets 1, 2, ...
    pub more_uvs: Vec<Vec<[f32; 2]>>,
    /// Unit tangents per vertex towards increasing u, with the bitangent's sign (glTF 2.0, 3.7.2.1).
    pub tangents: Option<Vec<[f32; 4]>>,
    /// Linear colours per vertex, interpolated.
    pub vertex_colors: Option<Vec<Rgb>>,
    /// Opacities per vertex, interpolated.
    pub vertex_opacities: Option<Vec<f32>>,
    /// Linear colours per triangle.
    pub face_colors: Option<Vec<Rgb>>,
    /// Per triangle: index into its object's `materials`; all 0 if absent.
    pub material_slots: Option<Vec<u16>>,
}

/// Maximum number of triangles in a mesh, because ids are int32.
pub const MAX_TRIANGLES: usize = i32::MAX as usize;

impl Mesh {
    /// Checks that all arrays are consistent.
    ///
    /// # Errors
    /// [`SceneError::World`] for no triangles, vertices that are not finite, indices out of range, arrays of the wrong
    /// length, normals or texture coordinates that are not finite, and colours outside 0..=1.
    pub fn validate(&self) -> Result<()> {
        let fail = |message: String| Err(SceneError::mesh(message));
        let (vertices, triangles) = (self.vertices.len(), self.triangles.len());
        if triangles == 0 {
            return fail(format!(
                "a mesh of {} without triangles; there is nothing to render",
                counted(vertices, "vertex")
            ));
        }
        if triangles > MAX_TRIANGLES {
            return fail(format!("a mesh of {triangles} triangles; the maximum is {MAX_TRIANGLES}"));
        }
        if let Some(i) = find_first_invalid(&self.vertices, |v| v.is_finite()) {
            return fail(format!("vertex {i} is {}; coordinates must be finite", self.vertices[i]));
        }
        let inside = |&[a, b, c]: &[u32; 3]| (a.max(b).max(c) as usize) < vertices;
        if let Some(i) = find_first_invalid(&self.triangles, inside) {
            let triangle = self.triangles[i];
            return fail(format!(
                "triangle {i} has corners {triangle:?}, but the mesh has {}; expected indices 0 to {}",
                counted(vertices, "vertex"),
                vertices.saturating_sub(1)
            ));
        }
        self.validate_attributes()
    }

    /// Checks the lengths and values of the per-vertex and per-triangle arrays.
    fn validate_attributes(&self) -> Result<()> {
        let (vertices, triangles) = (self.vertices.len(), self.triangles.len());
        check_numbers("normals", self.normals.as_deref(), vertices, "vertices", f32::is_finite, "finite")?;
        check_numbers("uvs", self.uvs.as_deref(), vertices, "vertices", f32::is_finite, "finite")?;
        for (i, uvs) in self.more_uvs.iter().enumerate() {
            check_numbers(&format!("more_uvs[{i}]"), Some(uvs), vertices, "vertices", f32::is_finite, "finite")?;
        }
        check_numbers("tangents", self.tangents.as_deref(), vertices, "vertices", f32::is_finite, "finite")?;
        let share = |v: f32| (0.0..=1.0).contains(&v);
        let opacities = self.vertex_opacities.as_deref().map(<[f32]>::as_chunks::<1>);
        check_numbers("vertex_opacities", opacities.map(|(all, _)| all), vertices, "vertices", share, "from 0 to 1")?;
        check_numbers("vertex_colors", self.vertex_colors.as_deref(), vertices, "vertices", share, "from 0 to 1")?;
        check_numbers("face_colors", self.face_colors.as_deref(), triangles, "triangles", share, "from 0 to 1")?;
        if let Some(slots) = &self.material_slots {
            check_length("material_slots", slots.len(), triangles, "triangles")?;
        }
        Ok(())
    }

    /// Number of triangles without area: they are kept, and rays never hit them.
    pub fn degenerate_count(&self) -> usize {
        let flat = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| self.vertices[i as usize]);
            (b - a).cross(c - a) == DVec3::ZERO
        };
        self.triangles.iter().filter(|triangle| flat(triangle)).count()
    }

    /// Axis-aligned bounds of the vertices that triangles use: the smallest and the largest coordinates. `None`
    /// without triangles.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds_in(DAffine3::IDENTITY)
    }

    /// Same as [`Mesh::bounds`], for the mesh placed by a transform; the bounds are equally tight.
    pub fn bounds_in(&self, world_from_mesh: DAffine3) -> Option<(DVec3, DVec3)> {
        let mut used = vec![false; self.vertices.len()];
        for &i in self.triangles.as_flattened() {
            used[i as usize] = true;
        }
        let corners = self.vertices.iter().zip(used).filter(|(_, used)| *used);
        corners.map(|(&vertex, _)| world_from_mesh.transform_point3(vertex)).fold(None, |bounds, point| {
            let (low, high) = bounds.unwrap_or((point, point));
            Some((low.min(point), high.max(point)))
        })
    }

    /// Returns the mesh in transformed coordinates. If the transform mirrors, triangles are reversed, so that their
    /// outside stays outside.
    pub fn transformed(&self, world_from_mesh: DAffine3) -> Mesh {
        let mut placed = self.clone();
        if world_from_mesh == DAffine3::IDENTITY {
            return placed;
        }
        let linear = world_from_mesh.matrix3;
        let mirrored = linear.determinant() < 0.0;
        let normal_from_mesh = linear.inverse().transpose();
        let turn = |matrix: DMat3, [x, y, z]: [f32; 3]| {
            let vector = matrix * Vec3::new(x, y, z).as_dvec3();
            vector.normalize_or_zero().as_vec3().to_array()
        };
        for vertex in &mut placed.vertices {
            *vertex = world_from_mesh.transform_point3(*vertex);
        }
        for normal in placed.normals.iter_mut().flatten() {
            *normal = turn(normal_from_mesh, *normal);
        }
        for [x, y, z, sign] in placed.tangents.iter_mut().flatten() {
            [*x, *y, *z] = turn(linear, [*x, *y, *z]);
            if mirrored {
                *sign = -*sign;
            }
        }
        if mirrored {
            placed.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        placed
    }

    /// Adds the vertices and triangles of another mesh, whose triangles get these material slots.
    pub(crate) fn append(&mut self, other: &Mesh, slots: Vec<u16>) {
        let [before, after] = [self.vertices.len(), other.vertices.len()];
        let [triangles, more] = [self.triangles.len(), other.triangles.len()];
        let offset = before as u32;
        concat_attribute(&mut self.normals, other.normals.as_deref(), before, after, [0.0; 3]);
        concat_attribute(&mut self.uvs, other.uvs.as_deref(), before, after, [0.0; 2]);
        for set in 0..self.more_uvs.len().max(other.more_uvs.len()) {
            if set == self.more_uvs.len() {
                self.more_uvs.push(vec![[0.0; 2]; before]);
            }
            match other.more_uvs.get(set) {
                Some(uvs) => self.more_uvs[set].extend_from_slice(uvs),
                None => self.more_uvs[set].resize(before + after, [0.0; 2]),
            }
        }
        concat_attribute(&mut self.tangents, other.tangents.as_deref(), before, after, [0.0; 4]);
        concat_attribute(&mut self.vertex_opacities, other.vertex_opacities.as_deref(), before, after, 1.0);
        concat_attribute(&mut self.vertex_colors, other.vertex_colors.as_deref(), before, after, [1.0; 3]);
        concat_attribute(&mut self.face_colors, other.face_colors.as_deref(), triangles, more, [1.0; 3]);
        concat_attribute(&mut self.material_slots, Some(&slots), triangles, more, 0);
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|v| v + offset)));
    }

    /// Texture coordinates of a set, if the mesh has it: set 0 is [`Mesh::uvs`].
    pub fn uv_set(&self, set: usize) -> Option<&[[f32; 2]]> {
        match set {
            0 => self.uvs.as_deref(),
            _ => self.more_uvs.get(set - 1).map(Vec::as_slice),
        }
    }

    /// Number of material slots that the mesh's triangles use: one more than the largest slot index.
    pub fn slot_count(&self) -> usize {
        self.material_slots.iter().flatten().max().map_or(1, |&slot| usize::from(slot) + 1)
    }
}

/// Joins two arrays of these lengths. If only one mesh has the attribute, the other mesh's part is filled with
/// `neutral`.
fn concat_attribute<T: Clone>(all: &mut Option<Vec<T>>, other: Option<&[T]>, before: usize, more: usize, neutral: T) {
    if all.is_none() && other.is_none() {
        return;
    }
    let all = all.get_or_insert_with(|| vec![neutral.clone(); before]);
    match other {
        Some(other) => all.extend_from_slice(other),
        None => all.resize(before + more, neutral),
    }
}

/// Index of the first value for which `valid` is false. Large arrays are checked by several threads.
fn find_first_invalid<T: Sync>(values: &[T], valid: impl Fn(&T) -> bool + Sync) -> Option<usize> {
    const PARALLEL_THRESHOLD: usize = 1 << 17;
    if values.len() < PARALLEL_THRESHOLD || cfg!(target_family = "wasm") {
        return find_first_invalid_serial(values, valid);
    }
    let (one, other) = values.split_at(values.len() / 2);
    std::thread::scope(|scope| {
        let second = scope.spawn(|| find_first_invalid_serial(other, &valid));
        let first = find_first_invalid_serial(one, &valid);
        let second = second.join().unwrap_or_else(|e| std::panic::resume_unwind(e));
        first.or_else(|| second.map(|i| one.len() + i))
    })
}

/// Same as [`find_first_invalid`], on one thread. Within a block, the loop has no early exit, which is several times as
/// fast.
fn find_first_invalid_serial<T>(values: &[T], valid: impl Fn(&T) -> bool) -> Option<usize> {
    const BLOCK: usize = 256;
    let bad = |block: &[T]| !block.iter().fold(true, |all, value| all & valid(value));
    let block = BLOCK * values.chunks(BLOCK).position(bad)?;
    let within = values[block..].iter().position(|value| !valid(value))?;
    Some(block + within)
}

/// Checks the length and the values of a per-vertex or per-triangle array.
fn check_numbers<const N: usize>(
    name: &str,
    values: Option<&[[f32; N]]>,
    count: usize,
    what: &str,
    valid: impl Fn(f32) -> bool + Sync,
    expected: &str,
) -> Result<()> {
    let Some(values) = values else { return Ok(()) };
    check_length(name, values.len(), count, what)?;
    let all = |value: &[f32; N]| value.iter().fold(true, |all, &v| all & valid(v));
    match find_first_invalid(values, all) {
        Some(i) => Err(SceneError::mesh(format!("{name}[{i}] is {:?}; expected numbers {expected}", values[i]))),
        None => Ok(()),
    }
}

fn check_length(name: &str, length: usize, count: usize, what: &str) -> Result<()> {
    if length == count {
        return Ok(());
    }
    Err(SceneError::mesh(format!(
        "{name} has {}; expected one for each of the {count} {what}",
        counted(length, "entry")
    )))
}
