//! Rays and hits, as they come in and go out of every query.

/// The id of nothing: instance and triangle of a ray that meets no triangle.
pub const INVALID_ID: u32 = u32::MAX;

/// A ray in scene-local coordinates (float32, relative to [`crate::Scene`]'s origin): 28 bytes.
///
/// It covers `origin + t * direction` for `0 <= t <= t_max`; `direction` needs no normalisation and `t` counts in its
/// lengths. A ray with a NaN or infinite origin or direction, or a zero direction, meets nothing.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, scene-local.
    pub origin: [f32; 3],
    /// Direction, any length but zero.
    pub direction: [f32; 3],
    /// The largest `t` that counts; infinity for no limit.
    pub t_max: f32,
}

impl Ray {
    /// Nothing beyond `t` counts any more. (A `t_max` that is NaN stays what it is: such a ray meets nothing.)
    #[inline(always)]
    pub(crate) fn clip_t_max(&mut self, t: f32) {
        if t < self.t_max {
            self.t_max = t;
        }
    }
}

/// What a ray met first: the smallest (t, instance, triangle) in lexicographic order.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// In lengths of the ray's direction; infinity where the ray met nothing.
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
    /// The answer of a ray that meets nothing.
    pub const MISS: Hit = Hit {
        t: f32::INFINITY,
        u: 0.0,
        v: 0.0,
        instance: INVALID_ID,
        triangle: INVALID_ID,
    };

    /// Takes another hit of the ray if it comes first.
    #[inline(always)]
    pub(crate) fn keep_closer(&mut self, other: Hit) {
        let order = |hit: &Hit| (hit.t, hit.instance, hit.triangle);
        if order(&other) < order(self) {
            *self = other;
        }
    }
}

/// A float64 ray in world coordinates, for answers that must be those of exact geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactRay {
    /// Start, in the world.
    pub origin: [f64; 3],
    /// Direction, any length but zero.
    pub direction: [f64; 3],
    /// The largest `t` that counts; infinity for no limit.
    pub t_max: f64,
}

/// The float64 answer: as [`Hit`], computed from the float64 corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactHit {
    /// In lengths of the ray's direction; infinity where the ray met nothing.
    pub t: f64,
    /// Barycentric weight of the triangle's second corner; 0 for a miss.
    pub u: f64,
    /// Barycentric weight of the triangle's third corner; 0 for a miss.
    pub v: f64,
    /// Index into the instances of the scene, or [`INVALID_ID`].
    pub instance: u32,
    /// Index into the triangles of that instance's mesh, or [`INVALID_ID`].
    pub triangle: u32,
    /// Of the triangle with corners a, b, c: (b - a) x (c - a) in the world, twice its area long; 0 for a miss.
    pub normal: [f64; 3],
}

impl ExactHit {
    /// The answer of a ray that meets nothing.
    pub const MISS: ExactHit = ExactHit {
        t: f64::INFINITY,
        u: 0.0,
        v: 0.0,
        instance: INVALID_ID,
        triangle: INVALID_ID,
        normal: [0.0; 3],
    };
}

/// What the caller knows of a batch. It changes the speed of an answer, never the answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// Nothing is known: the batch is looked at.
    #[default]
    Unknown,
    /// Neighbours in the slice run alike: 64 rays in a row are best an 8 x 8 tile of pixels.
    Coherent,
    /// Neighbours run apart, as diffuse bounces do.
    Incoherent,
}
