//! Lights from a point that move or turn while the shutter is open: lamps of a car, a torch that is swung. **Ours**: in pbrt-v4 lights stand still where
//! they start.
//!
//! Which light is chosen does not depend on the time: it is weighed by bounds of all that it is during the exposure. Where it is when a path passes
//! does.

use glam::{DQuat, DVec3, Mat3, Vec3};

use super::tree::LightBounds;
use super::tree::node::Node;
use super::{GoniometricLight, LightSample, PointLight, Receiver, SpotLight};
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

    fn sample(&self, p: Vec3) -> Option<LightSample> {
        match self {
            Self::Point(light) => light.sample(p),
            Self::Spot(light) => light.sample(p),
            Self::Goniometric(light) => light.sample(p),
        }
    }
}

/// A light from a point, and its motion.
#[derive(Clone, Debug)]
pub struct MovingLight {
    still: Punctual,
    start: Decomposed,
    end: Decomposed,
    bounds: LightBounds,
    /// The bounds again, as they are asked.
    node: Node,
}

impl MovingLight {
    /// `still` is placed by `start` at time 0 and by `end` at time 1; what is not its orientation is taken from it as it is, the stretch of an image too.
    pub fn new(still: Punctual, start: Decomposed, end: Decomposed) -> Self {
        let mut light =
            Self { still, start, end, bounds: LightBounds::of_point(Vec3::ZERO, 0.0), node: Node::default() };
        light.bounds = light.find_bounds();
        light.node = Node::new(&light.bounds, true, 0);
        light
    }

    /// It as it is at `time` in 0..=1, in render space.
    pub fn at(&self, time: f32) -> Punctual {
        let affine = self.start.interpolate(&self.end, f64::from(time));
        let place = |p: Vec3| affine.transform_point3(p.as_dvec3()).as_vec3();
        match &self.still {
            Punctual::Point(light) => Punctual::Point(PointLight { p: place(light.p), ..*light }),
            Punctual::Spot(light) => {
                let axis = affine.transform_vector3(light.axis.as_dvec3()).normalize_or(DVec3::Z).as_vec3();
                Punctual::Spot(SpotLight { p: place(light.p), axis, ..*light })
            }
            Punctual::Goniometric(light) => {
                let turned = Mat3::from_quat(self.rotation(time).as_quat());
                let to_local = light.to_local * turned.transpose();
                Punctual::Goniometric(GoniometricLight { p: place(light.p), to_local, ..light.clone() })
            }
        }
    }

    fn rotation(&self, time: f32) -> DQuat {
        self.start.rotation.slerp(self.end.rotation, f64::from(time))
    }

    /// The only direction there is at `time`.
    #[inline]
    pub fn sample(&self, p: Vec3, time: f32) -> Option<LightSample> {
        self.at(time).sample(p)
    }

    /// What moves, wherever it is.
    pub fn still(&self) -> &Punctual {
        &self.still
    }

    /// Bounds of all that it is between the times 0 and 1.
    pub fn bounds(&self) -> &LightBounds {
        &self.bounds
    }

    /// See [`super::Lights::contribution`]: positive wherever it contributes at some time.
    #[inline]
    pub fn contribution(&self, receiver: &Receiver) -> f32 {
        self.node.importance(receiver)
    }

    fn find_bounds(&self) -> LightBounds {
        let own = self.still.bounds();
        let motion = MotionTransform::Moving { start: Box::new(self.start), end: Box::new(self.end) };
        let (low, high) = motion.bounds(own.low, own.high);
        let mut bounds = LightBounds { even: false, ..self.at(0.0).bounds() };
        if bounds.cos_normals > -1.0 {
            for step in 1..=STEPS {
                bounds = bounds.union(&self.at(step as f32 / STEPS as f32).bounds());
            }
            // Between two looks the axis turns no farther than half a step, but where it is stretched another way meanwhile.
            let is_stretched = !self.start.stretch.abs_diff_eq(self.end.stretch, 1e-9);
            let turned = 2.0 * self.start.rotation.dot(self.end.rotation).abs().min(1.0).acos();
            let angle = bounds.cos_normals.clamp(-1.0, 1.0).acos() + 0.5 * turned as f32 / STEPS as f32 + 1e-3;
            bounds.cos_normals = if is_stretched || angle >= std::f32::consts::PI { -1.0 } else { angle.cos() };
        }
        let radius = 0.5 * (high - low).length() * (1.0 + 1e-5);
        LightBounds { low, high, radius, even: false, energy: own.energy, ..bounds }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, EulerRot};

    use super::*;
    use crate::light::goniometric::IntensityDistribution;
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

    #[test]
    fn bounds_hold_all_that_it_is() {
        let mut stream = Stream::from_seed(11);
        let mut lit = 0;
        for round in 0..60 {
            let stretch = if round % 3 == 0 { DVec3::new(1.0, 2.0, 0.5) } else { DVec3::ONE };
            let (start, end) = (key(&mut stream, DVec3::ONE), key(&mut stream, stretch));
            for still in lights(&mut stream) {
                let light = MovingLight::new(still, start, end);
                let bounds = light.bounds();
                for _ in 0..300 {
                    let time = stream.next_f32();
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
        for still in lights(&mut stream) {
            let light = MovingLight::new(still.clone(), start, end);
            for (time, key) in [(0.0, &start), (1.0, &end)] {
                let affine = key.interpolate(key, 0.0);
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
