//! A dielectric coat over an opaque base, with an absorbing or scattering medium between: f, pdf and samples are found by
//! random walks between the two boundaries. What may be the base is said in `base.rs`. Sources: Guo, Hašan & Zhao 2018, "Position-Free Monte Carlo Simulation for
//! Arbitrary Layered BSDFs"; pbrt-v4, section 14.3 (two-sided, walks cut off after `max_depth` steps).
//!
//! f and pdf are unbiased estimates that depend on (seed, ωo, ωi) alone. The two come from independent streams, so that a
//! light sample's contribution and its MIS weight are uncorrelated, which keeps their product unbiased.

use std::f32::consts::PI;

use glam::Vec3;

use super::base::Base;
use super::dielectric::Dielectric;
use super::fresnel;
use super::local::{LocalSample, Sides, Transport};
use crate::math::Rgb;
use crate::math::phase::HenyeyGreenstein;
use crate::math::sampler::Stream;

/// The least layer thickness.
const MIN_THICKNESS: f32 = f32::MIN_POSITIVE;

/// Salts that keep the streams of the three routines apart.
const STREAM_F: u64 = 0x66;
const STREAM_PDF: u64 = 0x70;
const STREAM_SAMPLE: u64 = 0x73;

/// A coat over a base.
#[derive(Clone, Copy, Debug)]
pub struct Coated<B> {
    /// The outer boundary.
    pub top: Dielectric,
    /// The base.
    pub base: B,
    /// Thickness in mean free paths of the medium between (its extinction is 1).
    pub thickness: f32,
    /// Single-scattering albedo of the medium between; black for a purely absorbing one.
    pub albedo: Rgb,
    /// Its phase function.
    pub phase: HenyeyGreenstein,
    /// Longest random walk, in steps.
    pub max_depth: u32,
    /// Walks an evaluation.
    pub samples: u32,
    /// Starts the random walks.
    pub seed: u32,
}

/// What a step between the boundaries met.
enum Step {
    /// A boundary: whether it is the coat.
    Boundary { is_top: bool },
    /// A scattering event in the medium.
    Scatter,
    /// Nothing: the direction is so grazing that no progress was made.
    Stuck,
}

/// The state of a walk: height above the base and direction of travel.
struct Walk {
    z: f32,
    w: Vec3,
}

impl<B: Base> Coated<B> {
    /// Whether the whole is a mirror: smooth boundaries, and nothing scatters between them.
    #[inline]
    pub fn is_specular(&self) -> bool {
        self.base.is_specular() && self.top.is_specular() && self.albedo.is_black()
    }

    /// An unbiased estimate (but for walks longer than `max_depth`) of f(wo, wi), without what mirrors alone reflect.
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if self.is_specular() {
            return Rgb::BLACK;
        }
        let Some((wo, wi)) = from_above(wo, wi) else { return Rgb::BLACK };
        let mut rng = self.stream(STREAM_F);
        let samples = self.samples.max(1);
        let mut sum = Rgb::BLACK;
        for _ in 0..samples {
            sum += self.walk(wo, wi, &mut rng);
        }
        self.top.evaluate(wo, wi, Transport::Radiance) + sum / samples as f32
    }

    /// One walk that enters along wo and counts what leaves along wi.
    fn walk(&self, wo: Vec3, wi: Vec3, rng: &mut Stream) -> Rgb {
        let enter = self.cross_top(wo, Transport::Radiance, rng);
        // The last step out through the coat, sampled backwards: next-event estimation through a (perhaps Dirac) boundary.
        let leave = self.cross_top(wi, Transport::Importance, rng);
        let (Some(enter), Some(leave)) = (enter, leave) else { return Rgb::BLACK };
        let leave_weight = leave.f / leave.pdf;
        let smooth_top = self.top.is_specular();
        let thickness = self.thickness();

        let mut f = Rgb::BLACK;
        let mut beta = enter.weight();
        let mut walk = Walk { z: thickness, w: enter.wi };
        for depth in 0..self.max_depth {
            if !survives(&mut beta, depth, rng) {
                break;
            }
            match self.step(&mut walk, &mut beta, rng) {
                Step::Stuck => continue,
                Step::Scatter => {
                    // Out along the sampled exit, against the chance that the phase function finds the way itself.
                    let phase = self.phase.evaluate(-walk.w, -leave.wi);
                    let weight = if smooth_top { 1.0 } else { power_heuristic(leave.pdf, phase) };
                    let out = transmittance(thickness - walk.z, leave.wi);
                    f += beta * self.albedo * leave_weight * (phase * weight * out);
                    if smooth_top && self.base.is_specular() {
                        f += beta * self.albedo * leave_weight * self.by_mirrors(&walk, -leave.wi, phase * out);
                    }
                    let (next, phase) = sample_phase(self.phase, -walk.w, rng);
                    if phase == 0.0 || next.z == 0.0 {
                        continue;
                    }
                    beta *= self.albedo;
                    walk.w = next;
                    if next.z > 0.0 && !smooth_top {
                        f += beta * self.exit(next, wi, phase, transmittance(thickness - walk.z, next));
                    }
                }
                Step::Boundary { is_top: true } => {
                    let u = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
                    let bounce = self.top.sample(-walk.w, u[0], [u[1], u[2]], Sides::Reflection, Transport::Radiance);
                    let Some(bounce) = bounce.filter(LocalSample::is_usable) else { break };
                    beta *= bounce.weight();
                    walk.w = bounce.wi;
                }
                Step::Boundary { is_top: false } => {
                    let towards = -leave.wi;
                    let weight =
                        if smooth_top { 1.0 } else { power_heuristic(leave.pdf, self.base.pdf(-walk.w, towards)) };
                    let out = weight * towards.z.abs() * transmittance(thickness, towards);
                    f += beta * self.base.evaluate(-walk.w, towards) * leave_weight * out;
                    let u = [rng.next_f32(), rng.next_f32()];
                    let Some(bounce) = self.base.sample(-walk.w, u).filter(LocalSample::is_usable) else { break };
                    beta *= bounce.weight();
                    walk.w = bounce.wi;
                    if !smooth_top {
                        // No other technique finds the direction of a mirror.
                        let pdf = if bounce.is_specular { f32::INFINITY } else { bounce.pdf };
                        f += beta * self.exit(walk.w, wi, pdf, transmittance(thickness, walk.w));
                    }
                }
            }
        }
        f
    }

    /// What reaches the smooth coat along `up` from a scattering event by way of the mirror below and, perhaps, of the coat, as often as it may
    /// be: nothing else finds it. `straight` is what reaches it without. (pbrt-v4 leaves this light out of f.)
    fn by_mirrors(&self, walk: &Walk, up: Vec3, straight: f32) -> Rgb {
        let thickness = self.thickness();
        let down = Vec3::new(up.x, up.y, -up.z);
        let through = transmittance(thickness, up);
        let mirror = self.base.mirror(up.z);
        let first = mirror * (self.phase.evaluate(-walk.w, down) * transmittance(walk.z, down) * through);
        let again = mirror * (fresnel::dielectric(-up.z, self.top.eta) * through * through);
        let mut sum = Rgb::BLACK;
        for c in 0..3 {
            sum[c] = if again[c] < 1.0 { (first[c] + straight * again[c]) / (1.0 - again[c]) } else { 0.0 };
        }
        sum
    }

    /// What leaves along `wi` when the walk, having sampled direction `w` with `pdf`, meets the rough coat from below.
    fn exit(&self, w: Vec3, wi: Vec3, pdf: f32, transmittance: f32) -> Rgb {
        let f = self.top.evaluate(-w, wi, Transport::Radiance);
        if f.is_black() {
            return f;
        }
        // The other technique finds w from wi: its density, not that of wi given w (as pbrt-v4 has it), balances the two.
        let exit_pdf = self.top.pdf(wi, -w, Sides::Transmission);
        f * (power_heuristic(pdf, exit_pdf) * transmittance)
    }

    /// An unbiased estimate of a density that approximates the one [`Coated::sample`] has: reflection by the coat and
    /// one bounce off the base, scaled up for the bounces that follow (off a diffuse base they leave in the same
    /// directions), mixed with 10 % of a uniform density for what scatters in the medium. 0 where [`Coated::is_specular`].
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.is_specular() {
            return 0.0;
        }
        let uniform = 0.25 / PI;
        let Some((wo, wi)) = from_above(wo, wi) else { return 0.1 * uniform };
        let mut rng = self.stream(STREAM_PDF);
        let samples = self.samples.max(1);
        let mut sum = 0.0;
        for _ in 0..samples {
            sum += self.pdf_walk(wo, wi, &mut rng);
        }
        let estimate = self.top.pdf(wo, wi, Sides::Both) + self.base.repeats(self.top.eta) * sum / samples as f32;
        0.1 * uniform + 0.9 * estimate
    }

    /// Estimates the density of leaving along wi after exactly one bounce off the base.
    fn pdf_walk(&self, wo: Vec3, wi: Vec3, rng: &mut Stream) -> f32 {
        let top = &self.top;
        let u = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
        let enter = top.sample(wo, u[0], [u[1], u[2]], Sides::Both, Transport::Radiance);
        let Some(enter) = enter.filter(|s| s.is_usable() && s.is_transmission) else { return 0.0 };
        let Some(leave) = self.cross_top(wi, Transport::Importance, rng) else { return 0.0 };
        let base_pdf = self.base.pdf(-enter.wi, -leave.wi);
        if top.is_specular() {
            // Refraction on the way out stretches solid angles by η² cos θ_i / cos θ_t.
            let transmit = 1.0 - fresnel::dielectric(leave.wi.z, top.eta);
            return base_pdf * transmit * wi.z / (leave.wi.z.abs() * top.eta * top.eta);
        }
        let u = [rng.next_f32(), rng.next_f32()];
        let Some(bounce) = self.base.sample(-enter.wi, u).filter(LocalSample::is_usable) else { return 0.0 };
        // ∫ p_base(enter → w) p_top(w → wi) dw by MIS between sampling w from the base and backwards through the coat.
        let bounce_pdf = if bounce.is_specular { f32::INFINITY } else { bounce.pdf };
        let forwards = power_heuristic(bounce_pdf, top.pdf(wi, -bounce.wi, Sides::Transmission))
            * top.pdf(-bounce.wi, wi, Sides::Both);
        let backwards =
            power_heuristic(leave.pdf, base_pdf) * base_pdf * top.pdf(leave.wi, wi, Sides::Both) / leave.pdf;
        forwards + backwards
    }

    /// A direction by one random walk. Only the ratio f/pdf of the result means anything, and is unbiased: what leaves after a
    /// walk through the layers has pdf 1 (products of densities along long walks would overflow).
    pub fn sample(&self, wo: Vec3, uc: f32, u: [f32; 2]) -> Option<LocalSample> {
        if wo.z == 0.0 {
            return None;
        }
        let flip = wo.z < 0.0;
        let wo = if flip { -wo } else { wo };
        let orient = |w: Vec3| if flip { -w } else { w };
        let first = self.top.sample(wo, uc, u, Sides::Both, Transport::Radiance).filter(LocalSample::is_usable)?;
        let pdf_is_proportional = !self.is_specular();
        if !first.is_transmission {
            return Some(LocalSample { wi: orient(first.wi), pdf_is_proportional, ..first });
        }
        let mut is_specular = first.is_specular;
        let mut rng = self.stream(STREAM_SAMPLE);
        let mut walk = Walk { z: self.thickness(), w: first.wi };
        let mut beta = first.weight();
        // One step more than `walk`, which counts the way out together with the step before it.
        for depth in 0..=self.max_depth {
            if !survives(&mut beta, depth, &mut rng) {
                return None;
            }
            match self.step(&mut walk, &mut beta, &mut rng) {
                Step::Stuck => return None,
                Step::Scatter => {
                    let (next, phase) = sample_phase(self.phase, -walk.w, &mut rng);
                    if phase == 0.0 || next.z == 0.0 {
                        return None;
                    }
                    beta *= self.albedo;
                    walk.w = next;
                    is_specular = false;
                }
                Step::Boundary { is_top } => {
                    let u = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
                    let bounce = if is_top {
                        self.top.sample(-walk.w, u[0], [u[1], u[2]], Sides::Both, Transport::Radiance)
                    } else {
                        self.base.sample(-walk.w, [u[1], u[2]])
                    };
                    let bounce = bounce.filter(LocalSample::is_usable)?;
                    is_specular &= bounce.is_specular;
                    if bounce.is_transmission {
                        let sample = LocalSample::rough(orient(bounce.wi), beta * (bounce.f / bounce.pdf), 1.0);
                        let sample = LocalSample { is_specular, pdf_is_proportional, ..sample };
                        return sample.f.is_finite().then_some(sample);
                    }
                    beta *= bounce.weight();
                    walk.w = bounce.wi;
                }
            }
            if beta.is_black() {
                return None;
            }
        }
        None
    }

    /// The albedo towards `wo`, with the coat taken as smooth and clear.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        self.base.coated_albedo(wo.z.abs(), self.top.eta, self.thickness())
    }

    fn thickness(&self) -> f32 {
        self.thickness.max(MIN_THICKNESS)
    }

    /// Goes from where the walk is to whatever comes next, and attenuates `beta` where the medium only absorbs.
    #[inline]
    fn step(&self, walk: &mut Walk, beta: &mut Rgb, rng: &mut Stream) -> Step {
        let thickness = self.thickness();
        if self.albedo.is_black() {
            let is_top = walk.w.z > 0.0;
            *beta *= transmittance(thickness, walk.w);
            walk.z = if is_top { thickness } else { 0.0 };
            return Step::Boundary { is_top };
        }
        let dz = -(1.0 - rng.next_f32()).ln() * walk.w.z;
        let z = walk.z + dz;
        if z == walk.z {
            return Step::Stuck;
        }
        if z > 0.0 && z < thickness {
            walk.z = z;
            return Step::Scatter;
        }
        let is_top = z >= thickness;
        walk.z = if is_top { thickness } else { 0.0 };
        Step::Boundary { is_top }
    }

    /// Samples the way through the coat from direction `w` outside.
    #[inline]
    fn cross_top(&self, w: Vec3, transport: Transport, rng: &mut Stream) -> Option<LocalSample> {
        let u = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
        self.top.sample(w, u[0], [u[1], u[2]], Sides::Transmission, transport).filter(LocalSample::is_usable)
    }

    /// A stream that is a function of (seed, purpose). The seed is one vertex's own, so directions need not go in: a last bit
    /// of theirs that differs (another ray backend, another place of the scene) does not change the walk.
    #[inline]
    fn stream(&self, salt: u64) -> Stream {
        Stream::from_seed(u64::from(self.seed) << 8 | salt)
    }
}

/// Both directions turned so that wo is above the coat; `None` where they are on different sides (the base is opaque).
#[inline]
fn from_above(wo: Vec3, wi: Vec3) -> Option<(Vec3, Vec3)> {
    let (wo, wi) = if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) };
    (wo.z > 0.0 && wi.z > 0.0).then_some((wo, wi))
}

/// Russian roulette of walks that carry less than a quarter after the fourth step.
#[inline]
fn survives(beta: &mut Rgb, depth: u32, rng: &mut Stream) -> bool {
    let survival = beta.max_channel();
    if depth > 3 && survival < 0.25 {
        if rng.next_f32() >= survival {
            return false;
        }
        *beta = *beta / survival;
    }
    true
}

/// Transmittance over height `dz` along `w` at extinction 1.
#[inline]
fn transmittance(dz: f32, w: Vec3) -> f32 {
    if dz.abs() <= MIN_THICKNESS { 1.0 } else { (-(dz / w.z).abs()).exp() }
}

/// The power heuristic with exponent 2 for one sample each.
#[inline]
fn power_heuristic(pdf: f32, other: f32) -> f32 {
    if pdf.is_infinite() {
        return 1.0;
    }
    let (a, b) = (pdf * pdf, other * other);
    if a + b > 0.0 { a / (a + b) } else { 0.0 }
}

/// A direction by the phase function, and its density.
#[inline]
fn sample_phase(phase: HenyeyGreenstein, wo: Vec3, rng: &mut Stream) -> (Vec3, f32) {
    let wi = phase.sample(wo, [rng.next_f32(), rng.next_f32()]);
    (wi, phase.evaluate(wo, wi))
}
