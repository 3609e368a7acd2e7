//! Mathematics of space and time, independent of a world: orientation, and curves of moving objects.

pub mod hermite;
pub mod polar;
pub mod rotation;
