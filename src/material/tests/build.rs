//! From scene descriptions to materials.

use std::path::PathBuf;

use glam::{DMat4, Vec2};

use super::*;
use crate::geometry::shape::{Shape, ShapeId, ShapeKind, TriangleMesh};
use crate::geometry::trace::{Opacity, PrimitivePoint};
use crate::geometry::{Geometry, SurfacePoint};
use crate::material::footprint::Footprint;
use crate::material::mip_map::memory::TextureSettings;
use crate::material::{MaterialId, Materials};
use crate::math::transform::Animated;
use crate::scene::{
    Entity, FileId, MaterialEntity, Param, ParamSet, ParamValue, SceneDescription, Span, TextureEntity, TextureOr,
    Warnings,
};

const SPAN: Span = Span { file: FileId(0), line: 1, column: 1, length: 1 };

pub(super) fn params(list: Vec<(&str, ParamValue)>) -> ParamSet {
    ParamSet::new("Test", SPAN, list.into_iter().map(|(name, value)| Param::new(name, "t", value, SPAN)).collect())
}

pub(super) fn entity(kind: &str, list: Vec<(&str, ParamValue)>) -> Entity {
    Entity { kind: kind.into(), params: params(list) }
}

pub(super) fn scene(materials: Vec<MaterialEntity>, textures: Vec<TextureEntity>, base: PathBuf) -> SceneDescription {
    let fixed = Animated::fixed(DMat4::IDENTITY);
    SceneDescription {
        base,
        camera: entity("perspective", vec![]),
        camera_transform: fixed,
        camera_medium: String::new(),
        film: entity("rgb", vec![]),
        film_color_space: "srgb",
        filter: entity("box", vec![]),
        sampler: entity("", vec![]),
        integrator: entity("", vec![]),
        options: params(vec![]),
        transform_times: [0.0, 1.0],
        shapes: vec![],
        objects: vec![],
        instances: vec![],
        lights: vec![],
        area_lights: vec![],
        materials,
        media: vec![],
        textures,
        systems: vec![],
    }
}

pub(super) fn material(name: &str, kind: &str, list: Vec<(&str, ParamValue)>) -> MaterialEntity {
    MaterialEntity { name: Some(name.into()), entity: entity(kind, list) }
}

pub(super) fn texture(name: &str, is_spectrum: bool, kind: &str, list: Vec<(&str, ParamValue)>) -> TextureEntity {
    let transform = Animated::fixed(DMat4::IDENTITY);
    TextureEntity { name: name.into(), is_spectrum, entity: entity(kind, list), transform }
}

pub(super) fn floats(value: f32) -> ParamValue {
    ParamValue::Float(vec![value])
}

pub(super) fn string(value: &str) -> ParamValue {
    ParamValue::String(vec![value.into()])
}

pub(super) fn names(values: [&str; 2]) -> ParamValue {
    ParamValue::String(values.map(String::from).to_vec())
}

pub(super) fn point(uv: Vec2) -> SurfacePoint {
    SurfacePoint {
        p: Vec3::ZERO,
        p_error: Vec3::ZERO,
        ng: Vec3::Z,
        ns: Vec3::Z,
        dpdu: Vec3::X,
        uv,
        shape: ShapeId(0),
        primitive: 0,
        instance: None,
    }
}

fn albedo(materials: &Materials, id: u32, u: f32) -> Rgb {
    materials.bsdf(MaterialId(id), &point(Vec2::splat(0.5)), &Footprint::NONE, u, 0).albedo(Vec3::Z)
}

pub(super) fn build(scene: &SceneDescription) -> (Materials, Warnings) {
    let mut warnings = Warnings::default();
    let materials = Materials::build(scene, TextureSettings::default(), false, &mut warnings).unwrap();
    (materials, warnings)
}

#[test]
fn every_kind_and_its_defaults() {
    let kinds = [
        "diffuse",
        "conductor",
        "dielectric",
        "coateddiffuse",
        "interface",
        "velvet",
        "thindielectric",
        "diffusetransmission",
        "coatedconductor",
        "hair",
        "subsurface",
        "measured",
    ];
    let list = kinds.iter().map(|kind| material(kind, kind, vec![])).collect();
    let (materials, warnings) = build(&scene(list, vec![], PathBuf::new()));
    assert_eq!(materials.len(), kinds.len());
    assert_eq!(albedo(&materials, 0, 0.0), Rgb::splat(0.5));
    let copper = albedo(&materials, 1, 0.0);
    assert!(copper[0] > 0.9 && copper[2] < 0.6, "{copper:?}");
    let bsdf = |id| materials.bsdf(MaterialId(id), &point(Vec2::ZERO), &Footprint::NONE, 0.0, 0);
    assert!(bsdf(1).is_specular() && !bsdf(1).is_transmissive());
    assert!(bsdf(2).is_specular() && bsdf(2).is_transmissive());
    assert!(!bsdf(3).is_specular());
    assert!(materials.is_interface(MaterialId(4)) && !materials.is_interface(MaterialId(3)));
    assert!(bsdf(4).sample(Vec3::Z, [0.5; 3]).is_some_and(|s| s.wi == -Vec3::Z && s.is_transmission));
    for (warning, words) in warnings.list().iter().zip(["velvet", "leaves where it enters", "the file is not read"]) {
        assert!(warning.message.contains(words), "{warning:?}");
    }
    assert_eq!(warnings.list().len(), 3);
    assert_eq!(materials.textures_in_use(), 0);
    assert!(bsdf(6).is_specular() && bsdf(6).is_transmissive() && !bsdf(6).is_fibre());
    assert!(!bsdf(7).is_specular() && bsdf(7).is_transmissive());
    assert_eq!(bsdf(7).albedo(Vec3::Z), Rgb::splat(0.5));
    assert!(bsdf(8).is_specular() && !bsdf(8).is_transmissive());
    // Copper seen through glass is as red.
    let coated = albedo(&materials, 8, 0.0);
    assert!(coated[0] > 0.8 && coated[2] < 0.6, "{coated:?}");
    assert!(!bsdf(9).is_specular() && bsdf(9).is_fibre());
    let transmissive: Vec<bool> = (0..12).map(|id| materials.is_transmissive(MaterialId(id))).collect();
    assert_eq!(
        transmissive,
        [2, 4, 6, 7].iter().fold(vec![false; 12], |mut list, &i| {
            list[i] = true;
            list
        })
    );
    assert!(materials.is_fibre(MaterialId(9)) && !materials.is_fibre(MaterialId(0)));
    // pbrt-v4's default matter is nearly white, redder than blue.
    let matter = albedo(&materials, 10, 0.0);
    assert!(matter[0] > matter[2] && matter[2] > 0.7 && matter[0] < 1.0, "{matter:?}");
    assert_eq!(materials.reliefs_in_use(), 0);
}

/// The albedo that a material of this kind and these parameters comes to, and what was warned of.
fn stated(kind: &str, list: Vec<(&str, ParamValue)>) -> (Rgb, Warnings) {
    let (materials, warnings) = build(&scene(vec![material("m", kind, list)], vec![], PathBuf::new()));
    (albedo(&materials, 0, 0.0), warnings)
}

fn fails(kind: &str, list: Vec<(&str, ParamValue)>) -> String {
    let scene = scene(vec![material("m", kind, list)], vec![], PathBuf::new());
    let error = Materials::build(&scene, TextureSettings::default(), false, &mut Warnings::default())
        .expect_err("this is wrong");
    error.to_string()
}

#[test]
fn the_parameters_of_each_kind_count() {
    let (both, warnings) = stated(
        "diffusetransmission",
        vec![("reflectance", floats(0.5)), ("transmittance", floats(0.25)), ("scale", floats(0.8))],
    );
    assert!((both[0] - 0.6).abs() < 1e-6 && warnings.list().is_empty());
    let (_, warnings) =
        stated("diffusetransmission", vec![("reflectance", floats(0.9)), ("transmittance", floats(0.2))]);
    assert!(warnings.list()[0].message.contains("more light than it receives"));

    let interface =
        |eta: f32| vec![("interface.eta", floats(eta)), ("reflectance", floats(0.9)), ("thickness", floats(0.0))];
    let (bare, warnings) = stated("coatedconductor", interface(1.0));
    assert!((bare[0] - 0.9).abs() < 1e-3 && warnings.list().is_empty(), "{bare:?} {warnings:?}");
    let (coated, _) = stated("coatedconductor", interface(1.5));
    assert!((coated[0] - 0.9).abs() > 1e-3);
    let names = ["conductor.roughness", "interface.roughness", "interface.vroughness", "conductor.uroughness"];
    let rough = names.map(|name| (name, floats(0.2))).to_vec();
    let more = vec![("g", floats(0.1)), ("albedo", floats(0.5)), ("remaproughness", ParamValue::Bool(vec![false]))];
    let (_, warnings) = stated("coatedconductor", [rough, more].concat());
    assert!(warnings.list().is_empty(), "{warnings:?}");

    let light = stated("hair", vec![("eumelanin", floats(0.1))]).0;
    let dark = stated("hair", vec![("eumelanin", floats(8.0))]).0;
    assert!(light[0] > dark[0] && stated("hair", vec![("sigma_a", floats(0.0))]).0[0] > 0.999);
    assert!(stated("hair", vec![("color", floats(1.0))]).0[0] > 0.999);
    let (_, warnings) = stated("hair", vec![("sigma_a", floats(0.1)), ("eumelanin", floats(1.0))]);
    assert!(warnings.list().len() == 1 && warnings.list()[0].message.contains("\"sigma_a\" is given too"));

    let skin = |r: f32| stated("subsurface", vec![("reflectance", floats(r)), ("mfp", floats(2.0))]);
    assert!(skin(0.8).0[0] > skin(0.2).0[0] && skin(0.8).1.list().len() == 1);
    let (cream, warnings) = stated("subsurface", vec![("name", string("Cream")), ("g", floats(0.5))]);
    assert!(warnings.list().len() == 2 && warnings.list()[1].message.contains("\"name\" is given too"), "{warnings:?}");
    let (same, _) = stated("subsurface", vec![("sigma_a", floats(0.0002)), ("sigma_s", floats(7.38))]);
    assert!((cream[0] - same[0]).abs() < 1e-6 && cream[2] < cream[0], "{cream:?} {same:?}");
    let (_, warnings) = stated("subsurface", vec![("name", string("cream"))]);
    assert!(warnings.list().len() == 2 && warnings.list()[1].message.contains("did you mean Cream?"), "{warnings:?}");
    let (black, _) =
        stated("subsurface", vec![("sigma_a", floats(1.0)), ("sigma_s", floats(0.0)), ("eta", floats(1.0))]);
    assert!(black[0] < 1e-6, "{black:?}");
    assert_eq!(stated("measured", vec![("filename", string("x.bsdf"))]).1.list().len(), 1);
}

#[test]
fn wrong_values_are_refused_by_name() {
    for (kind, name, value) in [
        ("hair", "beta_m", 1.5),
        ("hair", "beta_n", -0.1),
        ("hair", "alpha", 100.0),
        ("hair", "sigma_a", -1.0),
        ("hair", "eumelanin", -1.0),
        ("diffusetransmission", "scale", -1.0),
        ("coatedconductor", "g", 2.0),
    ] {
        let message = fails(kind, vec![(name, floats(value))]);
        assert!(message.contains(&format!("\"{name}\"")), "{message}");
    }
    assert!(fails("subsurface", vec![("sigma_a", floats(1.0))]).contains("sigma_s"));
    let both = vec![("sigma_a", floats(1.0)), ("sigma_s", floats(1.0)), ("reflectance", floats(0.5))];
    assert!(fails("subsurface", both).contains("reflectance"));
    let both = vec![("conductor.k", floats(1.0)), ("reflectance", floats(0.5))];
    assert!(fails("coatedconductor", both).contains("conductor.k"));
}

#[test]
fn conductors_by_reflectance_and_unused_parameters() {
    let list = vec![
        material(
            "a",
            "conductor",
            vec![("reflectance", floats(0.9)), ("roughness", floats(0.3)), ("nonsense", floats(1.0))],
        ),
        material("b", "conductor", vec![("reflectance", floats(0.9)), ("k", floats(1.0))]),
    ];
    let (materials, warnings) = build(&scene(list[..1].to_vec(), vec![], PathBuf::new()));
    assert!((albedo(&materials, 0, 0.0)[0] - 0.9).abs() < 1e-4);
    assert!(warnings.list().len() == 1 && warnings.list()[0].message.contains("nonsense"));
    assert!(
        Materials::build(
            &scene(list, vec![], PathBuf::new()),
            TextureSettings::default(),
            false,
            &mut Warnings::default()
        )
        .is_err()
    );
}

#[test]
fn mixes_choose_by_u_and_nest() {
    let diffuse = |name: &str, r| material(name, "diffuse", vec![("reflectance", floats(r))]);
    let list = vec![
        diffuse("a", 0.1),
        diffuse("b", 0.2),
        material("ab", "mix", vec![("materials", names(["a", "b"])), ("amount", floats(0.25))]),
        diffuse("c", 0.3),
        material("abc", "mix", vec![("materials", names(["ab", "c"])), ("amount", floats(0.5))]),
    ];
    let (materials, warnings) = build(&scene(list, vec![], PathBuf::new()));
    assert!(warnings.list().is_empty());
    let mut shares = [0; 3];
    for i in 0..1000 {
        shares[(albedo(&materials, 4, (i as f32 + 0.5) / 1000.0)[0] * 10.0).round() as usize - 1] += 1;
    }
    assert_eq!(shares, [375, 125, 500]);
}

#[test]
fn mixes_that_contain_themselves_are_refused() {
    let mix = |name: &str, of| material(name, "mix", vec![("materials", names(of))]);
    let fails = |list| {
        Materials::build(
            &scene(list, vec![], PathBuf::new()),
            TextureSettings::default(),
            false,
            &mut Warnings::default(),
        )
        .is_err()
    };
    let d = || material("d", "diffuse", vec![]);
    assert!(fails(vec![d(), mix("x", ["x", "d"])]));
    assert!(fails(vec![d(), mix("x", ["d", "y"]), mix("y", ["d", "x"])]));
    assert!(fails(vec![d(), mix("x", ["d", "unknown"])]));
    // A diamond is no cycle.
    assert!(!fails(vec![d(), mix("x", ["d", "d"]), mix("y", ["x", "x"]), mix("z", ["y", "x"])]));
}

fn write_image(folder: &std::path::Path) {
    // Two pixels: black, white.
    let image = image::GrayImage::from_raw(2, 1, vec![0, 255]).unwrap();
    image.save(folder.join("bw.png")).unwrap();
}

#[test]
fn textures_are_shared_scaled_and_loaded_once() {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path());
    let file = || ("filename", string("bw.png"));
    let named = |name: &str| ParamValue::Texture(name.into());
    let textures = vec![
        texture("image", true, "imagemap", vec![file(), ("filter", string("point"))]),
        texture("again", true, "imagemap", vec![file(), ("invert", ParamValue::Bool(vec![true]))]),
        texture("half", false, "constant", vec![("value", floats(0.5))]),
        texture("scaled", true, "scale", vec![("tex", named("image")), ("scale", named("half"))]),
        texture("unused", true, "imagemap", vec![("filename", string("not there.png"))]),
        texture("marble", true, "ptex", vec![]),
    ];
    let with = |name: &str| material(name, "diffuse", vec![("reflectance", named(name))]);
    let list = vec![with("image"), with("again"), with("scaled"), with("marble"), with("image")];
    let (materials, warnings) = build(&scene(list, textures, folder.path().into()));
    assert!(warnings.list().len() == 1 && warnings.list()[0].message.contains("marble"), "{warnings:?}");
    assert_eq!((materials.textures_in_use(), materials.images_in_use()), (3, 1));
    assert_eq!([0, 1, 2, 3, 4].map(|id| materials.is_textured(MaterialId(id))), [true, true, true, false, true]);
    let at =
        |id, u| materials.bsdf(MaterialId(id), &point(Vec2::new(u, 0.5)), &Footprint::NONE, 0.0, 0).albedo(Vec3::Z)[0];
    assert_eq!((at(0, 0.25), at(0, 0.75), at(4, 0.75)), (0.0, 1.0, 1.0));
    assert_eq!((at(1, 0.25), at(1, 0.75)), (1.0, 0.0));
    assert_eq!((at(2, 0.25), at(2, 0.75)), (0.0, 0.5));
    assert_eq!(at(3, 0.0), 0.5);
    assert!(materials.memory() >= 2 * size_of::<f32>());
}

#[test]
fn missing_files_are_magenta_or_an_error() {
    let named = || ParamValue::Texture("t".into());
    let folder = tempfile::tempdir().unwrap();
    let textures = vec![texture("t", true, "imagemap", vec![("filename", string("none.png"))])];
    let list = vec![material("m", "diffuse", vec![("reflectance", named())])];
    let scene = scene(list, textures, folder.path().into());
    let (materials, warnings) = build(&scene);
    assert_eq!(albedo(&materials, 0, 0.0), Rgb::new(1.0, 0.0, 1.0));
    assert!(warnings.list()[0].message.contains("none.png"));
    assert!(Materials::build(&scene, TextureSettings::default(), true, &mut Warnings::default()).is_err());
}

#[test]
fn textures_that_contain_themselves_or_do_not_exist_are_refused() {
    let named = |name: &str| ParamValue::Texture(name.into());
    let textures = vec![
        texture("a", true, "scale", vec![("tex", named("b"))]),
        texture("b", true, "scale", vec![("tex", named("a"))]),
        texture("f", false, "constant", vec![]),
    ];
    for name in ["a", "nowhere", "f"] {
        let list = vec![material("m", "diffuse", vec![("reflectance", named(name))])];
        let scene = scene(list, textures.clone(), PathBuf::new());
        assert!(
            Materials::build(&scene, TextureSettings::default(), false, &mut Warnings::default()).is_err(),
            "{name}"
        );
    }
}

/// The grey of grey with alpha, decoded; the alpha of colours, as it is.
#[test]
fn floats_are_of_greys_or_of_the_alpha_of_colours() {
    let folder = tempfile::tempdir().unwrap();
    image::GrayAlphaImage::from_pixel(1, 1, image::LumaA([188, 77])).save(folder.path().join("grey.png")).unwrap();
    image::RgbaImage::from_pixel(1, 1, image::Rgba([188, 0, 0, 128])).save(folder.path().join("colour.png")).unwrap();
    for (file, expected) in [("grey.png", 0.5029), ("colour.png", 128.0 / 255.0)] {
        let textures = vec![
            texture("f", false, "imagemap", vec![("filename", string(file))]),
            texture("t", true, "scale", vec![("tex", floats(1.0)), ("scale", ParamValue::Texture("f".into()))]),
        ];
        let list = vec![material("m", "diffuse", vec![("reflectance", ParamValue::Texture("t".into()))])];
        let (materials, _) = build(&scene(list, textures, folder.path().into()));
        let found = materials.bsdf(MaterialId(0), &point(Vec2::ZERO), &Footprint::NONE, 0.0, 0).albedo(Vec3::Z)[0];
        assert!((found - expected).abs() < 1e-3, "{file}: {found}");
    }
}

#[test]
fn alpha_is_a_repeatable_probability() {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path());
    let textures =
        vec![texture("mask", false, "imagemap", vec![("filename", string("bw.png")), ("filter", string("point"))])];
    let scene = scene(vec![], textures, folder.path().into());
    let (mut materials, mut warnings) = build(&scene);
    let mut alpha = |value| materials.alpha(value, &scene, false, &mut warnings).unwrap();
    assert_eq!(alpha(TextureOr::Value(1.0)), None);
    let third = alpha(TextureOr::Value(0.3));
    let mask = alpha(TextureOr::Texture("mask".into(), SPAN));
    assert_eq!(alpha(TextureOr::Value(0.3)), third);
    assert!(materials.alpha(TextureOr::Texture("none".into(), SPAN), &scene, false, &mut warnings).is_err());
    let shape = |alpha| Shape {
        kind: ShapeKind::Triangles(TriangleMesh {
            positions: vec![Vec3::ZERO; 3],
            indices: vec![[0, 1, 2]],
            normals: vec![],
            uvs: vec![Vec2::new(0.25, 0.5), Vec2::new(0.75, 0.5), Vec2::new(0.25, 0.5)],
        }),
        material: 0,
        light: None,
        medium_interface: None,
        alpha,
        is_boundary: false,
        links: 0,
        flip_normal: false,
    };
    let geometry = Geometry { shapes: vec![shape(third), shape(mask), shape(None)], ..Geometry::default() };
    let opaque = |shape, uv, seed| {
        let at = PrimitivePoint { shape: ShapeId(shape), instance: None, primitive: 0, uv };
        materials.is_opaque(&geometry, &at, seed)
    };
    let count = (0..10_000).filter(|&seed| opaque(0, [0.2, 0.2], seed)).count();
    // Six standard deviations.
    assert!(count.abs_diff(3000) < 275, "{count}");
    for seed in 0..100 {
        assert_eq!(opaque(0, [0.2, 0.2], seed), opaque(0, [0.2, 0.2], seed));
        assert!(!opaque(1, [0.0, 0.5], seed) && opaque(1, [0.9, 0.0], seed) && opaque(2, [0.1, 0.1], seed));
    }
}
