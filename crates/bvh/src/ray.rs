//! Rays and hits of all queries.

use crate::exact::predicates::RayPredicates;

/// Value of the instance and of the triangle for a miss.
pub const INVALID_ID: u32 = u32::MAX;

/// A ray in scene-local float32 coordinates, relative to [`crate::Scene`]'s origin: 28 bytes.
///
/// The ray covers `origin + t * direction` for `0 <= t <= t_max`; `direction` has any length, and `t` is measured in
/// units of this length. A ray with a NaN or infinite origin or direction, or a zero direction, misses.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin in scene-local coordinates.
    pub origin: [f32; 3],
    /// Direction of any length except 0, in the same coordinate frame.
    pub direction: [f32; 3],
    /// The largest valid `t`; infinity for no limit.
    pub t_max: f32,
}

impl Ray {
    /// Clips the ray at `t`. A NaN `t_max` is kept, and such a ray misses.
    #[inline(always)]
    pub(crate) fn clip_t_max(&mut self, t: f32) {
        if t < self.t_max {
            self.t_max = t;
        }
    }
}

/// The closest hit of a ray: the lexicographically smallest (t, instance, triangle).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in units of the direction's length; infinity for a miss.
    pub t: f32,
    /// Barycentric weight of the triangle's second corner; 0 for a miss.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner; 0 for a miss.
    pub v: f32,
    /// Index into the instances of the scene, or [`INVALID_ID`].
    pub instance: u32,
    /// Index into the triangles of that instance's mesh, or [`INVALID_ID`].
    pub triangle: u32,
}

impl Hit {
    /// The hit of a ray that misses.
    pub const MISS: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, instance: INVALID_ID, triangle: INVALID_ID };

    /// Replaces the hit by another hit of the same ray if the other hit is closer.
    #[inline(always)]
    pub(crate) fn keep_closer(&mut self, other: Hit) {
        let order = |hit: &Hit| (hit.t, hit.instance, hit.triangle);
        if order(&other) < order(self) {
            *self = other;
        }
    }
}

/// A float64 ray in world coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactRay {
    /// Origin in world coordinates.
    pub origin: [f64; 3],
    /// Direction of any length except 0, in the same coordinate frame.
    pub direction: [f64; 3],
    /// Minimum valid `t`, possibly negative; minus infinity for the whole line.
    pub t_min: f64,
    /// The largest valid `t`; infinity for no limit.
    pub t_max: f64,
}

/// The closest hit in float64, computed from float64 corners: the fields of [`Hit`], the normal and the side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactHit {
    /// Distance along the ray, in units of the direction's length; infinity for a miss.
    pub t: f64,
    /// Barycentric weight of the triangle's second corner; 0 for a miss.
    pub u: f64,
    /// Barycentric weight of the triangle's third corner; 0 for a miss.
    pub v: f64,
    /// Index into the instances of the scene, or [`INVALID_ID`].
    pub instance: u32,
    /// Index into the triangles of that instance's mesh, or [`INVALID_ID`].
    pub triangle: u32,
    /// (b - a) x (c - a) of the triangle a, b, c in the world; its length is twice the triangle's area; 0 for a miss.
    pub normal: [f64; 3],
    /// The exact sign of the ray's direction along that normal: 1 or -1; 0 for a miss.
    pub side: i32,
}

/// Fields of an [`ExactHit`] that a query computes; all other fields are unspecified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HitDetail {
    /// Instance and triangle.
    Triangle,
    /// Instance, triangle, the triangle's normal and the side.
    Side,
    /// All fields, with t and weights in float64.
    Intersection,
    /// All fields, with t and weights accurate to one unit in the last place.
    Refined,
}

/// A ray that hits several instances at the same distance, up to rounding to float32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tie {
    /// The ray's index in the batch.
    pub ray: u32,
    /// True if two of the surfaces are coplanar and the ray does not hit them at their edges. False if the surfaces
    /// only touch at the hit, for example if the ray hits the bottom edge of a box that stands on a floor.
    pub is_coplanar: bool,
}

impl ExactRay {
    /// Sign of d . (a - o) x (b - o) for the direction d and the origin o shifted by an infinitesimal vector: the side
    /// on which the line passes an edge. 0 only for an edge parallel to the ray.
    pub fn edge_side(&self, a: [f64; 3], b: [f64; 3]) -> i32 {
        RayPredicates { origin: self.origin, direction: self.direction }.moved_edge_sign(a, b)
    }
}

impl ExactHit {
    /// The hit of a ray that misses.
    pub const MISS: ExactHit = ExactHit {
        t: f64::INFINITY,
        u: 0.0,
        v: 0.0,
        instance: INVALID_ID,
        triangle: INVALID_ID,
        normal: [0.0; 3],
        side: 0,
    };
}

/// Filter that accepts or rejects a ray's hits; rays are identified by their index in the batch.
pub trait HitFilter {
    /// True if hits of an instance may be accepted.
    fn accepts_instance(&self, ray: usize, instance: u32) -> bool;

    /// True if every hit of an accepted instance is accepted, so that [`HitFilter::accepts`] need not be called.
    fn accepts_every_hit(&self) -> bool {
        false
    }

    /// True if a hit is accepted; its instance has already been accepted. All fields of the hit except `t` are set.
    fn accepts(&self, ray: usize, hit: &ExactHit) -> bool;
}

/// The point of a scene that is closest to a given point, computed from float64 corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// Distance in world units; infinity if no point is within reach.
    pub distance: f64,
    /// Position in world coordinates; NaN if no point is within reach.
    pub position: [f64; 3],
    /// Barycentric weights of the corners, with sum 1; 0 if no point is within reach.
    pub weights: [f64; 3],
    /// Index into the instances of the scene, or [`INVALID_ID`].
    pub instance: u32,
    /// Index into the triangles of that instance's mesh, or [`INVALID_ID`].
    pub triangle: u32,
}

impl ClosestPoint {
    /// The answer if no point is within reach.
    pub const MISS: ClosestPoint = ClosestPoint {
        distance: f64::INFINITY,
        position: [f64::NAN; 3],
        weights: [0.0; 3],
        instance: INVALID_ID,
        triangle: INVALID_ID,
    };
}

/// The caller's hint about a batch. Coherence only affects speed; hits do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// The coherence is unknown; the query examines the batch.
    #[default]
    Unknown,
    /// Neighbours in the slice are coherent; ideally, 64 consecutive rays are an 8 x 8 tile of pixels.
    Coherent,
    /// Neighbouring rays diverge, like diffuse bounces.
    Incoherent,
}
