//! One file for each concept of the crate.

mod common;
mod pile;
mod rest;
