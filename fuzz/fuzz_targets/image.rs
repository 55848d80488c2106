//! Images told by content: PNG, JPEG, Radiance HDR, PFM; and TGA, which is told by its name.

#![no_main]

use std::path::Path;

use lanternfish::film::image::{Encoding, read_image_bytes};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(mut image) = read_image_bytes(Path::new("fuzz.tga"), data.to_vec(), Encoding::Auto) {
        assert_eq!(image.pixels.len(), image.width * image.height * image.channels);
        assert!(image.width > 0 && image.height > 0 && [1, 3, 4].contains(&image.channels));
        image.drop_opaque_alpha();
        assert_eq!(image.pixels.len(), image.width * image.height * image.channels);
    }
});
