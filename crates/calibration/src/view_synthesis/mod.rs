//! Cameras of benchmarks for stereo and view synthesis.

pub(crate) mod llff;
pub(crate) mod middlebury;
pub(crate) mod mvsnet;
pub(crate) mod neus;
pub(crate) mod pmvs;
pub(crate) mod real_estate;
