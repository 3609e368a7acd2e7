//! Worlds, cameras and frames for JavaScript: what a page holds instead of a server.
//!
//! A thin shell: files come as bytes, pictures go as typed arrays, and everything between is done by the crates below.
//! Errors are JSON texts, see [`failure`]. One thread does all, in a worker of the page.
#![forbid(unsafe_code)]

pub mod failure;
pub mod request;

#[cfg(target_family = "wasm")]
mod page;
