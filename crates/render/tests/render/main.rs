//! One file for each concept of the crate.

mod adaptive;
mod amodal;
mod bright_path;
mod channel;
mod common;
mod direct;
mod display;
mod estimator;
mod flow;
mod frame;
mod gaps;
mod keypoints;
mod light;
mod media;
mod panes;
mod passes;
mod path;
mod physics;
mod prepare;
mod scales;
mod transparent;
mod truth;
