//! Ray, point and point-pair queries, decided exactly for the given float64 numbers.
//!
//! Rays hit closed triangles ([`rays`], each at its own time: [`timed`], [`visible`]) or cross surfaces ([`crossings`]); crossings decide inside or
//! outside ([`inside`]). Points have closest points ([`points`]) with a side ([`signed_distance`]).

pub mod crossings;
pub mod fields;
pub mod inside;
pub mod points;
pub mod rays;
pub mod selection;
pub mod signed_distance;
mod tasks;
pub mod timed;
pub mod visible;
pub mod winding;
