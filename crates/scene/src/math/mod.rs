//! Mathematics of space and time, independent of a world: orientation, and curves of moving things.

pub mod hermite;
pub mod polar;
pub mod rotation;
