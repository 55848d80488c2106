//! From what the scene file says to the [`World`] that paths meet. Builds only what the scene needs: media that nothing refers
//! to are not loaded, boundaries that separate nothing are left out, and so are lights that cannot emit.

mod cache;
mod geometry;
mod media;
mod rehearsal;

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;

pub use self::cache::CacheBuilder;
use self::geometry::GeometryBuilder;
use self::media::MediaBuilder;
use super::RenderError;
use super::memory;
use super::regions::camera_regions;
use super::settings::{LightSelection, RenderSettings, VolumeLights, VolumeSampling};
use super::timing::Timings;
use crate::cache_points::CachePoints;
use crate::film::FilmSettings;
use crate::geometry::{Backend, Tracer};
use crate::integrator::in_scatter::equi_angular::EquiAngular;
use crate::integrator::{LightChoice, World};
use crate::light::linking::LinkRequests;
use crate::light::selector::tree::DEFAULT_SPLITTING;
use crate::light::selector::{LightSelector, SelectorKind};
use crate::light::{Lights, VolumeLight};
use crate::material::Materials;
use crate::math::transform::RenderSpace;
use crate::medium::{Medium, MediumId};
use crate::scene::{SceneDescription, Warnings};
use crate::system::taken;

/// Up to this many lights, `auto` asks every light at every vertex: it costs little more than a look-up, and nothing to build. In the
/// scene `pier` (777 lights, 240 × 135 pixels, 16 spp, four candidates) both take about the same processor time for the same error, building
/// included; the more pixels there are, and the more is hidden, the earlier cache points pay. So it is set below that; where exactly they
/// break even was not measured.
const OPTIMAL_UP_TO: usize = 256;

/// Candidates that a light sample is resampled from where the choice of lights is left to `auto` or cache points make it. In the scenes `house`
/// and `rooms` (160 × 90 pixels, 32 spp, two seeds) four instead of two take at most 3 % off the RMSE and cost an eighth more processor time.
const DEFAULT_CANDIDATES: u32 = 2;

/// How many candidates suit a choice of lights: one where there is nothing to choose, and where a selector is asked for by name, so that
/// it can be compared as published.
pub fn light_candidates(choice: &LightChoice, wanted: LightSelection) -> u32 {
    match choice {
        LightChoice::CachePoints(_) => DEFAULT_CANDIDATES,
        LightChoice::Selector(LightSelector::Optimal(_)) | LightChoice::Beside(LightSelector::Optimal(_), _)
            if wanted == LightSelection::Auto =>
        {
            DEFAULT_CANDIDATES
        }
        _ => 1,
    }
}

/// Builds the world of `scene` for `settings`, whose lights nobody chooses yet. `timings` receives the seconds of each step. `film` is what is to be held besides.
pub fn build_world(
    scene: &SceneDescription,
    settings: &RenderSettings,
    film: &FilmSettings,
    backend: Backend,
    timings: &mut Timings,
    warnings: &mut Warnings,
) -> Result<World, RenderError> {
    let space = RenderSpace { origin: scene.camera_position() };

    taken::begin("volumes");
    let start = Instant::now();
    let mut materials = Materials::build(scene, settings.textures.clone(), settings.strict, warnings)?;
    let mut links = LinkRequests::default();
    let media = MediaBuilder::build(scene, &materials, &space, &mut links, settings.strict, warnings)?;
    timings.volumes_and_textures = start.elapsed().as_secs_f64();

    taken::begin("geometry");
    let start = Instant::now();
    let mut builder = GeometryBuilder::new(scene, space, &media, &mut materials, &mut links, settings.strict, warnings);
    builder.build()?;
    let (geometry, emitters, invisible) = (Arc::new(builder.out), builder.emitters, builder.invisible);
    timings.geometry_load = start.elapsed().as_secs_f64();

    taken::begin("textures");
    let start = Instant::now();
    materials.fit_images(|asked| memory::for_textures(asked, film, &geometry), warnings);
    materials.settle_images(warnings)?;
    timings.volumes_and_textures += start.elapsed().as_secs_f64();

    taken::begin("acceleration structure");
    let start = Instant::now();
    let materials = Arc::new(materials);
    let has_opacity = geometry.shapes.iter().any(|shape| shape.has_opacity());
    let opacity = has_opacity.then(|| materials.clone() as Arc<dyn crate::geometry::trace::Opacity>);
    let tracer = Tracer::build(geometry.clone(), opacity, backend)?;
    timings.geometry_build = start.elapsed().as_secs_f64();

    taken::begin("lights");
    let start = Instant::now();
    let mut lights = Lights::build(scene, &geometry, &space, &emitters, &links, settings.strict, warnings)?;
    if settings.volume_lights == VolumeLights::Auto {
        for (number, energy) in media.media.iter().enumerate().filter_map(|(i, m)| Some((i, m.energy()?))) {
            lights.add_volume(VolumeLight::new(MediumId(number as u32), energy.clone()));
        }
    }
    if lights.len() > 1 {
        // The power of distant and infinite lights depends on the scene's size: it matters only in a choice.
        let (low, high) = geometry.bounds();
        lights.set_scene_bounds(low, high);
    }
    for light in invisible {
        lights.set_invisible(light);
    }
    if has_opacity {
        lights.set_opacity(materials.clone());
    }
    timings.lights = start.elapsed().as_secs_f64();

    let extent = geometry.bounds();
    let mut world = World {
        geometry,
        tracer,
        materials,
        lights,
        light_choice: LightChoice::Pilot,
        equi_angular: None,
        fog_glows: media.media.iter().any(|m| matches!(m, Medium::Homogeneous(_)) && m.is_emissive()),
        fires: World::around_fires(&media.media),
        media: media.media,
        media_links: media.links,
        volume_files: media.volume_files,
        interfaces: media.interfaces,
        extent,
        camera_regions: Default::default(),
    };
    if world.has_media() {
        world.camera_regions = camera_regions(&world, Vec3::ZERO, media.camera, warnings);
        if let Some(ambient) = world.camera_regions.ambient() {
            media::check_ambient(scene, world.medium(ambient))?;
        }
    }
    Ok(world)
}

/// How lights are to be chosen.
pub struct ChoicePlan {
    /// By which selector; `None` for cache points.
    pub selector: Option<SelectorKind>,
    /// Whether scattering points are drawn on camera rays.
    pub in_scatter: bool,
    /// By equi-angular sampling and not by cache points.
    pub equi_angular: bool,
}

impl ChoicePlan {
    /// What was asked for; `auto` decides by the lights and media there are.
    pub fn of(lights: &Lights, media: &[Medium], settings: &RenderSettings) -> Self {
        let mut live = lights.ids().filter(|&id| !lights.is_dark(id));
        let (some, several) = (live.next().is_some(), live.next().is_some());
        let selector = match settings.lights {
            LightSelection::CachePoints if several => None,
            LightSelection::Auto if several && lights.len() > OPTIMAL_UP_TO => None,
            LightSelection::Uniform => Some(SelectorKind::Uniform),
            LightSelection::Power => Some(SelectorKind::Power),
            LightSelection::Tree => Some(SelectorKind::Tree),
            LightSelection::Optimal | LightSelection::CachePoints | LightSelection::Auto => Some(SelectorKind::Optimal),
        };
        let wanted = match settings.volume_sampling {
            VolumeSampling::Null => false,
            VolumeSampling::Both | VolumeSampling::Paths | VolumeSampling::InScatter | VolumeSampling::EquiAngular => {
                true
            }
            // Selectors that are asked for by name are compared as published.
            VolumeSampling::Auto => {
                matches!(settings.lights, LightSelection::Auto | LightSelection::CachePoints)
            }
        };
        let in_scatter = wanted && some && media.iter().any(Medium::scatters);
        let equi_angular = in_scatter && settings.volume_sampling == VolumeSampling::EquiAngular;
        Self { selector, in_scatter, equi_angular }
    }

    /// Whether cache points are to be built ([`CacheBuilder`]).
    pub const fn has_points(&self) -> bool {
        self.selector.is_none() || self.in_scatter && !self.equi_angular
    }
}

/// The selector of this kind.
fn selector(kind: SelectorKind, lights: &Lights, settings: &RenderSettings, warnings: &mut Warnings) -> LightSelector {
    let splitting = settings.splitting.unwrap_or(DEFAULT_SPLITTING);
    LightSelector::build(kind, lights, warnings).with_splitting(splitting)
}

/// Lets `world` choose its lights as `plan` says, with cache points where they are part of it.
pub fn choose_lights(
    world: &mut World,
    plan: &ChoicePlan,
    points: Option<CachePoints>,
    settings: &RenderSettings,
    warnings: &mut Warnings,
) {
    world.equi_angular = plan.equi_angular.then(|| EquiAngular::new(&world.lights, world.extent));
    if points.is_none() && plan.has_points() {
        let rest =
            if plan.selector.is_none() { "every vertex asks every light" } else { "there is no in-scatter sampling" };
        warnings.add(None, format!("too few places for cache points: {rest}"));
    }
    let selector = |kind: SelectorKind, warnings: &mut Warnings| selector(kind, &world.lights, settings, warnings);
    world.light_choice = match (plan.selector, points.map(Box::new)) {
        (None, Some(points)) => LightChoice::CachePoints(points),
        (Some(kind), Some(points)) => LightChoice::Beside(selector(kind, warnings), points),
        (kind, None) => LightChoice::Selector(selector(kind.unwrap_or(SelectorKind::Optimal), warnings)),
    };
}
