//! Images of one world with many poses and cameras.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DAffine3;
use raycam_scene::{Camera, Notice, World};

use crate::control::Control;
use crate::error::RenderError;
use crate::film::output_plane::OutputPlane;
use crate::motion::shutter::ShutterSlices;
use crate::prepare::world::{PreparedFamily, PreparedWorld};
use crate::render::{RenderRequest, estimated_frame_work};
use crate::settings::Settings;
use crate::thread_pool::Workers;

/// Images of a world; each image may have its own camera and its own poses of some objects.
#[derive(Clone, Copy, Debug)]
pub struct PictureSeries<'a> {
    /// World description.
    pub world: &'a World,
    /// The same world, prepared.
    pub prepared: &'a PreparedWorld,
    /// Family of prepared worlds; the images' worlds share its parts.
    pub family: &'a Arc<PreparedFamily>,
    /// Cameras of equal size: one camera for all images, or one camera per image.
    pub cameras: &'a [Camera],
    /// For each moving object: its index, and `world_from_mesh`: one matrix for all images, or one matrix per image.
    pub poses: &'a [(usize, Vec<DAffine3>)],
}

/// Estimated time per image, in nanoseconds, above which all threads share an image.
const SHARED_PICTURE: f64 = 20e6;

impl PictureSeries<'_> {
    /// Renders an image into each list of planes. Image i is equal to the image by [`crate::render_into`] with poses i,
    /// camera i and the frame `settings.frame` + i. Returns the notices, each once.
    ///
    /// # Errors
    /// Errors of [`crate::render_into`], and [`RenderError::World`] for a pose that flattens an object.
    pub fn render(
        &self,
        settings: &Settings,
        control: &Control,
        pictures: Vec<Vec<OutputPlane<'_>>>,
    ) -> Result<Vec<Notice>, RenderError> {
        let Some(first) = self.cameras.first() else {
            return Ok(vec![]);
        };
        let count = pictures.len();
        let region = settings.check(first.size())?;
        let each = estimated_frame_work(self.prepared, first, settings, region);
        let workers = Workers::for_work(settings.threads, each * count as f64, false)?;
        control.start(count);
        let found: Vec<Mutex<Vec<Notice>>> = (0..count).map(|_| Mutex::default()).collect();
        let jobs: Vec<_> = pictures.into_iter().enumerate().map(|(i, planes)| (i, Mutex::new(Some(planes)))).collect();
        let one = |(i, planes): &(usize, Mutex<Option<Vec<OutputPlane<'_>>>>), alone: bool| {
            control.check()?;
            let planes = planes.lock().unwrap_or_else(PoisonError::into_inner).take().unwrap_or_default();
            let notices = self.render_one(*i, settings, control, planes, alone)?;
            *found[*i].lock().unwrap_or_else(PoisonError::into_inner) = notices;
            control.advance();
            Ok(())
        };
        // Each of many small images uses one thread; a few large images use all threads.
        if each < SHARED_PICTURE || count >= 4 * workers.count() {
            workers.for_each_dynamic(&jobs, |_: &mut (), job| one(job, true))?;
        } else {
            jobs.iter().try_for_each(|job| one(job, false))?;
        }
        let mut notices: Vec<Notice> = vec![];
        for notice in found.into_iter().flat_map(|own| own.into_inner().unwrap_or_else(PoisonError::into_inner)) {
            if !notices.contains(&notice) {
                notices.push(notice);
            }
        }
        Ok(notices)
    }

    fn render_one(
        &self,
        picture: usize,
        settings: &Settings,
        control: &Control,
        planes: Vec<OutputPlane<'_>>,
        alone: bool,
    ) -> Result<Vec<Notice>, RenderError> {
        let part = control.part();
        let moved = self.posed(picture, settings, &part)?;
        let (world, prepared) =
            moved.as_ref().map_or((self.world, self.prepared), |(world, prepared)| (world, prepared));
        let camera = &self.cameras[if self.cameras.len() == 1 { 0 } else { picture }];
        let settings = &Settings { frame: settings.frame.wrapping_add(picture as u32), ..settings.clone() };
        let region = settings.check(camera.size())?;
        let shutter = ShutterSlices::new(world, prepared, camera);
        let request = RenderRequest { world: prepared, shutter: shutter.as_ref(), camera, settings, region };
        request.render(alone, &part, planes.into_iter())
    }

    /// World of an image with the image's poses; `None` if no object moves between images.
    fn posed(
        &self,
        picture: usize,
        settings: &Settings,
        control: &Control,
    ) -> Result<Option<(World, PreparedWorld)>, RenderError> {
        if self.poses.is_empty() {
            return Ok(None);
        }
        let mut world = self.world.clone();
        for (object, places) in self.poses {
            let place = places[if places.len() == 1 { 0 } else { picture }];
            let placed = world.place_object(*object, place);
            placed.map_err(|error| RenderError::world(format!("image {picture}: {error}")))?;
        }
        let prepared = PreparedWorld::in_family(&world, self.family, Some(self.prepared), settings.threads, control)?;
        Ok(Some((world, prepared)))
    }
}
