//! Parameters and options: what their values become.

use super::*;
use crate::math::Rgb;
use crate::math::spectrum::Spectrum;
use crate::scene::ParamValue;

#[test]
fn parameter_values() {
    let scene = scene(
        "\u{feff}WorldBegin # comment \"with quotes\"\nShape\"sphere\"\"float a\"[1 -2.5e-1 .5 +3.]\"integer i\"7 \"integer j\" [ 64.0 -1 ]\n\
         \"bool yes\" true \"bool both\" [ \"false\" true ] \"string s\" [\"a\\\"b\\\\\\n\" \"\"] \"point2 uv\" [1 2 3 4]\n\
         \"point3 P\" [1 2 3] \"normal N\" [0 0 1] \"vector3 V\" [] \"texture alpha\" \"holes\" \"float r\" 2 # end\n\
         \"rgb c\" [.1 .2 .3 1 1 1] \"blackbody b\" [2700] \"spectrum g\" \"glass-BK7\" \"spectrum p\" [400 1 700 0.5]\n\
         Texture \"holes\" \"float\" \"constant\" \"float value\" 1",
    );
    let params = &scene.shapes[0].entity.params;
    let value = |name: &str| params.get(name).unwrap().value.clone();
    assert_eq!(value("a"), ParamValue::Float(vec![1.0, -0.25, 0.5, 3.0]));
    assert_eq!(value("i"), ParamValue::Integer(vec![7]));
    assert_eq!(value("j"), ParamValue::Integer(vec![64, -1]));
    assert_eq!(value("yes"), ParamValue::Bool(vec![true]));
    assert_eq!(value("both"), ParamValue::Bool(vec![false, true]));
    assert_eq!(value("s"), ParamValue::String(vec!["a\"b\\\n".into(), String::new()]));
    assert_eq!(value("uv"), ParamValue::Vec2(vec![[1.0, 2.0], [3.0, 4.0]]));
    assert_eq!(value("P"), ParamValue::Vec3(vec![[1.0, 2.0, 3.0]]));
    assert_eq!(value("V"), ParamValue::Vec3(vec![]));
    assert_eq!(value("alpha"), ParamValue::Texture("holes".into()));
    let rgb = [Rgb::new(0.1, 0.2, 0.3), Rgb::WHITE].map(Spectrum::Rgb);
    assert_eq!(value("c"), ParamValue::Spectrum(rgb.to_vec()));
    assert_eq!(value("b"), ParamValue::Spectrum(vec![Spectrum::Blackbody(2700.0)]));
    assert_eq!(value("g"), ParamValue::Spectrum(vec![Spectrum::named("glass-BK7").unwrap()]));
    assert_eq!(value("p"), ParamValue::Spectrum(vec![Spectrum::Samples([(400.0, 1.0), (700.0, 0.5)].into())]));
    assert_eq!(params.owner, "Shape \"sphere\"");
    assert_eq!((params.span.line, params.span.column, params.span.length), (2, 1, 5));
    assert_eq!(params.get("i").unwrap().span.column, 41);
}

#[test]
fn colour_spaces_convert_when_read() {
    let scene = scene(
        "WorldBegin ColorSpace \"rec2020\" Material \"diffuse\" \"rgb reflectance\" [1 0 0] Material \"diffuse\" \"rgb reflectance\" [1 1 1]",
    );
    let colour = |i: usize| scene.materials[i].entity.params.spectrum("reflectance").unwrap().unwrap().to_albedo();
    assert!((colour(1).0 - glam::Vec3::new(1.6605, -0.1246, -0.0182)).abs().max_element() < 2e-4);
    assert!((colour(2).0 - glam::Vec3::ONE).abs().max_element() < 1e-6);
}

#[test]
fn options_in_both_forms() {
    let scene = scene(
        "Option \"seed\" 5 Option \"string rendercoordsys\" \"camera\" Option \"Disable-Pixel_Jitter\" true Option \"bool PixelStats\" true WorldBegin",
    );
    assert_eq!(scene.options.integer("seed", 0).unwrap(), 5);
    assert_eq!(scene.options.string("rendercoordsys").unwrap(), Some("camera"));
    // However they are spelled.
    assert!(scene.options.bool("disablepixeljitter", false).unwrap());
    assert!(scene.options.bool("pixelstats", false).unwrap());
}

#[test]
fn spectrum_files() {
    let files = Files::new(&[
        ("a.pbrt", b"WorldBegin LightSource \"point\" \"spectrum I\" \"s/x.spd\" LightSource \"point\" \"spectrum I\" \"s/bad.spd\""),
        ("s/x.spd", b"# comment\n400 1.0\n500, 2 # more\n\n600 3"),
        ("s/bad.spd", b"400 1\n500 x"),
    ]);
    assert!(files.error().starts_with("a.pbrt:1:88: s/bad.spd:2: expected a number"), "{}", files.error());
}
