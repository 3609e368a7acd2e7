#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::image(b"\x89PNG\r\n\x1a\n", bytes));
