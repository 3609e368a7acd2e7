//! Optical flow and scene flow: motion of surface points between two viewpoints.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use raycam_bvh::{ExactHit, ExactRay, INVALID_ID};
use raycam_scene::camera::Center;
use rayon::prelude::*;

use crate::annotations::viewpoint::Viewpoint;
use crate::control::Control;
use crate::error::RenderError;
use crate::film::tile::{TILE_SIZE, Tile};
use crate::ground_truth::convert::exact_ray;
use crate::memory::check_memory;
use crate::prepare::world::PreparedWorld;
use crate::thread_pool::with_pool;

/// Minimum distance between an occluder and the point behind it, relative to the point's distance.
const OCCLUSION_TOLERANCE: f64 = 1e-6;

/// Motion of the surface point at each pixel centre of the first viewpoint, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flow {
    /// Image motion to the right and down, in pixels; NaN for the background and for points without an image in the
    /// second camera.
    pub flow: Vec<[f32; 2]>,
    /// World-space motion in metres; NaN for the background.
    pub scene_flow: Vec<[f32; 3]>,
    /// Depth along the second camera's principal axis, in metres; NaN for the background.
    pub depth: Vec<f32>,
    /// True if the point projects into the second image but is occluded.
    pub occluded: Vec<bool>,
    /// True if the point does not project into the second image.
    pub outside: Vec<bool>,
}

/// Computes the motion of the first viewpoint's surface points to the second viewpoint. A point keeps its object,
/// triangle and barycentric coordinates, so the motion of moved and of deformed meshes is computed in the same way. All
/// computations are in float64 along exact centre rays; a ray of the second camera tests occlusion.
///
/// # Errors
/// [`RenderError::World`] if the worlds do not have the same objects with the same numbers of triangles, or if the
/// worlds of the second camera's rows take too much memory; [`RenderError::Cancelled`], and errors of `with_pool`.
pub fn flow(
    first: Viewpoint,
    second: Viewpoint,
    threads: Option<usize>,
    control: &Control,
) -> Result<Flow, RenderError> {
    check(first.world, second.world)?;
    let shutter = first.rolling_shutter();
    let cameras = [&first, &second].map(|view| view.world.geometry.camera_outside(view.camera));
    let [first, second] =
        [(first, &cameras[0]), (second, &cameras[1])].map(|(view, camera)| Viewpoint { camera, ..view });
    let size @ [width, height] = first.camera.size();
    let count = width as usize * height as usize;
    check_memory(|| format!("an optical flow image of {width} x {height} pixels"), count as u64 * 26)?;
    let mut found = Flow {
        flow: vec![[f32::NAN; 2]; count],
        scene_flow: vec![[f32::NAN; 3]; count],
        depth: vec![f32::NAN; count],
        occluded: vec![false; count],
        outside: vec![false; count],
    };
    let shown = with_pool(threads, || SecondView::new(second, control))??;
    let band = width as usize * TILE_SIZE as usize;
    control.start(count.div_ceil(band));
    with_pool(threads, || {
        let Flow { flow, scene_flow, depth, occluded, outside } = &mut found;
        let results = (
            flow.par_chunks_mut(band),
            scene_flow.par_chunks_mut(band),
            depth.par_chunks_mut(band),
            occluded.par_chunks_mut(band),
            outside.par_chunks_mut(band),
        );
        results.into_par_iter().enumerate().try_for_each(|(number, out)| {
            control.check()?;
            let top = number as u32 * TILE_SIZE;
            let rows = TILE_SIZE.min(height - top);
            let (flow, scene_flow, depth, occluded, outside) = out;
            let band = [0, top, width, rows];
            let lines = shutter.as_ref().map(|m| m.rows_of(first.camera, band));
            for [x, y, width, height] in lines.unwrap_or_else(|| vec![band]) {
                let center = first.camera.pixel_center_of(x, y);
                let then = shutter.as_ref().map(|m| m.row_world(first.camera, center, control)).transpose()?;
                let world = then.as_deref().unwrap_or(first.world);
                let seen = Viewpoint { world, ..first };
                for tile in Tile::tiles_of([x, y, width, height]) {
                    for (pixel, moved) in flow_of_tile(seen, &shown, &tile) {
                        let i = ((pixel[1] - top) * size[0] + pixel[0]) as usize;
                        flow[i] = moved.flow;
                        scene_flow[i] = moved.scene_flow;
                        depth[i] = moved.depth;
                        occluded[i] = moved.visibility == Visibility::Occluded;
                        outside[i] = moved.visibility == Visibility::OutOfFrame;
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
    let fail = |message| Err(RenderError::world(message));
    let (a, b) = (first.geometry.instances.len(), second.geometry.instances.len());
    if a != b {
        return fail(format!(
            "flow requires the same objects in both worlds; objects in the first: {a}, in the second: {b}"
        ));
    }
    for (i, (a, b)) in first.geometry.instances.iter().zip(&second.geometry.instances).enumerate() {
        let [a, b] = [a, b].map(|object| object.mesh.mesh.triangles.len());
        if a != b {
            return fail(format!(
                "flow requires the same triangles in both worlds; object {i} has {a} triangles in the first \
                 and {b} in the second"
            ));
        }
    }
    Ok(())
}

/// Visibility of a point in the second viewpoint.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Visibility {
    Visible,
    Occluded,
    OutOfFrame,
}

/// Surface point of the first viewpoint, as it appears in the second viewpoint.
struct FlowSample {
    flow: [f32; 2],
    scene_flow: [f32; 3],
    depth: f32,
    visibility: Visibility,
}

/// Second viewpoint, with the worlds at the times of its rows.
struct SecondView<'a> {
    view: Viewpoint<'a>,
    /// World of each row if the rows are exposed at different times; otherwise empty.
    row_worlds: Vec<Arc<PreparedWorld>>,
}

impl<'a> SecondView<'a> {
    fn new(view: Viewpoint<'a>, control: &Control) -> Result<Self, RenderError> {
        let lines = match view.rolling_shutter() {
            Some(shutter) => shutter.all_row_worlds(view.camera, control)?,
            None => vec![],
        };
        Ok(Self { view, row_worlds: lines })
    }

    /// World-space position of a point on a triangle in the second camera's world, its position in the image, and true
    /// if the camera can project it.
    fn project(&self, hit: &ExactHit) -> (DVec3, DVec2, bool) {
        let camera = self.view.camera;
        let Some(last) = self.row_worlds.len().checked_sub(1) else {
            let point = point_in(self.view.world, hit);
            let (pixel, sees) = camera.project(point);
            return (point, pixel, sees);
        };
        // The point's position is interpolated linearly in time, between the middles of the exposures of two
        // rows.
        let at = |line: f64| {
            let line = line * self.row_worlds.len() as f64 - 0.5;
            let before = (line.max(0.0) as usize).min(last.saturating_sub(1));
            let [a, b] = [before, last.min(before + 1)].map(|i| point_in(&self.row_worlds[i], hit));
            a.lerp(b, line - before as f64)
        };
        let (pixel, sees) = camera.project_moving(at);
        (at(camera.line_fraction(pixel)), pixel, sees)
    }

    /// The world at the time at which a pixel of the second camera is exposed.
    fn world(&self, pixel: DVec2) -> &PreparedWorld {
        let line = self.view.camera.line_fraction(pixel) * self.row_worlds.len() as f64;
        let last = self.row_worlds.len().saturating_sub(1);
        let then = self.row_worlds.get((line as usize).min(last));
        then.map_or(self.view.world, |world| world)
    }
}

/// Position in `world` of a surface point that was hit in another world.
fn point_in(world: &PreparedWorld, hit: &ExactHit) -> DVec3 {
    let [a, b, c] = world.geometry.corners(hit.instance, hit.triangle);
    a + (b - a) * hit.u + (c - a) * hit.v
}

/// Ray of the second camera to a point that projects into the second image.
struct OcclusionRay<'a> {
    world: &'a PreparedWorld,
    ray: ExactRay,
    distance: f64,
    /// Index of the point among the tile's flow samples, and the point's hit in the first viewpoint.
    sample: usize,
    hit: ExactHit,
}

/// Computes the optical flow of all pixels of a tile that show a surface.
fn flow_of_tile(first: Viewpoint, second: &SecondView, tile: &Tile) -> Vec<([u32; 2], FlowSample)> {
    let mut pixels = vec![];
    tile.pixels(&mut pixels);
    let camera = first.camera;
    let centers = pixels.iter().map(|&[x, y]| camera.pixel_center_of(x, y));
    let mut rays: Vec<ExactRay> = Vec::with_capacity(pixels.len());
    camera.rays(centers, |ray| rays.push(exact_ray(ray)));
    let mut hits = vec![ExactHit::MISS; rays.len()];
    first.world.geometry.closest_visible(&rays, &mut hits);

    let camera = second.view.camera;
    let size = camera.size().map(f64::from);
    let edge = 0.5 - camera.pixel_center().offset();
    let (mut moved, mut back) = (vec![], vec![]);
    for ((&[x, y], ray), &hit) in pixels.iter().zip(&rays).zip(&hits) {
        if hit.instance == INVALID_ID {
            continue;
        }
        let before = DVec3::from(ray.origin) + hit.t * DVec3::from(ray.direction);
        let (after, pixel, sees) = second.project(&hit);
        let from = first.camera.pixel_center_of(x, y) - first.camera.pixel_center().offset();
        let to = pixel - camera.pixel_center().offset();
        let inside =
            sees && (-edge <= pixel.x && pixel.x < size[0] - edge) && (-edge <= pixel.y && pixel.y < size[1] - edge);
        if inside {
            let world = second.world(pixel);
            let (origin, direction) = camera.ray(pixel);
            // With a rolling shutter, the ray is aimed at the point's position in the row's world, which
            // differs slightly from the interpolated position.
            let way = point_in(world, &hit) - origin;
            let direction = match second.row_worlds.is_empty() || camera.center() != Center::Point {
                true => direction,
                false => way.normalize(),
            };
            back.push(OcclusionRay {
                world,
                ray: exact_ray((origin, direction)),
                distance: way.dot(direction),
                sample: moved.len(),
                hit,
            });
        }
        let flow = if sees { to - from } else { DVec2::NAN };
        moved.push((
            [x, y],
            FlowSample {
                flow: flow.as_vec2().to_array(),
                scene_flow: (after - before).as_vec3().to_array(),
                depth: camera.depth_at(pixel, after) as f32,
                visibility: if inside { Visibility::Visible } else { Visibility::OutOfFrame },
            },
        ));
    }
    for same in back.chunk_by(|a, b| std::ptr::eq(a.world, b.world)) {
        let rays: Vec<ExactRay> = same.iter().map(|back| back.ray).collect();
        let mut hits = vec![ExactHit::MISS; rays.len()];
        let world = same[0].world;
        world.geometry.closest_visible(&rays, &mut hits);
        for (there, back) in hits.iter().zip(same) {
            let itself = (there.instance, there.triangle) == (back.hit.instance, back.hit.triangle);
            if there.t < back.distance * (1.0 - OCCLUSION_TOLERANCE) && !itself {
                moved[back.sample].1.visibility = Visibility::Occluded;
            }
        }
    }
    moved
}
