//! Displacement: a refined mesh whose vertices are moved along its normals by the heights of textures.
//!
//! R. Cook, L. Carpenter and E. Catmull, "The Reyes Image Rendering Architecture", SIGGRAPH 1987. Edges are split until
//! each edge is at most as long as a texel's diagonal, or as the given maximum length. Vertices at the same point move
//! together, so that a closed mesh remains closed.

use std::collections::HashMap;

use glam::{DMat3, DVec3};

use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::mesh::Mesh;
use crate::mesh::edge_refinement::EdgeRefinement;
use crate::texture::{Texture, TextureSlot};

/// Longest edge in texels: the diagonal of a texel, with a margin for rounding.
const MAX_EDGE_TEXELS: f64 = std::f64::consts::SQRT_2 * (1.0 + 1e-4);
/// Maximum cosine of the angle between the normals at a sharp edge: normals that differ by less than 0.03 degrees count
/// as equal.
const MAX_SHARP_COSINE: f64 = 1.0 - 1e-7;
/// Maximum length of the displacement at a sharp corner, as a multiple of the height.
const MAX_MITER: f64 = 2.0;
/// Approximate memory for each triangle of a displaced mesh while its search tree is built, in bytes.
const BYTES_PER_TRIANGLE: f64 = 200.0;

/// The height texture of a material.
pub(crate) struct HeightField<'a> {
    pub texture: &'a Texture,
    /// Mip levels of the texture, the full image first, for vertices whose edges are longer than a texel; empty if no
    /// edge is longer.
    pub levels: Vec<Texture>,
    pub slot: TextureSlot,
    /// Height that the value 1 represents, in metres of the world.
    pub scale: f64,
    /// Texture value at which the surface is not displaced.
    pub zero: f64,
}

impl HeightField<'_> {
    /// Height in metres at texture coordinates of the mesh, averaged over a width of `texels` texels.
    fn height(&self, uv: [f32; 2], texels: f64) -> f64 {
        let uv = self.slot.coordinates(uv);
        let level = (texels / MAX_EDGE_TEXELS).max(1.0).log2();
        let value = match self.levels.len().checked_sub(1) {
            Some(last) if level > 0.0 => {
                let first = (level as usize).min(last);
                let [fine, coarse] = [first, (first + 1).min(last)].map(|i| f64::from(self.levels[i].lookup(uv)[0]));
                fine + (coarse - fine) * level.fract()
            }
            _ => f64::from(self.texture.lookup(uv)[0]),
        };
        (value - self.zero) * self.scale
    }
}

/// Displacement of a mesh.
pub(crate) struct Displacement<'a> {
    /// Heights for each material slot; `None` for materials without relief.
    pub heights: Vec<Option<HeightField<'a>>>,
    /// Linear part of the transform from the mesh to the world, in which heights are measured.
    pub world_from_mesh: DMat3,
    /// Edges up to this length in metres of the world are not split.
    pub max_edge: f64,
    /// Maximum number of triangles.
    pub max_triangles: usize,
}

impl Displacement<'_> {
    /// Returns the displaced mesh, with shading normals. A point moves along its shading normal; on a sharp edge, it
    /// moves so that the planes on both sides are displaced by the height, at most by twice the height. Sharp edges
    /// stay sharp.
    ///
    /// # Errors
    /// [`SceneError::World`] if the displaced mesh would have more than `max_triangles` triangles, or coordinates that
    /// are not finite.
    pub fn apply(&self, mesh: &Mesh) -> Result<Mesh> {
        let mut refinement = EdgeRefinement::new(mesh);
        loop {
            let selected = refinement.select(|triangle, side| self.excess(&refinement.mesh, triangle, side) > 1.0);
            if selected.is_empty() {
                break;
            }
            if selected.triangle_count > self.max_triangles {
                return Err(self.too_large(&refinement.mesh));
            }
            refinement.split(&selected);
        }
        let displaced = DisplacedPoints::new(self, &refinement).move_points(self, refinement);
        displaced.validate()?;
        Ok(displaced)
    }

    fn heights_of(&self, mesh: &Mesh, triangle: usize) -> Option<&HeightField<'_>> {
        let slot = mesh.material_slots.as_ref().map_or(0, |slots| usize::from(slots[triangle]));
        self.heights.get(slot)?.as_ref()
    }

    /// Length of a side of a triangle relative to the longest edge that is not split.
    fn excess(&self, mesh: &Mesh, triangle: usize, side: usize) -> f64 {
        let texels = self.side_texels(mesh, triangle, side) / MAX_EDGE_TEXELS;
        let corners = mesh.triangles[triangle];
        let [a, b] = [corners[side], corners[(side + 1) % 3]].map(|vertex| mesh.vertices[vertex as usize]);
        let metres = (self.world_from_mesh * (b - a)).length();
        if self.max_edge > 0.0 { texels.min(metres / self.max_edge) } else { texels }
    }

    /// Length of a side of a triangle in texels; 0 without relief.
    fn side_texels(&self, mesh: &Mesh, triangle: usize, side: usize) -> f64 {
        let Some(heights) = self.heights_of(mesh, triangle) else { return 0.0 };
        let Some(uvs) = mesh.uv_set(heights.slot.uv_set) else { return 0.0 };
        let corners = mesh.triangles[triangle];
        let [a, b] = [corners[side], corners[(side + 1) % 3]].map(|vertex| vertex as usize);
        let [du, dv] = [0, 1].map(|axis| f64::from(uvs[b][axis]) - f64::from(uvs[a][axis]));
        let size = heights.texture.image.size;
        let texels = [0, 1].map(|axis| {
            let [x, y, _] = heights.slot.image_from_mesh[axis].map(f64::from);
            (x * du + y * dv) * f64::from(size[axis])
        });
        texels[0].hypot(texels[1])
    }

    /// Height in metres of a vertex, from the height texture of a material slot; `texels` is the length of the edges at
    /// the vertex.
    fn height(&self, mesh: &Mesh, (vertex, slot): (u32, u16), texels: f64) -> f64 {
        let Some(Some(heights)) = self.heights.get(usize::from(slot)) else { return 0.0 };
        mesh.uv_set(heights.slot.uv_set).map_or(0.0, |uvs| heights.height(uvs[vertex as usize], texels))
    }

    /// The error of a mesh whose refinement exceeds the budget.
    fn too_large(&self, mesh: &Mesh) -> SceneError {
        let wanted = |triangle: usize| {
            let longest = (0..3).map(|side| self.excess(mesh, triangle, side)).fold(1.0, f64::max);
            4f64.powf(longest.log2().ceil())
        };
        let count: f64 = (0..mesh.triangles.len()).map(wanted).sum();
        let gigabytes = count * BYTES_PER_TRIANGLE / f64::from(1 << 30);
        SceneError::World(ErrorCode::BudgetExceeded.message(format!(
            "the displaced surface requires about {count:.0} triangles and {gigabytes:.1} GiB of memory; max_triangles \
             is {}. Increase max_triangles, set max_edge to the longest allowed edge in metres, use a smaller image, or \
             omit displace to bend only the shading normals",
            self.max_triangles
        )))
    }
}

/// Points of a refined mesh, and their displacement.
struct DisplacedPoints {
    /// For each point, the start of its groups: corners with equal normals before the displacement. The last entry is
    /// the number of groups.
    group_starts: Vec<u32>,
    /// For each corner of each triangle, its group among all groups.
    group_of_corner: Vec<[u32; 3]>,
    /// Displacement of each point, in mesh coordinates.
    moves: Vec<DVec3>,
}

/// Normals and vertices of the corners at a point.
#[derive(Default)]
struct PointSums {
    /// Different unit normals, in world directions.
    normals: Vec<DVec3>,
    /// Pairs of a vertex and a material slot of its triangles, each with the length in texels of the longest edge of
    /// these triangles.
    vertices: Vec<((u32, u16), f64)>,
}

impl DisplacedPoints {
    fn new(displacement: &Displacement<'_>, refinement: &EdgeRefinement) -> Self {
        let EdgeRefinement { mesh, point_of_vertex, point_count } = refinement;
        let count = *point_count as usize;
        let corners = CornersOfPoints::new(mesh, point_of_vertex, count);
        let mesh_from_world = displacement.world_from_mesh.inverse();
        let normal_from_mesh = mesh_from_world.transpose();
        let mut points = Self {
            group_starts: Vec::with_capacity(count + 1),
            group_of_corner: vec![[0; 3]; mesh.triangles.len()],
            moves: Vec::with_capacity(count),
        };
        let (mut groups, mut sums) = (0, PointSums::default());
        for point in 0..count {
            points.group_starts.push(groups);
            sums.normals.clear();
            sums.vertices.clear();
            for &(triangle, corner) in corners.of_point(point) {
                let (triangle, corner) = (triangle as usize, usize::from(corner));
                let normal = (normal_from_mesh * corner_normal(mesh, triangle, corner)).normalize_or_zero();
                points.group_of_corner[triangle][corner] = groups + sums.group_of(normal);
                sums.add_corner(displacement, mesh, triangle, corner);
            }
            groups += sums.normals.len() as u32;
            points.moves.push(mesh_from_world * (miter(&sums.normals) * sums.mean_height(displacement, mesh)));
        }
        points.group_starts.push(groups);
        points
    }

    /// The refined mesh with moved vertices and new normals. Vertices at sharp edges are duplicated.
    fn move_points(self, displacement: &Displacement<'_>, refinement: EdgeRefinement) -> Mesh {
        let EdgeRefinement { mut mesh, point_of_vertex, .. } = refinement;
        for (vertex, &point) in mesh.vertices.iter_mut().zip(&point_of_vertex) {
            *vertex += self.moves[point as usize];
        }
        let mut sums = vec![DVec3::ZERO; self.group_starts.last().map_or(0, |&count| count as usize)];
        for (triangle, groups) in mesh.triangles.iter().zip(&self.group_of_corner) {
            let [a, b, c] = triangle.map(|vertex| displacement.world_from_mesh * mesh.vertices[vertex as usize]);
            let cross = (b - a).cross(c - a);
            groups.iter().for_each(|&group| sums[group as usize] += cross);
        }
        // Multiplication by the transposed matrix converts normal sums from world directions to mesh directions.
        let to_mesh = displacement.world_from_mesh.transpose() * displacement.world_from_mesh.determinant().signum();
        let normal = |group: u32| (to_mesh * sums[group as usize]).normalize_or_zero().as_vec3().to_array();

        let mut normals = vec![[0.0; 3]; mesh.vertices.len()];
        let mut group_of_vertex = vec![u32::MAX; mesh.vertices.len()];
        let (mut copies, mut originals) = (HashMap::new(), Vec::new());
        for (triangle, groups) in mesh.triangles.iter_mut().zip(&self.group_of_corner) {
            for (vertex, &group) in triangle.iter_mut().zip(groups) {
                let first = &mut group_of_vertex[*vertex as usize];
                if *first == u32::MAX {
                    *first = group;
                    normals[*vertex as usize] = normal(group);
                } else if *first != group {
                    *vertex = *copies.entry((*vertex, group)).or_insert_with(|| {
                        originals.push(*vertex);
                        normals.push(normal(group));
                        normals.len() as u32 - 1
                    });
                }
            }
        }
        mesh.normals = Some(normals);
        copy_vertices(&mut mesh, &originals);
        mesh
    }
}

impl PointSums {
    /// Returns the group of a normal; a new normal is added first.
    fn group_of(&mut self, normal: DVec3) -> u32 {
        let is_same = |other: &DVec3| other.dot(normal) > MAX_SHARP_COSINE || *other == normal;
        let found = self.normals.iter().position(is_same).unwrap_or_else(|| {
            self.normals.push(normal);
            self.normals.len() - 1
        });
        found as u32
    }

    fn add_corner(&mut self, displacement: &Displacement<'_>, mesh: &Mesh, triangle: usize, corner: usize) {
        let slot = mesh.material_slots.as_ref().map_or(0, |slots| slots[triangle]);
        let key = (mesh.triangles[triangle][corner], slot);
        let sides = [corner, (corner + 2) % 3].map(|side| displacement.side_texels(mesh, triangle, side));
        let longest = sides[0].max(sides[1]);
        match self.vertices.iter_mut().find(|(known, _)| *known == key) {
            Some((_, texels)) => *texels = texels.max(longest),
            None => self.vertices.push((key, longest)),
        }
    }

    fn mean_height(&self, displacement: &Displacement<'_>, mesh: &Mesh) -> f64 {
        let heights = self.vertices.iter().map(|&(key, texels)| displacement.height(mesh, key, texels));
        if self.vertices.is_empty() { 0.0 } else { heights.sum::<f64>() / self.vertices.len() as f64 }
    }
}

/// Shading normal of a triangle's corner, or the triangle's normal for a mesh without shading normals; the vector's
/// length is arbitrary.
fn corner_normal(mesh: &Mesh, triangle: usize, corner: usize) -> DVec3 {
    let corners = mesh.triangles[triangle];
    let given =
        mesh.normals.as_ref().map(|normals| DVec3::from_array(normals[corners[corner] as usize].map(f64::from)));
    given.filter(|normal| *normal != DVec3::ZERO).unwrap_or_else(|| {
        let [a, b, c] = corners.map(|vertex| mesh.vertices[vertex as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    })
}

/// The vector whose dot product with each of these unit normals is 1, or as close to 1 as possible; its length is at
/// most [`MAX_MITER`].
fn miter(normals: &[DVec3]) -> DVec3 {
    if let &[normal] = normals {
        return normal;
    }
    // The regularised normal equations are solved with one step of refinement, so that the error is only the square of
    // the regularisation.
    let (mut matrix, mut sum) = (DMat3::from_diagonal(DVec3::splat(1e-5)), DVec3::ZERO);
    for &normal in normals {
        matrix += DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        sum += normal;
    }
    let inverse = matrix.inverse();
    let first = inverse * sum;
    let product: DVec3 = normals.iter().map(|&normal| normal * normal.dot(first)).sum();
    (first + inverse * (sum - product)).clamp_length_max(MAX_MITER)
}

/// Appends copies of vertices with all attributes except normals.
fn copy_vertices(mesh: &mut Mesh, originals: &[u32]) {
    fn append<T: Copy>(values: &mut Vec<T>, originals: &[u32]) {
        values.reserve(originals.len());
        for &vertex in originals {
            values.push(values[vertex as usize]);
        }
    }
    append(&mut mesh.vertices, originals);
    mesh.uvs.iter_mut().chain(&mut mesh.more_uvs).for_each(|uvs| append(uvs, originals));
    mesh.vertex_colors.iter_mut().for_each(|colors| append(colors, originals));
    mesh.vertex_opacities.iter_mut().for_each(|opacities| append(opacities, originals));
}

/// The triangle corners at each distinct point.
struct CornersOfPoints {
    starts: Vec<u32>,
    /// Triangles and their corners 0 to 2.
    corners: Vec<(u32, u8)>,
}

impl CornersOfPoints {
    fn new(mesh: &Mesh, point_of_vertex: &[u32], count: usize) -> Self {
        let mut starts = vec![0u32; count + 1];
        for &vertex in mesh.triangles.as_flattened() {
            starts[point_of_vertex[vertex as usize] as usize + 1] += 1;
        }
        for point in 0..count {
            starts[point + 1] += starts[point];
        }
        let mut next = starts.clone();
        let mut corners = vec![(0, 0); 3 * mesh.triangles.len()];
        for (triangle, vertices) in mesh.triangles.iter().enumerate() {
            for (corner, &vertex) in vertices.iter().enumerate() {
                let place = &mut next[point_of_vertex[vertex as usize] as usize];
                corners[*place as usize] = (triangle as u32, corner as u8);
                *place += 1;
            }
        }
        Self { starts, corners }
    }

    fn of_point(&self, point: usize) -> &[(u32, u8)] {
        &self.corners[self.starts[point] as usize..self.starts[point + 1] as usize]
    }
}
