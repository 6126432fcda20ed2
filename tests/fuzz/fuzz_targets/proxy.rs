#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shellwarp_fuzz::proxy::run(bytes));
