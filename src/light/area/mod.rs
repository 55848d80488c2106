//! Diffuse area lights: shapes that radiate the same radiance from every point in every direction of one side or both, unless an image or a
//! photometric profile makes it vary ([`pattern`]).
//!
//! Sources: pbrt-v4 section 12.4; section 6.2.4 for cones over spheres. A mesh is one light. An emitter that belongs to an
//! instance is placed by the instance's transform at the ray's time, so a moving emitter is sampled where rays meet it.

pub mod extent;
pub mod mesh_tree;
pub mod parts;
pub mod pattern;

use std::sync::Arc;

use glam::{Affine3A, Vec2, Vec3};

use self::parts::Parts;
use self::pattern::EmissionPattern;
use super::{EmitterHit, LightEnd, LightSample};
use crate::geometry::affine;
use crate::geometry::sampling::{ShapeSampler, area_scale, round_sphere};
use crate::geometry::trace::{Opacity, PrimitivePoint};
use crate::geometry::{Geometry, InstanceId, Shape, ShapeId, ShapeKind};
use crate::math::Rgb;
use crate::math::frame::Frame;
use crate::math::sampler::mix;
use crate::math::warp::{uniform_cone, uniform_cone_pdf};

/// A shape that emits.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// The shape.
    pub shape: ShapeId,
    /// The one instance it appears in, where it belongs to a prototype.
    pub instance: Option<InstanceId>,
    /// Emitted radiance (W/(m² sr)), where there is a pattern times that.
    pub radiance: Rgb,
    /// What makes it vary, if anything does. Whoever sets it is to set `mean` and `by_cone` too.
    pub pattern: Option<Arc<EmissionPattern>>,
    /// The mean of the emitted radiance over the surface and, by the cosine, over directions.
    pub mean: Rgb,
    /// Emits from the side against the normal too.
    pub two_sided: bool,
    /// No ray can meet it (constant alpha 0): it lights the scene through sampling alone.
    pub invisible: bool,
    /// Drawn by the cone it fills: a whole, round sphere without `alpha` or pattern (the cone gives no parameters to ask them at).
    pub by_cone: bool,
    /// Draws points on it; `None` for what cannot be sampled, which is dark.
    pub sampler: Option<ShapeSampler>,
    /// Chooses among the primitives of a mesh that has many, or that an image lies on, instead of the sampler.
    pub parts: Option<Box<Parts>>,
    /// Area in render space, at time 0.
    pub area: f32,
    /// Where it is and which way it faces, over all times.
    pub bounds: EmitterBounds,
}

/// A sphere around an emitter and a cone around its normals.
#[derive(Clone, Copy, Debug, Default)]
pub struct EmitterBounds {
    /// Centre of the bounding sphere.
    pub centre: Vec3,
    /// Its radius.
    pub radius: f32,
    /// Unit axis of the cone of normals.
    pub axis: Vec3,
    /// Cosine of the cone's half angle; −1 for all directions.
    pub cos_normals: f32,
}

impl AreaLight {
    /// The radiance that leaves a point of normal `ng` and texture coordinates `uv` towards the unit direction `wo`.
    #[inline]
    pub fn emitted(&self, ng: Vec3, wo: Vec3, uv: Vec2) -> Rgb {
        let is_front = ng.dot(wo) > 0.0;
        if !self.two_sided && !is_front {
            return Rgb::BLACK;
        }
        match &self.pattern {
            None => self.radiance,
            Some(pattern) => self.radiance * pattern.at(if is_front { ng } else { -ng }, wo, uv),
        }
    }

    /// Prepares the choice among the primitives of `shape`, its own, where that pays; `weights` says how bright an image makes each.
    pub fn build_parts(&mut self, shape: &Shape, weights: Option<&[f32]>) {
        if let Some(sampler) = &mut self.sampler {
            self.parts = Parts::new(shape, sampler, self.two_sided, weights).map(Box::new);
            if self.parts.is_some() {
                sampler.forget_choice();
            }
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        let sampler = self.sampler.as_ref().map_or(0, ShapeSampler::memory);
        sampler + self.parts.as_ref().map_or(0, |parts| parts.memory())
    }

    /// Φ = π A L, twice that for both sides.
    pub fn power(&self) -> Rgb {
        self.mean * (std::f32::consts::PI * self.area * if self.two_sided { 2.0 } else { 1.0 })
    }

    /// Shape space to render space at `time`; `None` for the identity.
    #[inline]
    fn to_render(&self, geometry: &Geometry, time: f32) -> Option<Affine3A> {
        self.instance.map(|instance| geometry.instances[instance.0 as usize].transform.at(time))
    }

    /// A direction from `p` to the light.
    pub fn sample(
        &self,
        geometry: &Geometry,
        opacity: Option<&dyn Opacity>,
        p: Vec3,
        time: f32,
        u: [f32; 2],
        u_part: f64,
    ) -> Option<LightSample> {
        let sampler = self.sampler.as_ref()?;
        let shape = &geometry.shapes[self.shape.0 as usize];
        let to_render = self.to_render(geometry, time);
        if self.by_cone
            && let Some(cone) = Cone::new(shape, to_render.as_ref(), p)
        {
            return self.sample_cone(&cone, shape, u);
        }
        let sample = match &self.parts {
            None => sampler.sample(shape, u, u_part)?,
            Some(parts) => parts.sample(shape, sampler, to_render.as_ref(), p, u, u_part)?,
        };
        let point = sample.point;
        let (target, p_error, ng, mut pdf_area) = match &to_render {
            None => (point.p, point.p_error, point.ng, point.pdf_area),
            Some(m) => {
                let ng = normal_to_render(m, point.ng)?;
                let (target, p_error) = affine::point_with_error(m, point.p, point.p_error);
                (target, p_error, ng, point.pdf_area / area_scale(&m.matrix3, ng))
            }
        };
        let to_light = target - p;
        let square = to_light.length_squared();
        if !(square > 0.0 && square.is_finite()) {
            return None;
        }
        let wi = to_light / square.sqrt();
        let cos = ng.dot(wi).abs();
        let radiance = self.emitted(ng, -wi, point.uv);
        if radiance.is_black() || cos == 0.0 {
            return None;
        }
        if let (Some(opacity), Some(_), false) = (opacity, shape.alpha, self.invisible) {
            // The same chance to be there that a ray that meets the point gives it.
            let seed = mix(u64::from(u[0].to_bits()) << 32 | u64::from(u[1].to_bits())) ^ mix(u_part.to_bits());
            let (shape, instance) = (self.shape, self.instance);
            let at = PrimitivePoint { shape, instance, primitive: sample.primitive, uv: sample.parameters };
            if !opacity.is_opaque(geometry, &at, seed as u32) {
                return None;
            }
        }
        pdf_area *= square / cos;
        if !(pdf_area > 0.0 && pdf_area.is_finite()) {
            return None;
        }
        let end = LightEnd::Point { p: target, p_error, ng };
        Some(LightSample { wi, end, radiance, pdf: pdf_area, is_delta: self.invisible })
    }

    /// From outside only the outer side of a sphere is seen: light that leaves inwards does not come this way.
    fn sample_cone(&self, cone: &Cone, shape: &Shape, u: [f32; 2]) -> Option<LightSample> {
        if self.radiance.is_black() || (shape.flip_normal && !self.two_sided) {
            return None;
        }
        let wi = Frame::from_z(cone.axis).to_world(uniform_cone(u, cone.one_minus_cos)).normalize();
        let pdf = uniform_cone_pdf(cone.one_minus_cos);
        let end = LightEnd::Sphere { centre: cone.centre, radius: cone.radius };
        pdf.is_finite().then_some(LightSample { wi, end, radiance: self.radiance, pdf, is_delta: self.invisible })
    }

    /// The solid-angle pdf with which [`AreaLight::sample`] from `p` takes the unit direction `wi` that meets `hit`.
    pub fn pdf(&self, geometry: &Geometry, p: Vec3, hit: &EmitterHit, wi: Vec3) -> f32 {
        let Some(sampler) = self.sampler.as_ref() else { return 0.0 };
        if self.invisible {
            return 0.0;
        }
        let shape = &geometry.shapes[self.shape.0 as usize];
        let to_render = self.to_render(geometry, hit.time);
        if self.by_cone
            && let Some(cone) = Cone::new(shape, to_render.as_ref(), p)
        {
            return uniform_cone_pdf(cone.one_minus_cos);
        }
        let pdf_area = match &to_render {
            None => sampler.pdf_area(shape, hit.primitive, hit.parameters, hit.ng),
            Some(m) => {
                let normal = Vec3::from(m.matrix3.transpose() * glam::Vec3A::from(hit.ng)).normalize_or_zero();
                sampler.pdf_area(shape, hit.primitive, hit.parameters, normal) / area_scale(&m.matrix3, hit.ng)
            }
        };
        let preference = self
            .parts
            .as_ref()
            .map_or(1.0, |parts| parts.preference(shape, sampler, to_render.as_ref(), p, hit.primitive));
        let pdf = pdf_area * preference * (hit.p - p).length_squared() / hit.ng.dot(wi).abs();
        if pdf.is_finite() { pdf } else { 0.0 }
    }
}

/// The cone that a sphere fills as seen from outside.
struct Cone {
    centre: Vec3,
    radius: f32,
    /// Unit direction to the centre.
    axis: Vec3,
    one_minus_cos: f32,
}

impl Cone {
    /// `None` from inside (and from so near to the surface that it cannot be told).
    fn new(shape: &Shape, to_render: Option<&Affine3A>, p: Vec3) -> Option<Self> {
        let ShapeKind::Sphere(sphere) = &shape.kind else { return None };
        let (mut centre, mut radius) = round_sphere(sphere)?;
        if let Some(m) = to_render {
            centre = m.transform_point3(centre);
            radius *= m.matrix3.determinant().abs().cbrt();
        }
        let to_centre = centre - p;
        let distance = to_centre.length();
        if distance <= radius * (1.0 + 1e-5) || !distance.is_finite() {
            return None;
        }
        let sin = radius / distance;
        // 1 − cos θ_max without cancellation for spheres that look like points.
        let one_minus_cos = sin * sin / (1.0 + (1.0 - sin * sin).max(0.0).sqrt());
        let pdf = uniform_cone_pdf(one_minus_cos);
        pdf.is_finite().then_some(Self { centre, radius, axis: to_centre / distance, one_minus_cos })
    }
}

/// A unit normal under an affine map.
pub(in crate::light) fn normal_to_render(to_render: &Affine3A, normal: Vec3) -> Option<Vec3> {
    Some(affine::normal(to_render, normal.as_dvec3())).filter(|normal| *normal != Vec3::ZERO)
}
