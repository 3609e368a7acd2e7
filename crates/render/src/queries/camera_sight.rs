//! The surface points that a camera shows: their pixels, angles of incidence, and derivatives of the pixel.

use std::ops::Range;

use glam::DVec2;
use raycam_scene::camera::Camera;

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::queries::sight_line::{Incidence, SightLine, clearances};
use crate::queries::tasks::{NS_PER_RAY, in_tasks};

/// Points of surfaces, in world coordinates, with the conditions under which a camera shows them.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoints<'a> {
    /// Positions of the points.
    pub positions: &'a [[f64; 3]],
    /// Unit normals, one per point.
    pub normals: &'a [[f64; 3]],
    /// If true, the camera also shows the points from behind.
    pub both_sides: bool,
    /// Points are shown if the cosine of their angle of incidence is greater than this value.
    pub min_cosine: f64,
}

/// The points that a camera shows, in ascending order of their indices.
#[derive(Clone, Debug, Default)]
pub struct CameraSight {
    /// Indices of the shown points.
    pub index: Vec<i64>,
    /// Pixel coordinates of the shown points.
    pub pixels: Vec<[f64; 2]>,
    /// Cosines of the shown points' angles of incidence.
    pub cosines: Vec<f64>,
    /// Origins of the pixels' rays. With a rolling shutter, an origin is the camera's position while the pixel's line
    /// is exposed.
    pub origins: Vec<[f64; 3]>,
    /// Derivatives of the pixel along two orthonormal surface directions, in pixels per metre: \[du/da, du/db, dv/da,
    /// dv/db]. NaN if the lens does not project the neighbourhood of a point. Empty unless requested.
    pub footprints: Vec<[f64; 4]>,
}

/// Returns the points that the camera shows: they project through the lens into the image, face the camera, and no
/// triangle is between them and the origin of their pixel's ray. Triangles within rounding error of either end do not
/// count.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length, [`RenderError::Cancelled`], and errors of
/// `crate::thread_pool::with_pool`.
pub fn points_in_sight(
    world: &PreparedWorld,
    camera: &Camera,
    points: &SurfacePoints,
    with_footprints: bool,
    threads: Option<usize>,
    control: &Control,
) -> Result<CameraSight, RenderError> {
    let (n, normals) = (points.positions.len(), points.normals.len());
    if n != normals {
        return Err(RenderError::settings(format!("{n} points and {normals} normals; expected equal numbers")));
    }
    let mut found = CameraSight::default();
    let work = |range| sight_of(&world.geometry, camera, points, with_footprints, range);
    in_tasks((n, NS_PER_RAY), threads, control, work, |more| found.append(more))?;
    Ok(found)
}

impl CameraSight {
    fn append(&mut self, mut more: Self) {
        self.index.append(&mut more.index);
        self.pixels.append(&mut more.pixels);
        self.cosines.append(&mut more.cosines);
        self.origins.append(&mut more.origins);
        self.footprints.append(&mut more.footprints);
    }
}

fn sight_of(
    geometry: &Geometry,
    camera: &Camera,
    points: &SurfacePoints,
    with_footprints: bool,
    range: Range<usize>,
) -> CameraSight {
    let incidence = Incidence { both_sides: points.both_sides, min_cosine: points.min_cosine };
    let line = |index| SightLine::new(camera, incidence, index, [points.positions[index], points.normals[index]]);
    let (lines, pixels): (Vec<SightLine>, Vec<DVec2>) = range.filter_map(line).unzip();
    let mut found = CameraSight::default();
    let clear = clearances(geometry, &lines, |_| None);
    for ((line, pixel), _) in lines.iter().zip(pixels).zip(clear).filter(|(_, clearance)| clearance.is_clear()) {
        found.index.push(line.index as i64);
        found.pixels.push(pixel.to_array());
        found.cosines.push(line.cosine);
        found.origins.push(line.origin.to_array());
        if with_footprints {
            found.footprints.push(line.footprint(camera, points.normals[line.index]));
        }
    }
    found
}
