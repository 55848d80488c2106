//! Displaced meshes against those that they must be: moved planes, larger spheres, height fields; whole surfaces; and everything that is refused.

use std::collections::HashMap;

use glam::{DAffine3, DMat4, DVec3, Vec2, Vec3};

use super::Displacement;
use crate::geometry::ShapeKind;
use crate::geometry::build::{ShapeBindings, build_shape};
use crate::geometry::shape::TriangleMesh;
use crate::math::transform::Animated;
use crate::scene::{Entity, FileId, MaterialIndex, Param, ParamSet, ParamValue, ShapeEntity, Span, Warnings};

const SPAN: Span = Span { file: FileId(0), line: 7, column: 1, length: 5 };

type Params = Vec<(&'static str, ParamValue)>;

/// How a test displaces.
struct Case<'a> {
    kind: &'a str,
    params: Params,
    to_world: [DAffine3; 2],
    edge_length: f64,
    height: &'a (dyn Fn(DVec3, Vec3, Vec2) -> f32 + Sync),
}

impl Case<'_> {
    fn build(&self) -> Result<TriangleMesh, String> {
        let list = self.params.iter().map(|(name, value)| Param::new(*name, "test", value.clone(), SPAN)).collect();
        let entity = ShapeEntity {
            entity: Entity {
                kind: self.kind.into(),
                params: ParamSet::new(format!("Shape \"{}\"", self.kind), SPAN, list),
            },
            transform: Animated::fixed(DMat4::IDENTITY).into(),
            reverse_orientation: false,
            material: MaterialIndex(0),
            area_light: None,
            medium_interface: None,
        };
        let displacement =
            Displacement { height: self.height, to_world: self.to_world, edge_length: self.edge_length, span: SPAN };
        let base = |name: &str| std::path::PathBuf::from(name);
        let mut warnings = Warnings::default();
        let bindings = ShapeBindings::default();
        let shapes = build_shape(&entity, &self.to_world[0], &base, bindings, Some(&displacement), &mut warnings);
        let mut shapes = shapes.map_err(|error| error.to_string())?;
        assert!(warnings.list().is_empty() && shapes.len() == 1, "{warnings:?}");
        match shapes.remove(0).shape.kind {
            ShapeKind::Triangles(mesh) => Ok(mesh),
            other => panic!("not triangles: {other:?}"),
        }
    }
}

fn displaced(
    kind: &str,
    params: Params,
    edge_length: f64,
    height: &(dyn Fn(DVec3, Vec3, Vec2) -> f32 + Sync),
) -> TriangleMesh {
    let case = Case { kind, params, to_world: [DAffine3::IDENTITY; 2], edge_length, height };
    case.build().unwrap_or_else(|error| panic!("{error}"))
}

fn vec3s(values: impl IntoIterator<Item = [f32; 3]>) -> ParamValue {
    ParamValue::Vec3(values.into_iter().collect())
}

fn ints(values: &[i32]) -> ParamValue {
    ParamValue::Integer(values.to_vec())
}

/// A unit square in the plane z = 0 whose texture coordinates are x and y.
fn square() -> Params {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    vec![
        ("P", vec3s(corners.map(|[x, y]| [x, y, 0.0]))),
        ("uv", ParamValue::Vec2(corners.to_vec())),
        ("indices", ints(&[0, 1, 2, 0, 2, 3])),
    ]
}

fn area(mesh: &TriangleMesh) -> f64 {
    let of = |i: u32| {
        let [a, b, c] = mesh.triangle(i).map(|p| p.as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    (0..mesh.indices.len() as u32).map(of).sum()
}

/// Fails unless every edge between two places is used once in each direction.
#[track_caller]
fn assert_watertight(mesh: &TriangleMesh) {
    let mut uses: HashMap<[[u32; 3]; 2], [u32; 2]> = HashMap::new();
    for triangle in &mesh.indices {
        let places = triangle.map(|v| mesh.positions[v as usize].to_array().map(|x| (x + 0.0).to_bits()));
        for [a, b] in [[places[0], places[1]], [places[1], places[2]], [places[2], places[0]]] {
            assert_ne!(a, b, "an edge of no length");
            if a < b { uses.entry([a, b]).or_default()[0] += 1 } else { uses.entry([b, a]).or_default()[1] += 1 }
        }
    }
    let open = uses.values().filter(|uses| **uses != [1, 1]).count();
    assert!(open == 0, "{open} of {} edges are not shared by two triangles", uses.len());
}

#[track_caller]
fn longest_edge(mesh: &TriangleMesh) -> f32 {
    let of = |triangle: [Vec3; 3]| (0..3).map(|i| triangle[i].distance(triangle[(i + 1) % 3])).fold(0.0, f32::max);
    (0..mesh.indices.len() as u32).map(|i| of(mesh.triangle(i))).fold(0.0, f32::max)
}

/// A cube from −1 to 1 with vertices of its own for each face (normals and texture coordinates differ there), outward.
fn cube() -> Params {
    let (mut p, mut n, mut uv, mut indices) = (vec![], vec![], vec![], vec![]);
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            let first = p.len() as i32;
            for [a, b] in [[-1.0f32, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
                let mut corner = [0.0; 3];
                (corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (sign, a * sign, b);
                let mut normal = [0.0; 3];
                normal[axis] = sign;
                p.push(corner);
                n.push(normal);
                uv.push([0.5 + 0.5 * a, 0.5 + 0.5 * b]);
            }
            indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
        }
    }
    vec![("P", vec3s(p)), ("indices", ints(&indices)), ("uv", ParamValue::Vec2(uv)), ("N", vec3s(n))]
}

#[test]
fn a_plane_displaced_by_a_constant_is_the_plane_moved() {
    for normals in [false, true] {
        let mut params = square();
        if normals {
            params.push(("N", vec3s([[0.0, 0.0, 2.0]; 4])));
        }
        let mesh = displaced("trianglemesh", params, 0.2, &|_, n, _| {
            assert_eq!(n, Vec3::Z);
            0.25
        });
        assert!(mesh.positions.iter().all(|p| p.z == 0.25), "all of it moves alike");
        assert!((area(&mesh) - 1.0).abs() < 1e-6 && longest_edge(&mesh) <= 0.2);
        assert_eq!(mesh.normals.len(), if normals { mesh.positions.len() } else { 0 });
        assert!(mesh.normals.iter().all(|n| (*n - Vec3::Z).length() < 1e-6));
        assert!(mesh.uvs.iter().zip(&mesh.positions).all(|(uv, p)| *uv == p.truncate()));
        // No more than what the area takes, give or take: halves of the longest edge keep triangles in shape.
        assert!((50..400).contains(&mesh.indices.len()), "{}", mesh.indices.len());
    }
}

#[test]
fn a_sphere_displaced_by_a_constant_is_a_larger_sphere() {
    // An octahedron of good normals: they are interpolated, so that a displacement by 1 of edges in the ball of radius 1 is not round; of a fine mesh it is.
    let octahedron = vec![
        ("P", vec3s([[1., 0., 0.], [0., 1., 0.], [-1., 0., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]])),
        ("indices", ints(&[0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 1, 0, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5])),
    ];
    // First a ball: from each point to the sphere of radius 1 along the normal, which of an octahedron is everywhere nearly that of the sphere.
    let ball = displaced("trianglemesh", octahedron, 0.05, &|_, _, _| 0.0);
    let on_sphere: Vec<[f32; 3]> = ball.positions.iter().map(|p| p.normalize().to_array()).collect();
    let sphere = vec![
        ("P", vec3s(on_sphere.iter().copied())),
        ("N", vec3s(on_sphere.iter().copied())),
        ("indices", ints(&ball.indices.as_flattened().iter().map(|i| *i as i32).collect::<Vec<_>>())),
    ];
    let mesh = displaced("trianglemesh", sphere, 0.06, &|_, _, _| 0.5);
    let expected = 4.0 * std::f64::consts::PI * 2.25;
    assert!((area(&mesh) / expected - 1.0).abs() < 2e-3, "{} {expected}", area(&mesh));
    let radii = mesh.positions.iter().map(|p| p.length());
    assert!(radii.clone().all(|r| (1.497..1.5001).contains(&r)), "{:?}", radii.reduce(f32::min));
    assert_watertight(&mesh);
    let out = |(p, n): (&Vec3, &Vec3)| n.normalize().dot(p.normalize()) > 0.998;
    assert!(mesh.positions.iter().zip(&mesh.normals).all(out));
}

/// Heights that differ at every seam of the texture coordinates.
fn rough(_: DVec3, _: Vec3, uv: Vec2) -> f32 {
    0.2 * (5.0 * uv.x + 3.0 * uv.y * uv.y).sin()
}

#[test]
fn seams_do_not_tear() {
    let all = cube();
    // With normals and texture coordinates, without either, without both.
    for without in [&[][..], &["N"], &["uv"], &["N", "uv"]] {
        let params: Params = all.iter().filter(|(name, _)| !without.contains(name)).cloned().collect();
        // Edges of lengths that halving does not hit, stretched and turned: both sides of an edge decide alike.
        let turned = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7)
            * DAffine3::from_scale(DVec3::new(1.0, 3.7, 0.3));
        for to_world in [[DAffine3::IDENTITY; 2], [turned, DAffine3::from_scale(DVec3::splat(1.7))]] {
            let case =
                Case { kind: "trianglemesh", params: params.clone(), to_world, edge_length: 0.23, height: &rough };
            let mesh = case.build().expect("it can be displaced");
            assert_watertight(&mesh);
            assert!(mesh.indices.len() > 1000);
            // Faces stay flat up to their heights: within a face all points move along its normal.
            assert_eq!(mesh.normals.is_empty(), without.contains(&"N"));
        }
    }
    // Flat faces move along their normals, the seams along their mean: by 0.3/√2 or 0.3/√3 on each axis.
    let mesh = displaced("trianglemesh", all, 0.3, &|_, _, _| 0.3);
    let reach = |p: &Vec3| p.abs().max_element();
    assert!(
        mesh.positions.iter().all(|p| [1.3, 1.0 + 0.3 / 2f32.sqrt(), 1.0 + 0.3 / 3f32.sqrt()].iter().any(|r| (reach(
            p
        ) - r)
            .abs()
            < 1e-6))
    );
    // And hard edges stay hard: normals of different faces are not mixed.
    let corner = |n: &Vec3| n.normalize().abs().max_element() > 0.9;
    assert!(mesh.normals.iter().all(corner));
}

#[test]
fn the_two_sides_of_a_sheet_part() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
    let params = vec![("P", vec3s(corners.into_iter().chain(corners))), ("indices", ints(&[0, 1, 2, 3, 5, 4]))];
    let mesh = displaced("trianglemesh", params, 0.5, &|_, _, _| 0.1);
    assert!(mesh.positions.iter().all(|p| p.z.abs() == 0.1));
    let (up, down) = (mesh.positions.iter().filter(|p| p.z > 0.0).count(), mesh.positions.len() / 2);
    assert_eq!(up, down);
}

#[test]
fn a_height_field_is_the_exact_one() {
    let height = |x: f32, y: f32| 0.1 * (6.0 * x).sin() * (4.0 * y).cos();
    let mut params = square();
    params.push(("N", vec3s([[0.0, 0.0, 1.0]; 4])));
    // Looked up by texture coordinates, or by place.
    let heights: [&(dyn Fn(DVec3, Vec3, Vec2) -> f32 + Sync); 2] =
        [&|_, _, uv| height(uv.x, uv.y), &|p, _, _| height(p.x as f32, p.y as f32)];
    for heights in heights {
        let mesh = displaced("trianglemesh", params.clone(), 0.01, heights);
        for ((p, n), uv) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uvs) {
            assert_eq!((p.truncate(), p.z), (*uv, height(uv.x, uv.y)));
            let slope = Vec2::new(
                0.6 * (6.0 * uv.x).cos() * (4.0 * uv.y).cos(),
                -0.4 * (6.0 * uv.x).sin() * (4.0 * uv.y).sin(),
            );
            let expected = Vec3::new(-slope.x, -slope.y, 1.0).normalize();
            // Normals at the border know one side alone.
            assert!(n.normalize().distance(expected) < 0.03, "{uv}: {n} {expected}");
        }
    }
}

#[test]
fn every_mesh_can_be_displaced() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    // A patch's own coordinates where it has none.
    let patch = vec![("P", vec3s(corners))];
    let mesh = displaced("bilinearmesh", patch, 0.2, &|_, n, uv| {
        assert_eq!(n, Vec3::Z);
        uv.x + 2.0 * uv.y
    });
    assert!(mesh.positions.iter().all(|p| (p.z - p.x - 2.0 * p.y).abs() < 1e-6) && area(&mesh) > 2.4);

    let pyramid = vec![
        ("P", vec3s([[1., 0., 0.], [0., 1., 0.], [-1., -1., 0.], [0., 0., 1.]])),
        ("indices", ints(&[0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3])),
        ("levels", ints(&[2])),
    ];
    let smooth = displaced("loopsubdiv", pyramid, 0.1, &|_, n, _| 0.05 + 0.02 * n.x);
    assert_watertight(&smooth);
    assert_eq!(smooth.normals.len(), smooth.positions.len());

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("m.ply");
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
         property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0.5 0\n4 0 1 2 3\n3 1 4 2\n";
    std::fs::write(&path, text).expect("it can be written");
    let params = vec![("filename", ParamValue::String(vec![path.display().to_string()]))];
    let mesh = displaced("plymesh", params, 0.3, &|_, _, _| 0.5);
    assert!(mesh.positions.iter().all(|p| p.z == 0.5) && (area(&mesh) - 1.5).abs() < 1e-6);
}

#[test]
fn lengths_are_those_in_the_world_and_heights_those_of_the_shape() {
    // Ten times as large: edges of 2 in the world are 0.2 here; while it grows to twice that, 0.1.
    let ten = DAffine3::from_scale(DVec3::splat(10.0));
    for (end, longest) in [(ten, 2.0), (ten * DAffine3::from_scale(DVec3::splat(2.0)), 1.0)] {
        let case = Case {
            kind: "trianglemesh",
            params: square(),
            to_world: [ten, end],
            edge_length: 2.0,
            height: &|p, _, uv| {
                assert!((p.x as f32 - 10.0 * uv.x).abs() < 1e-5);
                0.25
            },
        };
        let mesh = case.build().expect("it can be displaced");
        assert!(mesh.positions.iter().all(|p| p.z == 2.5));
        let found = longest_edge(&mesh);
        assert!(found <= longest && found > 0.5 * longest, "{found} {longest}");
    }
}

#[test]
fn stated_normals_say_where_out_is() {
    let mut params = square();
    params.push(("N", vec3s([[0.0, 0.0, -1.0]; 4])));
    let mesh = displaced("trianglemesh", params, 0.5, &|_, n, _| {
        assert_eq!(n, Vec3::NEG_Z);
        0.5
    });
    assert!(mesh.positions.iter().all(|p| p.z == -0.5) && mesh.normals.iter().all(|n| n.z < 0.0));
}

#[test]
fn what_is_too_fine_or_not_finite_is_refused() {
    let case = |edge_length, height: &(dyn Fn(DVec3, Vec3, Vec2) -> f32 + Sync)| {
        let case =
            Case { kind: "trianglemesh", params: square(), to_world: [DAffine3::IDENTITY; 2], edge_length, height };
        case.build().expect_err("it must be refused")
    };
    let start = std::time::Instant::now();
    for edge_length in [1e-5, 1e-30, f64::MIN_POSITIVE] {
        let message = case(edge_length, &|_, _, _| panic!("nothing may be looked up"));
        assert!(message.contains("comes to more than"), "{message}");
    }
    assert!(start.elapsed().as_secs() < 20, "found out at once");
    // A sliver: hardly any area, but edges that go on and on.
    let sliver = vec![("P", vec3s([[0.0, 0.0, 0.0], [1e9, 0.0, 0.0], [0.0, 1e-9, 0.0]]))];
    let to_world = [DAffine3::IDENTITY; 2];
    let sliver = Case { kind: "trianglemesh", params: sliver, to_world, edge_length: 0.5, height: &|_, _, _| 1.0 };
    assert!(sliver.build().expect_err("too long").contains("comes to more than"));
    for bad in [f32::NAN, f32::INFINITY] {
        let message = case(0.5, &|_, _, uv| if uv.x > 0.5 { bad } else { 0.0 });
        assert!(message.contains("its displacement is not finite"), "{message}");
    }
    let message = case(0.5, &|_, _, _| 1e30);
    assert!(message.contains("beyond"), "{message}");
    let nothing =
        displaced("trianglemesh", vec![("P", vec3s([[0.0; 3]; 3])), ("indices", ints(&[]))], 1.0, &|_, _, _| 1.0);
    assert!(nothing.indices.is_empty());
    // Triangles without area have no normal, and stay.
    let point = displaced("trianglemesh", vec![("P", vec3s([[1.0; 3]; 3]))], 1.0, &|_, _, _| 1.0);
    assert_eq!(point.positions, [Vec3::ONE; 3]);
}
