//! What falls, where and how.

/// Physical properties of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physics {
    /// Mass per volume in kg/m³.
    pub density: f64,
    /// Coulomb's coefficient; of two surfaces, the mean counts.
    pub friction: f64,
    /// Share of the speed that a bounce keeps; of two surfaces, the mean counts.
    pub restitution: f64,
    /// Greatest number of convex parts that represent a mesh; 1 for its convex hull.
    pub parts: u32,
}

impl Default for Physics {
    fn default() -> Self {
        Self { density: 1000.0, friction: 0.5, restitution: 0.1, parts: 32 }
    }
}

/// How a target holds objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Objects lie completely within its sides.
    Into,
    /// The objects' centres lie above it.
    On,
}

/// Objects above which others are dropped.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Indices into the world's objects.
    pub objects: Vec<usize>,
    /// How they hold objects.
    pub place: Place,
}

/// What falls, where and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Indices into the world's objects.
    pub moving: Vec<usize>,
    /// Properties of each object of the world; the others are as by default. Density and parts have no effect on objects
    /// that do not move.
    pub physics: Vec<(usize, Physics)>,
    /// Where objects are thrown, with random poses; without it they fall from where they are.
    pub target: Option<Target>,
    /// Seed of random poses.
    pub seed: u64,
    /// Limit of the simulated time after the last object is dropped, in seconds.
    pub seconds: f64,
    /// Acceleration towards the ground in m/s².
    pub gravity: f64,
}

impl Request {
    /// The properties of an object.
    pub(crate) fn physics_of(&self, object: usize) -> Physics {
        let known = self.physics.iter().rev().find(|(known, _)| *known == object);
        known.map_or_else(Physics::default, |(_, physics)| *physics)
    }
}
