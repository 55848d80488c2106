//! Textures that are computed, and how textures lie on surfaces: through a diffuse material's albedo.

use std::path::PathBuf;

use glam::{DMat4, DVec3, Vec2, Vec3};

use super::build::{build, floats, material, point, scene, string, texture};
use crate::geometry::SurfacePoint;
use crate::material::footprint::Footprint;
use crate::material::mip_map::memory::TextureSettings;
use crate::material::{MaterialId, Materials};
use crate::math::Rgb;
use crate::math::transform::Animated;
use crate::scene::{ParamValue, TextureEntity, Warnings};

fn named(name: &str) -> ParamValue {
    ParamValue::Texture(name.into())
}

fn vector(v: [f32; 3]) -> ParamValue {
    ParamValue::Vec3(vec![v])
}

fn whole(n: i32) -> ParamValue {
    ParamValue::Integer(vec![n])
}

/// A diffuse material that shows `texture`.
struct Shown(Materials);

impl Shown {
    fn new(texture: TextureEntity) -> Self {
        Self::among(vec![texture])
    }

    /// The last of them.
    fn among(textures: Vec<TextureEntity>) -> Self {
        let name = textures.last().expect("one").name.clone();
        let list = vec![material("m", "diffuse", vec![("reflectance", named(&name))])];
        let (materials, warnings) = build(&scene(list, textures, PathBuf::new()));
        assert!(warnings.list().is_empty(), "{warnings:?}");
        Self(materials)
    }

    fn at(&self, point: &SurfacePoint) -> Rgb {
        self.0.bsdf(MaterialId(0), point, &Footprint::NONE, 0.0, 0).albedo(Vec3::Z)
    }

    fn uv(&self, u: f32, v: f32) -> f32 {
        self.at(&point(Vec2::new(u, v)))[0]
    }

    fn place(&self, x: f32, y: f32, z: f32) -> f32 {
        self.at(&SurfacePoint { p: Vec3::new(x, y, z), ..point(Vec2::ZERO) })[0]
    }
}

#[test]
fn checkerboards_change_with_every_cell() {
    let params = |dimension| vec![("dimension", whole(dimension)), ("uscale", floats(4.0)), ("udelta", floats(-2.0))];
    let flat = Shown::new(texture("t", true, "checkerboard", params(2)));
    for (u, v, expected) in [(0.55, 0.5, 1.0), (0.8, 0.5, 0.0), (0.3, 0.5, 0.0), (0.55, -0.5, 0.0), (0.55, 1.5, 0.0)] {
        assert_eq!(flat.uv(u, v), expected, "{u} {v}");
    }
    let params = vec![("dimension", whole(3)), ("tex1", floats(0.25)), ("tex2", floats(0.75))];
    let solid = Shown::new(texture("t", true, "checkerboard", params));
    assert_eq!(
        (solid.place(0.5, 0.5, 0.5), solid.place(-0.5, 0.5, 0.5), solid.place(-0.5, 0.5, -1.5)),
        (0.25, 0.75, 0.75)
    );
    assert_eq!(solid.place(-0.5, -0.5, 0.5), 0.25);
}

#[test]
fn mixes_follow_their_amount_and_direction() {
    let amount = texture("amount", false, "bilerp", vec![]);
    let mix =
        texture("t", true, "mix", vec![("amount", named("amount")), ("tex1", floats(0.2)), ("tex2", floats(0.6))]);
    let shown = Shown::among(vec![amount, mix]);
    // The amount rises from v = 0 to v = 1.
    for v in [0.0, 0.25, 1.0] {
        assert!((shown.uv(0.3, v) - (0.2 + 0.4 * v)).abs() < 1e-6, "{v}");
    }
    let params = vec![("dir", vector([3.0, 0.0, 0.0])), ("tex1", floats(0.8)), ("tex2", floats(0.0))];
    let shown = Shown::new(texture("t", true, "directionmix", params));
    for n in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::new(0.6, 0.0, 0.8)] {
        let value = shown.at(&SurfacePoint { ng: n, ..point(Vec2::ZERO) })[0];
        assert!((value - 0.8 * n.x.abs()).abs() < 1e-6, "{n}: {value}");
    }
}

#[test]
fn dots_cover_their_share_and_marble_stays_in_its_range() {
    let dots = Shown::new(texture("t", true, "dots", vec![("uscale", floats(40.0)), ("vscale", floats(40.0))]));
    let side = 400u32;
    let middle = |i: u32| (i as f32 + 0.5) / side as f32;
    let inside: f32 = (0..side * side).map(|i| dots.uv(middle(i % side), middle(i / side))).sum();
    // A dot fills 38 % of its square; about half of the squares have one.
    let share = inside / (side * side) as f32;
    assert!((0.14..0.25).contains(&share), "{share}");
    let marble = Shown::new(texture("t", true, "marble", vec![("scale", floats(3.0))]));
    let (mut low, mut high) = (1.0f32, 0.0f32);
    for i in 0..4000 {
        let value = marble.place(0.013 * i as f32, 0.0007 * i as f32, 0.4);
        (low, high) = (low.min(value), high.max(value));
    }
    assert!(low > 0.29 && low < 0.7 && high > 0.84 && high <= 0.91, "{low} {high}");
}

#[test]
fn textures_lie_in_the_space_where_they_are_declared() {
    // Twice as large, and moved: a unit of the texture is two of the world. The camera's place moves render space against the world.
    let params = vec![
        ("mapping", string("planar")),
        ("v1", vector([1.0, 0.0, 0.0])),
        ("v2", vector([0.0, 0.0, 1.0])),
        ("udelta", floats(0.25)),
        ("v00", floats(0.0)),
        ("v10", floats(1.0)),
        ("v01", floats(0.0)),
        ("v11", floats(1.0)),
    ];
    let mut planar = texture("t", true, "bilerp", params);
    let to_world = DMat4::from_translation(DVec3::new(10.0, 0.0, 0.0)) * DMat4::from_scale(DVec3::splat(2.0));
    planar.transform = Animated::fixed(to_world);
    let list = vec![material("m", "diffuse", vec![("reflectance", named("t"))])];
    let mut world = scene(list, vec![planar], PathBuf::new());
    world.camera_transform = Animated::fixed(DMat4::from_translation(DVec3::new(-9.0, 0.0, 0.0)));
    let shown = Shown(build(&world).0);
    // World x = 9 + 1.8, texture x = 0.4.
    assert!((shown.place(1.8, 5.0, 7.0) - 0.65).abs() < 1e-6, "{}", shown.place(1.8, 5.0, 7.0));

    let rising = |mapping: &str| {
        let corners =
            ["v00", "v10", "v01", "v11"].map(|name| (name, floats(if name.ends_with('1') { 1.0 } else { 0.0 })));
        let params = [("mapping", string(mapping))].into_iter().chain(corners).collect();
        Shown::new(texture("t", true, "bilerp", params))
    };
    // Along v: longitudes of a sphere, heights of a cylinder.
    let sphere = rising("spherical");
    assert!((sphere.place(0.0, 3.0, 0.0) - 0.25).abs() < 1e-6 && (sphere.place(0.0, -3.0, 1.0) - 0.75).abs() < 1e-6);
    let cylinder = rising("cylindrical");
    assert!((cylinder.place(3.0, 0.0, 0.8) - 0.8).abs() < 1e-6);
}

#[test]
fn noise_is_a_float_and_scales() {
    let textures = |kind: &str| {
        let noise = texture("noise", false, kind, vec![]);
        let half = texture("half", true, "constant", vec![("value", floats(0.5))]);
        vec![noise, half, texture("t", true, "scale", vec![("tex", named("half")), ("scale", named("noise"))])]
    };
    for kind in ["fbm", "wrinkled", "windy"] {
        let shown = Shown::among(textures(kind));
        let values: Vec<f32> = (0..200).map(|i| shown.place(0.37 * i as f32, 0.11 * i as f32, 0.5)).collect();
        let distinct = values.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(distinct > 50 && values.iter().all(|v| (0.0..=1.0).contains(v)), "{kind}: {values:?}");
    }
}

/// As in pbrt-v4, where errors of this kind stop nothing; `--strict` refuses them.
#[test]
fn what_pbrt_passes_over_is_a_fault() {
    for (kind, params, expected) in [
        ("marble", vec![("octaves", whole(0))], "\"octaves\""),
        ("marble", vec![("octaves", whole(100))], "\"octaves\""),
        ("checkerboard", vec![("mapping", string("wavy"))], "wavy"),
        ("imagemap", vec![("filename", string("none.png")), ("filter", string("cubic"))], "found \"cubic\""),
        (
            "imagemap",
            vec![("filename", string("none.png")), ("filter", string("EWA")), ("maxanisotropy", floats(0.5))],
            "from 1 to 64",
        ),
    ] {
        let list = vec![material("m", "diffuse", vec![("reflectance", named("t"))])];
        let (_, warnings) = build(&scene(list, vec![texture("t", true, kind, params)], PathBuf::new()));
        let error = warnings.refuse_faults().expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// pbrt-v4 makes images first, then other floats, then other spectra, wherever they stand; what contains itself is refused.
#[test]
fn textures_may_name_those_declared_later() {
    let textures = |last: ParamValue| {
        let tint = texture("tint", true, "scale", vec![("tex", named("base")), ("scale", floats(0.5))]);
        let show = texture("shown", true, "scale", vec![("tex", named("tint"))]);
        vec![show, tint, texture("base", true, "scale", vec![("tex", last)])]
    };
    let built = |last: ParamValue| {
        let list = vec![material("m", "diffuse", vec![("reflectance", named("shown"))])];
        let scene = scene(list, textures(last), PathBuf::new());
        Materials::build(&scene, TextureSettings::default(), false, &mut Warnings::default()).map(Shown)
    };
    assert_eq!(built(floats(0.5)).expect("it is good").uv(0.0, 0.0), 0.25);
    assert!(built(named("shown")).map(|_| ()).expect_err("a circle").to_string().contains("contains itself"));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let cases = [
        ("checkerboard", vec![("dimension", whole(4))], "2 or 3"),
        ("directionmix", vec![("dir", vector([0.0; 3]))], "\"dir\""),
    ];
    for (kind, params, expected) in cases {
        let entity = texture("t", true, kind, params);
        let list = vec![material("m", "diffuse", vec![("reflectance", named("t"))])];
        let result = Materials::build(
            &scene(list, vec![entity], PathBuf::new()),
            TextureSettings::default(),
            false,
            &mut Warnings::default(),
        );
        let message = result.map(|_| ()).expect_err(expected).to_string();
        assert!(message.contains(expected), "{message}");
    }
    // Mixes of mixes double what one look-up takes.
    let mut textures = vec![texture("t0", true, "bilerp", vec![])];
    for level in 1..40 {
        let below = named(&format!("t{}", level - 1));
        textures.push(texture(&format!("t{level}"), true, "mix", vec![("tex1", below.clone()), ("tex2", below)]));
    }
    let list = vec![material("m", "diffuse", vec![("reflectance", named("t39"))])];
    let result = Materials::build(
        &scene(list, textures, PathBuf::new()),
        TextureSettings::default(),
        false,
        &mut Warnings::default(),
    );
    assert!(result.map(|_| ()).expect_err("too much").to_string().contains("look-ups"));
}
