//! One file for each concept of the crate.

mod brute;
mod closest_points;
mod coplanar;
mod crossings;
mod degenerate;
mod flattened;
mod rebraid;
mod refit;
mod scene;
mod subpixel_geometry;
mod support;
mod translated_instances;
mod watertight;
