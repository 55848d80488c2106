//! What a set of lights looks like from outside: where they are, which way they face, how far they emit beyond their normals and how
//! strong they are. Source: Conty Estevez & Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG
//! 2018, section 4.1; the union of cones is theirs too (algorithm 1), with care for rounding.
//!
//! Energy is measured as in [`crate::light::contribution`]: energy over squared distance, times the cosines, estimates irradiance or fluence.

use glam::Vec3;

use crate::light::{AreaLight, GoniometricLight, LightId, LightRef, Lights, SpotLight};

/// Energies stay between the smallest normal number, so that no light that shines is out of reach, and this, so that sums are finite.
pub const MAX_ENERGY: f32 = f32::MAX / 4.0;

/// Bounds of one light or of many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Least corner of the box that holds them.
    pub low: Vec3,
    /// Greatest corner.
    pub high: Vec3,
    /// Radius of a sphere around the box's middle that holds them too: at most half the box's diagonal.
    pub radius: f32,
    /// Unit axis of the cone of normals.
    pub axis: Vec3,
    /// Cosine of the cone's half angle, cos θ_o: 1 where all normals agree, −1 for all directions.
    pub cos_normals: f32,
    /// Cosine of the angle to its normal within which a light emits, cos θ_e.
    pub cos_emission: f32,
    /// Some of them emit against their normals too.
    pub two_sided: bool,
    /// All of them fall off with the cosine to their normals. Else they are taken to emit alike within θ_e.
    pub lambertian: bool,
    /// Each of them emits alike in all directions, and they are of one kind: points, or closed surfaces.
    pub even: bool,
    /// Luminance of intensity, summed: 1 at the distance 1 gives the irradiance 1.
    pub energy: f32,
}

impl LightBounds {
    /// The bounds of the light `id`; `None` for light from infinity and for dark lights.
    pub fn of(lights: &Lights, id: LightId) -> Option<Self> {
        if lights.is_dark(id) {
            return None;
        }
        match lights.get(id) {
            LightRef::Area(light) => Some(Self::of_area(light)),
            LightRef::Point(light) => Some(Self::of_point(light.p, light.intensity.luminance())),
            LightRef::Spot(light) => Some(Self::of_spot(light)),
            LightRef::Goniometric(light) => Some(Self::of_goniometric(light)),
            LightRef::Moving(light) => Some(*light.bounds()),
            LightRef::Volume(light) => Some(light.bounds()),
            LightRef::Distant(_) | LightRef::Infinite(_) => None,
        }
    }

    /// A point that emits alike in all directions.
    pub fn of_point(p: Vec3, energy: f32) -> Self {
        Self {
            low: p,
            high: p,
            radius: 0.0,
            axis: Vec3::Z,
            cos_normals: -1.0,
            cos_emission: 0.0,
            two_sided: false,
            lambertian: false,
            even: true,
            energy: clamp_energy(energy),
        }
    }

    /// A point that emits within a cone.
    pub fn of_spot(light: &SpotLight) -> Self {
        Self {
            axis: light.axis,
            cos_normals: 1.0,
            cos_emission: light.cos_end,
            even: false,
            ..Self::of_point(light.p, light.intensity.luminance())
        }
    }

    /// A point with an intensity for each direction.
    pub fn of_goniometric(light: &GoniometricLight) -> Self {
        Self {
            axis: light.axis(),
            cos_normals: if light.cos_end() > -1.0 { 1.0 } else { -1.0 },
            cos_emission: light.cos_end(),
            even: false,
            ..Self::of_point(light.p, light.mean_intensity())
        }
    }

    fn of_area(light: &AreaLight) -> Self {
        let bounds = &light.bounds;
        // Far from the origin a small light's corners are rounded by more than its size.
        let low = (bounds.centre - bounds.radius).map(f32::next_down);
        let high = (bounds.centre + bounds.radius).map(f32::next_up);
        let middle = 0.5 * low + 0.5 * high;
        Self {
            low,
            high,
            radius: (bounds.radius + middle.distance(bounds.centre)) * (1.0 + 1e-6),
            axis: bounds.axis,
            cos_normals: bounds.cos_normals,
            cos_emission: 0.0,
            two_sided: light.two_sided,
            lambertian: true,
            even: bounds.cos_normals <= -1.0,
            energy: clamp_energy(light.strength()),
        }
    }

    /// The middle of the box.
    #[inline]
    pub fn centre(&self) -> Vec3 {
        0.5 * self.low + 0.5 * self.high
    }

    /// The bounds of both.
    pub fn union(&self, other: &Self) -> Self {
        let (low, high) = (self.low.min(other.low), self.high.max(other.high));
        let centre = 0.5 * low + 0.5 * high;
        // Around both spheres or around the box, whichever is less; the factor covers the roundings.
        let spheres =
            (centre.distance(self.centre()) + self.radius).max(centre.distance(other.centre()) + other.radius);
        let diagonal = (high - centre).max(centre - low).length();
        let (axis, cos_normals) = self.union_of_normals(other);
        Self {
            low,
            high,
            radius: spheres.min(diagonal) * (1.0 + 1e-6),
            axis,
            cos_normals,
            cos_emission: self.cos_emission.min(other.cos_emission),
            two_sided: self.two_sided || other.two_sided,
            lambertian: self.lambertian && other.lambertian,
            even: self.even && other.even && self.lambertian == other.lambertian && self.two_sided == other.two_sided,
            energy: (self.energy + other.energy).min(MAX_ENERGY),
        }
    }

    /// The cone around both cones of normals. What emits on both sides may be turned over.
    fn union_of_normals(&self, other: &Self) -> (Vec3, f32) {
        const ALL: (Vec3, f32) = (Vec3::Z, -1.0);
        let (wide, narrow) = if self.cos_normals <= other.cos_normals { (self, other) } else { (other, self) };
        if wide.cos_normals <= -1.0 {
            return ALL;
        }
        let turn = (self.two_sided || other.two_sided) && wide.axis.dot(narrow.axis) < 0.0;
        let to = if turn { -narrow.axis } else { narrow.axis };
        let (cross, dot) = (wide.axis.cross(to).length(), wide.axis.dot(to));
        let between = cross.atan2(dot);
        let [wide_angle, narrow_angle] = [wide, narrow].map(|b| b.cos_normals.clamp(-1.0, 1.0).acos());
        if between + narrow_angle <= wide_angle || (dot >= 1.0 - 1e-7 && wide.cos_normals == narrow.cos_normals) {
            return (wide.axis, wide.cos_normals);
        }
        let angle = 0.5 * (wide_angle + between + narrow_angle);
        // Opposite axes leave the plane to turn in unknown.
        if !(angle < std::f32::consts::PI - 1e-3 && between < std::f32::consts::PI - 1e-3) {
            return ALL;
        }
        // Slerp from the wide cone's axis; nearly equal axes are as good as either.
        let turned = angle - wide_angle;
        let axis = if cross > 1e-6 {
            (wide.axis * (between - turned).sin() + to * turned.sin()).normalize_or(wide.axis)
        } else {
            wide.axis
        };
        // A cosine near 1 resolves angles to 3e-4 only.
        (axis, (angle.cos() - 4e-7).max(-1.0))
    }
}

fn clamp_energy(energy: f32) -> f32 {
    // NaN becomes the least.
    if energy > f32::MIN_POSITIVE { energy.min(MAX_ENERGY) } else { f32::MIN_POSITIVE }
}
