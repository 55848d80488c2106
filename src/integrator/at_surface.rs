//! What a path does where its ray meets a surface.

use super::direct::{DirectLight, Vertex};
use super::layers::{FirstVertex, Layers};
use super::path::{MOST_BOUNCES, PathSettings, Scratch};
use super::record::{Event, VertexKind};
use super::walk::Walk;
use super::world::World;
use crate::film::gbuffer::SurfaceSample;
use crate::geometry::differentials::RayDifferentials;
use crate::geometry::{Ray, RayHit, SurfacePoint};
use crate::light::{EmitterHit, LightId, LinkSet};
use crate::material::footprint::Footprint;
use crate::material::{BsdfSample, MaterialId};
use crate::math::sampler::{Dimension, SamplePoint};

/// Adds what the surface emits and what light it scatters, and scatters the path; false where it is over.
#[inline]
pub(super) fn at_surface(
    world: &World,
    settings: &PathSettings,
    walk: &mut Walk,
    hit: &RayHit,
    random: &SamplePoint,
    scratch: &mut Scratch,
    layers: &mut Layers,
) -> bool {
    let Walk { index, .. } = *walk;
    let ray = walk.ray;
    let wo = -ray.direction;
    let mut point = world.geometry.surface_point(&ray, hit);
    let shape = &world.geometry.shapes[hit.shape.0 as usize];
    if shape.medium_interface.is_some() {
        // Whatever rounding did on the way: now it is known which side of this surface the path is on.
        walk.cross(world, &point, wo.dot(point.ng) < 0.0, scratch);
    }
    if let Some(light) = shape.light.map(LightId) {
        let radiance = world.lights.emitted(light, point.ng, wo, point.uv);
        if !radiance.is_black() {
            let weight = walk.mis_weight(world, light, scratch, |from| {
                let hit = emitter_hit(hit, &point, ray.time);
                world.lights.pdf(&world.geometry, light, from, &hit, ray.direction)
            });
            layers.add(weight * radiance, walk.depth, false);
        }
    }
    if walk.depth >= settings.max_depth {
        scratch.counters.cut_paths += u64::from(walk.depth >= MOST_BOUNCES);
        return false;
    }
    walk.depth += 1;
    let depth = walk.depth;
    scratch.counters.surface_vertices += 1;
    scratch.note(|| Event::Vertex {
        index,
        depth,
        kind: VertexKind::Surface,
        p: point.p,
        throughput: walk.path.weight.alone(),
        so_far: layers.result.beauty,
    });

    let material = MaterialId(shape.material);
    let [u_mix] = if world.materials.is_mix(material) { random.draw(index, Dimension::Mix) } else { [0.0] };
    let mut footprint = Footprint::NONE;
    if let Some(differentials) = &mut walk.differentials {
        differentials.transfer(ray.direction, hit.t, point.ng);
        if world.materials.is_textured(material) {
            footprint = Footprint::new(differentials.dp, &world.geometry.partials(&ray, hit));
        }
    }
    if world.materials.has_relief(material) {
        let partials = || world.geometry.partials(&ray, hit);
        world.materials.emboss(material, &mut point, wo, u_mix, &footprint, partials);
    }
    let bsdf = world.materials.bsdf(material, &point, &footprint, u_mix, random.hash(index, Dimension::Layers));
    if layers.first.is_none() {
        layers.first = Some(FirstVertex::Surface);
        layers.result.albedo = bsdf.albedo(wo);
        layers.result.normal = point.ns;
        layers.result.depth = hit.t;
        let surface = SurfaceSample { p: point.p, ng: point.ng, ns: point.ns, uv: point.uv, ..Default::default() };
        layers.result.surface = Some(surface);
    }

    walk.path.weight.light = walk.path.weight.unidirectional;
    if !bsdf.is_specular() {
        let (vertex, path) = (Vertex::Surface { point: &point, bsdf: &bsdf }, &walk.path);
        let direct = DirectLight { world, settings, vertex, wo, time: ray.time, path, depth, random, index };
        layers.add(direct.gather(scratch), depth, false);
    }

    let [u_lobe, u0, u1, u_roulette] = random.draw::<4>(index, Dimension::Scatter);
    let Some(sample) = bsdf.sample(wo, [u_lobe, u0, u1]) else { return false };
    let path = &mut walk.path;
    let cosine = sample.wi.dot(point.ns).abs();
    path.weight.throughput *= sample.f * (cosine / sample.pdf);
    if path.weight.throughput.is_black() {
        return false;
    }
    let pdf = if sample.pdf_is_proportional { bsdf.pdf(wo, sample.wi) } else { sample.pdf };
    path.weight.light = path.weight.light / pdf;
    path.links = Some(LinkSet(world.geometry.links(point.shape, point.instance)));
    walk.sampled_from = (!sample.is_specular).then_some(point.p);
    if sample.is_transmission {
        walk.roulette_scale *= sample.eta * sample.eta;
    }
    if let Some(differentials) = &mut walk.differentials {
        bend(differentials, world, &ray, hit, &point, &sample, pdf);
    }
    if shape.medium_interface.is_some() {
        // By the geometric normal: with shading normals a reflection may go through, a transmission may stay.
        walk.cross(world, &point, sample.wi.dot(point.ng) < 0.0, scratch);
    }
    let vertex = Vertex::Surface { point: &point, bsdf: &bsdf };
    walk.ray = Ray { origin: vertex.ray_origin(sample.wi), direction: sample.wi, t_max: f32::INFINITY, ..ray };
    walk.survives(u_roulette)
}

fn emitter_hit(hit: &RayHit, point: &SurfacePoint, time: f32) -> EmitterHit {
    EmitterHit {
        shape: hit.shape,
        primitive: hit.primitive,
        parameters: hit.uv,
        time,
        instance: hit.instance,
        p: point.p,
        ng: point.ng,
        uv: point.uv,
    }
}

/// Makes the ray differentials at a surface those of the scattered ray.
fn bend(
    differentials: &mut RayDifferentials,
    world: &World,
    ray: &Ray,
    hit: &RayHit,
    point: &SurfacePoint,
    sample: &BsdfSample,
    pdf: f32,
) {
    if !sample.is_specular {
        differentials.scatter(sample.wi, pdf);
        return;
    }
    let dn = || world.geometry.normal_change(ray, hit, point.ns, differentials.dp);
    match (sample.is_transmission, sample.eta) {
        (false, _) => differentials.reflect(ray.direction, point.ns, dn()),
        // Straight through.
        (true, 1.0) => {}
        (true, eta) => differentials.refract(ray.direction, sample.wi, point.ns, dn(), eta),
    }
}
