//! One file for each concept of the crate.

mod corpus;
mod formats;
mod samples;
mod support;
