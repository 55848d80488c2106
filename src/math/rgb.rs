//! Linear RGB with Rec. 709 primaries: radiance, reflectance, extinction per channel.

use derive_more::{Add, AddAssign, Neg, Sub, SubAssign, Sum};
use glam::Vec3;

/// A linear RGB triple. What it measures (radiance in W/(m² sr), albedo, μ per unit length) is said where it is used.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Add, AddAssign, Sub, SubAssign, Neg, Sum, bytemuck::Pod, bytemuck::Zeroable,
)]
#[repr(transparent)]
pub struct Rgb(pub Vec3);

impl Rgb {
    /// Zero in every channel.
    pub const BLACK: Self = Self(Vec3::ZERO);
    /// One in every channel.
    pub const WHITE: Self = Self(Vec3::ONE);

    /// A colour from its three channels.
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3::new(r, g, b))
    }

    /// The same value in all three channels.
    pub const fn splat(value: f32) -> Self {
        Self(Vec3::splat(value))
    }

    /// The channels as an array, in the order R, G, B.
    pub const fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }

    /// Relative luminance Y of Rec. 709 primaries.
    #[inline]
    pub fn luminance(self) -> f32 {
        self.0.dot(Vec3::new(0.212_671, 0.715_160, 0.072_169))
    }

    /// The mean of the three channels.
    #[inline]
    pub fn mean(self) -> f32 {
        self.0.element_sum() * (1.0 / 3.0)
    }

    /// The largest channel.
    #[inline]
    pub fn max_channel(self) -> f32 {
        self.0.max_element()
    }

    /// The smallest channel.
    #[inline]
    pub fn min_channel(self) -> f32 {
        self.0.min_element()
    }

    /// Whether every channel is exactly zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == Vec3::ZERO
    }

    /// Whether no channel is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// Applies `f` to each channel.
    #[inline]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::new(f(self.0.x), f(self.0.y), f(self.0.z))
    }

    /// Each channel limited to `low..=high`.
    #[inline]
    pub fn clamp(self, low: f32, high: f32) -> Self {
        Self(self.0.clamp(Vec3::splat(low), Vec3::splat(high)))
    }

    /// e raised to each channel.
    #[inline]
    pub fn exp(self) -> Self {
        self.map(f32::exp)
    }

    /// The square root of each channel; negative channels give 0.
    #[inline]
    pub fn sqrt(self) -> Self {
        self.map(|c| c.max(0.0).sqrt())
    }

    /// Linear interpolation from `self` (at 0) to `other` (at 1).
    #[inline]
    pub fn lerp(self, other: Self, t: f32) -> Self {
        Self(self.0.lerp(other.0, t))
    }
}

impl std::ops::Mul for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl std::ops::MulAssign for Rgb {
    #[inline]
    fn mul_assign(&mut self, other: Self) {
        self.0 *= other.0;
    }
}

impl std::ops::Div for Rgb {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0)
    }
}

impl std::ops::Mul<f32> for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, scale: f32) -> Self {
        Self(self.0 * scale)
    }
}

impl std::ops::MulAssign<f32> for Rgb {
    #[inline]
    fn mul_assign(&mut self, scale: f32) {
        self.0 *= scale;
    }
}

impl std::ops::Mul<Rgb> for f32 {
    type Output = Rgb;
    #[inline]
    fn mul(self, colour: Rgb) -> Rgb {
        colour * self
    }
}

impl std::ops::Div<f32> for Rgb {
    type Output = Self;
    #[inline]
    fn div(self, divisor: f32) -> Self {
        Self(self.0 / divisor)
    }
}

impl std::ops::Index<usize> for Rgb {
    type Output = f32;
    #[inline]
    fn index(&self, channel: usize) -> &f32 {
        &self.0[channel]
    }
}

impl std::ops::IndexMut<usize> for Rgb {
    #[inline]
    fn index_mut(&mut self, channel: usize) -> &mut f32 {
        &mut self.0[channel]
    }
}

impl From<[f32; 3]> for Rgb {
    fn from(channels: [f32; 3]) -> Self {
        Self(Vec3::from_array(channels))
    }
}
