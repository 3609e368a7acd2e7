//! Settings files of SLAM and odometry programs: K, lens and the mounts of cameras on a body.

pub(crate) mod ncamera;
pub(crate) mod orb_slam;
pub(crate) mod ov2slam;
pub(crate) mod vins;
