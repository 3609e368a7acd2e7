//! The faces that cameras show, with their best views: samples on each face are tested in every camera.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec2, DVec3};
use raycam_scene::camera::Camera;
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::queries::block_view::BlockView;
use crate::queries::sight_line::{Blocker, Clearance, Incidence, SightLine, clearances};
use crate::queries::tasks::NS_PER_RAY;
use crate::queries::view_bounds::ViewBounds;
use crate::thread_pool::Workers;

/// Faces per task. Their samples and results stay in the cache while all cameras are tested.
const BLOCK_FACES: usize = 512;

/// Number of faces before and after a face whose blockers are tested before a ray is traced.
const NEIGHBORS: usize = 4;

/// Area in pixels of a face, in any camera, above which the face has as many samples as pixels.
const LARGE_FACE_PX: f64 = 4.0;

/// A face is certainly not large if the upper bound of its area in pixels is below this value. The value is smaller
/// than `LARGE_FACE_PX`, because the projections of a face's edges are not exactly straight.
const MAX_SMALL_AREA_PX: f64 = LARGE_FACE_PX / 1.25;

/// Triangles in world coordinates, with their samples. Neighbouring faces should follow each other: the rays to them
/// are traced together.
#[derive(Clone, Copy, Debug)]
pub struct SampledFaces<'a> {
    /// Corners of each face.
    pub corners: &'a [[[f64; 3]; 3]],
    /// Unit normal of each face.
    pub normals: &'a [[f64; 3]],
    /// Minimum number of samples of each face; at least 1. Larger faces have as many samples as they cover pixels in the
    /// camera that shows them largest, up to the length of `pattern`.
    pub min_samples: &'a [u16],
    /// Weights of the corners for each sample; a face with n samples uses the first n entries.
    pub pattern: &'a [[f64; 3]],
    /// If true, cameras also show faces from behind.
    pub both_sides: bool,
}

/// The result of [`faces_in_sight`]. Vectors have one value per face unless stated otherwise.
#[derive(Clone, Debug, Default)]
pub struct FaceSight {
    /// Number of samples.
    pub samples: Vec<i32>,
    /// True for each sample of each face that any camera shows.
    pub is_shown: Vec<bool>,
    /// Number of cameras that show at least one sample.
    pub views: Vec<i32>,
    /// The camera with the largest resolution, -1 for none. The first camera is used if several have this resolution.
    pub best_view: Vec<i32>,
    /// Resolution in that camera, in pixels per metre: the smaller singular value of the derivative of the pixel with
    /// respect to the surface, at the first sample that the camera shows. 0 if no camera shows the face.
    pub best_resolution: Vec<f32>,
    /// Cosine of the angle of incidence in that camera, at the same sample; NaN if no camera shows the face.
    pub best_cosine: Vec<f64>,
    /// Number of faces that each camera shows.
    pub faces_shown: Vec<i32>,
    /// \[face, camera, number of samples shown] of each pair with at least one sample, face by face. Empty unless
    /// requested.
    pub pairs: Vec<[i32; 3]>,
}

/// Returns which faces the cameras show. A sample is shown by a camera under the conditions of
/// [`crate::queries::camera_sight::points_in_sight`].
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length or a number of samples is outside the pattern's length,
/// [`RenderError::Cancelled`], and errors of `crate::thread_pool::with_pool`.
pub fn faces_in_sight(
    world: &PreparedWorld,
    cameras: &[Camera],
    faces: &SampledFaces,
    with_pairs: bool,
    threads: Option<usize>,
    control: &Control,
) -> Result<FaceSight, RenderError> {
    faces.check()?;
    let (n, geometry) = (faces.corners.len(), &world.geometry);
    geometry.note_exact_rays((n * cameras.len()) as u64 / 2);
    let workers = Workers::for_work(threads, NS_PER_RAY * (n * cameras.len()) as f64, false)?;
    let blocks: Vec<Range<usize>> =
        (0..n).step_by(BLOCK_FACES).map(|first| first..n.min(first + BLOCK_FACES)).collect();
    let bounds = ViewBounds::of_cameras(cameras);
    control.start(blocks.len());
    let found: Result<Vec<FaceSight>, RenderError> = workers.run(|| {
        let test = |range: Range<usize>| {
            let views = BlockView::of_cameras(&faces.corners[range.clone()], cameras, &bounds);
            let mut block = Block::new(faces, range, cameras.len(), &views);
            for view in &views {
                control.check()?;
                block.add_camera(geometry, view, with_pairs);
            }
            control.advance();
            block.found.pairs.sort_unstable();
            Ok(block.found)
        };
        blocks.into_par_iter().map(test).collect()
    });
    let mut all = FaceSight { faces_shown: vec![0; cameras.len()], ..FaceSight::default() };
    found?.into_iter().for_each(|block| all.append(block));
    Ok(all)
}

impl SampledFaces<'_> {
    fn check(&self) -> Result<(), RenderError> {
        let (n, normals, numbers) = (self.corners.len(), self.normals.len(), self.min_samples.len());
        if n != normals || n != numbers {
            return Err(RenderError::settings(format!(
                "{n} faces, {normals} normals and {numbers} numbers of samples; expected equal numbers"
            )));
        }
        let limit = self.pattern.len();
        match self.min_samples.iter().find(|number| !(1..=limit).contains(&usize::from(**number))) {
            None => Ok(()),
            Some(number) => Err(RenderError::settings(format!(
                "min_samples contains {number}; expected a number from 1 to {limit}, the length of the sample pattern"
            ))),
        }
    }
}

impl FaceSight {
    fn append(&mut self, mut block: Self) {
        let first = self.views.len() as i32;
        self.pairs.extend(block.pairs.iter().map(|[face, camera, number]| [first + face, *camera, *number]));
        self.samples.append(&mut block.samples);
        self.is_shown.append(&mut block.is_shown);
        self.views.append(&mut block.views);
        self.best_view.append(&mut block.best_view);
        self.best_resolution.append(&mut block.best_resolution);
        self.best_cosine.append(&mut block.best_cosine);
        self.faces_shown.iter_mut().zip(block.faces_shown).for_each(|(sum, more)| *sum += more);
    }
}

/// Consecutive faces whose samples are tested together.
struct Block<'a> {
    corners: &'a [[[f64; 3]; 3]],
    normals: &'a [[f64; 3]],
    incidence: Incidence,
    /// Samples of each face.
    ranges: Vec<Range<usize>>,
    /// Position and face of each sample.
    positions: Vec<[f64; 3]>,
    owners: Vec<u32>,
    /// Number of samples of each face that the current camera shows.
    shown: Vec<i32>,
    /// A triangle that hides a sample of each face from the current camera. It probably hides neighbouring samples too.
    blockers: Vec<Option<Blocker>>,
    found: FaceSight,
}

impl<'a> Block<'a> {
    fn new(faces: &SampledFaces<'a>, range: Range<usize>, cameras: usize, views: &[BlockView]) -> Self {
        let corners = &faces.corners[range.clone()];
        let samples = sample_numbers(corners, &faces.min_samples[range.clone()], faces.pattern.len(), views);
        let (n, total) = (corners.len(), samples.iter().sum());
        let (mut ranges, mut positions) = (Vec::with_capacity(n), Vec::with_capacity(total));
        let mut owners = Vec::with_capacity(total);
        for ((face, corners), &number) in (0..).zip(corners).zip(&samples) {
            ranges.push(positions.len()..positions.len() + number);
            positions.extend(faces.pattern[..number].iter().map(|weights| weighted_point(corners, weights)));
            owners.extend(std::iter::repeat_n(face, number));
        }
        let found = FaceSight {
            samples: samples.iter().map(|number| *number as i32).collect(),
            is_shown: vec![false; total],
            views: vec![0; n],
            best_view: vec![-1; n],
            best_resolution: vec![0.0; n],
            best_cosine: vec![f64::NAN; n],
            faces_shown: vec![0; cameras],
            pairs: vec![],
        };
        let incidence = Incidence { both_sides: faces.both_sides, min_cosine: 0.0 };
        Self {
            corners,
            normals: &faces.normals[range],
            incidence,
            ranges,
            positions,
            owners,
            shown: vec![0; n],
            blockers: vec![None; n],
            found,
        }
    }

    /// Tests the first sample of each face in a camera, and then only samples that can change the result: those of
    /// faces that are not shown so far, and those that no earlier camera shows. With pairs, all samples are tested.
    fn add_camera(&mut self, geometry: &Geometry, view: &BlockView, with_pairs: bool) {
        self.shown.fill(0);
        self.blockers.fill(None);
        let faces: Vec<Range<usize>> = (0..self.ranges.len())
            .filter(|&face| view.may_show(&self.corners[face], self.normals[face], self.incidence))
            .map(|face| self.ranges[face].clone())
            .collect();
        let first: Vec<usize> = faces.iter().map(|range| range.start).collect();
        self.test_samples(geometry, view, &first);
        let can_change = |&sample: &usize| {
            with_pairs || self.shown[self.owners[sample] as usize] == 0 || !self.found.is_shown[sample]
        };
        let others: Vec<usize> = faces.iter().flat_map(|range| range.start + 1..range.end).filter(can_change).collect();
        self.test_samples(geometry, view, &others);
        for (face, &shown) in self.shown.iter().enumerate().filter(|(_, shown)| **shown > 0) {
            self.found.views[face] += 1;
            self.found.faces_shown[view.number] += 1;
            if with_pairs {
                self.found.pairs.push([face as i32, view.number as i32, shown]);
            }
        }
    }

    /// Tests samples, in ascending order. The first sample of a face that the camera shows represents the face.
    fn test_samples(&mut self, geometry: &Geometry, view: &BlockView, samples: &[usize]) {
        let line = |&sample: &usize| {
            let face = self.owners[sample] as usize;
            let point = [self.positions[sample], self.normals[face]];
            let line = match view.origin {
                Some(origin) => SightLine::from_origin(origin, self.incidence, sample, point)?,
                None => SightLine::new(view.camera, self.incidence, sample, point)?.0,
            };
            let near = &self.blockers[face.saturating_sub(NEIGHBORS)..(face + NEIGHBORS + 1).min(self.blockers.len())];
            (!near.iter().flatten().any(|blocker| blocker.certainly_blocks(&line))).then_some(line)
        };
        let lines: Vec<SightLine> = samples.iter().filter_map(line).collect();
        let found = clearances(geometry, &lines, |line| Some(&self.corners[self.owners[line.index] as usize]));
        for (line, clearance) in lines.iter().zip(found) {
            let face = self.owners[line.index] as usize;
            if let Clearance::Blocked(blocker) = clearance {
                self.blockers[face] = blocker;
                continue;
            }
            self.found.is_shown[line.index] = true;
            let best = self.found.best_resolution[face];
            if self.shown[face] == 0 && line.max_resolution(view.max_scale) > f64::from(best) {
                let resolution = smaller_singular_value(line.footprint(view.camera, self.normals[face])) as f32;
                if resolution > best {
                    self.found.best_resolution[face] = resolution;
                    self.found.best_view[face] = view.number as i32;
                    self.found.best_cosine[face] = line.cosine;
                }
            }
            self.shown[face] += 1;
        }
    }
}

fn weighted_point(corners: &[[f64; 3]; 3], weights: &[f64; 3]) -> [f64; 3] {
    let [a, b, c] = corners.map(DVec3::from_array);
    (weights[0] * a + weights[1] * b + weights[2] * c).to_array()
}

/// Number of samples of each face: its minimum or, if its area in any camera exceeds [`LARGE_FACE_PX`], its
/// largest area in pixels, rounded up and at most `limit`.
fn sample_numbers(corners: &[[[f64; 3]; 3]], min: &[u16], limit: usize, views: &[BlockView]) -> Vec<usize> {
    let mut numbers: Vec<usize> = min.iter().map(|number| usize::from(*number)).collect();
    if numbers.iter().all(|number| *number == limit) {
        return numbers;
    }
    let may_be_large = |view: &&BlockView| view.max_area >= MAX_SMALL_AREA_PX;
    let cameras: Vec<&Camera> = views.iter().filter(may_be_large).map(|view| view.camera).collect();
    if cameras.is_empty() {
        return numbers;
    }
    for (number, area) in numbers.iter_mut().zip(largest_areas(corners, &cameras)) {
        if area > LARGE_FACE_PX {
            *number = (area.ceil() as usize).clamp(*number, limit);
        }
    }
    numbers
}

/// The largest area in pixels of each triangle among the cameras that project it into the image; 0 if no
/// camera does. Parts outside of the image and hidden parts are included.
fn largest_areas(corners: &[[[f64; 3]; 3]], cameras: &[&Camera]) -> Vec<f64> {
    // Neighbouring faces share their corners: each position is projected once.
    let (mut positions, mut numbers) = (vec![], HashMap::with_capacity(corners.len()));
    let mut number_of = |position: [f64; 3]| {
        *numbers.entry(position.map(f64::to_bits)).or_insert_with(|| {
            positions.push(DVec3::from_array(position));
            positions.len() - 1
        })
    };
    let faces: Vec<[usize; 3]> = corners.iter().map(|corners| corners.map(&mut number_of)).collect();
    let mut largest = vec![0.0; corners.len()];
    for camera in cameras {
        let size = DVec2::from_array(camera.size().map(f64::from));
        let place = |position: &DVec3| {
            let (pixel, is_projected) = camera.project(*position);
            if is_projected { camera.offset_from_corner(pixel) } else { DVec2::NAN }
        };
        let places: Vec<DVec2> = positions.iter().map(place).collect();
        for (largest, face) in largest.iter_mut().zip(&faces) {
            let [p, q, r] = face.map(|number| places[number]);
            let area = (q - p).perp_dot(r - p).abs() / 2.0;
            let is_inside = p.max(q).max(r).cmpge(DVec2::ZERO).all() && p.min(q).min(r).cmple(size).all();
            // False if a corner is not projected, because the area is NaN.
            if is_inside && area > *largest && area.is_finite() {
                *largest = area;
            }
        }
    }
    largest
}

/// The smaller singular value of a matrix given by its rows; 0 for a matrix that is not finite.
fn smaller_singular_value([a, b, c, d]: [f64; 4]) -> f64 {
    let s = (a + d).hypot(c - b) / 2.0;
    let t = (a - d).hypot(c + b) / 2.0;
    let value = (s - t).abs();
    if value.is_finite() { value } else { 0.0 }
}
