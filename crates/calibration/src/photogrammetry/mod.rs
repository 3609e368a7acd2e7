//! Reconstructions of photogrammetry programs: cameras with lenses and poses for every image.

pub(crate) mod alice_vision;
pub(crate) mod bundler;
pub(crate) mod kapture;
pub(crate) mod metashape;
pub(crate) mod open_mvg;
pub(crate) mod open_sfm;
pub(crate) mod reality_capture;
pub(crate) mod xmp;
