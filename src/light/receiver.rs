//! Both ends of a connection: where light is received, and where a ray has met a light.

use glam::{Vec2, Vec3};

use super::LinkSet;
use crate::geometry::{InstanceId, ShapeId};

/// A point on an emitter that a ray has met.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    /// The emitting shape.
    pub shape: ShapeId,
    /// Its primitive.
    pub primitive: u32,
    /// The primitive's own parameters there: [`crate::geometry::RayHit::uv`].
    pub parameters: [f32; 2],
    /// Its instance.
    pub instance: Option<InstanceId>,
    /// Where, in render space.
    pub p: Vec3,
    /// Oriented geometric normal there.
    pub ng: Vec3,
    /// Texture coordinates there.
    pub uv: Vec2,
    /// The ray's time, 0..=1.
    pub time: f32,
}

/// Where light is received.
#[derive(Clone, Copy, Debug)]
pub enum Receiver {
    /// A surface: position, unit shading normal (towards the viewer's side), whether it also transmits.
    Surface {
        /// Position.
        p: Vec3,
        /// Shading normal, on the side that light is gathered from.
        ns: Vec3,
        /// Light from behind counts too.
        two_sided: bool,
        /// The lights that light it.
        links: LinkSet,
    },
    /// A point in a medium.
    Medium {
        /// Position.
        p: Vec3,
        /// The lights that light it.
        links: LinkSet,
    },
}

impl Receiver {
    /// A point in a medium that every ordinary light lights.
    pub fn medium(p: Vec3) -> Self {
        Self::Medium { p, links: LinkSet::ORDINARY }
    }

    /// A point on a surface that every ordinary light lights.
    pub fn surface(p: Vec3, ns: Vec3, two_sided: bool) -> Self {
        Self::Surface { p, ns, two_sided, links: LinkSet::ORDINARY }
    }

    /// Its position, render space.
    pub fn p(&self) -> Vec3 {
        match *self {
            Self::Surface { p, .. } | Self::Medium { p, .. } => p,
        }
    }

    /// The lights that light it.
    pub fn links(&self) -> LinkSet {
        match *self {
            Self::Surface { links, .. } | Self::Medium { links, .. } => links,
        }
    }
}
