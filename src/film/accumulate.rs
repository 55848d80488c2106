//! Sums over the samples of a pixel that stay accurate over millions of samples, and their variance.
//! Source: Welford 1962 for the running update, Chan, Golub, LeVeque 1979 (eq. 2.1) for joining two parts.

use glam::{DVec3, Vec3};

use super::gbuffer::{SurfaceSample, SurfaceSums};
use super::settings::Sensor;
use super::signed::SignedSums;
use crate::math::Rgb;
use crate::system::fault::{self, Fault};

/// What one sample of one pixel brings, before the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleResult {
    /// Radiance towards the camera: the sum of the next four.
    pub beauty: Rgb,
    /// Of it: light scattered once by a surface.
    pub direct: Rgb,
    /// Of it: light scattered more than once.
    pub indirect: Rgb,
    /// Of it: light of surfaces, environments and media that reaches the camera without scattering.
    pub emission: Rgb,
    /// Of it: light first scattered by a medium.
    pub volume: Rgb,
    /// Reflectance of what is seen first; black where nothing is.
    pub albedo: Rgb,
    /// Shading normal of what is seen first, in render space; zero where nothing is.
    pub normal: Vec3,
    /// Distance to what is seen first; infinite where nothing is.
    pub depth: f32,
    /// What else a `gbuffer` film records of it.
    pub surface: Option<SurfaceSample>,
}

impl SampleResult {
    /// Whether all of it is, but for the depth, which may be infinite.
    pub fn is_finite(&self) -> bool {
        let parts = [self.beauty, self.direct, self.indirect, self.emission, self.volume, self.albedo];
        parts.iter().all(|c| c.is_finite()) && self.normal.is_finite() && !self.depth.is_nan()
    }
}

/// Mean and variance of the beauty over some samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Moments {
    /// Number of samples.
    pub count: u64,
    /// Their mean.
    pub mean: DVec3,
    /// Sum of squared distances from the mean.
    pub squares: DVec3,
}

impl Moments {
    /// Adds one sample.
    #[inline]
    pub fn add(&mut self, value: DVec3) {
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
        if fault::is(Fault::SinglePrecisionSums) {
            (self.mean, self.squares) = (self.mean.as_vec3().as_dvec3(), self.squares.as_vec3().as_dvec3());
        }
    }

    /// Joins the samples of `other`.
    pub fn merge(&mut self, other: &Self) {
        if self.count == 0 {
            *self = *other;
        } else if other.count > 0 {
            let count = self.count + other.count;
            let (n, m) = (self.count as f64, other.count as f64);
            let apart = other.mean - self.mean;
            self.mean += apart * (m / count as f64);
            self.squares += other.squares + apart * apart * (n * m / count as f64);
            self.count = count;
        }
    }

    /// The variance of the mean per channel, s² / n, as if samples were independent: for stratified samples an upper
    /// estimate. Zero below two samples.
    pub fn variance_of_mean(&self) -> DVec3 {
        if self.count < 2 { DVec3::ZERO } else { self.squares / (self.count as f64 * (self.count - 1) as f64) }
    }
}

/// Sums of the AOVs of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct AovSums {
    pub(super) direct: DVec3,
    pub(super) indirect: DVec3,
    pub(super) emission: DVec3,
    pub(super) volume: DVec3,
    pub(super) albedo: DVec3,
    pub(super) normal: DVec3,
    pub(super) depth: f64,
    /// Samples with a finite depth.
    pub(super) hits: u64,
}

impl AovSums {
    fn add(&mut self, sample: &SampleResult) {
        self.direct += sample.direct.0.as_dvec3();
        self.indirect += sample.indirect.0.as_dvec3();
        self.emission += sample.emission.0.as_dvec3();
        self.volume += sample.volume.0.as_dvec3();
        self.albedo += sample.albedo.0.as_dvec3();
        self.normal += sample.normal.as_dvec3();
        if sample.depth.is_finite() {
            self.depth += f64::from(sample.depth);
            self.hits += 1;
        }
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.direct += other.direct;
        self.indirect += other.indirect;
        self.emission += other.emission;
        self.volume += other.volume;
        self.albedo += other.albedo;
        self.normal += other.normal;
        self.depth += other.depth;
        self.hits += other.hits;
    }
}

/// The samples of one pixel in one pass: filled by the thread that owns the pixel, then merged into the film.
#[derive(Clone, Debug)]
pub struct PixelSamples {
    pub(super) beauty: Moments,
    pub(super) aovs: AovSums,
    /// Sums of those samples that know their surface.
    pub(super) surfaces: SurfaceSums,
    /// What counts ±c; nothing where the filter has no negative lobes.
    pub(super) signed: SignedSums,
    /// Samples dropped because a value was NaN or infinite.
    pub(super) rejected: u64,
    /// The index of the first of them.
    pub(super) first_rejected: Option<u32>,
    sensor: Sensor,
}

impl PixelSamples {
    /// No samples yet.
    pub fn new(sensor: Sensor) -> Self {
        let (beauty, aovs, surfaces, signed) = Default::default();
        Self { beauty, aovs, surfaces, signed, rejected: 0, first_rejected: None, sensor }
    }

    /// Adds the sample number `index` of the pixel. A sample with a NaN or infinity (other than an infinite depth) is left out
    /// and counted.
    pub fn add(&mut self, index: u32, sample: &SampleResult) {
        self.add_weighted(index, sample, 1.0);
    }

    /// The same of a sample whose light counts `weight`, positive or negative: the filter's. What it says of surfaces counts 1.
    pub fn add_weighted(&mut self, index: u32, sample: &SampleResult, weight: f32) {
        let exposed = self.sensor.expose(sample, weight);
        if exposed.is_finite() {
            self.beauty.add(exposed.beauty.0.as_dvec3());
            self.aovs.add(&exposed);
            if weight != 1.0 {
                self.signed.add(&self.sensor.expose(sample, 1.0), weight);
            }
            if let Some(surface) = &sample.surface {
                self.surfaces.add(surface);
            }
        } else {
            self.rejected += 1;
            self.first_rejected.get_or_insert(index);
        }
    }

    /// Mean and variance so far.
    pub fn beauty(&self) -> &Moments {
        &self.beauty
    }
}
