//! From directives to lights: pbrt-v4's parameters, order, and what is left out.

use std::f32::consts::PI;

use glam::{DMat4, DVec3};

use super::*;
use crate::math::spectrum::Spectrum;
use crate::math::transform::{Animated, RenderSpace};
use crate::scene::{
    Entity, FileId, LightEntity, Param, ParamSet, ParamValue, SceneDescription, SceneError, Span, Warnings,
};

const SPAN: Span = Span { file: FileId(0), line: 1, column: 1, length: 1 };

fn float(name: &str, value: f32) -> Param {
    Param::new(name, "float", ParamValue::Float(vec![value]), SPAN)
}

fn point(name: &str, value: [f32; 3]) -> Param {
    Param::new(name, "point3", ParamValue::Vec3(vec![value]), SPAN)
}

fn entity(kind: &str, params: Vec<Param>) -> Entity {
    Entity { kind: kind.into(), params: ParamSet::new(format!("\"{kind}\""), SPAN, params) }
}

fn light(kind: &str, transform: DMat4, params: Vec<Param>) -> LightEntity {
    LightEntity { entity: entity(kind, params), transform: Animated::fixed(transform).into(), medium: "".into() }
}

fn scene(lights: Vec<LightEntity>, area_lights: Vec<Entity>) -> SceneDescription {
    let none = || entity("", Vec::new());
    SceneDescription {
        base: Default::default(),
        camera: none(),
        camera_transform: Animated::fixed(DMat4::IDENTITY),
        camera_medium: String::new(),
        film: none(),
        film_color_space: "srgb",
        filter: none(),
        sampler: none(),
        integrator: none(),
        options: ParamSet::new("Option", SPAN, Vec::new()),
        transform_times: [0.0, 1.0],
        shapes: Vec::new(),
        objects: Vec::new(),
        instances: Vec::new(),
        lights,
        area_lights,
        materials: Vec::new(),
        media: Vec::new(),
        textures: Vec::new(),
        systems: vec![],
    }
}

fn build(
    scene: &SceneDescription,
    geometry: &Geometry,
    emitters: &[(ShapeId, u32)],
    strict: bool,
) -> (Result<Lights, Box<SceneError>>, Warnings) {
    let mut warnings = Warnings::default();
    let space = RenderSpace { origin: DVec3::new(100.0, 0.0, 0.0) };
    (Lights::build(scene, geometry, &space, emitters, &Default::default(), strict, &mut warnings), warnings)
}

#[test]
fn parameters_mean_what_pbrt_means() {
    let place = DMat4::from_translation(DVec3::new(101.0, 2.0, 3.0)) * DMat4::from_rotation_x(PI.into());
    let two_sided = Param::new("twosided", "bool", ParamValue::Bool(vec![true]), SPAN);
    let scene = scene(
        vec![
            light("point", place, vec![point("from", [0.0, 1.0, 0.0]), float("scale", 2.0)]),
            light("point", place, vec![float("power", 10.0)]),
            light("moonbeam", place, vec![]),
            light("spot", place, vec![float("power", 5.0), float("coneangle", 40.0)]),
            light("distant", place, vec![float("illuminance", 7.0), float("nonsense", 1.0)]),
            light("infinite", place, vec![float("illuminance", 9.0)]),
        ],
        vec![
            entity("diffuse", vec![float("scale", 3.0), two_sided.clone()]),
            entity("diffuse", vec![float("power", 11.0), two_sided]),
        ],
    );
    let (mut geometry, _) = one(quad(Vec3::ZERO, Vec3::X, Vec3::Y), false, false);
    let mut unused = Lights::default();
    push(&mut geometry, &mut unused, sphere(Vec3::ZERO, 2.0), Rgb::WHITE, false, false);
    let (lights, warnings) = build(&scene, &geometry, &[(ShapeId(1), 1), (ShapeId(0), 0)], false);
    let lights = lights.expect("it is a good scene");
    assert_eq!(lights.len(), 7);
    let power = |id: u32| lights.power(LightId(id))[0];
    assert!((power(0) - 11.0).abs() < 1e-4, "{}", power(0));
    assert!((power(1) - 3.0 * 2.0 * PI).abs() < 1e-4);
    let LightRef::Point(first) = lights.get(LightId(2)) else { panic!("the order is wrong") };
    assert!(first.p.distance(Vec3::new(1.0, 1.0, 3.0)) < 1e-5 && first.intensity == Rgb::splat(2.0));
    assert!((power(3) - 10.0).abs() < 1e-4 && (power(4) - 5.0).abs() < 1e-4);
    let LightRef::Spot(spot) = lights.get(LightId(4)) else { panic!("the order is wrong") };
    assert!(spot.axis.distance(-Vec3::Z) < 1e-6 && (spot.cos_end - 40f32.to_radians().cos()).abs() < 1e-6);
    let LightRef::Distant(distant) = lights.get(LightId(5)) else { panic!("the order is wrong") };
    assert!(distant.wi.distance(Vec3::Z) < 1e-6 && distant.irradiance == Rgb::splat(7.0));
    assert!((lights.background(LightId(6), Vec3::ZERO, Vec3::X)[0] * PI - 9.0).abs() < 1e-5);
    assert_eq!(lights.infinite(), [LightId(6)]);
    let said: Vec<&str> = warnings.list().iter().map(|w| w.message.as_str()).collect();
    assert!(
        said.iter().any(|m| m.contains("\"moonbeam\" is unknown")) && said.iter().any(|m| m.contains("nonsense")),
        "{said:?}"
    );
    assert!(build(&scene, &geometry, &[], true).0.is_err(), "strict refuses what it does not know");
}

#[test]
fn edges_of_spots_wider_than_the_cone_are_as_in_pbrt() {
    let cosine = |degrees: f32| degrees.to_radians().cos();
    for (delta, start) in [(5.0, 25.0), (40.0, 10.0), (55.0, 25.0), (80.0, 30.0), (-5.0, 30.0)] {
        let spot = light("spot", DMat4::IDENTITY, vec![float("coneangle", 30.0), float("conedeltaangle", delta)]);
        let (lights, _) = build(&scene(vec![spot], vec![]), &Geometry::default(), &[], true);
        let lights = lights.expect("it is a good scene");
        let LightRef::Spot(spot) = lights.get(LightId(0)) else { panic!("it is a spot") };
        assert!((spot.cos_start - cosine(start)).abs() < 1e-6 && spot.cos_end == cosine(30.0), "{delta}: {spot:?}");
        assert!(spot.falloff(cosine(30.1)) == 0.0 && spot.falloff(cosine(29.9)) >= 0.0 && spot.power()[0] > 0.0);
    }
}

#[test]
fn power_counts_for_each_face_of_a_mesh() {
    let scene = scene(vec![], vec![entity("diffuse", vec![float("power", 5.0)])]);
    let uneven = ShapeKind::Triangles(TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NEG_Y * 3.0],
        indices: vec![[0, 1, 2], [0, 3, 1], [2, 2, 2]],
        ..Default::default()
    });
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y];
    for (kind, faces, warned) in
        [(quad(Vec3::ZERO, Vec3::X, Vec3::Y), 2.0, 0), (patch(corners), 1.0, 0), (uneven, 2.0, 1)]
    {
        let (geometry, _) = one(kind, false, false);
        let (lights, warnings) = build(&scene, &geometry, &[(ShapeId(0), 0)], false);
        let power = lights.expect("it is a good scene").power(LightId(0))[0];
        assert!((power - 5.0 * faces).abs() < 1e-4, "{power} W of {faces} faces");
        assert_eq!(warnings.list().len(), warned, "{warnings:?}");
    }
}

#[test]
fn a_point_light_may_be_many() {
    let at = |places: Vec<[f32; 3]>| Param::new("P", "point3", ParamValue::Vec3(places), SPAN);
    let colours = |list: &[f32]| {
        let list = list.iter().map(|&v| Spectrum::Rgb(Rgb::splat(v))).collect();
        Param::new("I", "rgb", ParamValue::Spectrum(list), SPAN)
    };
    let place = DMat4::from_translation(DVec3::new(100.0, 0.0, 5.0));
    let places = vec![[0.0, 1.0, 0.0], [2.0, 0.0, 0.0]];
    let good = scene(
        vec![
            light("point", place, vec![at(places.clone()), colours(&[3.0]), float("scale", 2.0)]),
            light("point", place, vec![at(places.clone()), colours(&[3.0, 4.0]), float("scale", 0.5)]),
            light("point", place, vec![at(places.clone()), float("power", 4.0 * PI)]),
        ],
        vec![],
    );
    let (lights, warnings) = build(&good, &Geometry::default(), &[], false);
    let lights = lights.expect("it is a good scene");
    let found: Vec<(Vec3, f32)> = lights
        .ids()
        .map(|id| match lights.get(id) {
            LightRef::Point(light) => (light.p, light.intensity[0]),
            _ => panic!("all are points"),
        })
        .collect();
    assert_eq!(found.iter().map(|(_, intensity)| *intensity).collect::<Vec<_>>(), [6.0, 6.0, 1.5, 2.0, 1.0, 1.0]);
    for pair in found.chunks_exact(2) {
        assert!(pair[0].0.distance(Vec3::new(0.0, 1.0, 5.0)) < 1e-5, "{pair:?}");
        assert!(pair[1].0.distance(Vec3::new(2.0, 0.0, 5.0)) < 1e-5, "{pair:?}");
    }
    assert!(warnings.list().is_empty(), "{:?}", warnings.list());
    for (params, message) in [
        (vec![at(vec![])], "at least one position"),
        (vec![at(places.clone()), colours(&[1.0; 3])], "one for each of the 2 positions of \"P\", found 3"),
        (vec![at(places), point("from", [0.0; 3])], "left out"),
    ] {
        let scene = scene(vec![light("point", place, params)], vec![]);
        let error = build(&scene, &Geometry::default(), &[], false).0.expect_err("it is wrong").to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn emitters_that_cannot_be_lights_keep_their_number_and_stay_dark() {
    let mut geometry = Geometry::default();
    let curves = crate::geometry::shape::Curves {
        kind: crate::geometry::curve::CurveKind::Flat,
        control_points: vec![[Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]],
        widths: vec![[1.0; 2]],
        parameters: vec![[0.0, 1.0]],
        normals: Vec::new(),
    };
    for kind in [ShapeKind::Curves(curves), quad(Vec3::ZERO, Vec3::X, Vec3::X), quad(Vec3::ZERO, Vec3::X, Vec3::Y)] {
        geometry.shapes.push(Shape {
            kind,
            material: 0,
            light: None,
            medium_interface: None,
            alpha: None,
            is_boundary: false,
            links: 0,
            flip_normal: false,
        });
    }
    let scene = scene(vec![], vec![entity("diffuse", vec![])]);
    let (lights, warnings) = build(&scene, &geometry, &[(ShapeId(0), 0), (ShapeId(1), 0), (ShapeId(2), 0)], false);
    let lights = lights.expect("it is a good scene");
    assert_eq!(lights.ids().map(|id| lights.is_dark(id)).collect::<Vec<_>>(), [true, true, false]);
    assert_eq!(lights.emitted(LightId(0), Vec3::Z, Vec3::Z, Vec2::ZERO), Rgb::BLACK);
    assert_eq!(warnings.list().len(), 2);
}

#[test]
fn senseless_directives_are_refused() {
    let same = vec![point("from", [1.0; 3]), point("to", [1.0; 3])];
    let flat = DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0));
    for light in [
        light("spot", DMat4::IDENTITY, same.clone()),
        light("distant", DMat4::IDENTITY, same),
        light("point", flat, vec![]),
    ] {
        assert!(build(&scene(vec![light], vec![]), &Geometry::default(), &[], false).0.is_err());
    }
}
