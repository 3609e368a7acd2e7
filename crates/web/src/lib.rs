//! Worlds, cameras and frames for JavaScript, for pages that do not use a server.
//!
//! A thin wrapper: files are passed as bytes, images are returned as typed arrays, and the other crates do all work.
//! Errors are JSON texts; see [`failure`]. One thread, a worker of the page, does all work.
#![forbid(unsafe_code)]

pub mod failure;
pub mod request;

#[cfg(target_family = "wasm")]
mod page;
