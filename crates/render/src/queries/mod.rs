//! Queries of rays, points and pairs of points, decided exactly for the float64 numbers given.
//!
//! Rays hit closed triangles ([`rays`], [`visible`]) or cross surfaces ([`crossings`]); crossings tell inside from outside
//! ([`inside`]). Points have closest points ([`points`]) with a side ([`signed_distance`]).

pub mod crossings;
pub mod fields;
pub mod inside;
pub mod points;
pub mod rays;
pub mod selection;
pub mod signed_distance;
mod tasks;
pub mod visible;
pub mod winding;
