//! Files that calibration programs write: Anipose, Kalibr, camodocal, mrcal, Basalt. OpenCV's have their own folder.

pub(crate) mod anipose;
pub(crate) mod basalt;
pub(crate) mod camodocal;
pub(crate) mod kalibr;
pub(crate) mod mrcal;
