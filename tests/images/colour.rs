//! Colours that are stated in other terms than those of the image: files with primaries of their own, a sensor balanced for another white.

use std::path::Path;

use exr::meta::attribute::Chromaticities;
use exr::prelude::{Encoding, Image, ImageAttributes, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage};

use crate::common::{Options, render_text};

/// A small picture all of this colour, in Rec. 2020.
fn write_rec2020(path: &Path, colour: [f32; 3]) {
    let channels = SpecificChannels::rgb(move |_: Vec2<usize>| (colour[0], colour[1], colour[2]));
    let layer = Layer::new((2, 2), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels);
    let mut attributes = ImageAttributes::with_size((2, 2));
    attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.708, 0.292),
        green: Vec2(0.170, 0.797),
        blue: Vec2(0.131, 0.046),
        white: Vec2(0.3127, 0.3290),
    });
    Image::empty(attributes).with_layer(layer).write().to_file(path).expect("an EXR");
}

/// A layer's first pixel.
fn first_pixel(text: &str, layer: &str) -> [f32; 3] {
    let outcome = render_text(text, &Options { spp: 1, max_depth: Some(1), ..Options::default() });
    let image = outcome.film.channels();
    ["R", "G", "B"].map(|c| image.channel(&format!("{layer}{c}")).expect("the layer")[0])
}

fn is_near(found: [f32; 3], expected: [f32; 3]) -> bool {
    found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-3)
}

const HEAD: &str = "Film \"rgb\" \"integer xresolution\" 2 \"integer yresolution\" 2\nCamera \"orthographic\"\n";

#[test]
fn a_file_may_have_primaries_of_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("i.exr");
    write_rec2020(&path, [0.2, 0.3, 0.4]);
    // ITU-R BT.2087, table 2 inverted.
    let expected = [
        1.6605 * 0.2 - 0.5876 * 0.3 - 0.0728 * 0.4,
        -0.1246 * 0.2 + 1.1329 * 0.3 - 0.0083 * 0.4,
        -0.0182 * 0.2 - 0.1006 * 0.3 + 1.1187 * 0.4,
    ];
    let file = path.display();
    let world = format!(
        "{HEAD}WorldBegin\nLightSource \"infinite\"\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{file}\"\n\
         Material \"diffuse\" \"texture reflectance\" \"t\"\nTranslate 0 0 1 Shape \"disk\" \"float radius\" 5\n"
    );
    let found = first_pixel(&world, "albedo.");
    assert!(is_near(found, expected), "{found:?} of a surface, not {expected:?}");
    let sky = format!("{HEAD}WorldBegin\nLightSource \"infinite\" \"string filename\" \"{file}\"\n");
    let found = first_pixel(&sky, "");
    assert!(is_near(found, expected), "{found:?} of the sky, not {expected:?}");
    // A normal is no colour, nor is a weight.
    let weight = "Texture \"w\" \"float\" \"imagemap\" \"string filename\" \"FILE\"
        Texture \"t\" \"spectrum\" \"scale\" \"rgb tex\" [1 1 1] \"texture scale\" \"w\"";
    let world = world.replace(
        &format!("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{file}\""),
        &weight.replace("FILE", &file.to_string()),
    );
    let found = first_pixel(&world, "albedo.");
    assert!(is_near(found, [0.3; 3]), "{found:?} of a weight");
}

#[test]
fn what_a_sensor_is_balanced_for_is_white() {
    let lit = |film: &str| {
        first_pixel(
            &format!(
                "Film \"rgb\" \"integer xresolution\" 2 \"integer yresolution\" 2 {film}\nCamera \"orthographic\"\nWorldBegin\n\
                 LightSource \"infinite\" \"blackbody L\" 3000\n"
            ),
            "",
        )
    };
    let [r, g, b] = lit("");
    assert!(r > 1.5 * g && g > 1.5 * b, "lamp light is {r} {g} {b}");
    let [r, g, b] = lit("\"float whitebalance\" 3000");
    assert!((r - g).abs() < 0.01 * g && (b - g).abs() < 0.01 * g, "balanced it is {r} {g} {b}");
    assert_eq!(lit("\"float whitebalance\" 0"), lit(""));
}
