//! An environment seen through a rectangle: only the directions that lead through it are sampled, in proportion to the image.
//!
//! Source: Bitterli, Novák, Jarosz, "Portal-Masked Environment Map Sampling", EGSR 2015; Pharr, Jakob, Humphreys (4th ed.) section
//! 12.5.3. The directions before the portal are laid out by the angles α and β that their projections make with its normal, over a square:
//! there the portal is a rectangle, from wherever it is seen, and a summed-area table draws points within it.
//!
//! The density comes from the image rectified so; radiance is looked up in the image itself. A thousandth of the density is the same for all
//! directions, so that none that shines is out of reach. As in pbrt-v4, whatever does not come through the portal is not there, also where a
//! ray leaves the scene by another way.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Mat3, Vec3};

use super::Receiver;
use super::sphere_image::SphereImage;
use crate::math::sampler::mix;
use crate::math::summed_area::SummedArea;
use crate::math::{Frame, Rgb};

/// Rows and columns of the rectified image: at least, and at most.
const RESOLUTION: (usize, usize) = (256, 2048);

/// The share of the density that is even.
const EVEN: f64 = 1e-3;

/// A rectangle that an environment shines through.
#[derive(Debug)]
pub struct Portal {
    image: SphereImage,
    scale: Rgb,
    /// The image's space to render space: orthogonal, perhaps a reflection.
    to_render: Mat3,
    corner: Vec3,
    /// Along the frame's x and y.
    size: [f32; 2],
    /// x and y along the edges, z outwards.
    frame: Frame,
    /// Luminance by α and β, for each unit of the unit square.
    density: SummedArea,
    resolution: usize,
    power: Rgb,
}

impl Portal {
    /// `image` times `scale`, turned by `to_render`, through the rectangle `corners` in render space. It comes from the side that (p₃ − p₀) × (p₁ −
    /// p₀) points to. `None` where the corners make no rectangle (edges may be off a right angle by a thousandth, as in pbrt-v4).
    pub fn new(image: SphereImage, scale: Rgb, to_render: Mat3, corners: [Vec3; 4]) -> Option<Self> {
        let [p0, p1, p2, p3] = corners;
        let edge = |from: Vec3, to: Vec3| (to - from).try_normalize();
        let (p01, p12, p32, p03) = (edge(p0, p1)?, edge(p1, p2)?, edge(p3, p2)?, edge(p0, p3)?);
        const TOLERANCE: f32 = 1e-3;
        let parallel = |a: Vec3, b: Vec3| (a.dot(b) - 1.0).abs() <= TOLERANCE;
        let square = |a: Vec3, b: Vec3| a.dot(b).abs() <= TOLERANCE;
        if !(parallel(p01, p32) && parallel(p12, p03) && square(p01, p12) && square(p01, p03)) {
            return None;
        }
        let frame = Frame::from_zx(p03.cross(p01).try_normalize()?, p03);
        let size = [p0.distance(p3), p0.distance(p1)];
        let resolution = image.height().clamp(RESOLUTION.0, RESOLUTION.1);
        let density = SummedArea::new(1, 1, |_, _| 0.0);
        let mut portal =
            Self { image, scale, to_render, corner: p0, size, frame, density, resolution, power: Rgb::BLACK };
        portal.rectify();
        Some(portal)
    }

    /// Fills in `density` and `power`.
    fn rectify(&mut self) {
        let n = self.resolution;
        let cell = 1.0 / (n * n) as f64;
        let mut sum = [0.0f64; 3];
        let mut luminances = vec![0.0f32; n * n];
        let (mut mean, mut measure) = (0.0, 0.0);
        for (i, luminance) in luminances.iter_mut().enumerate() {
            let (w, stretch) = direction([(i % n) as f64 + 0.5, (i / n) as f64 + 0.5], n);
            let radiance = self.lookup(self.frame.to_world(w.as_vec3()));
            *luminance = radiance.luminance();
            mean += f64::from(*luminance) * stretch;
            measure += stretch;
            (0..3).for_each(|c| sum[c] += f64::from(radiance[c]) * w.z * stretch * cell);
        }
        let even = EVEN * mean / measure;
        self.density = SummedArea::new(n, n, |x, y| {
            let (_, stretch) = direction([x as f64 + 0.5, y as f64 + 0.5], n);
            (f64::from(luminances[y * n + x]) + even) * stretch
        });
        let area = f64::from(self.size[0]) * f64::from(self.size[1]);
        self.power = Rgb::from(sum.map(|s| (s * area) as f32));
    }

    /// The environment's radiance from the unit direction `direction`, whether or not the portal is there.
    #[inline]
    fn lookup(&self, direction: Vec3) -> Rgb {
        self.scale * self.image.at((self.to_render.transpose() * direction).normalize_or(Vec3::Z))
    }

    /// Where the portal is on the grid as seen from `p`: from and to, along x and y. `None` from beside or behind.
    #[inline]
    fn window(&self, p: Vec3) -> Option<[[f64; 2]; 2]> {
        let corner = self.local(p);
        if !(corner.z > 0.0 && corner.is_finite()) {
            return None;
        }
        let n = self.resolution as f64;
        let place = |along: f64| (n * (0.5 + along.atan2(corner.z) / PI)).clamp(0.0, n);
        let span = |from: f64, size: f32| [place(from), place(from + f64::from(size))];
        Some([span(corner.x, self.size[0]), span(corner.y, self.size[1])])
    }

    /// The portal's corner in its frame, as seen from `p`.
    #[inline]
    fn local(&self, p: Vec3) -> DVec3 {
        let to_corner = self.corner.as_dvec3() - p.as_dvec3();
        let [x, y, z] = [self.frame.x, self.frame.y, self.frame.z].map(|axis| to_corner.dot(axis.as_dvec3()));
        DVec3::new(x, y, z)
    }

    /// The radiance that arrives at `p` from the unit direction `direction`.
    #[inline]
    pub fn radiance(&self, p: Vec3, direction: Vec3) -> Rgb {
        let (corner, w) = (self.local(p), self.frame.to_local(direction).as_dvec3());
        if !(corner.z > 0.0 && w.z > 0.0) {
            return Rgb::BLACK;
        }
        let hit = w.truncate() * (corner.z / w.z) - corner.truncate();
        let is_through =
            hit.cmpge(glam::DVec2::ZERO).all() && hit.x <= f64::from(self.size[0]) && hit.y <= f64::from(self.size[1]);
        if is_through { self.lookup(direction) } else { Rgb::BLACK }
    }

    /// The solid-angle pdf with which [`Portal::sample`] from `p` takes the unit direction `direction`.
    pub fn pdf(&self, p: Vec3, direction: Vec3) -> f32 {
        let w = self.frame.to_local(direction).as_dvec3();
        let Some([x, y]) = self.window(p) else { return 0.0 };
        if !(w.z > 0.0) {
            return 0.0;
        }
        let n = self.resolution as f64;
        let at = [w.x, w.y].map(|along| n * (0.5 + along.atan2(w.z) / PI));
        (self.density.pdf(x, y, at) * n * n / stretch(w)) as f32
    }

    /// A unit direction from `p` through the portal, and its solid-angle pdf. As for [`super::Environment`], a hash of the numbers goes below
    /// their bits.
    pub fn sample(&self, p: Vec3, u: [f32; 2], u_part: f64) -> Option<(Vec3, f32)> {
        let [x, y] = self.window(p)?;
        let bits = mix(u_part.to_bits() ^ mix(u64::from(u[0].to_bits()) << 32 | u64::from(u[1].to_bits())));
        let extended = |u: f32, bits: u64| (f64::from(u) + bits as f64 * 0.5f64.powi(56)).min(1.0 - f64::EPSILON);
        let u = [extended(u[0], bits >> 32), extended(u[1], bits & 0xffff_ffff)];
        let (at, pdf) = self.density.sample(x, y, u)?;
        let (w, stretch) = direction(at, self.resolution);
        let n = self.resolution as f64;
        let pdf = (pdf * n * n / stretch) as f32;
        (pdf > 0.0 && pdf.is_finite()).then(|| (self.frame.to_world(w.as_vec3()).normalize_or(self.frame.z), pdf))
    }

    /// Φ in watts: what comes through the portal.
    pub fn power(&self) -> Rgb {
        self.power
    }

    /// An estimate of the luminance that `receiver` gets: the fluence through the portal, at a surface times the mean of the cosines to its corners and
    /// its middle. Positive wherever anything arrives.
    pub fn contribution(&self, receiver: &Receiver) -> f32 {
        let p = receiver.p();
        let Some([x, y]) = self.window(p) else { return 0.0 };
        let n = self.resolution as f64;
        let fluence = (self.density.integral(x, y) / (n * n)) as f32;
        let Receiver::Surface { ns, two_sided, .. } = *receiver else { return fluence };
        let [a, b] = [self.frame.x * self.size[0], self.frame.y * self.size[1]];
        let cosine = |[s, t]: [f32; 2]| {
            let cos = (self.corner + a * s + b * t - p).normalize_or(self.frame.z).dot(ns);
            if two_sided { cos.abs() } else { cos.max(0.0) }
        };
        let places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]];
        fluence * places.map(cosine).iter().sum::<f32>() * 0.2
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.image.memory() + self.density.memory()
    }
}

/// The unit direction at `at` of the grid, in the portal's frame, and the solid angle of a unit of the unit square there.
#[inline]
fn direction(at: [f64; 2], resolution: usize) -> (DVec3, f64) {
    let [x, y] = at.map(|t| (PI * t / resolution as f64 - FRAC_PI_2).tan());
    let w = DVec3::new(x, y, 1.0).normalize();
    (w, stretch(w))
}

/// dω / (du dv) = π² (1 − x²) (1 − y²) / z.
#[inline]
fn stretch(w: DVec3) -> f64 {
    PI * PI * (1.0 - w.x * w.x) * (1.0 - w.y * w.y) / w.z
}
