//! Settings of SLAM and odometry programs: K, lens and mounts on a body.

pub(crate) mod basalt;
pub(crate) mod camodocal;
pub(crate) mod mrcal;
pub(crate) mod orb_slam;
pub(crate) mod real_sense;
pub(crate) mod vins;
pub(crate) mod zed;
