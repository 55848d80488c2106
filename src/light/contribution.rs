//! What a light would contribute at a point if nothing were in the way, in one number: the luminance of the irradiance at a
//! surface, of the fluence in a medium. Light selection weighs lights by it, so it must be positive wherever a
//! light can contribute, and need not be more than an estimate.
//!
//! Emitters with a surface are bounded by a sphere around them and a cone around their normals, after Conty Estevez & Kulla,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018, section 3: every cosine is the largest that
//! any direction into the sphere could have, and a distance is never taken as less than the sphere's radius.

use glam::Vec3;

use super::emitters::Emitter;
use super::{GoniometricLight, LightId, LightRef, Lights, Receiver, SpotLight};

impl Lights {
    /// An estimate of what the light `id` contributes at `receiver`, unoccluded (luminance of irradiance or fluence): positive
    /// wherever it contributes, finite.
    #[inline]
    pub fn contribution(&self, id: LightId, receiver: &Receiver) -> f32 {
        let value = match self.get(id) {
            LightRef::Area(light) => Emitter::of(light).at(receiver),
            LightRef::Point(light) => light.intensity.luminance() * from_point(light.p, receiver),
            LightRef::Spot(light) => {
                let w = (receiver.p() - light.p).normalize_or(light.axis);
                light.intensity.luminance() * light.falloff(w.dot(light.axis)) * from_point(light.p, receiver)
            }
            LightRef::Goniometric(light) => {
                let w = (receiver.p() - light.p).normalize_or(light.axis());
                light.intensity_towards(w).luminance() * from_point(light.p, receiver)
            }
            LightRef::Distant(light) => light.irradiance.luminance() * cosine(receiver, light.wi),
            LightRef::Infinite(light) => light.contribution(receiver),
            LightRef::Volume(light) => light.contribution(receiver),
            LightRef::Moving(light) => light.contribution(receiver),
        };
        usable(value)
    }

    /// [`Lights::contribution`] to planes at `p` that face +x, −x, +y, −y, +z and −z, and to a medium there.
    pub fn contributions_on_planes(&self, id: LightId, p: Vec3) -> [f32; 7] {
        match self.get(id) {
            LightRef::Area(light) => Emitter::of(light).on_planes(p).map(usable),
            _ => std::array::from_fn(|k| match PLANE_NORMALS.get(k) {
                Some(&normal) => self.contribution(id, &Receiver::surface(p, normal, false)),
                None => self.contribution(id, &Receiver::medium(p)),
            }),
        }
    }
}

/// The outward normals of six planes.
pub const PLANE_NORMALS: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

/// NaN becomes 0.
#[inline]
fn usable(value: f32) -> f32 {
    if value > 0.0 { value.min(f32::MAX) } else { 0.0 }
}

impl Lights {
    /// The middle of a light that is somewhere; `None` for light from infinitely far away.
    pub fn centre(&self, id: LightId) -> Option<Vec3> {
        match self.get(id) {
            LightRef::Area(light) => Some(light.bounds.centre),
            LightRef::Point(light) => Some(light.p),
            LightRef::Spot(light) => Some(light.p),
            LightRef::Goniometric(light) => Some(light.p),
            LightRef::Volume(light) => Some(light.bounds().centre()),
            LightRef::Moving(light) => Some(light.bounds().centre()),
            LightRef::Distant(_) | LightRef::Infinite(_) => None,
        }
    }
}

/// The cone that a light from a point shines into.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Its tip, in render space.
    pub p: Vec3,
    /// Unit axis, away from the light.
    pub axis: Vec3,
    /// Cosine of its half angle.
    pub cos_end: f32,
}

impl Beam {
    pub(super) fn of_spot(light: &SpotLight) -> Self {
        Self { p: light.p, axis: light.axis, cos_end: light.cos_end }
    }

    pub(super) fn of_goniometric(light: &GoniometricLight) -> Self {
        Self { p: light.p, axis: light.axis(), cos_end: light.cos_end() }
    }
}

impl Lights {
    /// The cone of a spot, or around the light of a point that does not shine alike in all directions, at `time` in 0..=1 of the transforms' keys.
    pub fn beam(&self, id: LightId, time: f32) -> Option<Beam> {
        match self.get(id) {
            LightRef::Spot(light) => Some(Beam::of_spot(light)),
            LightRef::Goniometric(light) => Some(Beam::of_goniometric(light)),
            LightRef::Moving(light) => light.beam(time),
            _ => None,
        }
    }

    /// [`Lights::beam`] after a share of the exposure, from 0 to 1.
    pub fn beam_after(&self, id: LightId, share: f32) -> Option<Beam> {
        match self.get(id) {
            LightRef::Moving(light) => light.beam_after(share),
            _ => self.beam(id, 0.0),
        }
    }
}

/// cos θ / d² for a point; a medium takes the cosine as 1.
fn from_point(light: Vec3, receiver: &Receiver) -> f32 {
    let to_light = light - receiver.p();
    let square = to_light.length_squared().max(f32::MIN_POSITIVE);
    cosine(receiver, to_light / square.sqrt()) / square
}

/// The cosine at the receiver of `wi`, where it counts.
#[inline]
fn cosine(receiver: &Receiver, wi: Vec3) -> f32 {
    match *receiver {
        Receiver::Medium { .. } => 1.0,
        Receiver::Surface { ns, two_sided: true, .. } => ns.dot(wi).abs(),
        Receiver::Surface { ns, two_sided: false, .. } => ns.dot(wi).max(0.0),
    }
}
