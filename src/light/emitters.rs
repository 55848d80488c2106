//! Bounds of all area lights, one array for each number, so that asking every light at a vertex runs in vector registers:
//! no branch, no call, four lights or more at a time. The formula is that of [`super::contribution`].

use glam::Vec3;

use super::Receiver;
use super::area::AreaLight;

/// What the estimate of one emitter's contribution needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emitter {
    /// Centre of the bounding sphere.
    centre: Vec3,
    /// The sphere's squared radius.
    radius_squared: f32,
    /// Luminance times area, times a quarter where the surface is closed (Cauchy), times 1 where it is flat.
    strength: f32,
    /// Axis of the cone of normals.
    axis: Vec3,
    /// Cosine of that cone's half angle.
    cos_normals: f32,
    /// 1 if it emits from both sides, else 0.
    two_sided: f32,
}

/// The receivers that differ in their formula.
#[derive(Clone, Copy)]
enum Kind {
    Medium,
    OneSided,
    TwoSided,
}

/// A point this much (squared) beyond the bounds counts as inside.
pub(in crate::light) const INSIDE: f32 = 1.002;

/// The larger of two numbers, in one instruction.
#[inline(always)]
pub(in crate::light) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// sin² of an angle by its cosine.
#[inline(always)]
pub(in crate::light) fn squared_sine(cos: f32) -> f32 {
    larger(1.0 - cos * cos, 0.0)
}

/// cos(max(0, a − b)) from cos a and cos b, both angles in 0..=π.
#[inline(always)]
pub(in crate::light) fn cos_less(cos_a: f32, cos_b: f32) -> f32 {
    let sines = larger((1.0 - cos_a * cos_a) * (1.0 - cos_b * cos_b), 0.0).sqrt();
    if cos_a >= cos_b { 1.0 } else { cos_a * cos_b + sines }
}

impl Emitter {
    pub(super) fn of(light: &AreaLight) -> Self {
        let bounds = &light.bounds;
        let strength = light.strength();
        Self {
            centre: bounds.centre,
            radius_squared: larger(bounds.radius * bounds.radius, f32::MIN_POSITIVE),
            // NaN becomes 0.
            strength: larger(strength, 0.0).min(f32::MAX / 4.0),
            axis: bounds.axis,
            cos_normals: bounds.cos_normals,
            two_sided: f32::from(u8::from(light.two_sided)),
        }
    }

    /// The contribution at `p` with the normal `n`, where the kind has one.
    #[inline(always)]
    fn contribution(&self, kind: Kind, p: Vec3, n: Vec3) -> f32 {
        let seen = self.seen_from(p);
        seen.contribution(match kind {
            Kind::Medium => 1.0,
            Kind::OneSided => seen.received(n.dot(seen.wi)),
            Kind::TwoSided => cos_less(n.dot(seen.wi).abs(), seen.cos_spread),
        })
    }

    /// What planes at `p` that face +x, −x, +y, −y, +z and −z receive, and what arrives in all.
    pub(super) fn on_planes(&self, p: Vec3) -> [f32; 7] {
        let seen = self.seen_from(p);
        let [x, y, z] = seen.wi.to_array();
        let of = |cos| seen.contribution(seen.received(cos));
        [of(x), of(-x), of(y), of(-y), of(z), of(-z), seen.contribution(1.0)]
    }

    /// What its contribution at `p` depends on, but for the cosine there.
    #[inline(always)]
    fn seen_from(&self, p: Vec3) -> Seen {
        let to_light = self.centre - p;
        let square = to_light.length_squared();
        let near = larger(square, self.radius_squared);
        let sin_spread = self.radius_squared / near;
        let cos_spread = larger(1.0 - sin_spread, 0.0).sqrt();
        let wi = to_light * (1.0 / near.sqrt());

        let cos = -self.axis.dot(wi);
        let cos = if self.two_sided > 0.0 { cos.abs() } else { cos };
        // The normals' cone widened by what the bounding sphere spans.
        let facing = larger(cos_less(cos_less(cos, self.cos_normals), cos_spread), 0.0);
        let is_inside = square <= self.radius_squared * INSIDE;
        Seen { wi, cos_spread, facing, is_inside, arriving: self.strength / near }
    }

    /// The contribution at `receiver`.
    pub(super) fn at(&self, receiver: &Receiver) -> f32 {
        match *receiver {
            Receiver::Medium { p, .. } => self.contribution(Kind::Medium, p, Vec3::ZERO),
            Receiver::Surface { p, ns, two_sided: false, .. } => self.contribution(Kind::OneSided, p, ns),
            Receiver::Surface { p, ns, two_sided: true, .. } => self.contribution(Kind::TwoSided, p, ns),
        }
    }
}

/// An emitter, seen from somewhere.
struct Seen {
    /// Unit direction to its centre.
    wi: Vec3,
    /// Cosine of the angle that its sphere spans.
    cos_spread: f32,
    /// The cosine at the emitter.
    facing: f32,
    /// Whether that is within its sphere.
    is_inside: bool,
    /// All that would arrive if both cosines were 1.
    arriving: f32,
}

impl Seen {
    /// The largest cosine at a surface whose normal and the direction to the centre have the cosine `cos`; 0 if all of it is behind.
    #[inline(always)]
    fn received(&self, cos: f32) -> f32 {
        larger(cos_less(cos, self.cos_spread), 0.0)
    }

    #[inline(always)]
    fn contribution(&self, received: f32) -> f32 {
        // From inside the bounds every direction may lead to it and any side may show.
        self.arriving * if self.is_inside { 1.0 } else { self.facing * received }
    }
}

impl AreaLight {
    /// Luminance times the area that shows: over squared distance and times the cosines, an estimate of irradiance.
    pub(super) fn strength(&self) -> f32 {
        // How much of the surface turns away: a closed one shows a quarter of its area on average.
        let roundness = 0.5 * (1.0 - self.bounds.cos_normals);
        self.mean.luminance() * self.area * (1.0 - 0.75 * roundness)
    }
}

/// The emitters of all area lights, in the order of their ids.
#[derive(Clone, Debug, Default)]
pub struct EmitterTable {
    centre: [Vec<f32>; 3],
    radius_squared: Vec<f32>,
    strength: Vec<f32>,
    axis: [Vec<f32>; 3],
    cos_normals: Vec<f32>,
    two_sided: Vec<f32>,
}

impl EmitterTable {
    pub(super) fn new(lights: &[AreaLight]) -> Self {
        let emitters: Vec<Emitter> = lights.iter().map(Emitter::of).collect();
        let column = |of: fn(&Emitter) -> f32| emitters.iter().map(of).collect::<Vec<f32>>();
        Self {
            centre: [column(|e| e.centre.x), column(|e| e.centre.y), column(|e| e.centre.z)],
            radius_squared: column(|e| e.radius_squared),
            strength: column(|e| e.strength),
            axis: [column(|e| e.axis.x), column(|e| e.axis.y), column(|e| e.axis.z)],
            cos_normals: column(|e| e.cos_normals),
            two_sided: column(|e| e.two_sided),
        }
    }

    /// Appends the contribution of every emitter at `receiver` to `out`.
    pub fn contributions(&self, receiver: &Receiver, out: &mut Vec<f32>) {
        match *receiver {
            Receiver::Medium { p, .. } => self.fill(out, |e| e.contribution(Kind::Medium, p, Vec3::ZERO)),
            Receiver::Surface { p, ns, two_sided: false, .. } => {
                self.fill(out, |e| e.contribution(Kind::OneSided, p, ns))
            }
            Receiver::Surface { p, ns, two_sided: true, .. } => {
                self.fill(out, |e| e.contribution(Kind::TwoSided, p, ns))
            }
        }
    }

    #[inline(always)]
    fn fill(&self, out: &mut Vec<f32>, contribution: impl Fn(Emitter) -> f32) {
        let count = self.strength.len();
        let start = out.len();
        out.resize(start + count, 0.0);
        // Slices of one known length: no check of bounds is left in the loop.
        let [x, y, z] = [0, 1, 2].map(|axis: usize| &self.centre[axis][..count]);
        let [u, v, w] = [0, 1, 2].map(|axis: usize| &self.axis[axis][..count]);
        let (radius_squared, strength) = (&self.radius_squared[..count], &self.strength[..count]);
        let (cos_normals, two_sided) = (&self.cos_normals[..count], &self.two_sided[..count]);
        for (i, out) in out[start..].iter_mut().enumerate().take(count) {
            *out = contribution(Emitter {
                centre: Vec3::new(x[i], y[i], z[i]),
                radius_squared: radius_squared[i],
                strength: strength[i],
                axis: Vec3::new(u[i], v[i], w[i]),
                cos_normals: cos_normals[i],
                two_sided: two_sided[i],
            });
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.strength.capacity() * 10 * size_of::<f32>()
    }
}
