//! Aperture of a thin lens: points out of focus are blurred (Kolb, Mitchell and Hanrahan, "A realistic camera model for
//! computer graphics", SIGGRAPH 1995, section 2).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use glam::{DMat3, DVec2, DVec3};

use serde::{Deserialize, Serialize};

use crate::camera::lens::Lens;
use crate::error::{Result, SceneError};

/// Minimum and maximum number of blades of a polygonal opening.
const BLADES: std::ops::RangeInclusive<u32> = 3..=64;

/// Round or polygonal opening around the camera's centre.
///
/// With a planar lens model (pinhole, `opencv`, `fov`), the opening is in the plane through the centre perpendicular to
/// the principal axis, and points at the depth `focus` are sharp. With wide-angle models, the opening is perpendicular
/// to the direction of the incoming light, and points at the distance `focus` are sharp.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Aperture {
    radius: f64,
    focus: f64,
    blades: u32,
    rotation: f64,
}

impl Aperture {
    /// Creates an opening with a radius (for a polygon, of its corners) that is focused at a distance, both in world
    /// units. `blades` is the number of the polygon's sides, 0 for a round opening. `rotation` turns the polygon, in
    /// degrees from the camera's x axis towards its y axis; at 0, a corner is on the x axis.
    ///
    /// # Errors
    /// [`SceneError::Camera`] for a negative radius, a focus that is not positive, numbers that are not finite, and 1,
    /// 2 or more than 64 blades.
    pub fn new(radius: f64, focus: f64, blades: u32, rotation: f64) -> Result<Self> {
        let fail = |message: String| Err(SceneError::camera(format!("aperture: {message}")));
        if !(radius >= 0.0 && radius.is_finite()) {
            return fail(format!("radius is {radius}; expected a finite length >= 0"));
        }
        if !(focus > 0.0 && focus.is_finite()) {
            return fail(format!("focus is {focus}; expected a finite distance > 0"));
        }
        if blades != 0 && !BLADES.contains(&blades) {
            return fail(format!("{blades} blades; expected 3 to 64, or 0 for a round opening"));
        }
        if !rotation.is_finite() {
            return fail(format!("rotation is {rotation}; expected a finite number of degrees"));
        }
        Ok(Self { radius, focus, blades, rotation })
    }

    /// Radius of a round opening, or of a polygon's corners.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Focus distance in world units.
    pub fn focus(&self) -> f64 {
        self.focus
    }

    /// Number of the polygon's sides; 0 for a round opening.
    pub fn blades(&self) -> u32 {
        self.blades
    }

    /// Rotation of the polygon in degrees.
    pub fn rotation(&self) -> f64 {
        self.rotation
    }

    /// For a ray with this unit direction through the centre, in camera axes: returns a random point of the opening,
    /// and the unit direction of the ray through this point that meets the first ray in focus. `numbers` are two random
    /// numbers in 0..1.
    pub(super) fn bend_ray(&self, direction: DVec3, lens: &Lens, numbers: [f64; 2]) -> (DVec3, DVec3) {
        let at = self.sample_point(numbers).extend(0.0);
        let (opening, sharp) = if lens.is_planar() {
            (at, direction * (self.focus / direction.z))
        } else {
            (rotation_from_z(direction) * at, direction * self.focus)
        };
        (opening, (sharp - opening).normalize())
    }

    /// A point of the opening, uniformly distributed.
    fn sample_point(&self, [a, b]: [f64; 2]) -> DVec2 {
        if self.blades == 0 {
            return self.radius * concentric_disk(a, b);
        }
        // The polygon is divided into triangles around the centre: select a triangle, and a point in it.
        let sides = f64::from(self.blades);
        let side = (a * sides).floor().min(sides - 1.0);
        let along = a * sides - side;
        let corner = |i: f64| DVec2::from_angle(self.rotation.to_radians() + TAU * i / sides);
        let edge = corner(side).lerp(corner(side + 1.0), along);
        self.radius * b.sqrt() * edge
    }
}

/// Maps the unit square to the unit disc, uniformly and continuously (Shirley and Chiu, "A low distortion map between
/// disk and square", 1997).
fn concentric_disk(a: f64, b: f64) -> DVec2 {
    let (x, y) = (2.0 * a - 1.0, 2.0 * b - 1.0);
    if x == 0.0 && y == 0.0 {
        DVec2::ZERO
    } else if x.abs() > y.abs() {
        x * DVec2::from_angle(FRAC_PI_4 * (y / x))
    } else {
        y * DVec2::from_angle(FRAC_PI_2 - FRAC_PI_4 * (x / y))
    }
}

/// Smallest rotation that maps z to a unit direction; for the opposite direction, half a turn about x.
fn rotation_from_z(direction: DVec3) -> DMat3 {
    if direction.z < -1.0 + 1e-12 {
        return DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    }
    let DVec3 { x, y, z } = direction;
    let s = 1.0 / (1.0 + z);
    DMat3::from_cols(
        DVec3::new(1.0 - x * x * s, -x * y * s, -x),
        DVec3::new(-x * y * s, 1.0 - y * y * s, -y),
        direction,
    )
}
