//! Calibration files of other projects.

use raycam_calibration::{ReadHints, read};
use raycam_formats::Budget;

use crate::support::data;

#[test]
fn opencv_samples_are_read_or_their_errors_name_the_file() {
    let path = data("opencv_sample.yml");
    if let Err(error) = read(&path, None, &ReadHints::default(), &Budget::default()) {
        let message = error.to_string();
        assert!(message.contains("opencv_sample.yml") && message.len() > 30, "{message}");
    }
}
