//! The geometry of one point of one primitive, in the space its shape is stored in.

use glam::{Vec2, Vec3};

/// A point on a primitive before the shape's flip and the instance's transform.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalPoint {
    /// Position.
    pub p: Vec3,
    /// Bound of its rounding error per axis.
    pub p_error: Vec3,
    /// Unit geometric normal as the parametrisation gives it.
    pub ng: Vec3,
    /// Unit shading normal.
    pub ns: Vec3,
    /// ∂p/∂u.
    pub dpdu: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Whether `ns` comes from the mesh's own normals: then the shape's flip does not apply and `ng` follows `ns`.
    pub authoritative_ns: bool,
}
