//! Files of calibration programs: Anipose, Kalibr, camodocal, mrcal, Basalt. OpenCV's files have a separate folder.

pub(crate) mod anipose;
pub(crate) mod basalt;
pub(crate) mod camodocal;
pub(crate) mod kalibr;
pub(crate) mod mrcal;
