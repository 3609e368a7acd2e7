#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::cameras("kitti-poses", bytes));
