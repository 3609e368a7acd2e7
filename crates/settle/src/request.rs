//! Request: which objects fall, where and how.

/// Physical properties of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physics {
    /// Density in kg/m³.
    pub density: f64,
    /// Coulomb friction coefficient; for two surfaces, the mean is used.
    pub friction: f64,
    /// Restitution: fraction of the speed that a bounce keeps; for two surfaces, the mean is used.
    pub restitution: f64,
    /// Maximum number of convex parts that represent a mesh; 1 for its convex hull.
    pub parts: u32,
}

impl Default for Physics {
    fn default() -> Self {
        Self { density: 1000.0, friction: 0.5, restitution: 0.1, parts: 32 }
    }
}

/// Constraint of a target on its objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Objects must be completely within the target's sides.
    Into,
    /// The objects' centres must be above this target.
    On,
}

/// Target: objects above which others are dropped.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Indices into the world's objects.
    pub objects: Vec<usize>,
    /// Constraint on the dropped objects.
    pub place: Place,
}

/// Request: which objects fall, where and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Indices into the world's objects.
    pub moving: Vec<usize>,
    /// Properties of each object of the world; missing properties have default values. Density and parts have no effect
    /// on objects that do not move.
    pub physics: Vec<(usize, Physics)>,
    /// Target above which objects are dropped with random poses; without a target, the objects fall from their current
    /// poses.
    pub target: Option<Target>,
    /// Seed of random poses.
    pub seed: u64,
    /// Limit of the simulated time after the last object is dropped, in seconds.
    pub seconds: f64,
    /// Acceleration towards the ground in m/s².
    pub gravity: f64,
}

impl Request {
    /// Returns the properties of an object.
    pub(crate) fn physics_of(&self, object: usize) -> Physics {
        let known = self.physics.iter().rev().find(|(known, _)| *known == object);
        known.map_or_else(Physics::default, |(_, physics)| *physics)
    }
}
