//! Calibrations that a device stores or its SDK prints: RealSense and ZED cameras, Aria glasses.

pub(crate) mod aria;
pub(crate) mod aria_mps;
pub(crate) mod real_sense;
pub(crate) mod zed;
