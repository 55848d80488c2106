//! What a film of type `gbuffer` records of the surface that is seen first: where it is, how it lies and which part of it it is.
//! Source: pbrt-v4, section 5.4.3, whose names the channels have.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::accumulate::Moments;

/// What positions and directions are relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// The camera, which looks along +z.
    Camera,
    /// The world of the scene.
    World,
}

/// A surface where a camera ray meets it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceSample {
    /// Where.
    pub p: Vec3,
    /// Its geometric normal, unit.
    pub ng: Vec3,
    /// Its shading normal, unit.
    pub ns: Vec3,
    /// Its parameters there.
    pub uv: Vec2,
    /// What the distance along the camera's z axis gains from one pixel to the next, to the right and down.
    pub slope: Vec2,
}

impl SurfaceSample {
    /// Whether all of it is.
    pub fn is_finite(&self) -> bool {
        [self.p, self.ng, self.ns].iter().all(|v| v.is_finite()) && self.uv.is_finite() && self.slope.is_finite()
    }
}

/// Sums over the samples of a pixel that met a surface first.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SurfaceSums {
    p: DVec3,
    ng: DVec3,
    ns: DVec3,
    uv: DVec2,
    slope: DVec2,
    hits: u64,
}

impl SurfaceSums {
    /// Adds one sample, if all of it is finite.
    pub fn add(&mut self, sample: &SurfaceSample) {
        if sample.is_finite() {
            self.p += sample.p.as_dvec3();
            self.ng += sample.ng.as_dvec3();
            self.ns += sample.ns.as_dvec3();
            self.uv += sample.uv.as_dvec2();
            self.slope += sample.slope.as_dvec2();
            self.hits += 1;
        }
    }

    /// Joins the samples of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.p += other.p;
        self.ng += other.ng;
        self.ns += other.ns;
        self.uv += other.uv;
        self.slope += other.slope;
        self.hits += other.hits;
    }
}

/// The channels' names; [`values`] has them in this order.
pub const CHANNELS: [&str; 23] = [
    "Albedo.R",
    "Albedo.G",
    "Albedo.B",
    "P.X",
    "P.Y",
    "P.Z",
    "N.X",
    "N.Y",
    "N.Z",
    "Ns.X",
    "Ns.Y",
    "Ns.Z",
    "u",
    "v",
    "dzdx",
    "dzdy",
    "Variance.R",
    "Variance.G",
    "Variance.B",
    "RelativeVariance.R",
    "RelativeVariance.G",
    "RelativeVariance.B",
    "surface.samples",
];

/// A pixel's channels: the mean `albedo`; means over the samples that met a surface, 0 where none did; then, as pbrt-v4 has it, the variance of a
/// single sample and that over the square of the mean; last how many samples met a surface.
pub fn values(albedo: DVec3, sums: &SurfaceSums, beauty: &Moments) -> [f64; CHANNELS.len()] {
    let scale = if sums.hits > 0 { 1.0 / sums.hits as f64 } else { 0.0 };
    let variance = beauty.variance_of_mean() * beauty.count as f64;
    let squared = beauty.mean * beauty.mean;
    let relative = DVec3::select(squared.cmpgt(DVec3::ZERO), variance / squared, DVec3::ZERO);
    let [p, ng, ns] = [sums.p, sums.ng, sums.ns].map(|sum| sum * scale);
    let [uv, slope] = [sums.uv, sums.slope].map(|sum| sum * scale);
    let mut all = [0.0; CHANNELS.len()];
    let triple = |v: DVec3| v.to_array();
    let pairs = [uv.to_array(), slope.to_array()];
    let values = [albedo, p, ng, ns].into_iter().flat_map(triple).chain(pairs.into_iter().flatten());
    for (slot, value) in
        all.iter_mut().zip(values.chain([variance, relative].into_iter().flat_map(triple)).chain([sums.hits as f64]))
    {
        *slot = value;
    }
    all
}
