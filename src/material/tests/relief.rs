//! Normal and bump maps from scene descriptions, and hair against the curve that it grows on.

use std::path::{Path, PathBuf};

use glam::Vec2;

use super::build::{build, floats, material, names, point, scene, string, texture};
use super::*;
use crate::geometry::curve::{CurveKind, Curves};
use crate::geometry::shape::{Shape, ShapeId, ShapeKind};
use crate::geometry::{Geometry, Partials, Ray, RayHit};
use crate::material::footprint::Footprint;
use crate::material::mip_map::memory::TextureSettings;
use crate::material::{MaterialId, Materials};
use crate::scene::{MaterialEntity, ParamValue, Warnings};

/// An image of one colour.
fn write_normals(folder: &Path, name: &str, rgb: [u8; 3]) {
    image::RgbImage::from_pixel(2, 2, image::Rgb(rgb)).save(folder.join(name)).expect("the image can be written");
}

const FLAT: Partials = Partials { dpdu: Vec3::X, dpdv: Vec3::Y };

fn embossed(materials: &Materials, id: u32, wo: Vec3, u: f32) -> Vec3 {
    let mut at = point(Vec2::splat(0.3));
    materials.emboss(MaterialId(id), &mut at, wo, u, &Footprint::NONE, || FLAT);
    at.ns
}

fn diffuse(name: &str, list: Vec<(&str, ParamValue)>) -> MaterialEntity {
    material(name, "diffuse", list)
}

#[test]
fn normal_maps_are_linear_and_in_tangent_space() {
    let folder = tempfile::tempdir().expect("a folder");
    write_normals(folder.path(), "n.png", [191, 64, 230]);
    std::fs::copy(folder.path().join("n.png"), folder.path().join("again.png")).expect("a copy");
    let map = || ("normalmap", string("n.png"));
    let list = vec![
        diffuse("mapped", vec![map()]),
        diffuse("plain", vec![]),
        material("mix", "mix", vec![("materials", names(["plain", "mapped"])), ("amount", floats(0.25))]),
        material("glass", "dielectric", vec![map()]),
        material("both", "hair", vec![map(), ("displacement", floats(1.0))]),
    ];
    let (materials, warnings) = build(&scene(list, vec![], folder.path().into()));
    assert!(materials.reliefs_in_use() == 3 && materials.images_in_use() == 1);
    let traits =
        [0, 1, 2, 3, 4].map(|id| [materials.has_relief(MaterialId(id)), materials.is_textured(MaterialId(id))]);
    assert_eq!(traits, [true, false, true, true, true].map(|relief| [relief; 2]));
    assert!(warnings.list().len() == 1 && warnings.list()[0].message.contains("\"displacement\""), "{warnings:?}");
    let local = Vec3::new(191.0, 64.0, 230.0) / 255.0 * 2.0 - Vec3::ONE;
    for id in [0, 3, 4] {
        assert!((embossed(&materials, id, Vec3::Z, 0.0) - local.normalize()).length() < 1e-6, "{id}");
    }
    assert_eq!(embossed(&materials, 1, Vec3::Z, 0.0), Vec3::Z);
    assert_eq!(embossed(&materials, 2, Vec3::Z, 0.3), Vec3::Z);
    assert_ne!(embossed(&materials, 2, Vec3::Z, 0.2), Vec3::Z);

    // The tangent is where x goes; a surface that faces the other way has its y turned round, as in pbrt-v4.
    let mut turned = point(Vec2::ZERO);
    (turned.dpdu, turned.ng, turned.ns) = (Vec3::Y, -Vec3::Z, -Vec3::Z);
    materials.emboss(MaterialId(0), &mut turned, -Vec3::Z, 0.0, &Footprint::NONE, || FLAT);
    let expected = (Vec3::Y * local.x + (-Vec3::Z).cross(Vec3::Y) * local.y - Vec3::Z * local.z).normalize();
    assert!((turned.ns - expected).length() < 1e-6, "{}", turned.ns);
}

#[test]
fn maps_that_cannot_be_used_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    image::GrayImage::new(2, 2).save(folder.path().join("grey.png")).expect("the image can be written");
    let with = |file: &str| scene(vec![diffuse("m", vec![("normalmap", string(file))])], vec![], folder.path().into());
    let (materials, warnings) = build(&with("none.png"));
    assert!(materials.reliefs_in_use() == 0 && warnings.list()[0].message.contains("stays as it is"), "{warnings:?}");
    assert!(Materials::build(&with("none.png"), TextureSettings::default(), true, &mut Warnings::default()).is_err());
    let error = Materials::build(&with("grey.png"), TextureSettings::default(), false, &mut Warnings::default())
        .expect_err("it is grey");
    assert!(error.to_string().contains("grey"), "{error}");
    // What is not shaded by itself has no relief.
    let list = vec![
        diffuse("a", vec![]),
        material("m", "mix", vec![("materials", names(["a", "a"])), ("normalmap", string("none.png"))]),
    ];
    let (_, warnings) = build(&scene(list, vec![], PathBuf::new()));
    assert!(warnings.list().len() == 1 && warnings.list()[0].message.contains("not used"), "{warnings:?}");
}

#[test]
fn displacement_is_a_slope() {
    let folder = tempfile::tempdir().expect("a folder");
    // Twenty rows, white at the top: the height rises with v.
    let image =
        image::GrayImage::from_fn(1, 20, |_, y| image::Luma([(255.0 * (1.0 - (y as f32 + 0.5) / 20.0)).round() as u8]));
    image.save(folder.path().join("ramp.png")).expect("the image can be written");
    let ramp = |name: &str, scale: f32| {
        let list = vec![("filename", string("ramp.png")), ("encoding", string("linear")), ("scale", floats(scale))];
        texture(name, false, "imagemap", list)
    };
    let textures =
        vec![ramp("up", 0.5), ramp("down", -0.5), texture("even", false, "constant", vec![("value", floats(3.0))])];
    let with = |name: &str| diffuse(name, vec![("displacement", ParamValue::Texture(name.into()))]);
    let list = vec![with("up"), with("down"), with("even")];
    let (materials, warnings) = build(&scene(list, textures, folder.path().into()));
    assert!(warnings.list().is_empty() && materials.reliefs_in_use() == 2, "{warnings:?}");
    for (id, slope) in [(0, 0.5), (1, -0.5), (2, 0.0)] {
        let expected = Vec3::new(0.0, -slope, 1.0).normalize();
        let found = embossed(&materials, id, Vec3::Z, 0.0);
        // Eight bits of height over half a twentieth.
        assert!((found - expected).length() < 0.08, "{id}: {found} {expected}");
    }
    // Seen from the other side the surface is the same, turned towards the viewer; from beyond its slope it is bent.
    let below = embossed(&materials, 0, -Vec3::Z, 0.0);
    assert!(below.z > 0.0);
    let grazing = direction(0.05, std::f32::consts::FRAC_PI_2);
    assert!(embossed(&materials, 0, grazing, 0.0).dot(grazing) > 0.0099);
}

/// Seen from anywhere, hair on a round curve reflects about the curve's own normal.
#[test]
fn the_offset_on_curves_is_that_of_a_cylinder() {
    let ends = [Vec3::new(-1.0, 0.2, 0.0), Vec3::new(1.0, -0.1, 0.3)];
    let curves = Curves {
        kind: CurveKind::Cylinder,
        control_points: vec![[0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|t| ends[0].lerp(ends[1], t))],
        widths: vec![[0.1; 2]],
        parameters: vec![[0.25, 0.5]],
        normals: vec![],
    };
    let shape = Shape {
        kind: ShapeKind::Curves(curves),
        material: 0,
        light: None,
        medium_interface: None,
        alpha: None,
        is_boundary: false,
        links: 0,
        flip_normal: false,
    };
    let geometry = Geometry { shapes: vec![shape], top_level: vec![ShapeId(0)], ..Geometry::default() };
    let list = ["beta_m", "beta_n", "alpha"].map(|name| (name, floats(0.0))).to_vec();
    let (materials, _) = build(&scene(vec![material("m", "hair", list)], vec![], PathBuf::new()));
    for wo in [Vec3::Z, direction(0.5, 1.0), direction(-0.7, -2.0)] {
        for across in [0.1, 0.5, 0.8] {
            let hit = RayHit { t: 1.0, shape: ShapeId(0), instance: None, primitive: 0, uv: [across, 0.4] };
            let ray = Ray { origin: wo, direction: -wo, t_max: f32::INFINITY, time: 0.0, opacity_seed: 0 };
            let at = geometry.surface_point(&ray, &hit);
            assert!((at.uv - Vec2::new(0.35, across)).length() < 1e-6, "{}", at.uv);
            let bsdf = materials.bsdf(MaterialId(0), &at, &Footprint::NONE, 0.0, 0);
            // The very first numbers are those of what the surface reflects.
            let sample = bsdf.sample(wo, [1e-3, 0.0, 0.5]).expect("a direction");
            let (near, ns) = (sample.wi, at.ns);
            let mirrored = fresnel::reflect(wo, ns);
            // A thousandth is not the middle of the term, but the fibre is nearly smooth.
            assert!((near - mirrored).length() < 0.05, "{wo} {across}: {near} {mirrored}");
        }
    }
}
