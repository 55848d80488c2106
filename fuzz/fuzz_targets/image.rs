//! Images told by content: PNG, JPEG, BMP, QOI, GIF, PNM, Radiance HDR, PFM; and TGA, which is told by its name.

#![no_main]

use std::path::Path;

use lanternfish::film::image::Encoding;
use lanternfish::film::stored_image::{StoredImage, Values, read_stored_bytes};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(mut image) = read_stored_bytes(Path::new("fuzz.tga"), data.to_vec()) {
        check(&image);
        image.drop_opaque_alpha();
        check(&image);
        let decoded = image.decoded(Encoding::Auto);
        assert_eq!(decoded.pixels.len(), decoded.width * decoded.height * decoded.channels);
    }
});

fn check(image: &StoredImage) {
    assert!(image.width > 0 && image.height > 0 && [1, 3, 4].contains(&image.channels));
    let values = match &image.values {
        Values::Bytes(bytes) => bytes.len(),
        Values::Floats(floats) => floats.len(),
    };
    assert_eq!(values, image.width * image.height * image.channels);
}
