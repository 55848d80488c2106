//! The media that the scene uses, and the interfaces between them.

use std::collections::HashMap;

use crate::light::LinkSet;
use crate::light::linking::LinkRequests;
use crate::material::{MaterialId, Materials};
use crate::math::transform::RenderSpace;
use crate::medium::build::build_medium;
use crate::medium::regions::Interface;
use crate::medium::{Medium, MediumId};
use crate::render::RenderError;
use crate::scene::{MediumEntity, MediumInterface, SceneDescription, SceneError, SceneErrorKind, Warnings};

/// The media that the scene uses, and the interfaces between them.
pub(super) struct MediaBuilder {
    pub media: Vec<Medium>,
    /// The lights that light each of them.
    pub links: Vec<LinkSet>,
    /// How many of them were read from OpenVDB files.
    pub volume_files: usize,
    pub interfaces: Vec<Interface>,
    /// The place in `interfaces` of what shapes name.
    pub numbers: HashMap<MediumInterface, u32>,
    /// The medium that the file says surrounds the camera.
    pub camera: Option<MediumId>,
}

impl MediaBuilder {
    pub fn build(
        scene: &SceneDescription,
        materials: &Materials,
        space: &RenderSpace,
        links: &mut LinkRequests,
        strict: bool,
        warnings: &mut Warnings,
    ) -> Result<Self, RenderError> {
        let mut built = Self {
            media: vec![],
            links: vec![],
            volume_files: 0,
            interfaces: vec![],
            numbers: HashMap::new(),
            camera: None,
        };
        let mut ids: HashMap<&str, MediumId> = HashMap::new();
        let shapes = scene.shapes.iter().chain(scene.objects.iter().flat_map(|object| &object.shapes));
        // An opaque surface's media are never seen from within: only boundaries and surfaces that transmit count.
        let used: Vec<&MediumInterface> = shapes
            .filter(|shape| materials.is_transmissive(MaterialId(shape.material.0)))
            .filter_map(|shape| shape.medium_interface.as_deref())
            .collect();
        let by_name: HashMap<&str, &MediumEntity> =
            scene.media.iter().map(|medium| (medium.name.as_str(), medium)).collect();
        let mut load = |name: &str, media: &mut Vec<Medium>, warnings: &mut Warnings| -> Result<_, RenderError> {
            if name.is_empty() {
                return Ok(None);
            }
            let entity = by_name
                .get(name)
                .ok_or_else(|| SceneError::new(SceneErrorKind::Undefined(format!("no medium is named \"{name}\""))))?;
            if let Some(id) = ids.get(entity.name.as_str()) {
                return Ok(Some(*id));
            }
            let matrix = space.from_world(&entity.transform.start);
            built.links.push(links.add(&entity.entity.params)?);
            media.push(build_medium(entity, &matrix, scene, strict, warnings)?);
            let id = MediumId(media.len() as u32 - 1);
            ids.insert(&entity.name, id);
            Ok(Some(id))
        };
        for interface in used {
            if interface.inside == interface.outside || built.numbers.contains_key(interface) {
                continue;
            }
            let inside = load(&interface.inside, &mut built.media, warnings)?;
            let outside = load(&interface.outside, &mut built.media, warnings)?;
            built.interfaces.push(Interface { inside, outside });
            built.numbers.insert(interface.clone(), built.interfaces.len() as u32 - 1);
        }
        built.camera = load(&scene.camera_medium, &mut built.media, warnings)?;
        for medium in &scene.media {
            if ids.contains_key(medium.name.as_str()) && medium.entity.kind == "openvdb" {
                built.volume_files += 1;
            }
            if !ids.contains_key(medium.name.as_str()) {
                let message = format!("medium \"{}\" is not used and was not loaded", medium.name);
                warnings.add(Some(medium.entity.span()), message);
            }
        }
        Ok(built)
    }
}

/// Refuses a medium that surrounds the whole scene, but cannot end a ray that goes on for ever.
pub(super) fn check_ambient(scene: &SceneDescription, medium: &Medium) -> Result<(), RenderError> {
    let Medium::Grid(grid) = medium else { return Ok(()) };
    if !grid.never_ends() {
        return Ok(());
    }
    let message = format!(
        "medium \"{}\" surrounds the whole scene and reaches to infinity, but lets light of some colour through (nearly) without end",
        scene.camera_medium
    );
    let kind = SceneErrorKind::Parameter(message);
    let entity = scene.media.iter().find(|medium| medium.name == scene.camera_medium);
    let error = match entity {
        Some(medium) => SceneError::at(medium.entity.params.span, kind),
        None => SceneError::new(kind),
    };
    Err(error
        .help("put the camera inside a boundary that holds the medium, leave out \"densityoffset\" and \"emissionoffset\", or let \"sigma_a\" and \"sigma_s\" stop every colour")
        .into())
}
