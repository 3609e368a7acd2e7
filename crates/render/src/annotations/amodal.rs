//! Amodal masks: the pixels that an object would cover if no other object occluded it.

use glam::{DMat3, DVec2, DVec3};
use raycam_bvh::{ExactHit, ExactRay, ExactTriangles, INVALID_ID, Scene};
use raycam_scene::{Camera, counted};
use rayon::prelude::*;

use crate::annotations::viewpoint::Viewpoint;
use crate::control::Control;
use crate::error::RenderError;
use crate::film::output_plane::MAX_FRAME_BYTES;
use crate::film::tile::{TILE_SIZE, Tile};
use crate::ground_truth::convert::exact_ray;
use crate::prepare::world::PreparedWorld;
use crate::thread_pool::with_pool;

/// Amodal mask of one object: all pixels that it would cover if nothing occluded it.
#[derive(Clone, Debug, PartialEq)]
pub struct AmodalMask {
    /// Index of the object.
    pub object: usize,
    /// First column and row (negative within the margin), width and height of the bounding box.
    pub region: [i32; 4],
    /// True where the exact centre ray hits the object: `height * width`, row by row.
    pub mask: Vec<bool>,
}

/// Amodal masks of the `objects` that cover any pixel centre, in the given order.
///
/// The image is extended by `margin[0]` columns on the left and on the right and by `margin[1]` rows above
/// and below, so that objects that cross the image border are complete. With a rolling shutter, each row
/// shows the world at its own time.
///
/// # Errors
///
/// [`RenderError::Settings`] for a missing object, [`RenderError::TooLarge`] if the extended image is too
/// large, [`RenderError::Cancelled`], and errors of `with_pool`.
pub fn amodal_masks(
    view: Viewpoint,
    objects: &[usize],
    margin: [u32; 2],
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<AmodalMask>, RenderError> {
    let world = view.world;
    let count = world.geometry.instances.len();
    if let Some(object) = objects.iter().find(|&&object| object >= count) {
        return Err(RenderError::settings(format!(
            "object {object} does not exist; the world has {}",
            counted(count, "object")
        )));
    }
    let camera = &world.geometry.camera_outside(view.camera);
    let canvas = [0, 1].map(|axis| u64::from(camera.size()[axis]) + 2 * u64::from(margin[axis]));
    let [Ok(width), Ok(height)] = canvas.map(i32::try_from) else {
        return Err(too_large(canvas));
    };
    if canvas[0] * canvas[1] > MAX_FRAME_BYTES {
        return Err(too_large(canvas));
    }
    let shutter = view.rolling_shutter();
    let whole = [0, 0, width as u32, height as u32];
    let lines = shutter.as_ref().map(|m| m.rows_of(camera, whole));
    let regions = lines.unwrap_or_else(|| vec![whole]);
    let tiles = |region: &[u32; 4]| Tile::tiles_of(*region);
    control.start(regions.iter().map(|region| tiles(region).len()).sum());
    let covered = with_pool(threads, || {
        let of_region = |region: &[u32; 4]| {
            let pixel = canvas_pixel(camera, margin, region[0].into(), region[1].into());
            let then = shutter.as_ref().map(|m| m.row_world(camera, pixel, control));
            let then = then.transpose()?;
            let world = then.as_deref().unwrap_or(world);
            let alone: Vec<IsolatedObject> =
                objects.par_iter().map(|&object| IsolatedObject::new(world, object)).collect::<Result<_, _>>()?;
            tiles(region)
                .into_par_iter()
                .map(|tile| {
                    control.check()?;
                    let covered = rasterize_tile(&tile, camera, margin, &alone);
                    control.advance();
                    Ok((tile, covered))
                })
                .collect::<Result<Vec<_>, RenderError>>()
        };
        regions.par_iter().map(of_region).collect::<Result<Vec<_>, _>>()
    })??;
    let mut patches: Vec<Vec<(Tile, TileBits)>> = vec![vec![]; objects.len()];
    for (tile, covered) in covered.into_iter().flatten() {
        for (i, rows) in covered {
            patches[i].push((tile, rows));
        }
    }
    let silhouette = |(&object, patches): (&usize, Vec<_>)| merge_tiles(object, &patches, margin);
    Ok(objects.iter().zip(patches).filter_map(silhouette).collect())
}

/// Image coordinates of a pixel of the extended image.
fn canvas_pixel(camera: &Camera, margin: [u32; 2], x: f64, y: f64) -> DVec2 {
    let shift = DVec2::new(margin[0].into(), margin[1].into());
    DVec2::new(x, y) - shift + camera.pixel_center().offset()
}

fn too_large([width, height]: [u64; 2]) -> RenderError {
    RenderError::TooLarge {
        what: format!("an image of {width} x {height} pixels, margin included"),
        bytes: width.saturating_mul(height),
        limit: MAX_FRAME_BYTES,
    }
}

/// Mask of a tile's pixels: bit x of word y is the pixel in column x and row y.
type TileBits = [u32; TILE_SIZE as usize];

/// Scene that contains only one object.
struct IsolatedObject<'a> {
    world: &'a PreparedWorld,
    object: u32,
    scene: Scene,
    /// Bounding sphere of the object, in world coordinates.
    center: DVec3,
    radius: f64,
    /// Bounding box of the object, in mesh coordinates.
    lower: DVec3,
    upper: DVec3,
    mesh_from_world: DMat3,
    translation: DVec3,
}

impl ExactTriangles for IsolatedObject<'_> {
    fn corners(&self, _instance: u32, triangle: u32) -> [[f64; 3]; 3] {
        let corners = self.world.geometry.corners(self.object, triangle);
        corners.map(|corner| corner.to_array())
    }
}

impl<'a> IsolatedObject<'a> {
    fn new(world: &'a PreparedWorld, object: usize) -> Result<Self, RenderError> {
        let placed = &world.geometry.instances[object];
        let instance = placed.bvh_instance(world.geometry.origin);
        let scene = Scene::build(vec![instance], world.geometry.origin.to_array())
            .map_err(|error| RenderError::world(error.to_string()))?;
        let [lower, upper] = [placed.mesh.lower, placed.mesh.upper];
        let center = placed.world_from_mesh.transform_point3(lower + (upper - lower) / 2.0);
        let corner = |i: u32| {
            let pick = |axis: usize| [lower, upper][(i >> axis & 1) as usize][axis];
            let corner = DVec3::new(pick(0), pick(1), pick(2));
            placed.world_from_mesh.transform_point3(corner)
        };
        let radius = (0..8).map(|i| corner(i).distance(center)).fold(0.0, f64::max);
        Ok(Self {
            world,
            object: object as u32,
            scene,
            center,
            radius,
            lower,
            upper,
            mesh_from_world: placed.world_from_mesh.matrix3.inverse(),
            translation: placed.world_from_mesh.translation,
        })
    }

    /// False only if a ray with a unit direction misses the bounding sphere or the bounding box. Most rays of a tile
    /// miss one of them and skip the traversal.
    fn may_intersect(&self, ray: &ExactRay) -> bool {
        let [origin, direction] = [ray.origin, ray.direction].map(DVec3::from);
        let to_center = self.center - origin;
        let radius = self.radius + BOX_PADDING * (self.radius + to_center.length());
        if to_center.cross(direction).length_squared() > radius * radius {
            return false;
        }
        let origin = self.mesh_from_world * (origin - self.translation);
        let direction = self.mesh_from_world * direction;
        let slack = BOX_PADDING * ((self.upper - self.lower).length() + origin.length());
        let to_lower = (self.lower - slack - origin) / direction;
        let to_upper = (self.upper + slack - origin) / direction;
        let (enter, leave) = (to_lower.min(to_upper), to_lower.max(to_upper));
        // Comparisons with NaN are false, so rays with unknown directions are traced.
        !(enter.max_element() > leave.min_element() || leave.min_element() < 0.0)
    }
}

/// Pixels of a tile that each object covers; objects that cover no pixel are omitted.
fn rasterize_tile(tile: &Tile, camera: &Camera, margin: [u32; 2], alone: &[IsolatedObject]) -> Vec<(usize, TileBits)> {
    let ray = |x: f64, y: f64| camera.ray(canvas_pixel(camera, margin, x, y));
    let cone = TileCone::enclosing(tile, ray);
    let near: Vec<usize> = (0..alone.len()).filter(|&i| cone.may_intersect(alone[i].center, alone[i].radius)).collect();
    if near.is_empty() {
        return vec![];
    }
    let mut pixels = vec![];
    tile.pixels(&mut pixels);
    let centers = pixels.iter().map(|&[x, y]| canvas_pixel(camera, margin, x.into(), y.into()));
    let mut rays: Vec<ExactRay> = Vec::with_capacity(pixels.len());
    camera.rays(centers, |ray| rays.push(exact_ray(ray)));
    let mut covered = vec![];
    for i in near {
        let (pixels, rays): (Vec<_>, Vec<_>) = pixels
            .iter()
            .zip(&rays)
            .filter(|(_, ray)| alone[i].may_intersect(ray))
            .map(|(pixel, ray)| (*pixel, *ray))
            .unzip();
        let mut hits = vec![ExactHit::MISS; rays.len()];
        alone[i].scene.closest_exact(&rays, &alone[i], &mut hits);
        let mut rows = [0; TILE_SIZE as usize];
        for ([x, y], hit) in pixels.iter().zip(&hits) {
            rows[(y - tile.y) as usize] |= u32::from(hit.instance != INVALID_ID) << (x - tile.x);
        }
        if rows != [0; TILE_SIZE as usize] {
            covered.push((i, rows));
        }
    }
    covered
}

/// Cone of a tile's rays: directions within an angle of an axis, origins within a distance of a point.
struct TileCone {
    origin: DVec3,
    axis: DVec3,
    angle: f64,
    width: f64,
}

/// Padding of bounding spheres and boxes for rounding errors, relative to the sum of their size and distance.
const BOX_PADDING: f64 = 1e-6;
/// Factor on the spread of nine rays of a tile. The cone then also contains the rays between these nine, even
/// if the lens distorts them.
const LENS_MARGIN: f64 = 1.5;

impl TileCone {
    /// Computes the cone of a tile's rays from nine of these rays.
    fn enclosing(tile: &Tile, ray: impl Fn(f64, f64) -> (DVec3, DVec3)) -> TileCone {
        let thirds = |start: u32, length: u32| {
            let (start, end) = (f64::from(start), f64::from(start + length - 1));
            [start, (start + end) / 2.0, end]
        };
        let (columns, rows) = (thirds(tile.x, tile.width), thirds(tile.y, tile.height));
        let rays: Vec<_> =
            rows.iter().flat_map(|&y| columns.iter().map(move |&x| (x, y))).map(|(x, y)| ray(x, y)).collect();
        let count = rays.len() as f64;
        let origin = rays.iter().map(|ray| ray.0).sum::<DVec3>() / count;
        let axis = rays.iter().map(|ray| ray.1).sum::<DVec3>().normalize_or_zero();
        // If any ray is NaN, the angle is NaN too, and the tile is not culled.
        let widest = |a: f64, b: f64| if a >= b { a } else { b };
        let angle = rays.iter().map(|ray| ray.1.angle_between(axis)).fold(0.0, widest);
        let width = rays.iter().map(|ray| ray.0.distance(origin)).fold(0.0, widest);
        let known = axis != DVec3::ZERO && rays.iter().all(|(o, d)| o.is_finite() && d.is_finite());
        TileCone {
            origin,
            axis,
            angle: if known { LENS_MARGIN * angle + 1e-6 } else { f64::NAN },
            width: LENS_MARGIN * width,
        }
    }

    /// False only if every ray of the tile misses the sphere.
    fn may_intersect(&self, center: DVec3, radius: f64) -> bool {
        let to_center = center - self.origin;
        let radius = (radius + self.width) * (1.0 + 1e-6);
        let distance = to_center.length();
        if distance <= radius || self.angle.is_nan() {
            return true;
        }
        to_center.angle_between(self.axis) <= self.angle + (radius / distance).asin() + 1e-6
    }
}

/// Merges an object's tiles into one mask.
fn merge_tiles(object: usize, patches: &[(Tile, TileBits)], margin: [u32; 2]) -> Option<AmodalMask> {
    let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
    for (tile, rows) in patches {
        let all = rows.iter().fold(0, |all, row| all | row);
        let first = rows.iter().position(|&row| row != 0)? as u32;
        let last = rows.iter().rposition(|&row| row != 0)? as u32;
        let left = tile.x + all.trailing_zeros();
        let right = tile.x + 31 - all.leading_zeros();
        low = [low[0].min(left), low[1].min(tile.y + first)];
        high = [high[0].max(right), high[1].max(tile.y + last)];
    }
    if low[0] > high[0] {
        return None;
    }
    let [width, height] = [0, 1].map(|axis| (high[axis] - low[axis] + 1) as usize);
    let mut mask = vec![false; width * height];
    for (tile, rows) in patches {
        for (y, &row) in rows.iter().enumerate() {
            let mut row = row;
            while row != 0 {
                let x = tile.x + row.trailing_zeros() - low[0];
                row &= row - 1;
                mask[(tile.y as usize + y - low[1] as usize) * width + x as usize] = true;
            }
        }
    }
    // The coordinates of the extended image fit into int32.
    let [x, y] = [0, 1].map(|axis| low[axis] as i32 - margin[axis] as i32);
    Some(AmodalMask { object, region: [x, y, width as i32, height as i32], mask })
}
