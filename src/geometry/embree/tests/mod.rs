//! Tests of the Embree backend: each question against an independent way to answer it. Random cases have fixed seeds.

mod apart;
mod backends;
mod boundaries;
mod motion;
mod opacity;
mod scale;
mod surfaces;
mod watertight;

use std::sync::Arc;

use glam::{Affine3A, Vec3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use super::EmbreeTracer;
use crate::geometry::{
    Geometry, Instance, MotionTransform, Prototype, Ray, Shape, ShapeId, ShapeKind, shape::TriangleMesh,
};

/// One tracer answers all threads.
const _: fn() = || {
    fn shared_by_threads<T: Send + Sync>() {}
    shared_by_threads::<EmbreeTracer>();
};

/// A source of random numbers for making cases.
pub(super) struct Random(Pcg32);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(Pcg32::seed_from_u64(seed))
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 / 16_777_216.0
    }

    /// In [−1, 1)³.
    pub fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// On the unit sphere, uniformly.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.in_cube();
            if p.length_squared() <= 1.0 && p.length_squared() > 0.01 {
                return p.normalize();
            }
        }
    }

    /// From a point on a sphere of radius 3 towards one in the unit cube, without end.
    pub fn inward_ray(&mut self) -> Ray {
        let origin = 3.0 * self.direction();
        ray(origin, self.in_cube() - origin)
    }
}

/// Equal but for roundings: Embree divides by approximate reciprocals.
pub(super) fn near(found: f32, wanted: f32) -> bool {
    (found - wanted).abs() <= 1e-6 * wanted.abs()
}

/// A ray without end, at time 0.
pub(super) fn ray(origin: Vec3, towards: Vec3) -> Ray {
    Ray { origin, direction: towards.normalize(), t_max: f32::INFINITY, time: 0.0, opacity_seed: 0 }
}

/// A plain opaque shape.
pub(super) fn shape(kind: ShapeKind) -> Shape {
    Shape {
        kind,
        material: 0,
        light: None,
        medium_interface: None,
        alpha: None,
        is_boundary: false,
        links: 0,
        flip_normal: false,
    }
}

/// Shapes in render space.
pub(super) fn top_level(shapes: Vec<Shape>) -> Arc<Geometry> {
    let ids = (0..shapes.len() as u32).map(ShapeId).collect();
    Arc::new(Geometry { shapes, top_level: ids, ..Geometry::default() })
}

/// Shapes of one prototype, seen through the transforms.
pub(super) fn instanced(shapes: Vec<Shape>, transforms: Vec<MotionTransform>) -> Arc<Geometry> {
    let ids = (0..shapes.len() as u32).map(ShapeId).collect();
    let instances = transforms.into_iter().map(|transform| Instance { prototype: 0, transform }).collect();
    Arc::new(Geometry {
        shapes,
        top_level: Vec::new(),
        prototypes: vec![Prototype { shapes: ids }],
        instances,
        ..Geometry::default()
    })
}

pub(super) fn build(geometry: &Arc<Geometry>) -> EmbreeTracer {
    EmbreeTracer::build(geometry.clone(), None).expect("the case is well formed")
}

/// A closed box, its faces wound to look outward.
pub(super) fn box_mesh(low: Vec3, high: Vec3) -> TriangleMesh {
    let corner = |i: u32| {
        Vec3::new(
            if i & 1 == 0 { low.x } else { high.x },
            if i & 2 == 0 { low.y } else { high.y },
            if i & 4 == 0 { low.z } else { high.z },
        )
    };
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let indices = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriangleMesh { positions: (0..8).map(corner).collect(), indices, ..TriangleMesh::default() }
}

/// A sphere of triangles (an octahedron divided `depth` times), its faces wound to look outward.
pub(super) fn ball_mesh(centre: Vec3, radius: f32, depth: u32) -> TriangleMesh {
    let mut points = vec![Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
    let mut indices = vec![[0u32, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    let mut middles = std::collections::HashMap::new();
    for _ in 0..depth {
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let divided = indices.iter().flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        indices = divided.collect();
    }
    let positions = points.into_iter().map(|p| centre + radius * p).collect();
    TriangleMesh { positions, indices, ..TriangleMesh::default() }
}

/// The nearest hit by asking every primitive of every shape in turn; `to_render` per instance, identity for none.
pub(super) fn brute_force(geometry: &Geometry, ray: &Ray) -> Option<(f32, ShapeId, u32)> {
    let mut best: Option<(f32, ShapeId, u32)> = None;
    let mut try_shape = |id: ShapeId, to_render: Affine3A| {
        let inverse = to_render.inverse();
        let (origin, direction) = (inverse.transform_point3(ray.origin), inverse.transform_vector3(ray.direction));
        let shape = &geometry.shapes[id.0 as usize];
        for primitive in 0..shape.primitive_count() {
            let t_max = best.map_or(ray.t_max, |(t, ..)| t);
            if let Some((t, _)) = shape.intersect(primitive, origin, direction, 0.0, t_max) {
                best = Some((t, id, primitive));
            }
        }
    };
    for &id in &geometry.top_level {
        try_shape(id, Affine3A::IDENTITY);
    }
    for instance in &geometry.instances {
        for &id in &geometry.prototypes[instance.prototype as usize].shapes {
            try_shape(id, instance.transform.at(ray.time));
        }
    }
    best
}

/// Compares `closest` and `occluded` with brute force over random rays: at most `odd` of them may differ in whether they hit
/// (at outlines) and distances agree to `tolerance`. At least a tenth must hit, or the case tests nothing.
pub(super) fn agrees_with_brute_force(geometry: &Arc<Geometry>, rays: usize, seed: u64, odd: usize, tolerance: f32) {
    let tracer = build(geometry);
    let mut random = Random::new(seed);
    let (mut hits, mut differing) = (0, 0);
    for _ in 0..rays {
        let ray = Ray { time: random.unit(), ..random.inward_ray() };
        let found = tracer.closest(&ray);
        let wanted = brute_force(geometry, &ray);
        assert_eq!(tracer.occluded(&ray), found.is_some(), "{ray:?}");
        match (found, wanted) {
            (Some(found), Some((t, shape, primitive))) => {
                hits += 1;
                let same = (found.shape, found.primitive) == (shape, primitive);
                if (found.t - t).abs() > tolerance * t.max(1.0) || (!same && found.t != t) {
                    differing += 1;
                }
            }
            (None, None) => {}
            _ => differing += 1,
        }
    }
    assert!(hits * 10 > rays, "only {hits} of {rays} rays hit");
    assert!(differing <= odd, "{differing} of {rays} rays differ");
}
