//! The unidirectional volumetric path tracer. Source: Kajiya 1986; Veach 1997 (MIS); Miller et al. 2019 (media); the depth
//! rule is pbrt-v4's (section 14.2.2): a path of k bounces gathers surface emission while k ≤ `max_depth`, and emission of media
//! only while k < `max_depth`.

use glam::Vec3;

use super::counters::Counters;
use super::direct::{DirectLight, Vertex};
use super::flight::{FlightVertex, PathState, PathWeight, sample_flight};
use super::glow_line;
use super::in_scatter::alternatives::OwnVertex;
use super::in_scatter::{self, InScatter, MOST_RAYS, RayStart, null_share};
use super::layers::{FirstVertex, Layers};
use super::light_choice::LightScratch;
use super::record::{Event, PathRecord, VertexKind};
use super::volume_light::FlightPdfs;
use super::world::World;
use crate::film::SampleResult;
use crate::film::gbuffer::SurfaceSample;
use crate::geometry::differentials::RayDifferentials;
use crate::geometry::{BoundaryCrossing, Ray, RayHit, SurfacePoint};
use crate::light::{EmitterHit, LightId, LinkSet};
use crate::material::footprint::Footprint;
use crate::material::{BsdfSample, MaterialId};
use crate::math::Rgb;
use crate::math::sampler::{Dimension, SamplePoint};
use crate::medium::regions::Regions;
use crate::system::fault::{self, Fault};

/// The most bounces of any path, whatever [`PathSettings::max_depth`] says. In a white medium (albedo exactly 1) Russian roulette ends no path, and one
/// as dense as [`crate::medium::resolution`] lets it be keeps some for 10⁹ vertices. Of the paths that enter a white half-space, H(μ) / √(πn) are still in it after
/// n bounces (from its albedo 1 − √(1 − ϖ) H(μ) as a generating function; Chandrasekhar's H is at most 2.91), so at most 0.052 % of the light is
/// lost: a bias by design, which [`Counters::cut_paths`] counts.
pub const MOST_BOUNCES: u32 = 10_000_000;

/// What the path tracer may be told.
#[derive(Clone, Copy, Debug)]
pub struct PathSettings {
    /// The largest number of bounces, at most [`MOST_BOUNCES`].
    pub max_depth: u32,
    /// From how many candidates the light sample of a vertex is resampled; 1 for no resampling.
    pub light_candidates: u32,
    /// How often each draw of lights is made at a vertex. More than once only where paths rehearse: what they bring is of no use then.
    pub tries: u32,
}

/// Memory that a thread reuses from path to path.
#[derive(Default)]
pub struct Scratch {
    /// Boundary crossings of the current ray.
    pub crossings: Vec<BoundaryCrossing>,
    /// The lights' weights at the current vertex.
    pub lights: LightScratch,
    /// What is known of the camera rays of the current pixel.
    pub in_scatter: InScatter,
    /// What was done so far.
    pub counters: Counters,
    /// What happens along paths, where that is asked for.
    pub record: Option<Box<PathRecord>>,
}

impl Scratch {
    /// Records an event, if events are recorded.
    #[inline]
    pub(super) fn note(&mut self, event: impl FnOnce() -> Event) {
        if let Some(record) = &mut self.record {
            record.add(event());
        }
    }
}

/// A ray from a camera, and how it would change with the pixel, where textures have levels of detail.
pub type CameraRay = (Ray, Option<RayDifferentials>);

/// A path on its way: where it goes next, and what it carries there.
pub(super) struct Walk {
    /// Its next ray.
    pub ray: Ray,
    /// Weight and media.
    pub path: PathState,
    /// Bounces so far.
    pub depth: u32,
    /// The last vertex, if lights were sampled from it.
    pub sampled_from: Option<Vec3>,
    /// What the path's weight counts in Russian roulette: undoes the radiance scaling of refraction, and the weight that it began with.
    pub roulette_scale: f32,
    /// The number of the next ray: 1 for a camera's alone.
    pub index: u32,
    /// How it would change with the pixel, where textures have levels of detail.
    pub differentials: Option<RayDifferentials>,
}

/// The radiance that arrives along `ray` from a camera, as one unbiased sample, sorted into layers. `seen` is told what of it surfaces and environments
/// shine straight into the camera, and answers with another unbiased sample of that, which the result has in its place.
///
/// `MEDIA` is whether the world has any: without, the code for them is not there.
pub fn trace_path<const MEDIA: bool>(
    world: &World,
    settings: &PathSettings,
    (ray, differentials): CameraRay,
    random: &SamplePoint,
    scratch: &mut Scratch,
    seen: impl FnOnce(Rgb, &mut Scratch) -> Rgb,
) -> SampleResult {
    scratch.counters.paths += 1;
    world.light_choice.begin_path(&mut scratch.lights);
    scratch.in_scatter.begin_path();
    let path = PathState {
        weight: PathWeight::START,
        regions: if MEDIA { camera_regions(world, &ray, scratch) } else { Default::default() },
        hero: None,
        links: None,
    };
    let start = Walk { ray, path, depth: 0, sampled_from: None, roulette_scale: 1.0, index: 1, differentials };
    let mut layers = Layers::new();
    walk::<MEDIA>(world, settings, start, random, scratch, &mut layers);
    if MEDIA {
        scratch.in_scatter.glow = layers.glow;
    }
    let seen = seen(layers.seen, scratch);
    scratch.note(|| Event::Seen { brought: seen });
    layers.whole(seen)
}

/// Goes on along a path until it ends, and adds what it meets to `layers`.
pub(super) fn walk<const MEDIA: bool>(
    world: &World,
    settings: &PathSettings,
    start: Walk,
    random: &SamplePoint,
    scratch: &mut Scratch,
    layers: &mut Layers,
) {
    let Walk {
        mut ray,
        mut path,
        mut depth,
        mut sampled_from,
        mut roulette_scale,
        index: first_index,
        mut differentials,
    } = start;
    // The first vertex in a medium, where in-scatter sampling may have come to as well.
    let mut mixed: Option<OwnVertex> = None;

    for index in first_index.. {
        ray.opacity_seed = random.hash(index, Dimension::Opacity);
        scratch.counters.closest_rays += 1;
        let hit = world.tracer.closest(&ray);
        let wo = -ray.direction;

        if MEDIA {
            ray.t_max = hit.as_ref().map_or(f32::INFINITY, |hit| hit.t);
        }
        // Most rays of a scene with little smoke are nowhere near it, and should not pay for it.
        if MEDIA && (!path.regions.media().is_empty() || scratch.in_scatter.is_on() || world.tracer.may_cross(&ray)) {
            path.hero.get_or_insert_with(|| (random.draw::<2>(0, Dimension::Time)[1] * 3.0) as u8);
            // Camera rays, and what mirrors and glass make of them. Rays from rough surfaces share their knots with no other: in `godrays`
            // drawing points on them as well left the variance as it was and took 1.7 times as long.
            let is_mixed = index <= MOST_RAYS
                && sampled_from.is_none()
                && mixed.is_none()
                && scratch.in_scatter.is_on()
                && depth < settings.max_depth;
            let began_with = path.weight;
            if is_mixed {
                let start = RayStart {
                    ray: &ray,
                    number: index,
                    path: &path,
                    depth,
                    roulette_scale,
                    differentials: differentials.as_ref(),
                };
                let scattered = in_scatter::gather(world, settings, &start, random, scratch);
                layers.add_scattered(scattered, depth + 1);
            }
            let mut grids_glow = world.fires.is_some() && depth < settings.max_depth;
            if grids_glow && sampled_from.is_none() {
                // Nothing else finds what emits along this ray.
                let mut stream = random.stream(index, Dimension::Glow);
                let [u] = random.draw::<1>(index, Dimension::Glow);
                let glow = glow_line::gather(world, &ray, &path.regions, u, &mut stream, scratch);
                layers.add(path.weight.alone() * glow, depth, true);
                grids_glow = false;
            }
            let mut stream = random.stream(index, Dimension::Flight);
            let mut pdfs = FlightPdfs::new(world, &ray, sampled_from, path.links);
            let vertex = sample_flight(
                world,
                &ray,
                &mut path,
                grids_glow,
                &mut stream,
                scratch,
                |weight, medium, glow, lights| {
                    if depth < settings.max_depth {
                        layers.add(pdfs.weight(weight, medium, lights) * glow, depth, true);
                    }
                },
            );
            if path.weight.throughput.is_black() {
                break;
            }
            if let Some(FlightVertex { vertex, medium, t, passed }) = vertex {
                if depth >= settings.max_depth {
                    scratch.counters.cut_paths += u64::from(depth >= MOST_BOUNCES);
                    break;
                }
                depth += 1;
                scratch.counters.medium_vertices += 1;
                layers.first.get_or_insert(FirstVertex::Medium);
                let p = vertex.p;
                scratch.note(|| Event::Vertex {
                    index,
                    depth,
                    kind: VertexKind::Medium,
                    p,
                    throughput: path.weight.alone(),
                    so_far: layers.result.beauty,
                });
                let mut is_drawn = false;
                if is_mixed {
                    let share = in_scatter::medium_share(world, path.regions.media(), medium, p, ray.time);
                    let expected = passed * share * scratch.in_scatter.expected(index, t);
                    is_drawn = expected > 0.0 && expected.is_finite();
                    let drawn = if is_drawn { began_with.unidirectional * expected } else { Rgb::BLACK };
                    let null = path.weight.unidirectional;
                    roulette_scale *= scratch.in_scatter.share(&mut path.weight, drawn, &began_with);
                    mixed = Some(OwnVertex {
                        share: null_share(null, drawn),
                        before: layers.result.beauty,
                        light: Rgb::BLACK,
                    });
                }
                let gathered_at = Vertex::Medium(&vertex);
                let direct = DirectLight {
                    world,
                    settings,
                    vertex: gathered_at,
                    wo,
                    time: ray.time,
                    path: &path,
                    depth,
                    random,
                    index,
                };
                if is_drawn && !scratch.in_scatter.null_lights() {
                    direct.prepare(scratch);
                } else {
                    let before = scratch.counters.work();
                    let gathered = direct.gather::<MEDIA>(scratch);
                    layers.add(gathered, depth, false);
                    if let Some(vertex) = mixed.as_mut().filter(|_| is_mixed) {
                        vertex.light = gathered;
                        scratch.in_scatter.work.null_lights += scratch.counters.work() - before;
                    }
                }

                let [u0, u1, u_roulette] = random.draw::<3>(index, Dimension::Scatter);
                let wi = vertex.phase.sample(wo, [u0, u1]);
                // f / pdf = 1: only the pdf of having sampled a light instead changes.
                let pdf = vertex.phase.evaluate(wo, wi);
                path.weight.light = path.weight.light / pdf;
                if let Some(differentials) = &mut differentials {
                    differentials.pass(t);
                    differentials.scatter(wi, pdf);
                }
                sampled_from = Some(p);
                path.links = Some(vertex.links);
                ray = Ray { origin: p, direction: wi, t_max: f32::INFINITY, ..ray };
                if !survives(&mut path.weight, roulette_scale, depth, u_roulette) {
                    break;
                }
                continue;
            }
        }

        let Some(hit) = hit else {
            for &light in world.lights.infinite() {
                let radiance = world.lights.background(light, ray.origin, ray.direction);
                if !radiance.is_black() {
                    let weight = mis_weight(world, &path, sampled_from, light, scratch, || {
                        let from = sampled_from.unwrap_or(ray.origin);
                        world.lights.background_pdf(light, from, ray.direction)
                    });
                    layers.add(weight * radiance, depth, false);
                }
            }
            break;
        };

        let mut point = world.geometry.surface_point(&ray, &hit);
        let shape = &world.geometry.shapes[hit.shape.0 as usize];
        if MEDIA {
            // Whatever rounding did on the way: now it is known which side of this surface the path is on.
            let fits = world.cross(&mut path.regions, hit.shape, hit.instance, wo.dot(point.ng) < 0.0);
            scratch.counters.region_overflows += u64::from(!fits);
        }
        if let Some(light) = shape.light.map(LightId) {
            let radiance = world.lights.emitted(light, point.ng, wo, point.uv);
            if !radiance.is_black() {
                let weight = mis_weight(world, &path, sampled_from, light, scratch, || {
                    // `sampled_from` is set whenever this is called.
                    let from = sampled_from.unwrap_or(ray.origin);
                    world.lights.pdf(&world.geometry, light, from, &emitter_hit(&hit, &point, ray.time), ray.direction)
                });
                layers.add(weight * radiance, depth, false);
            }
        }
        if depth >= settings.max_depth {
            scratch.counters.cut_paths += u64::from(depth >= MOST_BOUNCES);
            break;
        }
        depth += 1;
        scratch.counters.surface_vertices += 1;
        scratch.note(|| Event::Vertex {
            index,
            depth,
            kind: VertexKind::Surface,
            p: point.p,
            throughput: path.weight.alone(),
            so_far: layers.result.beauty,
        });

        let material = MaterialId(shape.material);
        let [u_mix] = if world.materials.is_mix(material) { random.draw(index, Dimension::Mix) } else { [0.0] };
        let footprint = match &mut differentials {
            Some(differentials) => {
                differentials.transfer(ray.direction, hit.t, point.ng);
                Footprint::new(differentials.dp, &world.geometry.partials(&ray, &hit))
            }
            None => Footprint::NONE,
        };
        if world.materials.has_relief() {
            let partials = || world.geometry.partials(&ray, &hit);
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

        path.weight.light = path.weight.unidirectional;
        let specular = bsdf.is_specular();
        if !specular {
            let vertex = Vertex::Surface { point: &point, bsdf: &bsdf };
            let direct = DirectLight { world, settings, vertex, wo, time: ray.time, path: &path, depth, random, index };
            layers.add(direct.gather::<MEDIA>(scratch), depth, false);
        }

        let [u_lobe, u0, u1, u_roulette] = random.draw::<4>(index, Dimension::Scatter);
        let Some(sample) = bsdf.sample(wo, [u_lobe, u0, u1]) else { break };
        let cosine = sample.wi.dot(point.ns).abs();
        path.weight.throughput *= sample.f * (cosine / sample.pdf);
        if path.weight.throughput.is_black() {
            break;
        }
        let pdf = if sample.pdf_is_proportional { bsdf.pdf(wo, sample.wi) } else { sample.pdf };
        path.weight.light = path.weight.light / pdf;
        sampled_from = (!sample.is_specular).then_some(point.p);
        path.links = Some(LinkSet(world.geometry.links(point.shape, point.instance)));
        if sample.is_transmission {
            roulette_scale *= sample.eta * sample.eta;
        }
        if let Some(differentials) = &mut differentials {
            bend(differentials, world, &ray, &hit, &point, &sample, pdf);
        }
        if MEDIA {
            // By the geometric normal: with shading normals a reflection may go through, a transmission may stay.
            let fits = world.cross(&mut path.regions, point.shape, point.instance, sample.wi.dot(point.ng) < 0.0);
            scratch.counters.region_overflows += u64::from(!fits);
        }
        let vertex = Vertex::Surface { point: &point, bsdf: &bsdf };
        ray = Ray { origin: vertex.ray_origin(sample.wi), direction: sample.wi, t_max: f32::INFINITY, ..ray };
        if !survives(&mut path.weight, roulette_scale, depth, u_roulette) {
            break;
        }
    }
    scratch.note(|| Event::End { so_far: layers.result.beauty + layers.seen });
    if let Some(vertex) = mixed {
        let rest = layers.result.beauty - (vertex.before + vertex.light);
        scratch.in_scatter.add_own(&vertex, rest);
    }
}

/// The regions where a camera ray starts: those of the camera's first position, taken along to where a moving camera or a
/// lens has put the ray. Only boundaries count on that way, not surfaces that separate media, and boundaries count as they stand at the
/// ray's time.
#[inline]
pub(super) fn camera_regions(world: &World, ray: &Ray, scratch: &mut Scratch) -> Regions {
    let mut regions = world.camera_regions.clone();
    let distance = ray.origin.length();
    if distance > 0.0 {
        let way = Ray { origin: Vec3::ZERO, direction: ray.origin / distance, t_max: distance, ..*ray };
        if !world.tracer.may_cross(&way) {
            return regions;
        }
        world.tracer.boundaries(&way, &mut scratch.crossings);
        scratch.counters.boundary_rays += 1;
        for crossing in &scratch.crossings {
            let fits = world.cross(&mut regions, crossing.shape, crossing.instance, crossing.entering);
            scratch.counters.region_overflows += u64::from(!fits);
        }
    }
    regions
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

/// The weight of light that the path met by itself: shared with next-event estimation where the last vertex sampled lights; 0 where
/// that light does not light the last vertex, whatever it is made of.
#[inline]
fn mis_weight(
    world: &World,
    path: &PathState,
    sampled_from: Option<Vec3>,
    light: LightId,
    scratch: &Scratch,
    pdf: impl FnOnce() -> f32,
) -> Rgb {
    if path.links.is_some_and(|links| !world.lights.is_linked(links, light)) {
        Rgb::BLACK
    } else if sampled_from.is_some() {
        let pmf = world.light_choice.pmf(&world.lights, light, &scratch.lights);
        path.weight.with_light(if fault::is(Fault::CertainLight) { 1.0 } else { pmf } * pdf())
    } else {
        path.weight.alone()
    }
}

/// Unbiased Russian roulette (Arvo & Kirk 1990): from the second bounce on, a path that would count less than 1 goes on with that
/// probability, and then counts as 1.
#[inline]
fn survives(weight: &mut PathWeight, roulette_scale: f32, depth: u32, u: f32) -> bool {
    let continuation = (weight.throughput * roulette_scale).max_channel() / weight.unidirectional.mean();
    if continuation >= 1.0 || depth <= 1 {
        return true;
    }
    if u >= continuation {
        return false;
    }
    weight.throughput *= if fault::is(Fault::FreeRoulette) { 1.0 } else { 1.0 / continuation };
    true
}
