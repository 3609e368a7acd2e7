//! Polygons of a file, and the triangles into which they are cut.

use std::ops::Range;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{Notice, NoticeCode, counted};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::geometry::ear_clipping;
use crate::geometry::vertex_dedup::{Corner, NO_INDEX};

/// Maximum number of corners in a polygon; limits the memory for cutting it.
const MAX_CORNERS: usize = 1 << 20;

/// Faces with fewer than 3 corners: they have no area, and are skipped, as in other readers.
#[derive(Debug, Default)]
pub(crate) struct DegenerateFaces {
    count: usize,
    /// Position in the file of the first face with fewer than 3 corners.
    first: Option<String>,
}

impl DegenerateFaces {
    /// Counts a face with fewer than 3 corners.
    pub(crate) fn add(&mut self, place: impl FnOnce() -> String) {
        self.count += 1;
        self.first.get_or_insert_with(place);
    }

    /// Counts the faces of a later part of the file.
    pub(crate) fn append(&mut self, later: Self) {
        self.count += later.count;
        self.first = self.first.take().or(later.first);
    }

    /// Notice about faces with fewer than 3 corners; `None` if there are none.
    pub(crate) fn notice(&self, path: &Path) -> Option<Notice> {
        let (path, count, first) = (path.display(), self.count, self.first.as_ref()?);
        let message = format!("{path}: {} omitted: fewer than 3 corners, the first in {first}", counted(count, "face"));
        Some(Notice::new(NoticeCode::DroppedGeometry, message))
    }
}

/// Polygons as one flat list of corners. Most files contain only triangles, and many only positions. Data that a file
/// does not have takes no memory, because first access to memory takes much of the reading time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Polygons {
    positions: Vec<u32>,
    /// Texture coordinates and normal of each corner; empty if no corner has any.
    attributes: Vec<[u32; 2]>,
    /// Number of triangles before the first polygon with more than 3 corners.
    triangles: usize,
    /// End offsets in `positions` of the polygons after these triangles.
    ends: Vec<usize>,
}

impl Polygons {
    /// Reserves the memory of later calls of [`Polygons::append`].
    pub(crate) fn reserve<'a>(&mut self, later: impl Iterator<Item = &'a Self> + Clone) {
        let sum = |count: fn(&Self) -> usize| later.clone().map(count).sum();
        self.positions.reserve_exact(sum(|p| p.positions.len()));
        self.attributes.reserve_exact(sum(|p| p.attributes.len()));
        self.ends.reserve_exact(sum(|p| p.ends.len()));
    }

    /// Number of polygons.
    pub(crate) fn len(&self) -> usize {
        self.triangles + self.ends.len()
    }

    /// Adds a corner to the current polygon.
    pub(crate) fn push_corner(&mut self, corner: Corner) {
        let attributes = [corner.uv, corner.normal];
        if !self.attributes.is_empty() || attributes != [NO_INDEX; 2] {
            self.attributes.resize(self.positions.len(), [NO_INDEX; 2]);
            self.attributes.push(attributes);
        }
        self.positions.push(corner.position);
    }

    /// Ends the current polygon, and drops it if it has fewer than 3 corners. Returns true if the polygon was kept.
    pub(crate) fn end_face(&mut self) -> bool {
        let (start, end) = (self.start(self.len()), self.positions.len());
        match end - start {
            0..3 => {
                self.positions.truncate(start);
                self.attributes.truncate(start);
                return false;
            }
            3 if self.ends.is_empty() => self.triangles += 1,
            _ => self.ends.push(end),
        }
        true
    }

    /// Appends the polygons of a later piece of the file.
    pub(crate) fn append(&mut self, mut later: Self) {
        let start = self.positions.len();
        if self.ends.is_empty() {
            self.triangles += later.triangles;
        } else {
            let ends = (1..=later.triangles).map(|count| start + 3 * count);
            self.ends.extend(ends);
        }
        self.ends.extend(later.ends.iter().map(|end| start + end));
        if !self.attributes.is_empty() || !later.attributes.is_empty() {
            self.attributes.resize(start, [NO_INDEX; 2]);
            later.attributes.resize(later.positions.len(), [NO_INDEX; 2]);
            self.attributes.append(&mut later.attributes);
        }
        self.positions.append(&mut later.positions);
    }

    /// Number of corners of all polygons, including the current one.
    pub(crate) fn corner_count(&self) -> usize {
        self.positions.len()
    }

    /// Corner by its index over all polygons.
    fn corner_at(&self, corner: usize) -> Corner {
        let [uv, normal] = (self.attributes.get(corner)).map_or([NO_INDEX; 2], |given| *given);
        Corner { position: self.positions[corner], uv, normal }
    }

    /// Changes a corner, given by its index over all polygons, if the corner exists.
    pub(crate) fn edit_corner(&mut self, corner: usize, change: impl FnOnce(&mut Corner)) {
        if corner >= self.positions.len() {
            return;
        }
        let mut changed = self.corner_at(corner);
        change(&mut changed);
        self.positions[corner] = changed.position;
        let attributes = [changed.uv, changed.normal];
        if !self.attributes.is_empty() || attributes != [NO_INDEX; 2] {
            self.attributes.resize(self.positions.len(), [NO_INDEX; 2]);
            self.attributes[corner] = attributes;
        }
    }

    /// Removes the texture coordinates (1) or normals (2) of all corners.
    pub(crate) fn drop_attribute(&mut self, kind: usize) {
        for attributes in &mut self.attributes {
            attributes[kind - 1] = NO_INDEX;
        }
    }

    /// Index of the first corner of a polygon.
    fn start(&self, polygon: usize) -> usize {
        match polygon.checked_sub(self.triangles + 1) {
            None => 3 * polygon,
            Some(before) => self.ends[before],
        }
    }

    /// Indices of the corners of a polygon.
    pub(crate) fn range(&self, polygon: usize) -> Range<usize> {
        self.start(polygon)..self.start(polygon + 1)
    }

    /// The corners of a polygon.
    pub(crate) fn get(&self, polygon: usize) -> impl ExactSizeIterator<Item = Corner> + Clone {
        self.range(polygon).map(|corner| self.corner_at(corner))
    }

    /// Cuts a range of the polygons, of at least 3 corners each, and passes every triangle with the index of its
    /// polygon, in order. Corners and work are charged to the budget.
    pub(crate) fn triangles(
        &self,
        range: Range<usize>,
        path: &Path,
        budget: &mut Budget,
        position: impl Fn(Corner) -> DVec3,
        mut triangle: impl FnMut(usize, [Corner; 3]),
    ) -> Result<()> {
        let corners = self.start(range.end) - self.start(range.start);
        budget.take_elements(path, corners as u64)?;
        let before = budget.steps;
        let (mut points, mut cut) = (Vec::new(), Vec::new());
        for polygon in range {
            let corners = self.range(polygon);
            if corners.len() == 3 {
                triangle(polygon, [0, 1, 2].map(|i| self.corner_at(corners.start + i)));
                continue;
            }
            if corners.len() > MAX_CORNERS {
                let message = format!("a face has {} corners; the maximum is {MAX_CORNERS}", corners.len());
                return Err(FormatError::unsupported(path, message));
            }
            points.clear();
            points.extend(self.get(polygon).map(&position));
            // A face with a corner that is not finite is omitted later, so a single triangle represents it.
            if let Some(bad) = points.iter().position(|point| !point.is_finite()) {
                let count = corners.len();
                triangle(polygon, [0, 1, 2].map(|i| self.corner_at(corners.start + (bad + i) % count)));
                continue;
            }
            cut.clear();
            ear_clipping::triangulate(&points, &mut budget.steps, &mut cut).map_err(|_| FormatError::Budget {
                path: path.into(),
                what: "steps to cut its polygons into triangles",
                amount: before,
                left: 0,
            })?;
            for corner in &cut {
                triangle(polygon, corner.map(|i| self.corner_at(corners.start + i as usize)));
            }
        }
        Ok(())
    }
}
