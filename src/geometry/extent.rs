//! How large the geometry is: in space and in memory.

use glam::Vec3;

use super::{Geometry, ShapeId, ShapeKind};

impl Geometry {
    /// The box of everything in render space, over the whole animation interval. (0, 0) where there is nothing.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let of_shapes = |ids: &[ShapeId]| ids.iter().filter_map(|&id| self.shape_bounds(id)).reduce(union);
        let prototypes: Vec<_> = self.prototypes.iter().map(|prototype| of_shapes(&prototype.shapes)).collect();
        let instances = self.instances.iter().filter_map(|instance| {
            let (low, high) = prototypes[instance.prototype as usize]?;
            Some(instance.transform.bounds(low, high))
        });
        of_shapes(&self.top_level).into_iter().chain(instances).reduce(union).unwrap_or((Vec3::ZERO, Vec3::ZERO))
    }

    /// The box of all primitives of a shape, in the shape's space; `None` for an empty mesh.
    pub fn shape_bounds(&self, id: ShapeId) -> Option<(Vec3, Vec3)> {
        let shape = &self.shapes[id.0 as usize];
        (0..shape.primitive_count()).map(|primitive| shape.bounds(primitive)).reduce(union)
    }

    /// Bytes of the shapes' own data, without acceleration structures.
    pub fn memory(&self) -> usize {
        let shapes: usize = self.shapes.iter().map(|shape| shape.kind.memory()).sum();
        shapes + size_of_val(&*self.shapes) + size_of_val(&*self.instances) + size_of_val(&*self.instance_links)
    }
}

impl ShapeKind {
    fn memory(&self) -> usize {
        match self {
            Self::Triangles(mesh) => {
                size_of_val(&*mesh.positions)
                    + size_of_val(&*mesh.indices)
                    + size_of_val(&*mesh.normals)
                    + size_of_val(&*mesh.uvs)
            }
            Self::Bilinear(mesh) => {
                size_of_val(&*mesh.positions)
                    + size_of_val(&*mesh.indices)
                    + size_of_val(&*mesh.normals)
                    + size_of_val(&*mesh.uvs)
            }
            Self::Curves(curves) => {
                size_of_val(&*curves.control_points)
                    + size_of_val(&*curves.widths)
                    + size_of_val(&*curves.parameters)
                    + size_of_val(&*curves.normals)
            }
            Self::Sphere(_) | Self::Disk(_) => 0,
        }
    }
}

/// The box around two.
pub fn union(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}
