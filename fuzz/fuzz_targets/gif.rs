#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::image(b"GIF89a", bytes));
