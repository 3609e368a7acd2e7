//! World states over a camera's shutter.
//!
//! The exposure is divided into many equal time slices. A sample shows the world at the middle of one slice.
//! The number of slices depends on the motion of objects in the image (see [`SliceCount`]). With a rolling
//! shutter, there are [`MAX_SLICES`] slices if the world has few objects and all of them are rigid. Ground
//! truth shows the world at the exact middle of each row's exposure.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use glam::DVec2;
use raycam_scene::camera::{ReadoutDirection, ShutterMotion};
use raycam_scene::world::WorldTime;
use raycam_scene::{Camera, Mesh, Notice, NoticeCode, World};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::motion::slice_count::SliceCount;
use crate::prepare::world::PreparedWorld;

/// Maximum number of slices between the opening of the first row and the closing of the last row, for few rigid objects
/// and for all other worlds.
const MAX_SLICES: usize = 1024;
const MAX_SLICES_OF_MANY: usize = 256;
/// Maximum number of objects in a world that gets up to [`MAX_SLICES`] slices.
const FINE_MAX_OBJECTS: usize = 128;
/// Maximum memory of the worlds of all rows of an image, in bytes.
const ROW_WORLDS_MAX_BYTES: usize = 2 << 30;
/// Approximate memory in bytes of an object in a row's world, and of a deforming mesh's vertices, its triangles and
/// their BVH.
const OBJECT_BYTES: usize = 1024;
const VERTEX_BYTES: usize = 128;
const TRIANGLE_BYTES: usize = 128;

/// States of a moving world while a shutter is open.
pub(crate) struct ShutterSlices<'a> {
    world: &'a World,
    /// World at the middle of the shutter's time.
    reference: &'a PreparedWorld,
    clock: WorldTime,
    /// Time from the opening of the first row until the closing of the last row, in seconds.
    duration: f64,
    /// Time between the middles of the first and the last row's exposures; 0 for a global shutter.
    readout: f64,
    count: SliceCount,
    slices: Vec<OnceLock<Arc<PreparedWorld>>>,
}

/// Worlds of a tile's rows by their time (the bits of the seconds), kept for the next tile, which usually has the same
/// rows.
pub(crate) type RowWorlds = HashMap<u64, Arc<PreparedWorld>>;

impl<'a> ShutterSlices<'a> {
    /// Slices for a camera with a shutter and a moving world with a time; otherwise `None`.
    pub fn new(world: &'a World, still: &'a PreparedWorld, camera: &Camera) -> Option<Self> {
        let (motion, clock) = (camera.motion()?, world.time?);
        let readout = motion.readout();
        let few = world.node_tree.is_none() && world.objects.len() <= FINE_MAX_OBJECTS;
        let duration = motion.total_duration();
        if duration <= 0.0 || !world.is_animated() {
            return None;
        }
        let max = if few { MAX_SLICES } else { MAX_SLICES_OF_MANY };
        let at = |part: f64| world_after(world, clock, (part - 0.5) * duration).ok();
        let mut count = SliceCount::of_exposure(world, camera, max, at);
        if readout > 0.0 && few {
            count.slices = MAX_SLICES;
        }
        let slices = std::iter::repeat_with(OnceLock::new).take(count.slices).collect();
        Some(Self { world, reference: still, clock, duration, readout, count, slices })
    }

    /// Notice about objects that move visibly between two slices.
    pub fn notice(&self) -> Option<Notice> {
        let SliceCount { slices, motion } = self.count;
        let step = self.count.coarse_step()?;
        let message = format!(
            "objects move by up to {motion:.0} pixels during the exposure. Motion blur averages {slices} moments, \
             {step:.1} pixels apart, so separate images of an object may be visible; shorten the exposure, or \
             render shorter exposures and average them"
        );
        Some(Notice::new(NoticeCode::CoarseMotionBlur, message))
    }

    /// True if rows are exposed at different times.
    pub fn is_rolling(&self) -> bool {
        self.readout > 0.0
    }

    /// Index of the slice that a pixel shows at a fraction of its exposure.
    pub fn slice_index(&self, camera: &Camera, pixel: DVec2, part: f64) -> usize {
        let time = camera.shutter_offset(pixel, part) / self.duration + 0.5;
        let slices = self.slices.len();
        ((time * slices as f64) as usize).min(slices - 1)
    }

    /// World in the middle of a slice.
    pub fn world_in_slice(&self, slice: usize, control: &Control) -> Result<&Arc<PreparedWorld>, RenderError> {
        let place = &self.slices[slice];
        if let Some(world) = place.get() {
            return Ok(world);
        }
        let part = (slice as f64 + 0.5) / self.slices.len() as f64;
        let time = (part - 0.5) * self.duration;
        let world = self.prepare_at(time, control)?;
        // Another thread may already have prepared the same world.
        Ok(place.get_or_init(|| world))
    }

    /// World at the middle of the exposure of a pixel's row; at most `most` worlds are kept.
    pub fn cached_row_world(
        &self,
        camera: &Camera,
        pixel: DVec2,
        rows: &mut RowWorlds,
        most: usize,
        control: &Control,
    ) -> Result<Arc<PreparedWorld>, RenderError> {
        let time = camera.shutter_offset(pixel, 0.5);
        if !rows.contains_key(&time.to_bits()) {
            if rows.len() >= most {
                rows.clear();
            }
            rows.insert(time.to_bits(), self.prepare_at(time, control)?);
        }
        Ok(rows[&time.to_bits()].clone())
    }

    /// Regions of equal exposure time within a region (x, y, width, height): rows or columns of pixels.
    pub fn rows_of(&self, camera: &Camera, [x, y, width, height]: [u32; 4]) -> Vec<[u32; 4]> {
        match camera.motion().map(ShutterMotion::direction) {
            Some(ReadoutDirection::Right | ReadoutDirection::Left) => {
                (x..x + width).map(|x| [x, y, 1, height]).collect()
            }
            _ => (y..y + height).map(|y| [x, y, width, 1]).collect(),
        }
    }

    /// World at the middle of the exposure of a pixel's row.
    pub fn row_world(
        &self,
        camera: &Camera,
        pixel: DVec2,
        control: &Control,
    ) -> Result<Arc<PreparedWorld>, RenderError> {
        self.prepare_at(camera.shutter_offset(pixel, 0.5), control)
    }

    /// World at the middle of the exposure of every row, in the order of readout.
    ///
    /// # Errors
    /// [`RenderError::World`] if the worlds would take too much memory.
    pub fn all_row_worlds(&self, camera: &Camera, control: &Control) -> Result<Vec<Arc<PreparedWorld>>, RenderError> {
        let middle = |[x, y, ..]: [u32; 4]| camera.pixel_center_of(x, y);
        let [width, height] = camera.size();
        let mut rows: Vec<_> = self.rows_of(camera, [0, 0, width, height]).into_iter().map(middle).collect();
        rows.sort_by(|a, b| camera.line_fraction(*a).total_cmp(&camera.line_fraction(*b)));
        let count = rows.len();
        let objects = OBJECT_BYTES * self.world.objects.len();
        let taken = AtomicUsize::new(count * objects);
        rows.into_par_iter()
            .map(|pixel| {
                let then = self.row_world(camera, pixel, control)?;
                let deforming = self.deforming_bytes(&then);
                if taken.fetch_add(deforming, Ordering::Relaxed) + deforming <= ROW_WORLDS_MAX_BYTES {
                    return Ok(then);
                }
                Err(RenderError::world(format!(
                    "optical flow to a camera with a rolling shutter of {count} lines in a moving world requires too \
                     much memory: the {} objects and their deforming meshes take about {} MiB per line; the limit for \
                     all lines is 2 GiB. Use a second camera with fewer lines or with readout=0, or a world that does \
                     not move",
                    then.geometry.instances.len(),
                    (objects + deforming).div_ceil(1 << 20)
                )))
            })
            .collect()
    }

    /// Approximate memory in bytes of the meshes that a row's world does not share with other worlds.
    fn deforming_bytes(&self, then: &PreparedWorld) -> usize {
        let objects = then.geometry.instances.iter().zip(&self.reference.geometry.instances);
        let deforming: HashMap<_, _> = objects
            .filter(|(now, still)| !Arc::ptr_eq(&now.mesh, &still.mesh))
            .map(|(now, _)| (Arc::as_ptr(&now.mesh), &now.mesh.mesh))
            .collect();
        let of_mesh = |mesh: &&Arc<Mesh>| VERTEX_BYTES * mesh.vertices.len() + TRIANGLE_BYTES * mesh.triangles.len();
        deforming.values().map(of_mesh).sum::<usize>()
    }

    /// World description at the middle of the exposure of the row at this fraction of the image, from 0 to 1.
    pub fn scene_at_row(&self, line: f64) -> Result<World, RenderError> {
        self.scene_at((line - 0.5) * self.readout)
    }

    fn scene_at(&self, since_middle: f64) -> Result<World, RenderError> {
        world_after(self.world, self.clock, since_middle)
    }

    fn prepare_at(&self, since_middle: f64, control: &Control) -> Result<Arc<PreparedWorld>, RenderError> {
        let world = self.scene_at(since_middle)?;
        let moved = PreparedWorld::advance_world(&world, self.reference, control)?;
        Ok(Arc::new(moved))
    }
}

/// Prepares the world at `seconds` after its own time; `reference` is the prepared `world`.
///
/// # Errors
/// [`RenderError::World`] if an object cannot be placed at this time; errors of [`PreparedWorld::new`].
pub(crate) fn prepare_after(
    world: &World,
    reference: &PreparedWorld,
    seconds: f64,
    control: &Control,
) -> Result<PreparedWorld, RenderError> {
    let clock = world.time.unwrap_or(WorldTime { time: 0.0, animation: None });
    PreparedWorld::advance_world(&world_after(world, clock, seconds)?, reference, control)
}

/// World at `seconds` after the time `clock`.
fn world_after(world: &World, clock: WorldTime, seconds: f64) -> Result<World, RenderError> {
    let clock = WorldTime { time: clock.time + seconds, ..clock };
    world.at_time(clock).map_err(RenderError::world)
}
