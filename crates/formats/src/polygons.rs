//! The polygons of a file, and the triangles they become.

use std::ops::Range;
use std::path::Path;

use glam::DVec3;

use crate::budget::Budget;
use crate::error::FormatError;
use crate::polygon;

/// The most corners of one polygon: the memory to cut it stays in proportion to the file.
const MOST_CORNERS: usize = 1 << 20;

/// Faces of fewer than 3 corners: they have no area, and are passed over as other readers do.
#[derive(Debug, Default)]
pub(crate) struct Thin {
    count: usize,
    /// Where the first is.
    first: Option<String>,
}

impl Thin {
    /// Counts one.
    pub(crate) fn add(&mut self, place: impl FnOnce() -> String) {
        self.count += 1;
        self.first.get_or_insert_with(place);
    }

    /// Counts those of a later part of the file.
    pub(crate) fn append(&mut self, later: Self) {
        self.count += later.count;
        self.first = self.first.take().or(later.first);
    }

    /// What there is to say about them, if there are any.
    pub(crate) fn notice(&self, path: &Path) -> Option<String> {
        let (path, count, first) = (path.display(), self.count, self.first.as_ref()?);
        Some(format!(
            "{path}: faces of fewer than 3 corners are skipped: {count}, the first in {first}"
        ))
    }
}

/// Polygons as one flat list of corners of any kind.
#[derive(Clone, Debug)]
pub(crate) struct Polygons<C> {
    corners: Vec<C>,
    /// Where each polygon ends in `corners`.
    ends: Vec<usize>,
}

impl<C> Default for Polygons<C> {
    fn default() -> Self {
        Self {
            corners: Vec::new(),
            ends: Vec::new(),
        }
    }
}

impl<C: Copy> Polygons<C> {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Makes room for so many more polygons and corners.
    pub(crate) fn reserve(&mut self, polygons: usize, corners: usize) {
        self.ends.reserve_exact(polygons);
        self.corners.reserve_exact(corners);
    }

    /// How many polygons there are.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Adds a corner to the polygon under way.
    pub(crate) fn corner(&mut self, corner: C) {
        self.corners.push(corner);
    }

    /// Ends the polygon under way, or lets go of it where it has fewer than 3 corners; whether it was kept.
    pub(crate) fn end_face(&mut self) -> bool {
        let start = self.ends.last().copied().unwrap_or(0);
        let kept = self.corners.len() - start >= 3;
        if kept {
            self.ends.push(self.corners.len());
        } else {
            self.corners.truncate(start);
        }
        kept
    }

    /// Adds polygons after these.
    pub(crate) fn append(&mut self, mut later: Self) {
        let start = self.corners.len();
        self.ends.extend(later.ends.iter().map(|end| start + end));
        self.corners.append(&mut later.corners);
    }

    /// How many corners all polygons have, with the one under way.
    pub(crate) fn corner_count(&self) -> usize {
        self.corners.len()
    }

    /// A corner, counted over all polygons.
    pub(crate) fn corner_mut(&mut self, corner: usize) -> Option<&mut C> {
        self.corners.get_mut(corner)
    }

    /// The corners of a range of polygons, to be changed, and where each polygon ends in all corners.
    pub(crate) fn corners_mut(&mut self, range: Range<usize>) -> impl Iterator<Item = &mut [C]> {
        let first = if range.start == 0 {
            0
        } else {
            self.ends[range.start - 1]
        };
        let ends = &self.ends[range];
        let mut rest = &mut self.corners[first..];
        let mut start = first;
        ends.iter().map(move |&end| {
            let (polygon, after) = std::mem::take(&mut rest).split_at_mut(end - start);
            (rest, start) = (after, end);
            polygon
        })
    }

    /// The corners of a polygon.
    pub(crate) fn get(&self, polygon: usize) -> &[C] {
        let start = if polygon == 0 {
            0
        } else {
            self.ends[polygon - 1]
        };
        &self.corners[start..self.ends[polygon]]
    }

    /// Cuts a range of the polygons, of at least 3 corners each, and shows every triangle with the number of its
    /// polygon, in order. Corners and work are taken from the budget.
    pub(crate) fn triangles(
        &self,
        range: Range<usize>,
        path: &Path,
        budget: &mut Budget,
        position: impl Fn(C) -> DVec3,
        mut triangle: impl FnMut(usize, [C; 3]),
    ) -> Result<(), FormatError> {
        let corners: usize = range.clone().map(|polygon| self.get(polygon).len()).sum();
        budget.take_elements(path, corners as u64)?;
        let before = budget.steps;
        let (mut points, mut cut) = (Vec::new(), Vec::new());
        for polygon in range {
            let corners = self.get(polygon);
            if let [a, b, c] = *corners {
                triangle(polygon, [a, b, c]);
                continue;
            }
            if corners.len() > MOST_CORNERS {
                let message = format!(
                    "a face of {} corners, more than {MOST_CORNERS}",
                    corners.len()
                );
                return Err(FormatError::unsupported(path, message));
            }
            points.clear();
            points.extend(corners.iter().map(|&c| position(c)));
            cut.clear();
            polygon::triangulate(&points, &mut budget.steps, &mut cut).map_err(|_| {
                FormatError::Budget {
                    path: path.into(),
                    what: "steps were not enough to cut its polygons into triangles",
                    amount: before,
                    left: 0,
                }
            })?;
            for corner in &cut {
                triangle(polygon, corner.map(|i| corners[i as usize]));
            }
        }
        Ok(())
    }
}
