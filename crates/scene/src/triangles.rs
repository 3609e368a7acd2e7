//! A world as a plain list of triangles in the order of (instance, triangle), for callers that trace rays themselves.

use crate::color::Rgb;
use crate::world::{Object, World};

/// Number of triangles of one object, or of all visible objects.
pub fn count(world: &World, object: Option<usize>) -> usize {
    let of_object = |object: &Object| world.meshes[object.mesh].triangles.len();
    match object {
        Some(object) => world.objects.get(object).map_or(0, of_object),
        None => world.objects.iter().filter(|object| object.visible).map(of_object).sum(),
    }
}

/// Memory in bytes that [`corners`] requires, including the largest mesh's vertices in the world.
pub fn corner_bytes(world: &World, object: Option<usize>) -> usize {
    let vertices = |object: &Object| world.meshes[object.mesh].vertices.len();
    let most = match object {
        Some(object) => world.objects.get(object).map_or(0, vertices),
        None => visible(world).map(vertices).max().unwrap_or(0),
    };
    count(world, object) * size_of::<[[f64; 3]; 3]>() + most * size_of::<[f64; 3]>()
}

/// Corner positions in the world of each triangle, of one object or of all visible objects.
pub fn corners(world: &World, object: Option<usize>) -> Vec<[[f64; 3]; 3]> {
    let mut found = Vec::with_capacity(count(world, object));
    let mut add = |object: &Object| {
        let mesh = &world.meshes[object.mesh];
        let placed: Vec<_> =
            mesh.vertices.iter().map(|&vertex| object.world_from_mesh.transform_point3(vertex).to_array()).collect();
        found.extend(mesh.triangles.iter().map(|triangle| triangle.map(|i| placed[i as usize])));
    };
    match object {
        Some(object) => world.objects.get(object).into_iter().for_each(&mut add),
        None => visible(world).for_each(&mut add),
    }
    found
}

/// Indices (instance, triangle) of each triangle of all visible objects.
pub fn ids(world: &World) -> Vec<[i32; 2]> {
    let of_object = |object: &Object| world.meshes[object.mesh].triangles.len();
    let mut found = Vec::with_capacity(count(world, None));
    for (instance, object) in world.objects.iter().enumerate().filter(|(_, object)| object.visible) {
        found.extend((0..of_object(object)).map(|triangle| [instance as i32, triangle as i32]));
    }
    found
}

/// One linear base colour per triangle: the product of the material's colour, the face's colour, the mean of the
/// corners' colours, and the texture at the triangle's centre.
pub fn colors(world: &World) -> Vec<Rgb> {
    let times = |a: Rgb, b: Rgb| [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
    let mut found = Vec::with_capacity(count(world, None));
    for object in visible(world) {
        let mesh = &world.meshes[object.mesh];
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
        found.extend(mesh.triangles.iter().enumerate().map(color));
    }
    found
}

fn visible(world: &World) -> impl Iterator<Item = &Object> {
    world.objects.iter().filter(|object| object.visible)
}

fn mean<const N: usize>([a, b, c]: [[f32; N]; 3]) -> [f32; N] {
    std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0)
}
