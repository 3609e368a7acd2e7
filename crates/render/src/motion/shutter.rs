//! A world that moves while a camera's shutter is open.
//!
//! The colour of a sample is that of the world in one of [`SLICES`] equal slices of the shutter's work, at the slice's
//! middle; with a rolling shutter, whose lines each have a part of them, in one of [`FINE_SLICES`], where what moves are
//! few and rigid objects. Ground truth is of the world at the exact middle of each line's exposure.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use glam::DVec2;
use raycam_scene::camera::{Motion, Readout};
use raycam_scene::video::Clock;
use raycam_scene::{Camera, Mesh, Object, World};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::guiding::caustic_casters::mirrors;
use crate::prepare::dielectric_bounds::bodies;
use crate::prepare::material::prepare_materials;
use crate::prepare::mesh::prepare_meshes;
use crate::prepare::{PreparedWorld, bounds, check, is_see_through, place};

/// Slices of the time from when the first line opens until the last one closes.
const SLICES: usize = 64;
/// The same of a rolling shutter.
const FINE_SLICES: usize = 1024;
/// The most objects of a world of which there are so many.
const FEW: usize = 128;
/// Bytes that the worlds of all lines of a picture may take together.
const ALL_LINES: usize = 2 << 30;
/// About how many of them an object takes, and a vertex and a triangle of a mesh that bends, with its tree.
const OBJECT: usize = 1024;
const VERTEX: usize = 128;
const TRIANGLE: usize = 128;

/// The times at which a world is seen.
pub(crate) struct Moments<'a> {
    world: &'a World,
    /// As it is in the middle of the shutter's work.
    still: &'a PreparedWorld,
    clock: Clock,
    /// From when the first line opens until the last one closes, in seconds.
    whole: f64,
    /// From the middle of the first line's exposure until that of the last one's; 0 where all lines open at once.
    readout: f64,
    slices: Vec<OnceLock<Arc<PreparedWorld>>>,
}

/// The worlds of the lines of a tile; kept for the next tile, which mostly has the same ones.
pub(crate) type Lines = HashMap<u64, Arc<PreparedWorld>>;

impl<'a> Moments<'a> {
    /// Those of a camera with a shutter, of a world that moves and knows what time it is; none of any other.
    pub fn new(world: &'a World, still: &'a PreparedWorld, camera: &Camera) -> Option<Self> {
        let (motion, clock) = (camera.motion()?, world.clock?);
        let readout = motion.readout();
        let few = world.rig.is_none() && world.objects.len() <= FEW;
        let slices = if readout > 0.0 && few {
            FINE_SLICES
        } else {
            SLICES
        };
        (motion.whole() > 0.0 && world.moves()).then(|| Self {
            world,
            still,
            clock,
            whole: motion.whole(),
            readout,
            slices: std::iter::repeat_with(OnceLock::new).take(slices).collect(),
        })
    }

    /// Whether the ground truth of different lines is of different times.
    pub fn is_rolling(&self) -> bool {
        self.readout > 0.0
    }

    /// The slice in which a pixel is seen at a part of its exposure.
    pub fn slice(&self, camera: &Camera, pixel: DVec2, part: f64) -> usize {
        let time = camera.since_middle(pixel, part) / self.whole + 0.5;
        let slices = self.slices.len();
        ((time * slices as f64) as usize).min(slices - 1)
    }

    /// The world in the middle of a slice.
    pub fn of_slice(
        &self,
        slice: usize,
        control: &Control,
    ) -> Result<&Arc<PreparedWorld>, RenderError> {
        let place = &self.slices[slice];
        if let Some(world) = place.get() {
            return Ok(world);
        }
        let part = (slice as f64 + 0.5) / self.slices.len() as f64;
        let time = (part - 0.5) * self.whole;
        let world = self.at(time, control)?;
        // Another thread may have made the same one.
        Ok(place.get_or_init(|| world))
    }

    /// The world at the middle of the exposure of a pixel's line; at most `most` are kept.
    pub fn of_line(
        &self,
        camera: &Camera,
        pixel: DVec2,
        lines: &mut Lines,
        most: usize,
        control: &Control,
    ) -> Result<Arc<PreparedWorld>, RenderError> {
        let time = camera.since_middle(pixel, 0.5);
        if let Some(world) = lines.get(&time.to_bits()) {
            return Ok(world.clone());
        }
        if lines.len() >= most {
            lines.clear();
        }
        let world = self.at(time, control)?;
        lines.insert(time.to_bits(), world.clone());
        Ok(world)
    }

    /// The lines of a region (x, y, width, height): what is seen at the same time.
    pub fn lines(&self, camera: &Camera, [x, y, width, height]: [u32; 4]) -> Vec<[u32; 4]> {
        match camera.motion().map(Motion::direction) {
            Some(Readout::Right | Readout::Left) => {
                (x..x + width).map(|x| [x, y, 1, height]).collect()
            }
            _ => (y..y + height).map(|y| [x, y, width, 1]).collect(),
        }
    }

    /// The world at the middle of the exposure of a pixel's line.
    pub fn at_line(
        &self,
        camera: &Camera,
        pixel: DVec2,
        control: &Control,
    ) -> Result<Arc<PreparedWorld>, RenderError> {
        self.at(camera.since_middle(pixel, 0.5), control)
    }

    /// The world at the middle of the exposure of every line, in the order in which they are read.
    ///
    /// # Errors
    /// [`RenderError::World`] where so many worlds would take too much memory.
    pub fn of_all_lines(
        &self,
        camera: &Camera,
        control: &Control,
    ) -> Result<Vec<Arc<PreparedWorld>>, RenderError> {
        let middle = |[x, y, ..]: [u32; 4]| camera.pixel_center_of(x, y);
        let [width, height] = camera.size();
        let mut lines: Vec<_> = self
            .lines(camera, [0, 0, width, height])
            .into_iter()
            .map(middle)
            .collect();
        lines.sort_by(|a, b| camera.line_of(*a).total_cmp(&camera.line_of(*b)));
        let count = lines.len();
        let objects = OBJECT * self.world.objects.len();
        let taken = AtomicUsize::new(count * objects);
        lines
            .into_par_iter()
            .map(|pixel| {
                let then = self.at_line(camera, pixel, control)?;
                let bent = self.bent_bytes(&then);
                if taken.fetch_add(bent, Ordering::Relaxed) + bent <= ALL_LINES {
                    return Ok(then);
                }
                Err(RenderError::World(format!(
                    "the second camera reads {count} lines one after another while the world moves: its {} objects, and \
                     the meshes among them that bend, take about {} MiB for each line, and 2 GiB are for all of them: \
                     follow to a camera of fewer lines or without a readout, or to a world that stands",
                    then.objects.len(),
                    (objects + bent).div_ceil(1 << 20)
                )))
            })
            .collect()
    }

    /// About how much the meshes of a line's world take that are its own.
    fn bent_bytes(&self, then: &PreparedWorld) -> usize {
        let objects = then.objects.iter().zip(&self.still.objects);
        let bent: HashMap<_, _> = objects
            .filter(|(now, still)| !Arc::ptr_eq(&now.mesh, &still.mesh))
            .map(|(now, _)| (Arc::as_ptr(&now.mesh), &now.mesh.mesh))
            .collect();
        let of_mesh =
            |mesh: &&Arc<Mesh>| VERTEX * mesh.vertices.len() + TRIANGLE * mesh.triangles.len();
        bent.values().map(of_mesh).sum::<usize>()
    }

    /// The world as it is described, when the line at a fraction of the picture, from 0 to 1, is in the middle of its
    /// exposure.
    pub fn described_at(&self, line: f64) -> Result<World, RenderError> {
        self.described((line - 0.5) * self.readout)
    }

    fn described(&self, since_middle: f64) -> Result<World, RenderError> {
        let clock = Clock {
            time: self.clock.time + since_middle,
            ..self.clock
        };
        let world = self.world.at_clock(clock);
        world.map_err(|error| RenderError::World(error.to_string()))
    }

    fn at(&self, since_middle: f64, control: &Control) -> Result<Arc<PreparedWorld>, RenderError> {
        let world = self.described(since_middle)?;
        let moved = PreparedWorld::moved(&world, self.world, self.still, control)?;
        Ok(Arc::new(moved))
    }
}

impl PreparedWorld {
    /// `world`, in which things have moved since it was `still`, as `before`; in the same pool of threads. Its origin,
    /// its textures, and as far as they stay the same its materials and lights are those of `still`.
    ///
    /// # Errors
    /// Those of [`PreparedWorld::new`].
    fn moved(
        world: &World,
        before: &World,
        still: &Self,
        control: &Control,
    ) -> Result<Self, RenderError> {
        control.check()?;
        check(world)?;
        let meshes = prepare_meshes(world, Some(still), control)?;
        let placed = |object: &Object| meshes[object.mesh].clone();
        let meshes: Vec<_> = world.objects.iter().filter_map(placed).collect();
        let (lower, upper) = bounds(&world.objects, &meshes);
        let origin = still.origin;
        let (objects, scene) = place(world, meshes, origin)?;
        let radius = (upper - origin).abs().max((lower - origin).abs()).length();
        let materials = match world.materials == before.materials {
            true => still.materials.clone(),
            false => Arc::new(prepare_materials(&world.materials)),
        };
        let mut moved = Self {
            scene,
            merged: Arc::default(),
            origin,
            radius,
            boxes: vec![], // for pictures of worlds that stand
            bodies: bodies(&objects, &materials, origin),
            objects,
            materials,
            see_through: is_see_through(world),
            textures: still.textures.clone(),
            texture_memory: still.texture_memory.clone(),
            mirrors: vec![],
            // There are too many moments for light to be followed in each.
            thrown: vec![].into(),
            lights: still.lights.clone(),
            default_lights: still.default_lights.clone(),
        };
        moved.mirrors = mirrors(&moved);
        let shines = still.lights.has_surfaces() || world.materials != before.materials;
        if shines || world.lights != before.lights {
            moved.light(world);
        }
        Ok(moved)
    }
}
