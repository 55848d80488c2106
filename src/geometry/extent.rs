//! How large the geometry is: in space and in memory.

use glam::Vec3;

use super::{Geometry, ShapeId, ShapeKind};

impl Geometry {
    /// The box of everything in render space, over the whole animation interval (sampled at its keys and between them).
    /// (0, 0) where there is nothing.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut all = empty;
        let shape_box = |id: &ShapeId| self.shape_bounds(*id).unwrap_or(empty);
        for shape in &self.top_level {
            all = union(all, shape_box(shape));
        }
        let prototypes: Vec<_> =
            self.prototypes.iter().map(|prototype| prototype.shapes.iter().map(shape_box).fold(empty, union)).collect();
        for instance in &self.instances {
            let (low, high) = prototypes[instance.prototype as usize];
            if low.cmpgt(high).any() {
                continue;
            }
            for step in 0..=8 {
                let transform = instance.transform.at(step as f32 / 8.0);
                for corner in 0..8 {
                    let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                    let p = transform.transform_point3(Vec3::new(pick(0), pick(1), pick(2)));
                    all = union(all, (p, p));
                }
            }
        }
        if all.0.cmpgt(all.1).any() { (Vec3::ZERO, Vec3::ZERO) } else { all }
    }

    /// The box of all primitives of a shape, in the shape's space; `None` for an empty mesh.
    pub fn shape_bounds(&self, id: ShapeId) -> Option<(Vec3, Vec3)> {
        let shape = &self.shapes[id.0 as usize];
        (0..shape.primitive_count()).map(|primitive| shape.bounds(primitive)).reduce(union)
    }

    /// Bytes of the shapes' own data, without acceleration structures.
    pub fn memory(&self) -> usize {
        let shapes: usize = self.shapes.iter().map(|shape| shape.kind.memory()).sum();
        shapes + size_of_val(&*self.shapes) + size_of_val(&*self.instances)
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
