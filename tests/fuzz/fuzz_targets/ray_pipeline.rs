//! The target `ray_pipeline` on libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| lvk_fuzz::run("ray_pipeline", bytes));
