//! A world that moves while a camera's shutter is open.
//!
//! The colour of a sample is that of the world in one of [`TIME_SLICES`] equal slices of the shutter's work, at the slice's
//! middle; with a rolling shutter, whose lines each have a part of them, in one of [`ROLLING_TIME_SLICES`], where what moves are
//! few and rigid objects. Ground truth is of the world at the exact middle of each line's exposure.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use glam::DVec2;
use raycam_scene::camera::{ReadoutDirection, ShutterMotion};
use raycam_scene::world::WorldTime;
use raycam_scene::{Camera, Mesh, World};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::world::PreparedWorld;

/// Slices of the time from when the first line opens until the last one closes.
const TIME_SLICES: usize = 64;
/// The same of a rolling shutter.
const ROLLING_TIME_SLICES: usize = 1024;
/// The most objects of a world of which there are so many.
const FINE_MAX_OBJECTS: usize = 128;
/// Bytes that the worlds of all lines of a picture may take together.
const ROW_WORLDS_MAX_BYTES: usize = 2 << 30;
/// About how many of them an object takes, and a vertex and a triangle of a mesh that bends, with its tree.
const OBJECT_BYTES: usize = 1024;
const VERTEX_BYTES: usize = 128;
const TRIANGLE_BYTES: usize = 128;

/// The times at which a world is seen.
pub(crate) struct ShutterSlices<'a> {
    world: &'a World,
    /// As it is in the middle of the shutter's work.
    reference: &'a PreparedWorld,
    clock: WorldTime,
    /// From when the first line opens until the last one closes, in seconds.
    duration: f64,
    /// From the middle of the first line's exposure until that of the last one's; 0 where all lines open at once.
    readout: f64,
    slices: Vec<OnceLock<Arc<PreparedWorld>>>,
}

/// The worlds of the lines of a tile; kept for the next tile, which mostly has the same ones.
pub(crate) type RowWorlds = HashMap<u64, Arc<PreparedWorld>>;

impl<'a> ShutterSlices<'a> {
    /// Those of a camera with a shutter, of a world that moves and knows what time it is; none of any other.
    pub fn new(world: &'a World, still: &'a PreparedWorld, camera: &Camera) -> Option<Self> {
        let (motion, clock) = (camera.motion()?, world.time?);
        let readout = motion.readout();
        let few = world.node_tree.is_none() && world.objects.len() <= FINE_MAX_OBJECTS;
        let slices = if readout > 0.0 && few {
            ROLLING_TIME_SLICES
        } else {
            TIME_SLICES
        };
        (motion.total_duration() > 0.0 && world.is_animated()).then(|| Self {
            world,
            reference: still,
            clock,
            duration: motion.total_duration(),
            readout,
            slices: std::iter::repeat_with(OnceLock::new).take(slices).collect(),
        })
    }

    /// Whether the ground truth of different lines is of different times.
    pub fn is_rolling(&self) -> bool {
        self.readout > 0.0
    }

    /// The slice in which a pixel is seen at a part of its exposure.
    pub fn slice_index(&self, camera: &Camera, pixel: DVec2, part: f64) -> usize {
        let time = camera.shutter_offset(pixel, part) / self.duration + 0.5;
        let slices = self.slices.len();
        ((time * slices as f64) as usize).min(slices - 1)
    }

    /// The world in the middle of a slice.
    pub fn world_in_slice(
        &self,
        slice: usize,
        control: &Control,
    ) -> Result<&Arc<PreparedWorld>, RenderError> {
        let place = &self.slices[slice];
        if let Some(world) = place.get() {
            return Ok(world);
        }
        let part = (slice as f64 + 0.5) / self.slices.len() as f64;
        let time = (part - 0.5) * self.duration;
        let world = self.prepare_at(time, control)?;
        // Another thread may have made the same one.
        Ok(place.get_or_init(|| world))
    }

    /// The world at the middle of the exposure of a pixel's line; at most `most` are kept.
    pub fn cached_row_world(
        &self,
        camera: &Camera,
        pixel: DVec2,
        lines: &mut RowWorlds,
        most: usize,
        control: &Control,
    ) -> Result<Arc<PreparedWorld>, RenderError> {
        let time = camera.shutter_offset(pixel, 0.5);
        if let Some(world) = lines.get(&time.to_bits()) {
            return Ok(world.clone());
        }
        if lines.len() >= most {
            lines.clear();
        }
        let world = self.prepare_at(time, control)?;
        lines.insert(time.to_bits(), world.clone());
        Ok(world)
    }

    /// The lines of a region (x, y, width, height): what is seen at the same time.
    pub fn rows_of(&self, camera: &Camera, [x, y, width, height]: [u32; 4]) -> Vec<[u32; 4]> {
        match camera.motion().map(ShutterMotion::direction) {
            Some(ReadoutDirection::Right | ReadoutDirection::Left) => {
                (x..x + width).map(|x| [x, y, 1, height]).collect()
            }
            _ => (y..y + height).map(|y| [x, y, width, 1]).collect(),
        }
    }

    /// The world at the middle of the exposure of a pixel's line.
    pub fn row_world(
        &self,
        camera: &Camera,
        pixel: DVec2,
        control: &Control,
    ) -> Result<Arc<PreparedWorld>, RenderError> {
        self.prepare_at(camera.shutter_offset(pixel, 0.5), control)
    }

    /// The world at the middle of the exposure of every line, in the order in which they are read.
    ///
    /// # Errors
    /// [`RenderError::World`] where so many worlds would take too much memory.
    pub fn all_row_worlds(
        &self,
        camera: &Camera,
        control: &Control,
    ) -> Result<Vec<Arc<PreparedWorld>>, RenderError> {
        let middle = |[x, y, ..]: [u32; 4]| camera.pixel_center_of(x, y);
        let [width, height] = camera.size();
        let mut lines: Vec<_> = self
            .rows_of(camera, [0, 0, width, height])
            .into_iter()
            .map(middle)
            .collect();
        lines.sort_by(|a, b| {
            camera
                .line_fraction(*a)
                .total_cmp(&camera.line_fraction(*b))
        });
        let count = lines.len();
        let objects = OBJECT_BYTES * self.world.objects.len();
        let taken = AtomicUsize::new(count * objects);
        lines
            .into_par_iter()
            .map(|pixel| {
                let then = self.row_world(camera, pixel, control)?;
                let bent = self.deforming_bytes(&then);
                if taken.fetch_add(bent, Ordering::Relaxed) + bent <= ROW_WORLDS_MAX_BYTES {
                    return Ok(then);
                }
                Err(RenderError::World(format!(
                    "the second camera reads {count} lines one after another while the world moves: its {} objects, and \
                     the meshes among them that bend, take about {} MiB for each line, and 2 GiB are for all of them: \
                     follow to a camera of fewer lines or without a readout, or to a world that stands",
                    then.geometry.instances.len(),
                    (objects + bent).div_ceil(1 << 20)
                )))
            })
            .collect()
    }

    /// About how much the meshes of a line's world take that are its own.
    fn deforming_bytes(&self, then: &PreparedWorld) -> usize {
        let objects = then
            .geometry
            .instances
            .iter()
            .zip(&self.reference.geometry.instances);
        let bent: HashMap<_, _> = objects
            .filter(|(now, still)| !Arc::ptr_eq(&now.mesh, &still.mesh))
            .map(|(now, _)| (Arc::as_ptr(&now.mesh), &now.mesh.mesh))
            .collect();
        let of_mesh = |mesh: &&Arc<Mesh>| {
            VERTEX_BYTES * mesh.vertices.len() + TRIANGLE_BYTES * mesh.triangles.len()
        };
        bent.values().map(of_mesh).sum::<usize>()
    }

    /// The world as it is described, when the line at a fraction of the picture, from 0 to 1, is in the middle of its
    /// exposure.
    pub fn scene_at_row(&self, line: f64) -> Result<World, RenderError> {
        self.scene_at((line - 0.5) * self.readout)
    }

    fn scene_at(&self, since_middle: f64) -> Result<World, RenderError> {
        let clock = WorldTime {
            time: self.clock.time + since_middle,
            ..self.clock
        };
        let world = self.world.at_time(clock);
        world.map_err(|error| RenderError::World(error.to_string()))
    }

    fn prepare_at(
        &self,
        since_middle: f64,
        control: &Control,
    ) -> Result<Arc<PreparedWorld>, RenderError> {
        let world = self.scene_at(since_middle)?;
        let moved = PreparedWorld::advance_world(&world, self.world, self.reference, control)?;
        Ok(Arc::new(moved))
    }
}
