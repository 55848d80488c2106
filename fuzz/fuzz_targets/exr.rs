//! OpenEXR files: all layers, and as a texture.

#![no_main]

use std::path::Path;

use lanternfish::film::exr::read_exr_bytes;
use lanternfish::film::image::{Encoding, read_image_bytes};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let path = Path::new("fuzz.exr");
    if let Ok(file) = read_exr_bytes(path, data) {
        assert!(file.channels.iter().all(|(_, values)| values.len() == file.bounds.area()));
    }
    if let Ok(image) = read_image_bytes(path, data.to_vec(), Encoding::Auto) {
        assert_eq!(image.pixels.len(), image.width * image.height * image.channels);
    }
});
