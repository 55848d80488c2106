//! One acceleration structure: an Embree scene for render space, with those of the shapes of `top_level` and of the instances that are its members, and one
//! for each prototype that these use. Debian's Embree allows one level of instances, which is what [`Geometry`] has.

use std::sync::Arc;

use ::embree::{CurveKind, Device, Error, HitFilter, Scene, SceneBuilder};
use glam::Vec3;

use super::adapters::{InstanceNumbers, ShapeOpacity, ShapePrimitives};
use super::kinds::{Kind, Members};
use super::scale::{Scale, Scales};
use super::{is_embree_curve, motion};
use crate::geometry::curve::Curves;
use crate::geometry::trace::Opacity;
use crate::geometry::{Geometry, InstanceId, Shape, ShapeId, ShapeKind};

/// Pieces that Embree cuts a flat curve into: the most it allows. The deviation of chords from
/// a cubic falls with the square of their number.
const CURVE_PIECES: u32 = 16;

/// What a geometry number of the render-space scene stands for.
enum Target {
    Shape(ShapeId),
    Instance { id: InstanceId, prototype: u32 },
}

/// A prototype's scene.
struct PrototypeScene {
    /// `None` where the prototype has no shape for this structure.
    scene: Option<Arc<Scene>>,
    /// The shape of each geometry number.
    shapes: Vec<ShapeId>,
}

/// An acceleration structure over some of the opaque shapes or over the boundaries.
pub(super) struct Structure {
    /// Render space.
    pub scene: Scene,
    targets: Vec<Target>,
    /// Parallel to [`Geometry::prototypes`]; `None` for those without an instance here. Empty where no instance can be.
    prototypes: Vec<Option<PrototypeScene>>,
}

/// What building needs at every step.
struct Builder<'a> {
    device: &'a Arc<Device>,
    geometry: &'a Arc<Geometry>,
    opacity: Option<&'a Arc<dyn Opacity>>,
    scales: &'a Scales,
    instances: Arc<InstanceNumbers>,
    members: Members<'a>,
}

impl Structure {
    /// The structure over `members`.
    pub fn build(
        device: &Arc<Device>,
        geometry: &Arc<Geometry>,
        opacity: Option<&Arc<dyn Opacity>>,
        scales: &Scales,
        members: Members,
    ) -> Result<Self, Error> {
        let builder = Builder { device, geometry, opacity, scales, instances: Arc::default(), members };
        let mut top = SceneBuilder::new(device, true)?;
        let mut targets = Vec::new();
        let is_member = |shape: &&ShapeId| members.have(Kind::of(&geometry.shapes[shape.0 as usize]));
        for &shape in geometry.top_level.iter().filter(is_member) {
            if let Some(made) = builder.shape(shape, scales.render)? {
                top.attach(made)?;
                targets.push(Target::Shape(shape));
            }
        }
        let mut prototypes: Vec<Option<PrototypeScene>> = Vec::new();
        prototypes.resize_with(if members.have_instances() { geometry.prototypes.len() } else { 0 }, || None);
        let instances = geometry.instances.iter().enumerate();
        for (id, instance) in instances.filter(|(_, instance)| members.have(Kind::of_instance(instance))) {
            let slot = &mut prototypes[instance.prototype as usize];
            let prototype = match slot {
                Some(prototype) => prototype,
                None => slot.insert(builder.prototype(instance.prototype)?),
            };
            let Some(scene) = &prototype.scene else {
                continue;
            };
            let within = scales.prototypes[instance.prototype as usize];
            if let Some(made) = motion::instance(device, scene, &instance.transform, scales.render, within)? {
                top.attach(made)?;
                targets.push(Target::Instance { id: InstanceId(id as u32), prototype: instance.prototype });
            }
        }
        let instance = |target: &Target| match target {
            Target::Shape(_) => None,
            Target::Instance { id, .. } => Some(*id),
        };
        builder.instances.get_or_init(|| targets.iter().map(instance).collect());
        Ok(Self { scene: top.commit()?, targets, prototypes })
    }

    /// The shape and instance of Embree's geometry and instance numbers.
    #[inline]
    pub fn resolve(&self, geometry: u32, instance: Option<u32>) -> (ShapeId, Option<InstanceId>) {
        match self.targets[instance.unwrap_or(geometry) as usize] {
            Target::Shape(shape) => (shape, None),
            Target::Instance { id, prototype } => {
                let prototype = self.prototypes[prototype as usize].as_ref().expect("an instanced prototype is built");
                (prototype.shapes[geometry as usize], Some(id))
            }
        }
    }
}

impl Builder<'_> {
    fn prototype(&self, number: u32) -> Result<PrototypeScene, Error> {
        let mut builder = SceneBuilder::new(self.device, true)?;
        let mut shapes = Vec::new();
        for &shape in &self.geometry.prototypes[number as usize].shapes {
            if let Some(made) = self.shape(shape, self.scales.prototypes[number as usize])? {
                builder.attach(made)?;
                shapes.push(shape);
            }
        }
        let scene = if shapes.is_empty() { None } else { Some(Arc::new(builder.commit()?)) };
        Ok(PrototypeScene { scene, shapes })
    }

    /// Embree's geometry of a shape in a space of this scale, if it belongs to this structure and has anything to hit.
    fn shape(&self, id: ShapeId, scale: Scale) -> Result<Option<::embree::Geometry>, Error> {
        let shape = &self.geometry.shapes[id.0 as usize];
        if shape.is_boundary != self.members.are_boundaries() || shape.primitive_count() == 0 {
            return Ok(None);
        }
        let filter = self.filter(id, shape);
        match &shape.kind {
            ShapeKind::Triangles(mesh) if scale != Scale::ONE => {
                let owner = Arc::new(ScaledMesh::new(self.geometry.clone(), &mesh.positions, scale));
                ::embree::Geometry::triangles(self.device, owner, |scaled| scaled.buffers(id), filter)
            }
            ShapeKind::Triangles(_) => {
                let owner = self.geometry.clone();
                ::embree::Geometry::triangles(self.device, owner, |all| triangle_buffers(all, id), filter)
            }
            ShapeKind::Curves(curves) if is_embree_curve(shape) => self.flat_curves(curves, scale, filter),
            _ => {
                let primitives =
                    ShapePrimitives { geometry: self.geometry.clone(), shape: id, scale, render: self.scales.render };
                ::embree::Geometry::user(self.device, Arc::new(primitives), filter)
            }
        }
        .map(Some)
    }

    fn filter(&self, id: ShapeId, shape: &Shape) -> HitFilter {
        match self.opacity {
            _ if self.members.are_boundaries() => HitFilter::Collect,
            Some(opacity) if shape.has_opacity() => HitFilter::Test(Arc::new(ShapeOpacity {
                instances: self.instances.clone(),
                geometry: self.geometry.clone(),
                shape: id,
                opacity: opacity.clone(),
            })),
            _ => HitFilter::None,
        }
    }

    fn flat_curves(&self, curves: &Curves, scale: Scale, filter: HitFilter) -> Result<::embree::Geometry, Error> {
        let segments = curves.control_points.iter().zip(&curves.widths);
        let vertices = segments.flat_map(|(points, &[start, end])| {
            // A width linear along the segment has Bézier ordinates at thirds.
            let radius = move |third: usize| 0.5 * (start + (end - start) * (third as f32 / 3.0));
            let vertex = move |(third, p): (usize, &Vec3)| [p.x, p.y, p.z, radius(third)].map(|x| x * scale.to_embree);
            points.iter().enumerate().map(vertex)
        });
        let first = (0..curves.control_points.len() as u32).map(|segment| 4 * segment);
        let (vertices, first) = (vertices.collect(), first.collect());
        ::embree::Geometry::bezier_curves(self.device, CurveKind::Flat, vertices, first, CURVE_PIECES, filter)
    }
}

/// A mesh's vertices in Embree's units, and whose indices they go with.
struct ScaledMesh {
    geometry: Arc<Geometry>,
    positions: Vec<Vec3>,
}

impl ScaledMesh {
    fn new(geometry: Arc<Geometry>, positions: &[Vec3], scale: Scale) -> Self {
        // With the room for one more that saves another copy.
        let mut scaled = Vec::with_capacity(positions.len() + 1);
        scaled.extend(positions.iter().map(|&p| p * scale.to_embree));
        Self { geometry, positions: scaled }
    }

    fn buffers(&self, id: ShapeId) -> (&Vec<Vec3>, &[[u32; 3]]) {
        (&self.positions, triangle_buffers(&self.geometry, id).1)
    }
}

/// Where a mesh's vertices and indices are.
fn triangle_buffers(geometry: &Geometry, id: ShapeId) -> (&Vec<Vec3>, &[[u32; 3]]) {
    match &geometry.shapes[id.0 as usize].kind {
        ShapeKind::Triangles(mesh) => (&mesh.positions, &mesh.indices),
        _ => unreachable!("asked only for shapes that were matched as triangles"),
    }
}
