//! What lights send, and how a direction to them is drawn: each question is passed on to the light's own type.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::{EmitterHit, LightId, LightRef, LightSample, Lights, emitters};
use crate::geometry::Geometry;
use crate::math::Rgb;

impl Lights {
    /// A direction from `p` to the light `id` at `time`, drawn with `u` and, for a choice among the light's parts, `u_part`, all in
    /// [0, 1). `None` where nothing arrives. `u_part` is f64 because a mesh may have millions of parts.
    #[inline]
    pub fn sample(
        &self,
        geometry: &Geometry,
        id: LightId,
        p: Vec3,
        time: f32,
        u: [f32; 2],
        u_part: f64,
    ) -> Option<LightSample> {
        match self.get(id) {
            LightRef::Area(light) => light.sample(geometry, self.opacity.as_deref(), p, time, u, u_part),
            LightRef::Point(light) => light.sample(p),
            LightRef::Spot(light) => light.sample(p),
            LightRef::Goniometric(light) => light.sample(p),
            LightRef::Distant(light) => light.sample(),
            LightRef::Infinite(light) => light.sample(p, u, u_part),
            LightRef::Volume(light) => light.sample(p, u, u_part),
            LightRef::Moving(light) => light.sample(p, time),
        }
    }

    /// The solid-angle pdf with which [`Lights::sample`] from `p` (the very same point) draws the unit direction `wi` of a ray that
    /// has met the area light `id` at `hit`. 0 for lights that no ray meets.
    #[inline]
    pub fn pdf(&self, geometry: &Geometry, id: LightId, p: Vec3, hit: &EmitterHit, wi: Vec3) -> f32 {
        match self.get(id) {
            LightRef::Area(light) => light.pdf(geometry, p, hit, wi),
            _ => 0.0,
        }
    }

    /// The solid-angle pdf with which [`Lights::sample`] from `p` draws `direction` for the light `id` that is a medium.
    #[inline]
    pub fn volume_pdf(&self, id: LightId, p: Vec3, direction: Vec3) -> f32 {
        match self.get(id) {
            LightRef::Volume(light) => light.pdf(p, direction),
            _ => 0.0,
        }
    }

    /// The bounds of all area lights, for selectors that ask every light.
    pub fn emitter_table(&self) -> emitters::EmitterTable {
        emitters::EmitterTable::new(&self.area)
    }

    /// The radiance that the area light `id` emits at a point of oriented normal `ng` and texture coordinates `uv` towards the viewer, in unit
    /// direction `wo`.
    #[inline]
    pub fn emitted(&self, id: LightId, ng: Vec3, wo: Vec3, uv: Vec2) -> Rgb {
        match self.get(id) {
            LightRef::Area(light) => light.emitted(ng, wo, uv),
            _ => Rgb::BLACK,
        }
    }

    /// The lights that a ray which leaves the scene sees.
    pub fn infinite(&self) -> &[LightId] {
        &self.infinite
    }

    /// What the infinite light `id` sends to `p` from the unit direction `direction`.
    #[inline]
    pub fn background(&self, id: LightId, p: Vec3, direction: Vec3) -> Rgb {
        match self.get(id) {
            LightRef::Infinite(light) => light.radiance(p, direction),
            _ => Rgb::BLACK,
        }
    }

    /// The solid-angle pdf with which [`Lights::sample`] from `p` draws `direction` for the infinite light `id`.
    #[inline]
    pub fn background_pdf(&self, id: LightId, p: Vec3, direction: Vec3) -> f32 {
        match self.get(id) {
            LightRef::Infinite(light) => light.pdf(p, direction),
            _ => 0.0,
        }
    }

    /// Emitted power Φ in watts. Light from infinity counts as far as it enters the sphere around the scene.
    pub fn power(&self, id: LightId) -> Rgb {
        let disk = PI * self.scene_radius * self.scene_radius;
        match self.get(id) {
            LightRef::Area(light) => light.power(),
            LightRef::Point(light) => light.power(),
            LightRef::Spot(light) => light.power(),
            LightRef::Goniometric(light) => light.power(),
            LightRef::Distant(light) => light.irradiance * disk,
            LightRef::Infinite(light) => light.power(disk),
            LightRef::Volume(light) => light.power(),
            LightRef::Moving(light) => light.still().power(),
        }
    }

    /// Whether the light emits nothing at all.
    #[inline]
    pub fn is_dark(&self, id: LightId) -> bool {
        match self.get(id) {
            LightRef::Area(light) => light.mean.is_black() || light.sampler.is_none(),
            LightRef::Point(light) => light.intensity.is_black(),
            LightRef::Spot(light) => light.intensity.is_black(),
            LightRef::Goniometric(light) => light.power().is_black(),
            LightRef::Distant(light) => light.irradiance.is_black(),
            LightRef::Infinite(light) => light.is_dark(),
            LightRef::Volume(light) => light.is_dark(),
            LightRef::Moving(light) => light.still().power().is_black(),
        }
    }
}
