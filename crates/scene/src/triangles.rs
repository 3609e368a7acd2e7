//! A world as a plain list of triangles in the order of (instance, triangle), for callers that trace rays themselves.

use crate::color::Rgb;
use crate::mesh::Mesh;
use crate::world::{Object, World};

/// Number of triangles of one object, or of all visible objects.
pub fn count(world: &World, object: Option<usize>) -> usize {
    let of_object = |object: &Object| world.meshes[object.mesh].triangles.len();
    match object {
        Some(object) => world.objects.get(object).map_or(0, of_object),
        None => world.objects.iter().filter(|object| object.visible).map(of_object).sum(),
    }
}

/// Corner positions in the world of each triangle, of one object or of all visible objects.
pub fn corners(world: &World, object: Option<usize>) -> Vec<[[f64; 3]; 3]> {
    let of_object = |object: &Object, mesh: &Mesh| {
        let placed: Vec<_> =
            mesh.vertices.iter().map(|&vertex| object.world_from_mesh.transform_point3(vertex).to_array()).collect();
        let corners = |triangle: &[u32; 3]| triangle.map(|i| placed[i as usize]);
        mesh.triangles.iter().map(corners).collect()
    };
    match object {
        Some(object) => flat_map_objects(world, world.objects.get(object).into_iter(), of_object),
        None => flat_map_objects(world, visible(world), of_object),
    }
}

/// Indices (instance, triangle) of each triangle of all visible objects.
pub fn ids(world: &World) -> Vec<[i32; 2]> {
    let count = |object: &Object| world.meshes[object.mesh].triangles.len();
    let ids = world
        .objects
        .iter()
        .enumerate()
        .filter(|(_, object)| object.visible)
        .flat_map(|(instance, object)| (0..count(object)).map(move |triangle| [instance as i32, triangle as i32]));
    ids.collect()
}

/// One linear base colour per triangle: the product of the material's colour, the face's colour, the mean of the
/// corners' colours, and the texture at the triangle's centre.
pub fn colors(world: &World) -> Vec<Rgb> {
    let times = |a: Rgb, b: Rgb| [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
    flat_map_objects(world, visible(world), |object, mesh| {
        let color = |(t, corners): (usize, &[u32; 3])| {
            let slot = mesh.material_slots.as_ref().map_or(0, |slots| usize::from(slots[t]));
            let material = &world.materials[object.materials[slot]];
            let mut rgb = material.color;
            if let Some(colors) = &mesh.face_colors {
                rgb = times(rgb, colors[t]);
            }
            if let Some(colors) = &mesh.vertex_colors {
                rgb = times(rgb, mean(corners.map(|i| colors[i as usize])));
            }
            if let Some(slot) = &material.texture
                && let Some(uvs) = mesh.uv_set(slot.uv_set)
            {
                let uv = slot.coordinates(mean(corners.map(|i| uvs[i as usize])));
                let [r, g, b, _] = world.textures[slot.texture].lookup(uv);
                rgb = times(rgb, [r, g, b]);
            }
            rgb
        };
        mesh.triangles.iter().enumerate().map(color).collect()
    })
}

/// The concatenated results of `f` for each of these objects.
fn flat_map_objects<'a, T>(
    world: &World,
    objects: impl Iterator<Item = &'a Object>,
    f: impl Fn(&Object, &Mesh) -> Vec<T>,
) -> Vec<T> {
    objects.flat_map(|object| f(object, &world.meshes[object.mesh])).collect()
}

fn visible(world: &World) -> impl Iterator<Item = &Object> {
    world.objects.iter().filter(|object| object.visible)
}

fn mean<const N: usize>([a, b, c]: [[f32; N]; 3]) -> [f32; N] {
    std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0)
}
