//! The small text files: descriptions of lenses, and spectra.

#![no_main]

use lanternfish::fuzzing::{lens, spectrum};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    if let Ok([focal_length, _, _]) = lens(&text) {
        assert!(focal_length > 0.0);
    }
    if let Ok(numbers) = spectrum(&text) {
        assert!(numbers.iter().all(|number| number.is_finite()));
    }
});
