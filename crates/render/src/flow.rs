//! Optical flow and scene flow: where what a camera sees is in another world, and where another camera sees it there.

use glam::DVec3;
use raycam_bvh::{ExactHit, ExactRay, NOTHING};
use raycam_scene::{Camera, World};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::moments::Moments;
use crate::prepare::PreparedWorld;
use crate::threads::with_pool;
use crate::tile::{TILE, Tile};
use crate::truth::exact_ray;

/// What lies nearer to the second camera by this share of the distance hides a point.
const IN_FRONT: f64 = 1e-6;

/// A world and a camera that sees it.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The world; of one that moves on while the shutter is open, as it stands in the middle of that.
    pub world: &'a PreparedWorld,
    /// The same as it is described, which says how it moves on; none for a world that stands.
    pub moving: Option<&'a World>,
    /// The camera.
    pub camera: &'a Camera,
}

impl<'a> View<'a> {
    /// The times at which its lines see the world, where these differ.
    pub(crate) fn moments(&self) -> Option<Moments<'a>> {
        Moments::new(self.moving?, self.world, self.camera).filter(Moments::is_rolling)
    }
}

/// For each pixel of the first view, row by row, the surface point at its centre, followed to the second view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flow {
    /// How far its image moves right and down, in pixels; NaN where the first view shows the background, and where the
    /// second camera has no image of the point.
    pub flow: Vec<[f32; 2]>,
    /// How far the point moves in the world, in metres; NaN for the background.
    pub scene_flow: Vec<[f32; 3]>,
    /// Its z along the second camera's principal axis, in metres; NaN for the background.
    pub depth: Vec<f32>,
    /// Whether the second camera has it inside of its picture, but something hides it.
    pub occluded: Vec<bool>,
    /// Whether it is not inside of the second picture.
    pub outside: Vec<bool>,
}

/// Follows what the first view shows to the second. Points keep their object, triangle and barycentric coordinates, so
/// that moved and deformed meshes are followed alike. All in float64 at the exact pixel-centre ray; a ray of the second
/// camera finds what hides a point.
///
/// # Errors
/// [`RenderError::World`] where the worlds do not have the same objects with as many triangles, and where the second one
/// moves on while its camera reads one line after the other: where a point is seen would depend on where it is seen.
/// [`RenderError::Cancelled`], and those of [`with_pool`].
pub fn flow(
    first: View,
    second: View,
    threads: Option<usize>,
    control: &Control,
) -> Result<Flow, RenderError> {
    check(first.world, second.world)?;
    if second.moments().is_some() {
        return Err(RenderError::World(
            "the second camera reads line after line while the world moves: where a point is seen depends on when, and \
             when on where. Follow to a camera without a readout, or to a world that stands"
                .into(),
        ));
    }
    let moments = first.moments();
    let cameras = [&first, &second].map(|view| view.world.before(view.camera));
    let [first, second] =
        [(first, &cameras[0]), (second, &cameras[1])].map(|(view, camera)| View { camera, ..view });
    let size @ [width, height] = first.camera.size();
    let count = width as usize * height as usize;
    let mut found = Flow {
        flow: vec![[f32::NAN; 2]; count],
        scene_flow: vec![[f32::NAN; 3]; count],
        depth: vec![f32::NAN; count],
        occluded: vec![false; count],
        outside: vec![false; count],
    };
    let band = width as usize * TILE as usize;
    control.start(count.div_ceil(band));
    with_pool(threads, || {
        let Flow {
            flow,
            scene_flow,
            depth,
            occluded,
            outside,
        } = &mut found;
        let results = (
            flow.par_chunks_mut(band),
            scene_flow.par_chunks_mut(band),
            depth.par_chunks_mut(band),
            occluded.par_chunks_mut(band),
            outside.par_chunks_mut(band),
        );
        results
            .into_par_iter()
            .enumerate()
            .try_for_each(|(number, out)| {
                control.check()?;
                let top = number as u32 * TILE;
                let rows = TILE.min(height - top);
                let (flow, scene_flow, depth, occluded, outside) = out;
                let band = [0, top, width, rows];
                let lines = moments.as_ref().map(|m| m.lines(first.camera, band));
                for [x, y, width, height] in lines.unwrap_or_else(|| vec![band]) {
                    let center = first.camera.pixel_center_of(x, y);
                    let then = moments
                        .as_ref()
                        .map(|m| m.at_line(first.camera, center, control))
                        .transpose()?;
                    let world = then.as_deref().unwrap_or(first.world);
                    let seen = View { world, ..first };
                    for tile in Tile::of_region([x, y, width, height]) {
                        for (pixel, moved) in follow(seen, second, &tile) {
                            let i = ((pixel[1] - top) * size[0] + pixel[0]) as usize;
                            flow[i] = moved.flow;
                            scene_flow[i] = moved.scene_flow;
                            depth[i] = moved.depth;
                            occluded[i] = moved.seen == Seen::Hidden;
                            outside[i] = moved.seen == Seen::Outside;
                        }
                    }
                }
                control.advance();
                Ok::<(), RenderError>(())
            })
    })??;
    Ok(found)
}

fn check(first: &PreparedWorld, second: &PreparedWorld) -> Result<(), RenderError> {
    let fail = |message| Err(RenderError::World(message));
    let (a, b) = (first.objects.len(), second.objects.len());
    if a != b {
        return fail(format!(
            "the first world has {a} objects, the second {b}: flow follows the same objects from one to the other"
        ));
    }
    for (i, (a, b)) in first.objects.iter().zip(&second.objects).enumerate() {
        let [a, b] = [a, b].map(|object| object.mesh.mesh.triangles.len());
        if a != b {
            return fail(format!(
                "object {i} has {a} triangles in the first world and {b} in the second: flow follows the same triangles"
            ));
        }
    }
    Ok(())
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Seen {
    Yes,
    Hidden,
    Outside,
}

/// A surface point in the second view.
struct Moved {
    flow: [f32; 2],
    scene_flow: [f32; 3],
    depth: f32,
    seen: Seen,
}

/// The pixels of a tile that show something, followed.
fn follow(first: View, second: View, tile: &Tile) -> Vec<([u32; 2], Moved)> {
    let mut pixels = vec![];
    tile.pixels(&mut pixels);
    let rays: Vec<ExactRay> = pixels
        .iter()
        .map(|&[x, y]| exact_ray(first.camera.ray(first.camera.pixel_center_of(x, y))))
        .collect();
    let mut hits = vec![ExactHit::MISS; rays.len()];
    first
        .world
        .scene
        .closest_exact(&rays, first.world, &mut hits);

    let size = second.camera.size().map(f64::from);
    let edge = 0.5 - second.camera.pixel_center().offset();
    let mut moved = vec![];
    // Rays of the second camera through the points that lie inside of its picture.
    let (mut back, mut distances, mut whose) = (vec![], vec![], vec![]);
    for ((&[x, y], ray), hit) in pixels.iter().zip(&rays).zip(&hits) {
        if hit.instance == NOTHING {
            continue;
        }
        let before = DVec3::from(ray.origin) + hit.t * DVec3::from(ray.direction);
        let [a, b, c] = second.world.corners(hit.instance, hit.triangle);
        let after = a + (b - a) * hit.u + (c - a) * hit.v;
        let from = first.camera.pixel_center_of(x, y) - first.camera.pixel_center().offset();
        let (pixel, sees) = second.camera.project(after);
        let to = pixel - second.camera.pixel_center().offset();
        let inside = sees
            && (-edge <= pixel.x && pixel.x < size[0] - edge)
            && (-edge <= pixel.y && pixel.y < size[1] - edge);
        if inside {
            let (origin, direction) = second.camera.ray(pixel);
            distances.push((after - origin).dot(direction));
            back.push(exact_ray((origin, direction)));
            whose.push((moved.len(), hit.instance, hit.triangle));
        }
        let flow = if sees { to - from } else { glam::DVec2::NAN };
        moved.push((
            [x, y],
            Moved {
                flow: flow.as_vec2().to_array(),
                scene_flow: (after - before).as_vec3().to_array(),
                depth: second.camera.depth_at(pixel, after) as f32,
                seen: if inside { Seen::Yes } else { Seen::Outside },
            },
        ));
    }
    let mut hits = vec![ExactHit::MISS; back.len()];
    second
        .world
        .scene
        .closest_exact(&back, second.world, &mut hits);
    for ((hit, distance), (i, instance, triangle)) in hits.iter().zip(distances).zip(whose) {
        let itself = (hit.instance, hit.triangle) == (instance, triangle);
        if hit.t < distance * (1.0 - IN_FRONT) && !itself {
            moved[i].1.seen = Seen::Hidden;
        }
    }
    moved
}
