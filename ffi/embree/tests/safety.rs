//! What the safe interface promises, tried from outside: errors instead of undefined behaviour, panics kept out of C.

use std::sync::Arc;

use embree::{
    Candidate, CurveKind, Device, Filter, Geometry, HitFilter, QuaternionKey, Ray, Scene, SceneBuilder, UserGeometry,
    UserHit,
};

struct Mesh {
    positions: Vec<[f32; 3]>,
    indices: Vec<[u32; 3]>,
}

/// The unit triangle in the plane of `z`, its vector with `spare` places behind the last vertex.
fn mesh(z: f32, spare: usize) -> Arc<Mesh> {
    let mut positions = Vec::with_capacity(3 + spare);
    positions.extend([[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]]);
    positions.shrink_to(3 + spare);
    Arc::new(Mesh { positions, indices: vec![[0, 1, 2]] })
}

fn triangles(device: &Arc<Device>, mesh: Arc<Mesh>, filter: HitFilter) -> Result<Geometry, embree::Error> {
    Geometry::triangles(device, mesh, |mesh| (&mesh.positions, mesh.indices.as_slice()), filter)
}

fn scene_of(device: &Arc<Device>, geometry: Geometry) -> Scene {
    let mut builder = SceneBuilder::new(device, true).unwrap();
    assert_eq!(builder.attach(geometry).unwrap(), 0);
    builder.commit().unwrap()
}

fn down() -> Ray {
    Ray { origin: [0.25, 0.5, 5.0], direction: [0.0, 0.0, -1.0], t_min: 0.0, t_max: f32::INFINITY, time: 0.0, id: 7 }
}

/// Embree divides by approximate reciprocals.
fn near(found: f32, wanted: f32) -> bool {
    (found - wanted).abs() <= 1e-6 * wanted.abs()
}

#[test]
fn shared_and_copied_buffers_outlive_their_makers() {
    let device = Device::new(1).unwrap();
    for spare in [0, 1] {
        let owner = mesh(1.0, spare);
        let watch = Arc::downgrade(&owner);
        let scene = scene_of(&device, triangles(&device, owner, HitFilter::None).unwrap());
        let hit = scene.intersect(&down()).unwrap();
        assert!(near(hit.t, 4.0) && near(hit.uv[0], 0.25) && near(hit.uv[1], 0.5), "{hit:?}");
        assert_eq!((hit.geometry, hit.primitive, hit.instance), (0, 0, None));
        // The normal of a counter-clockwise triangle looks at the viewer.
        assert!(hit.normal[2] > 0.0);
        assert!(watch.upgrade().is_some(), "the scene keeps the buffers' owner");
        drop(scene);
        assert!(watch.upgrade().is_none(), "and lets go of it");
    }
    drop(device);
}

#[test]
fn wrong_input_is_an_error() {
    let device = Device::new(1).unwrap();
    let other = Device::new(1).unwrap();
    let bad = Arc::new(Mesh { positions: vec![[0.0; 3]; 3], indices: vec![[0, 1, 3]] });
    let error = triangles(&device, bad, HitFilter::None).err().unwrap();
    assert_eq!(error.to_string(), "Embree: vertex number 3 of 3 vertices");
    let curve = Geometry::bezier_curves(&device, CurveKind::Flat, vec![[0.0; 4]; 4], vec![1], 4, HitFilter::None);
    assert!(curve.is_err());

    let foreign = triangles(&other, mesh(0.0, 1), HitFilter::None).unwrap();
    assert!(SceneBuilder::new(&device, true).unwrap().attach(foreign).is_err());
    let scene = Arc::new(scene_of(&device, triangles(&device, mesh(0.0, 1), HitFilter::None).unwrap()));
    assert!(Geometry::instance(&other, &scene, [0.0; 12]).is_err());
    let key = QuaternionKey { scale: [1.0; 3], skew: [0.0; 3], rotation: [1.0, 0.0, 0.0, 0.0], translation: [0.0; 3] };
    for count in [0, 1, 130] {
        assert!(Geometry::moving_instance(&device, &scene, &vec![key; count]).is_err());
    }
    // Embree's own message arrives: a triangle mesh has no transform.
    let plain = triangles(&device, mesh(0.0, 1), HitFilter::None).unwrap();
    let error = plain.transform_at(0.0).unwrap_err().to_string();
    assert!(error.starts_with("Embree: invalid operation"), "{error}");
    assert!(device.memory() > 0);
}

#[test]
fn a_moving_instance_moves_with_its_keys() {
    let device = Device::new(1).unwrap();
    let inner = Arc::new(scene_of(&device, triangles(&device, mesh(0.0, 1), HitFilter::None).unwrap()));
    let key = |z: f32| QuaternionKey {
        scale: [1.0; 3],
        skew: [0.0; 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
        translation: [0.0, 0.0, z],
    };
    let scene = scene_of(&device, Geometry::moving_instance(&device, &inner, &[key(0.0), key(2.0)]).unwrap());
    drop(inner);
    for (time, t) in [(0.0, 5.0), (0.25, 4.5), (1.0, 3.0)] {
        let hit = scene.intersect(&Ray { time, ..down() }).unwrap();
        assert!((hit.t - t).abs() < 1e-6 && hit.instance == Some(0), "{hit:?}");
    }
}

#[test]
fn rays_that_are_no_numbers_hit_nothing() {
    let device = Device::new(1).unwrap();
    let scene = scene_of(&device, triangles(&device, mesh(0.0, 1), HitFilter::Collect).unwrap());
    let nan = f32::NAN;
    for ray in [
        Ray { origin: [nan, 0.0, 0.0], ..down() },
        Ray { direction: [0.0, f32::NEG_INFINITY, 0.0], ..down() },
        Ray { direction: [0.0, -0.0, 0.0], ..down() },
        Ray { t_min: nan, ..down() },
        Ray { t_max: nan, ..down() },
        Ray { time: nan, ..down() },
        Ray { t_min: 6.0, t_max: 6.0, ..down() },
    ] {
        assert!(scene.intersect(&ray).is_none() && !scene.occluded(&ray));
        scene.collect(&ray, &mut |candidate| panic!("{candidate:?}"));
    }
    let mut found = Vec::new();
    scene.collect(&down(), &mut |candidate: &Candidate| found.push((candidate.hit.t, candidate.ray_id)));
    found.dedup();
    assert!(found.len() == 1 && near(found[0].0, 5.0) && found[0].1 == 7, "{found:?}");
    // Outside of `collect` such a geometry counts as nothing.
    assert!(scene.intersect(&down()).is_none() && !scene.occluded(&down()));
}

/// Planes of constant z = primitive number, each `thickness` apart twice; misbehaves on demand.
struct Planes {
    fail_bounds: bool,
    fail_intersect: bool,
    stuck: bool,
}

const GOOD: Planes = Planes { fail_bounds: false, fail_intersect: false, stuck: false };

impl UserGeometry for Planes {
    fn len(&self) -> u32 {
        4
    }

    fn bounds(&self, primitive: u32) -> Option<([f32; 3], [f32; 3])> {
        assert!(!self.fail_bounds, "no bounds today");
        let z = primitive as f32;
        // Primitive 3 would be hit first, but is left out.
        (primitive < 3).then_some(([-1.0, -1.0, z], [1.0, 1.0, z + 0.5]))
    }

    fn intersect(&self, primitive: u32, o: [f32; 3], d: [f32; 3], t_min: f32, t_max: f32) -> Option<UserHit> {
        assert!(!self.fail_intersect, "no hits today");
        if self.stuck {
            return Some(UserHit { t: t_min, uv: [0.0; 2] });
        }
        let z = primitive as f32;
        let mut ts = [(z - o[2]) / d[2], (z + 0.5 - o[2]) / d[2]];
        ts.sort_by(f32::total_cmp);
        ts.into_iter().find(|&t| t > t_min && t < t_max).map(|t| UserHit { t, uv: [0.25, z] })
    }
}

#[test]
fn user_geometry_is_hit_collected_and_filtered() {
    let device = Device::new(2).unwrap();
    let make = |filter| scene_of(&device, Geometry::user(&device, Arc::new(GOOD), filter).unwrap());
    let scene = make(HitFilter::None);
    let hit = scene.intersect(&down()).unwrap();
    assert_eq!((hit.t, hit.uv, hit.primitive), (2.5, [0.25, 2.0], 2));
    assert!(scene.occluded(&down()) && !scene.occluded(&Ray { t_max: 2.25, ..down() }));

    let mut found = Vec::new();
    make(HitFilter::Collect).collect(&down(), &mut |candidate| found.push(candidate.hit.t));
    found.sort_by(f32::total_cmp);
    assert_eq!(found, [2.5, 3.0, 3.5, 4.0, 4.5, 5.0]);

    struct Deeper(f32);
    impl Filter for Deeper {
        fn accept(&self, candidate: &Candidate) -> bool {
            assert_eq!(candidate.ray_id, 7);
            candidate.hit.t > self.0
        }
    }
    let scene = make(HitFilter::Test(Arc::new(Deeper(2.75))));
    assert_eq!(scene.intersect(&down()).unwrap().t, 3.0);
    assert!(scene.occluded(&down()));
    let scene = make(HitFilter::Test(Arc::new(Deeper(9.0))));
    assert!(scene.intersect(&down()).is_none() && !scene.occluded(&down()));
}

#[test]
fn misbehaving_user_geometry_is_contained() {
    let device = Device::new(1).unwrap();
    let attach = |planes: Planes, filter| {
        let mut builder = SceneBuilder::new(&device, true).unwrap();
        builder.attach(Geometry::user(&device, Arc::new(planes), filter).unwrap()).unwrap();
        builder.commit()
    };
    let error = attach(Planes { fail_bounds: true, ..GOOD }, HitFilter::None).err().unwrap().to_string();
    assert!(error.contains("no bounds today"), "{error}");

    let scene = attach(Planes { fail_intersect: true, ..GOOD }, HitFilter::None).unwrap();
    let asked = std::panic::AssertUnwindSafe(|| scene.intersect(&down()));
    assert!(std::panic::catch_unwind(asked).is_err());
    let asked = std::panic::AssertUnwindSafe(|| scene.occluded(&down()));
    assert!(std::panic::catch_unwind(asked).is_err());

    // One that never gets on does not hang the query.
    let scene = attach(Planes { stuck: true, ..GOOD }, HitFilter::Collect).unwrap();
    let mut count = 0;
    scene.collect(&down(), &mut |_| count += 1);
    assert!(count > 0);
}

#[test]
fn many_threads_ask_one_scene() {
    let device = Device::new(2).unwrap();
    let scene = scene_of(&device, triangles(&device, mesh(0.0, 1), HitFilter::None).unwrap());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| (0..1000).for_each(|_| assert!(near(scene.intersect(&down()).unwrap().t, 5.0))));
        }
    });
}
