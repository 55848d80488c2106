//! Orthonormal frames around a direction. Source: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.

use glam::Vec3;

/// A right-handed orthonormal frame: local z is `z`.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Local x axis in the outer space.
    pub x: Vec3,
    /// Local y axis in the outer space.
    pub y: Vec3,
    /// Local z axis in the outer space.
    pub z: Vec3,
}

impl Frame {
    /// A frame whose z axis is the unit vector `z`; x and y are any that complete it (Duff et al. 2017, listing 3).
    #[inline]
    pub fn from_z(z: Vec3) -> Self {
        let sign = 1.0f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// A frame with z axis `z` (unit) and x axis as near to `x` as orthogonality allows; falls back to [`Frame::from_z`]
    /// where `x` is parallel to `z`, zero or not finite. Anisotropic materials and hair need the tangent.
    #[inline]
    pub fn from_zx(z: Vec3, x: Vec3) -> Self {
        let tangent = x - z * z.dot(x);
        let length_squared = tangent.length_squared();
        if length_squared > 1e-12 * x.length_squared() && length_squared.is_finite() {
            let x = tangent / length_squared.sqrt();
            Self { x, y: z.cross(x), z }
        } else {
            Self::from_z(z)
        }
    }

    /// From the outer space into this frame.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// From this frame into the outer space.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}
