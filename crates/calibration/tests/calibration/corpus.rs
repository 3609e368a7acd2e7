//! Files of other projects.

use raycam_calibration::{ReadHints, read};
use raycam_formats::Budget;

use crate::support::data;

#[test]
fn opencv_sample_is_read_or_its_error_names_the_file() {
    let path = data("opencv_sample.yml");
    if let Err(error) = read(&path, None, &ReadHints::default(), &Budget::default()) {
        let message = error.to_string();
        assert!(message.contains("opencv_sample.yml") && message.len() > 30, "{message}");
    }
}
