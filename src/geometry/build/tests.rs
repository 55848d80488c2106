//! Directives to shapes: defaults, conversions, and an error for everything that can be wrong.

use std::path::PathBuf;

use glam::{DAffine3, DMat4, DVec3, Vec3};

use super::{Displacement, ShapeBindings, build_shape};
use crate::geometry::curve::CurveKind;
use crate::geometry::{Shape, ShapeKind};
use crate::math::transform::Animated;
use crate::scene::{Entity, FileId, MaterialIndex, Param, ParamSet, ParamValue, ShapeEntity, Span, Warnings};

/// Kind, parameters, and what the message must hold.
type Case = (&'static str, Vec<(&'static str, ParamValue)>, &'static str);

const SPAN: Span = Span { file: FileId(0), line: 1, column: 1, length: 5 };

fn entity(kind: &str, params: Vec<(&str, ParamValue)>) -> ShapeEntity {
    let params = params.into_iter().map(|(name, value)| Param::new(name, "test", value, SPAN)).collect();
    ShapeEntity {
        entity: Entity { kind: kind.into(), params: ParamSet::new(format!("Shape \"{kind}\""), SPAN, params) },
        transform: Animated::fixed(DMat4::IDENTITY).into(),
        reverse_orientation: false,
        material: MaterialIndex(0),
        area_light: None,
        medium_interface: None,
    }
}

fn build_in(entity: &ShapeEntity, to_space: DAffine3) -> (Result<Vec<Shape>, String>, Warnings) {
    let mut warnings = Warnings::default();
    let base = |name: &str| PathBuf::from("/nonexistent").join(name);
    let shapes = build_shape(entity, &to_space, &base, ShapeBindings::default(), None, &mut warnings);
    let shapes = shapes.map(|shapes| shapes.into_iter().map(|built| built.shape).collect());
    (shapes.map_err(|e| e.to_string()), warnings)
}

fn build(kind: &str, params: Vec<(&str, ParamValue)>) -> Result<Vec<Shape>, String> {
    build_in(&entity(kind, params), DAffine3::IDENTITY).0
}

fn points(count: usize) -> ParamValue {
    ParamValue::Vec3((0..count).map(|i| [i as f32, (i * i) as f32, 0.0]).collect())
}

fn floats(value: f32) -> ParamValue {
    ParamValue::Float(vec![value])
}

fn word(value: &str) -> ParamValue {
    ParamValue::String(vec![value.into()])
}

#[test]
fn what_is_wrong_is_an_error_that_says_so() {
    let ints = |v: &[i32]| ParamValue::Integer(v.to_vec());
    let nan = ParamValue::Vec3(vec![[0.0; 3], [f32::NAN, 0.0, 0.0], [1.0; 3]]);
    let huge = ParamValue::Vec3(vec![[0.0; 3], [1e30, 0.0, 0.0], [1.0; 3]]);
    let cases: Vec<Case> = vec![
        ("trianglemesh", vec![("P", nan)], "number 1 is not finite"),
        ("trianglemesh", vec![("P", huge)], "beyond"),
        ("trianglemesh", vec![("P", floats(1.0))], "expected point3"),
        ("plymesh", vec![], "\"filename\" is missing"),
        ("plymesh", vec![("filename", word("no.ply"))], "cannot read"),
        ("sphere", vec![("radius", floats(0.0))], "must be above 0"),
        ("sphere", vec![("radius", floats(f32::NAN))], "\"radius\""),
        ("sphere", vec![("zmin", floats(0.5)), ("zmax", floats(0.5))], "nothing lies between"),
        ("sphere", vec![("phimax", floats(-3.0))], "\"phimax\""),
        ("disk", vec![("innerradius", floats(1.0))], "\"innerradius\""),
        ("disk", vec![("height", floats(f32::INFINITY))], "\"height\""),
        ("cylinder", vec![("zmin", floats(2.0)), ("zmax", floats(2.0))], "nothing lies between"),
        ("cylinder", vec![("radius", floats(-1.0))], "must be above 0"),
        ("loopsubdiv", vec![("P", points(3)), ("levels", ints(&[13]))], "from 0 to 12"),
        (
            "loopsubdiv",
            vec![("P", points(3)), ("indices", ints(&[0, 1, 2].repeat(64))), ("levels", ints(&[12]))],
            "come to more than",
        ),
    ];
    for (kind, params, expected) in cases {
        let message = build(kind, params).expect_err(expected);
        assert!(message.contains(expected), "{message:?} lacks {expected:?}");
    }
}

/// As pbrt-v4 does.
#[test]
fn shapes_that_cannot_be_are_left_out() {
    let ints = |v: &[i32]| ParamValue::Integer(v.to_vec());
    let cases: Vec<Case> = vec![
        ("trianglemesh", vec![], "\"P\" is missing"),
        ("loopsubdiv", vec![], "\"P\" is missing"),
        ("trianglemesh", vec![("P", points(4))], "\"indices\" are missing"),
        ("bilinearmesh", vec![("P", points(5))], "\"indices\" are missing"),
        ("trianglemesh", vec![("P", points(3)), ("indices", ints(&[0, 1, 3]))], "index 3 is out of range"),
        ("trianglemesh", vec![("P", points(3)), ("indices", ints(&[0, -1, 2]))], "index -1 is out of range"),
        ("bilinearmesh", vec![("P", points(4)), ("indices", ints(&[0, 1, 2, 9]))], "index 9"),
        ("loopsubdiv", vec![("P", points(3)), ("indices", ints(&[0, 1, 1]))], "uses a point twice"),
        ("loopsubdiv", vec![("P", points(3)), ("indices", ints(&[0, 1, 2].repeat(2)))], "as another face does"),
        ("curve", vec![("P", points(5))], "found 5"),
        ("curve", vec![("P", points(0))], "found 0"),
        ("curve", vec![("P", points(4)), ("degree", ParamValue::Integer(vec![4]))], "\"degree\" must be 2 or 3"),
        ("curve", vec![("P", points(3)), ("basis", word("bspline"))], "at least 4"),
        ("curve", vec![("P", points(4)), ("basis", word("hermite"))], "\"basis\" is \"hermite\""),
        ("curve", vec![("P", points(4)), ("type", word("ribbon"))], "takes 2 normals"),
        ("curve", vec![("P", points(4)), ("width", floats(-1.0))], "widths must not be negative"),
    ];
    for (kind, params, expected) in cases {
        let (shapes, warnings) = build_in(&entity(kind, params), DAffine3::IDENTITY);
        assert!(shapes.expect(expected).is_empty(), "{expected}");
        let [said] = warnings.list() else { panic!("{expected}: {warnings:?}") };
        assert!(said.message.contains(expected) && said.message.ends_with(": the shape is left out"), "{said:?}");
        assert_eq!(said.span, Some(SPAN));
        assert!(warnings.refuse_faults().is_err(), "{expected}");
    }
    let tube = vec![("P", points(4)), ("type", word("tube"))];
    let (shapes, warnings) = build_in(&entity("curve", tube), DAffine3::IDENTITY);
    let shapes = shapes.expect("a curve");
    assert!(matches!(&shapes[0].kind, ShapeKind::Curves(curves) if curves.kind == CurveKind::Cylinder));
    assert!(warnings.list()[0].message.contains("\"type\" is \"tube\"") && warnings.refuse_faults().is_err());
}

/// As pbrt-v4 does.
#[test]
fn lists_that_do_not_go_with_the_points_are_left_out() {
    let ints = |v: &[i32]| ParamValue::Integer(v.to_vec());
    let uvs = ParamValue::Vec2(vec![[0.0; 2]]);
    let cases: Vec<(Case, usize)> = vec![
        (("trianglemesh", vec![("P", points(3)), ("indices", ints(&[0, 1]))], "multiple of 3, found 2"), 0),
        (("trianglemesh", vec![("P", points(3)), ("indices", ints(&[0, 1, 2, 1, 2]))], "multiple of 3, found 5"), 1),
        // What is cut off is looked at by nobody.
        (("trianglemesh", vec![("P", points(3)), ("indices", ints(&[0, 1, 2, 9]))], "multiple of 3, found 4"), 1),
        (("trianglemesh", vec![("P", points(3)), ("N", points(2))], "\"N\" has 2 values for 3 points"), 1),
        (("trianglemesh", vec![("P", points(3)), ("uv", uvs.clone())], "\"uv\" has 1 values"), 1),
        (("trianglemesh", vec![("P", points(3)), ("uv", ParamValue::Vec2(vec![[0.5; 2]; 4]))], "has 4 values"), 1),
        (("bilinearmesh", vec![("P", points(4)), ("indices", ints(&[0, 1, 2, 3, 0]))], "multiple of 4, found 5"), 1),
        (("bilinearmesh", vec![("P", points(4)), ("N", points(5))], "\"N\" has 5 values for 4 points"), 1),
        (("bilinearmesh", vec![("P", points(4)), ("uv", uvs)], "\"uv\" has 1 values"), 1),
    ];
    for ((kind, params, expected), faces) in cases {
        let (shapes, warnings) = build_in(&entity(kind, params), DAffine3::IDENTITY);
        let found = match &shapes.expect(expected)[0].kind {
            ShapeKind::Triangles(mesh) => (mesh.indices.len(), mesh.normals.len(), mesh.uvs.len()),
            ShapeKind::Bilinear(mesh) => (mesh.indices.len(), mesh.normals.len(), mesh.uvs.len()),
            other => panic!("{other:?}"),
        };
        assert_eq!(found, (faces, 0, 0), "{expected}");
        let [warning] = warnings.list() else { panic!("{warnings:?}") };
        assert!(warning.message.contains(expected), "{warning:?} lacks {expected:?}");
        assert!(warnings.refuse_faults().expect_err("a fault").to_string().contains(expected));
    }
}

#[test]
fn flat_transforms_are_refused_only_where_they_must_be() {
    let flat = DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0));
    assert!(build_in(&entity("sphere", vec![]), flat).0.unwrap_err().contains("flattens"));
    assert!(build_in(&entity("trianglemesh", vec![("P", points(3))]), flat).0.is_ok());
    let broken = DAffine3::from_translation(DVec3::NAN);
    assert!(build_in(&entity("sphere", vec![]), broken).0.unwrap_err().contains("not finite"));
}

#[test]
fn unknown_shapes_and_unused_parameters_are_named() {
    let (shapes, warnings) = build_in(&entity("hyperboloid", vec![]), DAffine3::IDENTITY);
    assert!(shapes.unwrap().is_empty());
    assert!(warnings.list()[0].message.contains("hyperboloid"));
    let params = vec![("alpha", floats(0.5)), ("radios", floats(2.0))];
    let (shapes, warnings) = build_in(&entity("sphere", params), DAffine3::IDENTITY);
    assert_eq!(shapes.unwrap().len(), 1);
    assert_eq!(warnings.list().len(), 1, "alpha is the caller's: {warnings:?}");
    assert!(warnings.list()[0].message.contains("radios"));
}

#[test]
fn defaults_handedness_and_far_places() {
    let shapes = build("sphere", vec![]).unwrap();
    let ShapeKind::Sphere(sphere) = &shapes[0].kind else { panic!("a sphere was asked for") };
    assert_eq!((sphere.radius, sphere.z_min, sphere.z_max), (1.0, -1.0, 1.0));
    assert!(sphere.is_whole() && !shapes[0].flip_normal);
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let triangle = || vec![("P", points(3))];
    for (kind, params) in [("sphere", vec![]), ("disk", vec![]), ("trianglemesh", triangle())] {
        let mut mirrored = entity(kind, params);
        assert!(build_in(&mirrored, mirror).0.unwrap()[0].flip_normal);
        mirrored.reverse_orientation = true;
        assert!(!build_in(&mirrored, mirror).0.unwrap()[0].flip_normal, "twice is not at all");
    }

    // Object coordinates far away that the transform brings home lose nothing on the way.
    let mesh = ParamValue::Vec3(vec![[8388608.0, 0.0, 0.0], [8388609.0, 0.0, 0.0], [8388608.0, 1.0, 0.0]]);
    let home = DAffine3::from_scale(DVec3::splat(0.1)) * DAffine3::from_translation(DVec3::new(-8388608.0, 0.0, 0.0));
    let shapes = build_in(&entity("trianglemesh", vec![("P", mesh)]), home).0.unwrap();
    let ShapeKind::Triangles(mesh) = &shapes[0].kind else { panic!("a mesh was asked for") };
    assert_eq!(mesh.positions[1], Vec3::new(0.1, 0.0, 0.0));
}

#[test]
fn splines_become_the_same_curve() {
    // The uniform B-spline basis at the middle of a segment: cubic (1, 23, 23, 1)/48, quadratic (1, 6, 1)/8.
    let p: Vec<Vec3> = (0..4).map(|i| Vec3::new(i as f32, (i * i) as f32, 0.0)).collect();
    let middle = |params: Vec<(&str, ParamValue)>| {
        let shapes = build("curve", params).unwrap();
        let ShapeKind::Curves(curves) = &shapes[0].kind else { panic!("a curve was asked for") };
        let [a, b, c, d] = curves.control_points[0];
        ((a + 3.0 * b + 3.0 * c + d) / 8.0, curves.control_points.len(), curves.widths.clone())
    };
    let (at, count, widths) =
        middle(vec![("P", points(4)), ("basis", word("bspline")), ("width0", floats(2.0)), ("width1", floats(1.0))]);
    assert!(at.distance((p[0] + 23.0 * p[1] + 23.0 * p[2] + p[3]) / 48.0) < 1e-5);
    assert_eq!((count, widths), (1, vec![[2.0, 1.0]]));
    let degree = || ("degree", ParamValue::Integer(vec![2]));
    let (at, count, _) = middle(vec![("P", points(4)), ("basis", word("bspline")), degree()]);
    assert!(at.distance((p[0] + 6.0 * p[1] + p[2]) / 8.0) < 1e-5);
    assert_eq!(count, 2);
    let (at, count, widths) = middle(vec![("P", points(5)), degree()]);
    assert!(at.distance((p[0] + 2.0 * p[1] + p[2]) / 4.0) < 1e-5);
    assert_eq!((count, widths), (2, vec![[1.0, 1.0]; 2]));
}

/// What is a face in the file stays one, however many triangles it is cut into: powers of lights count faces.
#[test]
fn faces_of_files_are_counted_as_they_are_stated() {
    let folder = tempfile::tempdir().expect("a folder");
    let header = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 3\n\
                  property list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n3 1 0\n1 2 0\n0 1 0\n";
    std::fs::write(folder.path().join("m.ply"), format!("{header}5 0 1 2 3 4\n3 0 1 2\n4 0 1 2 3\n")).expect("a file");
    let entity = entity("plymesh", vec![("filename", word("m.ply"))]);
    let base = |name: &str| folder.path().join(name);
    let build = |displacement: Option<&Displacement>| {
        let (bindings, mut warnings) = (ShapeBindings::default(), Warnings::default());
        let built = build_shape(&entity, &DAffine3::IDENTITY, &base, bindings, displacement, &mut warnings);
        assert!(warnings.list().is_empty(), "{warnings:?}");
        let built = built.expect("a mesh");
        built.iter().map(|built| (built.shape.primitive_count(), built.stated_faces)).collect::<Vec<_>>()
    };
    assert_eq!(build(None), [(4, Some(2)), (1, None)]);
    let displacement =
        Displacement { height: &|_, _, _| 0.0, to_world: [DAffine3::IDENTITY; 2], edge_length: 100.0, span: SPAN };
    assert_eq!(build(Some(&displacement)), [(6, Some(3))]);
}
