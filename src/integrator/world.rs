//! Everything a path meets: immutable, shared by all threads.

use std::sync::Arc;

use glam::Vec3;

use super::in_scatter::equi_angular::EquiAngular;
use super::light_choice::LightChoice;
use crate::cache_points::scatter::{MOST_PHASES, Phases};
use crate::geometry::{Geometry, InstanceId, ShapeId, Tracer};
use crate::light::{Lights, LinkSet};
use crate::material::Materials;
use crate::medium::regions::{Interface, Regions};
use crate::medium::{Medium, MediumId};

/// The scene as the integrator sees it.
pub struct World {
    /// Shapes and instances.
    pub geometry: Arc<Geometry>,
    /// Rays.
    pub tracer: Tracer,
    /// Materials and textures.
    pub materials: Arc<Materials>,
    /// Lights.
    pub lights: Lights,
    /// How a light is chosen at a vertex.
    pub light_choice: LightChoice,
    /// What scattering points on camera rays are drawn by in place of cache points, where that was asked for; for pilot paths, what says where on
    /// their camera rays cache points are wanted.
    pub equi_angular: Option<EquiAngular>,
    /// Media, by [`MediumId`]; empty for scenes without.
    pub media: Vec<Medium>,
    /// Whether any of them is homogeneous and emits.
    pub fog_glows: bool,
    /// A box around all given by grids that emit, if there are any.
    pub fires: Option<(Vec3, Vec3)>,
    /// The lights that light each of them.
    pub media_links: Vec<LinkSet>,
    /// How many of them were read from OpenVDB files.
    pub volume_files: usize,
    /// What [`crate::geometry::Shape::medium_interface`] refers to.
    pub interfaces: Vec<Interface>,
    /// A box around all shapes.
    pub extent: (Vec3, Vec3),
    /// The regions that the camera starts in.
    pub camera_regions: Regions,
}

impl World {
    /// Where media given by grids may emit: a box, which may be infinite; `None` where none does.
    pub fn around_fires(media: &[Medium]) -> Option<(Vec3, Vec3)> {
        let everywhere = (Vec3::NEG_INFINITY, Vec3::INFINITY);
        let fires = media.iter().filter(|medium| matches!(medium, Medium::Grid(_)) && medium.is_emissive());
        fires.map(|fire| fire.bounds().unwrap_or(everywhere)).reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
    }

    /// Whether any surface or environment may be seen to shine.
    pub fn shines(&self) -> bool {
        !self.lights.infinite().is_empty() || self.geometry.shapes.iter().any(|shape| shape.light.is_some())
    }

    /// Whether any path can be in a medium.
    pub fn has_media(&self) -> bool {
        !self.media.is_empty()
    }

    /// The mean cosines of all media that scatter, each once, in rising order: [`MOST_PHASES`] of them, evenly chosen.
    fn phases(&self) -> Phases {
        let mut all: Vec<f32> = self.media.iter().filter(|m| m.scatters()).map(Medium::g).collect();
        all.sort_by(f32::total_cmp);
        all.dedup();
        let count = all.len().min(MOST_PHASES);
        (0..count).map(|k| all[if count > 1 { k * (all.len() - 1) / (count - 1) } else { 0 }]).collect()
    }

    /// Lets the cache points keep ready what media scatter towards the camera.
    pub fn begin_scattering(&mut self) {
        let phases = self.phases();
        self.light_choice.begin_scattering(&self.lights, phases);
    }

    /// The interface of a shape, where it separates different media.
    #[inline]
    pub fn transition(&self, shape: ShapeId) -> Option<Interface> {
        let interface = self.interfaces[self.geometry.shapes[shape.0 as usize].medium_interface? as usize];
        interface.is_transition().then_some(interface)
    }

    /// The medium of that number.
    #[inline]
    pub fn medium(&self, id: MediumId) -> &Medium {
        &self.media[id.0 as usize]
    }

    /// Moves `regions` across a boundary; false where too many overlap.
    #[inline]
    #[must_use]
    pub fn cross(&self, regions: &mut Regions, shape: ShapeId, instance: Option<InstanceId>, entering: bool) -> bool {
        self.transition(shape).is_none_or(|interface| regions.cross(shape, instance, interface, entering))
    }
}
