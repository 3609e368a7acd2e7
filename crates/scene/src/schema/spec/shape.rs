//! Shapes with a name.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::schema::shorthand::Splat;

/// A box.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BoxShape {
    /// Edge lengths along x, y, z, or one number for all; default 1.
    pub size: Splat<3>,
}

/// A rectangle.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlaneShape {
    /// Edge lengths along x and y, or one number for both; default 1.
    pub size: Splat<2>,
}

/// A sphere.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SphereShape {
    /// The radius; default 0.5.
    pub radius: f64,
    /// Number of times that the 20 faces of an icosahedron are split into four, 0 to 9; default 4 (5120 triangles).
    pub level: u32,
}

/// A cylinder.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CylinderShape {
    /// The radius; default 0.5.
    pub radius: f64,
    /// The height; default 1.
    pub height: f64,
    /// Corners around the axis, 3 to 4096; default 64.
    pub segments: u32,
}

/// A cone.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConeShape {
    /// The radius of its base; default 0.5.
    pub radius: f64,
    /// The height; default 1.
    pub height: f64,
    /// Corners around the axis, 3 to 4096; default 64.
    pub segments: u32,
}

/// A torus.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TorusShape {
    /// Distance from the centre to the middle of the tube; default 0.5.
    pub radius: f64,
    /// The radius of the tube; default 0.2.
    pub tube: f64,
    /// Corners around the axis, 3 to 2048; half as many, at least 3, around the tube. Default 64.
    pub segments: u32,
}

impl Default for BoxShape {
    fn default() -> Self {
        Self { size: Splat([1.0; 3]) }
    }
}

impl Default for PlaneShape {
    fn default() -> Self {
        Self { size: Splat([1.0; 2]) }
    }
}

impl Default for SphereShape {
    fn default() -> Self {
        Self { radius: 0.5, level: 4 }
    }
}

impl Default for CylinderShape {
    fn default() -> Self {
        Self { radius: 0.5, height: 1.0, segments: 64 }
    }
}

impl Default for ConeShape {
    fn default() -> Self {
        Self { radius: 0.5, height: 1.0, segments: 64 }
    }
}

impl Default for TorusShape {
    fn default() -> Self {
        Self { radius: 0.5, tube: 0.2, segments: 64 }
    }
}
