#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::image(b"II*\0", bytes));
