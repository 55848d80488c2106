//! Next-event estimation: one light chosen, one point on it, one shadow ray, weighed against BSDF or phase-function sampling by the
//! balance heuristic. Source: Veach 1997, chapter 9; Miller et al. 2019 for media; pbrt-v4 section 14.2.2.

use glam::Vec3;

use super::flight::{MediumVertex, PathState, transmittance};
use super::path::Scratch;
use super::world::World;
use crate::geometry::{Ray, SurfacePoint};
use crate::light::Receiver;
use crate::light::selector::choice;
use crate::material::Bsdf;
use crate::math::Rgb;
use crate::math::robust::offset_ray_origin;
use crate::math::sampler::{Dimension, SamplePoint};
use crate::medium::tracker::Transmittance;

/// A vertex that light is gathered at.
pub enum Vertex<'a> {
    /// On a surface.
    Surface {
        /// The point.
        point: &'a SurfacePoint,
        /// Its scattering.
        bsdf: &'a Bsdf,
    },
    /// In a medium.
    Medium(&'a MediumVertex),
}

impl Vertex<'_> {
    /// Position in render space.
    pub fn p(&self) -> Vec3 {
        match self {
            Self::Surface { point, .. } => point.p,
            Self::Medium(vertex) => vertex.p,
        }
    }

    /// As light selection sees it, for a path that arrives along −`wo`.
    pub fn receiver(&self, wo: Vec3) -> Receiver {
        match self {
            Self::Surface { point, bsdf } => Receiver::Surface {
                p: point.p,
                ns: if wo.dot(point.ns) < 0.0 { -point.ns } else { point.ns },
                two_sided: bsdf.is_transmissive(),
            },
            Self::Medium(vertex) => Receiver::Medium { p: vertex.p },
        }
    }

    /// The scattered share of radiance (f·cos, or the phase function) from `wi` to `wo`, and the pdf of sampling `wi`.
    #[inline]
    fn scatter(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        match self {
            Self::Surface { point, bsdf } => {
                let f = bsdf.evaluate(wo, wi) * wi.dot(point.ns).abs();
                (f, if f.is_black() { 0.0 } else { bsdf.pdf(wo, wi) })
            }
            Self::Medium(vertex) => {
                let p = vertex.phase.evaluate(wo, wi);
                (Rgb::splat(p), p)
            }
        }
    }

    /// Where a ray in direction `wi` starts.
    #[inline]
    pub fn ray_origin(&self, wi: Vec3) -> Vec3 {
        match self {
            Self::Surface { point, .. } => offset_ray_origin(point.p, point.p_error, point.ng, wi),
            Self::Medium(vertex) => vertex.p,
        }
    }
}

/// The light that reaches `vertex` straight from the lights and leaves along `wo`, times the path's weight. Leaves the
/// selector prepared for this vertex, so that the next hit can ask for the pmf of the light it meets.
#[inline]
pub fn sample_direct<const MEDIA: bool>(
    world: &World,
    vertex: &Vertex<'_>,
    wo: Vec3,
    time: f32,
    path: &PathState,
    (random, index): (&SamplePoint, u32),
    scratch: &mut Scratch,
) -> Rgb {
    world.selector.prepare(&world.lights, &vertex.receiver(wo), &mut scratch.selector);
    let [u_light, u0, u1, u_part] = random.draw::<4>(index, Dimension::Light);
    let Some((light, pmf, u_part)) = world.selector.sample(choice(u_light, u_part), &scratch.selector) else {
        return Rgb::BLACK;
    };
    let p = vertex.p();
    let Some(sample) = world.lights.sample(&world.geometry, light, p, time, [u0, u1], u_part) else {
        return Rgb::BLACK;
    };
    if sample.radiance.is_black() {
        return Rgb::BLACK;
    }
    let (f, scatter_pdf) = vertex.scatter(wo, sample.wi);
    if f.is_black() {
        return Rgb::BLACK;
    }

    let origin = vertex.ray_origin(sample.wi);
    let (direction, t_max) = sample.segment(origin);
    let ray = Ray { origin, direction, t_max, time, opacity_seed: random.hash(index, Dimension::Light) };
    scratch.counters.shadow_rays += 1;
    if world.tracer.occluded(&ray) {
        scratch.counters.shadow_rays_blocked += 1;
        return Rgb::BLACK;
    }
    let passed = if MEDIA {
        let mut stream = random.stream(index, Dimension::Transmittance);
        match vertex {
            // Light from behind a surface that separates media arrives through the medium there.
            Vertex::Surface { point, .. } if (sample.wi.dot(point.ng) < 0.0) != (wo.dot(point.ng) < 0.0) => {
                let mut regions = path.regions.clone();
                let fits = world.cross(&mut regions, point.shape, point.instance, sample.wi.dot(point.ng) < 0.0);
                scratch.counters.region_overflows += u64::from(!fits);
                transmittance(world, &ray, &regions, &mut stream, scratch)
            }
            _ => transmittance(world, &ray, &path.regions, &mut stream, scratch),
        }
    } else {
        Transmittance::CLEAR
    };

    let weight = &path.weight;
    let light_pdf = weight.unidirectional * (pmf * sample.pdf);
    let pdf = if sample.is_delta {
        light_pdf
    } else {
        light_pdf + weight.unidirectional * passed.pass_probability * scatter_pdf
    };
    weight.throughput * f * passed.value * sample.radiance / pdf.mean()
}
