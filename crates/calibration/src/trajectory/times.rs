//! Times of trajectories.

use raycam_scene::{Notice, NoticeCode};

use crate::CameraRecord;

/// Latest time, in seconds since 1970 (the year 5138); later times must be in another unit.
const LATEST_TIME: f64 = 1e11;

/// Returns a notice if the times are not in seconds.
pub(crate) fn notice_of_odd_times(records: &[CameraRecord]) -> Option<Notice> {
    let times = records.iter().filter_map(|record| record.time);
    let latest = times.fold(0.0, |latest: f64, time| latest.max(time.abs()));
    if latest <= LATEST_TIME {
        return None;
    }
    let unit = ["milliseconds", "microseconds", "nanoseconds"]
        .into_iter()
        .zip([1e14, 1e17, f64::INFINITY])
        .find_map(|(unit, end)| (latest < end).then_some(unit))
        .unwrap_or("another unit");
    let message = format!("times up to {latest:e}, read as seconds, look like {unit}; the numbers are kept");
    Some(Notice::new(NoticeCode::Implausible, message))
}
