//! The target `environment` on libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| lvk_fuzz::run("environment", bytes));
