//! Lights from a point that move or turn while the shutter is open: lamps of a car, a torch that is swung. **Ours**: in pbrt-v4 lights stand still where
//! they start.
//!
//! Which light is chosen does not depend on the time: it is weighed by bounds of all that it is during the exposure. Where it is when a path passes
//! does.

use std::sync::Arc;

use glam::{DVec3, Mat3, Vec3};

use super::contribution::Beam;
use super::goniometric::IntensityDistribution;
use super::tree::LightBounds;
use super::tree::node::Node;
use super::{GoniometricLight, LightSample, PointLight, Receiver, SpotLight, point};
use crate::geometry::MotionTransform;
use crate::math::Rgb;
use crate::math::transform::Decomposed;

/// Looks at the motion for the cone that its axis stays in.
const STEPS: u32 = 32;

/// What moves, in a space of its own.
#[derive(Clone, Debug)]
pub enum Punctual {
    /// A point.
    Point(PointLight),
    /// A point with a cone.
    Spot(SpotLight),
    /// A point with an intensity for each direction.
    Goniometric(GoniometricLight),
}

impl Punctual {
    fn bounds(&self) -> LightBounds {
        match self {
            Self::Point(light) => LightBounds::of_point(light.p, light.intensity.luminance()),
            Self::Spot(light) => LightBounds::of_spot(light),
            Self::Goniometric(light) => LightBounds::of_goniometric(light),
        }
    }

    /// Φ.
    pub fn power(&self) -> Rgb {
        match self {
            Self::Point(light) => light.power(),
            Self::Spot(light) => light.power(),
            Self::Goniometric(light) => light.power(),
        }
    }

    /// What it shares with others: the distribution of its intensity.
    pub fn shared(&self) -> Option<&Arc<IntensityDistribution>> {
        match self {
            Self::Goniometric(light) => Some(&light.distribution),
            Self::Point(_) | Self::Spot(_) => None,
        }
    }
}

/// How lights move from when the shutter opens to when it closes.
#[derive(Clone, Debug)]
pub struct Exposure {
    start: Decomposed,
    end: Decomposed,
    /// When that is, in 0..=1 of the interval of the transforms' keys.
    shutter: [f32; 2],
}

impl Exposure {
    /// The part of the motion from `start` at time 0 to `end` at time 1 that lies within `shutter`.
    pub fn new(start: &Decomposed, end: &Decomposed, shutter: [f32; 2]) -> Self {
        let shutter = shutter.map(|time| time.clamp(0.0, 1.0));
        let [open, close] = shutter.map(|time| start.between(end, f64::from(time)));
        Self { start: open, end: close, shutter }
    }

    /// Where the transform is at `time` in 0..=1 of its keys.
    #[inline]
    fn at(&self, time: f32) -> Decomposed {
        let [open, close] = self.shutter;
        self.after(if close > open { (time - open) / (close - open) } else { 0.0 })
    }

    /// Where it is after a share of the exposure.
    #[inline]
    fn after(&self, share: f32) -> Decomposed {
        self.start.between(&self.end, f64::from(share))
    }

    /// Whether the stretch changes by more than a factor: then axes turn by more than the rotation.
    fn is_stretched_otherwise(&self) -> bool {
        let [start, end] =
            [&self.start, &self.end].map(|key| key.stretch * key.stretch.determinant().abs().cbrt().recip());
        !start.abs_diff_eq(end, 1e-6)
    }
}

/// A light from a point, and its motion.
#[derive(Clone, Debug)]
pub struct MovingLight {
    still: Punctual,
    /// Shared among lights that move together.
    exposure: Arc<Exposure>,
    bounds: LightBounds,
    /// The bounds again, as they are asked.
    node: Node,
}

impl MovingLight {
    /// `still` is in a space of its own that `exposure` places; the orientation of what depends on the direction follows its rotation alone.
    pub fn new(still: Punctual, exposure: Arc<Exposure>) -> Self {
        let bounds = LightBounds::of_point(Vec3::ZERO, 0.0);
        let mut light = Self { still, exposure, bounds, node: Node::default() };
        light.bounds = light.find_bounds();
        light.node = Node::new(&light.bounds, true, 0);
        light
    }

    /// It as it is at `time` in 0..=1 of the transforms' keys, in render space.
    pub fn at(&self, time: f32) -> Punctual {
        self.placed(&self.exposure.at(time))
    }

    fn placed(&self, key: &Decomposed) -> Punctual {
        match &self.still {
            Punctual::Point(light) => Punctual::Point(PointLight { p: place(key, light.p), ..*light }),
            Punctual::Spot(light) => Punctual::Spot(placed_spot(key, light)),
            Punctual::Goniometric(light) => {
                let to_local = light.to_local * turn(key).transpose();
                Punctual::Goniometric(GoniometricLight { p: place(key, light.p), to_local, ..light.clone() })
            }
        }
    }

    /// The only direction there is at `time`.
    pub fn sample(&self, p: Vec3, time: f32) -> Option<LightSample> {
        let key = self.exposure.at(time);
        match &self.still {
            Punctual::Point(light) => point::towards(place(&key, light.p), p, |_| light.intensity),
            Punctual::Spot(light) => placed_spot(&key, light).sample(p),
            Punctual::Goniometric(light) => {
                let to_own = turn(&key).transpose();
                point::towards(place(&key, light.p), p, |w| light.intensity_towards(to_own * w))
            }
        }
    }

    /// The cone that it shines into, if it is one, at `time` in 0..=1 of the transforms' keys.
    pub fn beam(&self, time: f32) -> Option<Beam> {
        self.beam_placed(&self.exposure.at(time))
    }

    /// [`MovingLight::beam`] after a share of the exposure, from 0 to 1.
    pub fn beam_after(&self, share: f32) -> Option<Beam> {
        self.beam_placed(&self.exposure.after(share))
    }

    fn beam_placed(&self, key: &Decomposed) -> Option<Beam> {
        match &self.still {
            Punctual::Point(_) => None,
            Punctual::Spot(light) => Some(Beam::of_spot(&placed_spot(key, light))),
            Punctual::Goniometric(light) => {
                let Beam { p, axis, cos_end } = Beam::of_goniometric(light);
                Some(Beam { p: place(key, p), axis: turn(key) * axis, cos_end })
            }
        }
    }

    /// What moves, wherever it is.
    pub fn still(&self) -> &Punctual {
        &self.still
    }

    /// Bounds of all that it is during the exposure.
    pub fn bounds(&self) -> &LightBounds {
        &self.bounds
    }

    /// See [`super::Lights::contribution`]: positive wherever it contributes at some time of the exposure.
    #[inline]
    pub fn contribution(&self, receiver: &Receiver) -> f32 {
        self.node.importance(receiver)
    }

    fn find_bounds(&self) -> LightBounds {
        let Exposure { start, end, .. } = &*self.exposure;
        let own = self.still.bounds();
        let motion = MotionTransform::Moving { start: Box::new(*start), end: Box::new(*end) };
        let (low, high) = motion.bounds(own.low, own.high);
        let mut bounds = self.placed(start).bounds();
        if bounds.cos_normals > -1.0 {
            for step in 1..=STEPS {
                bounds = bounds.union(&self.placed(&self.exposure.after(step as f32 / STEPS as f32)).bounds());
            }
            // Between two looks the axis turns no farther than half a step.
            let turned = 2.0 * start.rotation.dot(end.rotation).abs().min(1.0).acos();
            let angle = bounds.cos_normals.clamp(-1.0, 1.0).acos() + 0.5 * turned as f32 / STEPS as f32 + 1e-3;
            let anywhere = self.exposure.is_stretched_otherwise() || angle >= std::f32::consts::PI;
            bounds.cos_normals = if anywhere { -1.0 } else { angle.cos() };
        }
        let radius = 0.5 * (high - low).length() * (1.0 + 1e-5);
        LightBounds { low, high, radius, even: false, energy: own.energy, ..bounds }
    }
}

fn place(key: &Decomposed, p: Vec3) -> Vec3 {
    key.affine().transform_point3(p.as_dvec3()).as_vec3()
}

fn turn(key: &Decomposed) -> Mat3 {
    Mat3::from_quat(key.rotation.as_quat())
}

fn placed_spot(key: &Decomposed, light: &SpotLight) -> SpotLight {
    let affine = key.affine();
    let axis = affine.transform_vector3(light.axis.as_dvec3()).normalize_or(DVec3::Z).as_vec3();
    SpotLight { p: affine.transform_point3(light.p.as_dvec3()).as_vec3(), axis, ..*light }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DQuat, EulerRot};

    use super::*;
    use crate::light::sphere_image::{Layout, SphereImage};
    use crate::math::sampler::Stream;

    fn vector(stream: &mut Stream) -> Vec3 {
        Vec3::from_array([(); 3].map(|()| 2.0 * stream.next_f32() - 1.0))
    }

    fn key(stream: &mut Stream, stretch: DVec3) -> Decomposed {
        let turn = vector(stream).as_dvec3() * 3.0;
        let rotation = DQuat::from_euler(EulerRot::XYZ, turn.x, turn.y, turn.z);
        let affine = DAffine3::from_scale_rotation_translation(stretch, rotation, vector(stream).as_dvec3() * 3.0);
        Decomposed::new(&affine).expect("it can be inverted")
    }

    fn lights(stream: &mut Stream) -> Vec<Punctual> {
        let image = SphereImage::new(Layout::Octahedral, 1, 1, vec![[1.0; 3]]);
        let distribution = Arc::new(IntensityDistribution::of_image(image));
        let (p, axis) = (vector(stream), vector(stream).normalize());
        let intensity = Rgb::splat(2.0);
        vec![
            Punctual::Point(PointLight { p, intensity }),
            Punctual::Spot(SpotLight { p, axis, intensity, cos_start: 0.95, cos_end: 0.9 }),
            Punctual::Goniometric(GoniometricLight { p, intensity, to_local: Mat3::IDENTITY, distribution }),
        ]
    }

    fn sample_of(light: &Punctual, p: Vec3) -> Option<LightSample> {
        match light {
            Punctual::Point(light) => light.sample(p),
            Punctual::Spot(light) => light.sample(p),
            Punctual::Goniometric(light) => light.sample(p),
        }
    }

    #[test]
    fn bounds_hold_all_that_it_is() {
        let mut stream = Stream::from_seed(11);
        let mut lit = 0;
        for round in 0..60 {
            let stretch = [DVec3::ONE, DVec3::new(1.0, 2.0, 0.5), DVec3::splat(3.0)][round % 3];
            let (start, end) = (key(&mut stream, DVec3::ONE), key(&mut stream, stretch));
            let shutter = [[0.0, 1.0], [0.25, 0.5], [-1.0, 0.75], [0.5, 0.5]][round % 4];
            let exposure = Arc::new(Exposure::new(&start, &end, shutter));
            for still in lights(&mut stream) {
                let light = MovingLight::new(still, exposure.clone());
                let bounds = light.bounds();
                for _ in 0..300 {
                    let [open, close] = shutter;
                    let time = (open + stream.next_f32() * (close - open)).clamp(0.0, 1.0);
                    let now = light.at(time).bounds();
                    let outside = (bounds.low - now.low).max(now.high - bounds.high).max_element();
                    assert!(outside <= 0.0, "{outside} outside at {time}");
                    if bounds.cos_normals > -1.0 {
                        let off = bounds.axis.dot(now.axis).clamp(-1.0, 1.0).acos();
                        assert!(off <= bounds.cos_normals.acos() + 1e-3, "{off} at {time}");
                    }
                    let (p, ns) = (vector(&mut stream) * 5.0, vector(&mut stream).normalize());
                    let receiver = Receiver::surface(p, ns, false);
                    if light.sample(p, time).is_some_and(|sample| sample.wi.dot(ns) > 0.0) {
                        assert!(light.contribution(&receiver) > 0.0, "lit from {p} at {time}");
                        lit += 1;
                    }
                }
            }
        }
        assert!(lit > 10_000, "{lit}");
    }

    #[test]
    fn it_is_where_its_transform_takes_it() {
        let mut stream = Stream::from_seed(12);
        let (start, end) = (key(&mut stream, DVec3::ONE), key(&mut stream, DVec3::ONE));
        let shutter = [0.25, 0.5];
        for still in lights(&mut stream) {
            let light = MovingLight::new(still.clone(), Arc::new(Exposure::new(&start, &end, shutter)));
            for time in [0.25f32, 0.4, 0.5] {
                let key = start.between(&end, f64::from(time));
                let affine = key.affine();
                let samples = (0..100).filter_map(|_| {
                    let p = vector(&mut stream) * 4.0;
                    Some((light.sample(p, time)?, sample_of(&light.at(time), p)?))
                });
                assert!(
                    samples.filter(|(a, b)| a.wi == b.wi && (a.radiance.0 - b.radiance.0).length() < 1e-3).count() > 1
                );
                let place = |p: Vec3| affine.transform_point3(p.as_dvec3()).as_vec3();
                let turn = |v: Vec3| affine.transform_vector3(v.as_dvec3()).as_vec3();
                match (light.at(time), &still) {
                    (Punctual::Point(now), Punctual::Point(own)) => assert!(now.p.distance(place(own.p)) < 1e-5),
                    (Punctual::Spot(now), Punctual::Spot(own)) => {
                        assert!(now.p.distance(place(own.p)) < 1e-5 && now.axis.distance(turn(own.axis)) < 1e-5);
                    }
                    (Punctual::Goniometric(now), Punctual::Goniometric(own)) => {
                        assert!(now.p.distance(place(own.p)) < 1e-5);
                        let w = vector(&mut stream);
                        assert!((now.to_local * turn(w)).distance(own.to_local * w) < 1e-5);
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
    }
}
