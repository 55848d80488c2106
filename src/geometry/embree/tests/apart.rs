//! Kinds of shapes that few rays come near are scenes of their own, and no ray knows.

use glam::Vec3;

use super::backends::{Chequered, everything};
use super::surfaces::{disk, random_curves, sphere};
use super::*;
use crate::geometry::curve::CurveKind;
use crate::geometry::embree::boxes::Boxes;
use crate::geometry::embree::kinds::{Kind, apart};
use crate::geometry::trace::Opacity;

/// [`everything`], with a disk and curves, over a floor that is larger by far.
fn with_floor(half: f32) -> Geometry {
    let mut all = Arc::into_inner(everything()).expect("it is no one else's");
    let floor = TriangleMesh {
        positions: [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| Vec3::new(x, y, -1.3))
            .to_vec(),
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    };
    let to_shape = Affine3A::from_translation(Vec3::new(0.0, 0.0, 1.0));
    let made = [
        ShapeKind::Triangles(floor),
        ShapeKind::Disk(disk(to_shape)),
        ShapeKind::Curves(random_curves(&mut Random::new(61), CurveKind::Flat, 20)),
    ];
    for kind in made {
        all.top_level.push(ShapeId(all.shapes.len() as u32));
        all.shapes.push(Shape { alpha: Some(0), ..shape(kind) });
    }
    all
}

/// Tracers with all in one scene, and with what is to be apart.
fn both(geometry: &Arc<Geometry>) -> [EmbreeTracer; 2] {
    let boxes = Boxes::new(geometry);
    let apart = apart(geometry, &boxes);
    let opacity: Arc<dyn Opacity> = Arc::new(Chequered);
    [&[], &*apart].map(|apart| {
        EmbreeTracer::with_apart(geometry.clone(), Some(opacity.clone()), &boxes, apart).expect("well formed")
    })
}

#[test]
fn no_ray_knows() {
    let mut geometry = with_floor(6.0);
    let kinds = |geometry: &_| apart(geometry, &Boxes::new(geometry)).iter().map(|&(kind, _)| kind).collect::<Vec<_>>();
    assert_eq!(kinds(&geometry), [Kind::Curves, Kind::Others], "still and moving appearances of one prototype");
    let moving = geometry.instances.iter_mut().find(|instance| instance.transform.is_moving()).expect("there is one");
    moving.prototype = 1;
    geometry.prototypes.push(Prototype { shapes: geometry.prototypes[0].shapes.clone() });
    assert_eq!(kinds(&geometry), Kind::ALL[1..]);
    let geometry = Arc::new(geometry);
    let [together, apart] = both(&geometry);
    let mut random = Random::new(62);
    let mut met = [0; Kind::ALL.len()];
    for opacity_seed in 0..40_000 {
        let ray = Ray { time: random.unit(), t_max: 2.0 + 3.0 * random.unit(), opacity_seed, ..random.inward_ray() };
        let of = |tracer: &EmbreeTracer| {
            tracer.closest(&ray).map(|hit| (hit.t.to_bits(), hit.shape, hit.instance, hit.primitive))
        };
        let (a, b) = (of(&together), of(&apart));
        assert_eq!(a, b, "{ray:?}");
        assert_eq!(together.occluded(&ray), apart.occluded(&ray), "{ray:?}");
        if let Some((_, shape, instance, _)) = b {
            let kind = match instance {
                Some(instance) => Kind::of_instance(&geometry.instances[instance.0 as usize]),
                None => Kind::of(&geometry.shapes[shape.0 as usize]),
            };
            met[Kind::ALL.iter().position(|&other| other == kind).expect("one of all")] += 1;
        }
    }
    assert!(met.iter().all(|&count| count > 500), "{met:?}");
}

/// A tiny ball far from the origin and, from near or far, rays that meet it; many mirrors have turned them, so that they are not quite of unit length.
#[test]
fn directions_need_not_be_of_unit_length() {
    for (at, from) in [(0.0, 9.0), (500.0, 9.0), (500.0, 600.0), (3000.0, 0.1)] {
        let centre = Vec3::new(at, 0.3 * at, -0.2 * at);
        let mut random = Random::new(63);
        let floor = box_mesh(Vec3::new(-4e3, -4e3, -2e3), Vec3::new(4e3, 4e3, -1.9e3));
        let ball = sphere(Affine3A::from_scale_rotation_translation(Vec3::splat(5e-3), glam::Quat::IDENTITY, centre));
        let geometry = top_level(vec![shape(ShapeKind::Triangles(floor)), shape(ShapeKind::Sphere(ball))]);
        let [together, apart] = both(&geometry);
        assert_eq!(apart.apart.len(), 1);
        let mut hits = 0;
        for _ in 0..2000 {
            let origin = centre + from * random.direction();
            let aim = centre + 6e-3 * random.in_cube();
            let mut ray = ray(origin, aim - origin);
            ray.direction *= 1.0 + 1e-5 * (2.0 * random.unit() - 1.0);
            let [a, b] = [&together, &apart].map(|tracer| tracer.closest(&ray).map(|hit| (hit.t.to_bits(), hit.shape)));
            assert_eq!(a, b, "{ray:?}");
            hits += u32::from(a.is_some_and(|(_, shape)| shape == ShapeId(1)));
        }
        assert!(hits > 400, "{hits} at {at} from {from}");
    }
}

#[test]
fn what_most_rays_come_near_is_not_apart() {
    let kinds = |shapes| {
        let geometry = top_level(shapes);
        apart(&geometry, &Boxes::new(&geometry)).into_iter().map(|(kind, _)| kind).collect::<Vec<_>>()
    };
    let ball = || shape(ShapeKind::Triangles(ball_mesh(Vec3::ZERO, 1.0, 1)));
    let with_disk =
        |scale: f32| kinds(vec![ball(), shape(ShapeKind::Disk(disk(Affine3A::from_scale(Vec3::splat(scale)))))]);
    assert_eq!(with_disk(0.1), [Kind::Others]);
    assert_eq!(with_disk(3.0), []);
    assert_eq!(kinds(vec![ball()]), [], "triangles alone");
}
