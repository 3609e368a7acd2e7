//! Ray, point and point-pair queries, decided exactly for the given float64 numbers.
//!
//! Rays hit closed triangles ([`rays`], [`visible`]; with a time per ray: [`timed`]) or cross surfaces ([`crossings`]).
//! Cameras show surface points ([`camera_sight`]) and faces ([`face_sight`]). Crossings decide whether points are inside
//! ([`inside`]). Points have closest points ([`points`]) and signed distances ([`signed_distance`]); points of surfaces
//! receive and emit light ([`light`]) and move ([`velocity`]). Photographs have colours at fractional pixels
//! ([`photo_pyramid`]), and texels keep their best views in photographs ([`texel_views`]).

mod block_view;
pub mod camera_sight;
pub mod crossings;
pub mod face_sight;
pub mod fields;
pub mod inside;
pub mod light;
mod moving_objects;
pub mod photo_pyramid;
pub mod points;
mod ray_order;
pub mod rays;
pub mod selection;
mod sight_line;
pub mod signed_distance;
mod tasks;
pub mod texel_views;
pub mod timed;
pub mod velocity;
mod view_bounds;
pub mod visible;
pub mod winding;
