//! How large the geometry is: in space and in memory.

use glam::Vec3;

use super::{Geometry, Ray, Shape, ShapeId, ShapeKind};

impl Geometry {
    /// The box of everything in render space, over the whole animation interval. (0, 0) where there is nothing.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds_of(|_| true).unwrap_or((Vec3::ZERO, Vec3::ZERO))
    }

    /// That of the shapes that `is_meant`; `None` where there are none.
    pub fn bounds_of(&self, is_meant: impl Fn(&Shape) -> bool) -> Option<(Vec3, Vec3)> {
        let of_shapes = |ids: &[ShapeId]| {
            let ids = ids.iter().filter(|id| is_meant(&self.shapes[id.0 as usize]));
            ids.filter_map(|&id| self.shape_bounds(id)).reduce(union)
        };
        let prototypes: Vec<_> = self.prototypes.iter().map(|prototype| of_shapes(&prototype.shapes)).collect();
        let instances = self.instances.iter().filter_map(|instance| {
            let (low, high) = prototypes[instance.prototype as usize]?;
            Some(instance.transform.bounds(low, high))
        });
        of_shapes(&self.top_level).into_iter().chain(instances).reduce(union)
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
            Self::Sphere(_) | Self::Disk(_) | Self::Cylinder(_) => 0,
        }
    }
}

/// From where to where `ray` may be inside of a box, before its end; a little more than that, by what rounding may shift points along the ray. `None` where it
/// passes the box.
#[inline]
pub fn within(ray: &Ray, (low, high): (Vec3, Vec3)) -> Option<[f32; 2]> {
    let (mut enter, mut leave) = (0.0f32, ray.t_max);
    for axis in 0..3 {
        let (o, d) = (ray.origin[axis], ray.direction[axis]);
        if d == 0.0 {
            continue;
        }
        let (a, b) = ((low[axis] - o) / d, (high[axis] - o) / d);
        let margin = 1e-6 * (o.abs() / d.abs() + a.abs().max(b.abs()));
        enter = enter.max(a.min(b) - margin);
        leave = leave.min(a.max(b) + margin);
    }
    (enter <= leave).then_some([enter, leave])
}

/// The box around two.
pub fn union(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}
