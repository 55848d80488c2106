//! What a scene needs: which systems its render has, which are left out, and why. Building the world decided it, from the scene alone
//! and once; here it is said.

use bytesize::ByteSize;
use serde::Serialize;

use super::memory;
use super::splitting::Splitting;
use crate::film::FilmSettings;
use crate::geometry::camera::Camera;
use crate::geometry::{MotionTransform, Shape};
use crate::integrator::{LightChoice, World};
use crate::light::Linking;
use crate::light::selector::LightSelector;
use crate::material::Materials;
use crate::medium::Medium;

/// One system of the renderer and whether this scene gets it.
#[derive(Clone, Debug, Serialize)]
pub struct System {
    /// What it is.
    pub name: &'static str,
    /// Whether it is built.
    pub built: bool,
    /// Why, with counts.
    pub reason: String,
    /// Bytes it holds.
    pub bytes: usize,
}

/// All decisions for one scene.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// The systems, built or left out.
    pub systems: Vec<System>,
}

impl Plan {
    /// The plan that `world` was built by, seen from `camera` on `film`. `in_scatter` is whether scattering points are sampled by cache points too,
    /// `splits_views` whether camera rays are split.
    pub fn of(world: &World, camera: &Camera, in_scatter: bool, splits_views: bool, film: &FilmSettings) -> Self {
        let mut plan = Self { systems: vec![] };
        let geometry = &world.geometry;
        let shapes = &geometry.shapes;
        let count = |of: fn(&Shape) -> bool| shapes.iter().filter(|shape| of(shape)).count();

        let primitives: usize = shapes.iter().map(|shape| shape.primitive_count() as usize).sum();
        let reason =
            format!("{} with {}", counted(shapes.len(), SHAPES), counted(primitives, ["primitive", "primitives"]));
        plan.built("geometry", reason, geometry.memory() + world.tracer.memory());
        let moving =
            geometry.instances.iter().filter(|i| matches!(i.transform, MotionTransform::Moving { .. })).count();
        plan.decide("displacement", geometry.displaced, ["displaced mesh", "displaced meshes"], 0);
        plan.decide("instances", geometry.instances.len(), ["instance", "instances"], 0);
        plan.decide("motion blur", moving, ["moving instance", "moving instances"], 0);
        plan.decide("moving lights", world.lights.moving_count(), ["moving light", "moving lights"], 0);
        plan.decide_one("moving camera", camera.is_moving(), ["the camera moves", "the camera stands still"]);
        plan.decide_one("depth of field", camera.has_lens(), ["the camera has a lens", "the camera is a pinhole"]);
        plan.decide("opacity", count(Shape::has_opacity), ["shape with alpha", "shapes with alpha"], 0);
        plan.systems.push(textures(&world.materials));
        let reliefs = ["material with a normal map or displacement", "materials with normal maps or displacement"];
        plan.decide("relief", world.materials.reliefs_in_use(), reliefs, 0);
        let media_bytes = world.media.iter().map(|m| m.memory()).sum();
        plan.decide("media", world.media.len(), ["medium", "media"], media_bytes);
        let grids = world.media.iter().filter(|m| matches!(m, Medium::Grid(_))).count();
        plan.decide("density bounds", grids, ["medium given by grids", "media given by grids"], 0);
        plan.decide("volume reader", world.volume_files, ["OpenVDB medium", "OpenVDB media"], 0);
        let boundaries = count(|shape| shape.is_boundary);
        plan.decide("medium boundaries", boundaries, ["boundary shape", "boundary shapes"], 0);
        let emissive = world.media.iter().filter(|m| m.is_emissive()).count();
        plan.decide("emission gathering in media", emissive, ["emissive medium", "emissive media"], 0);
        plan.systems.push(volume_lights(world, emissive));

        let lights = &world.lights;
        plan.decide("lights", lights.len(), LIGHTS, lights.memory());
        plan.systems.push(light_selection(world));
        let reason = match (in_scatter, world.media.iter().any(Medium::scatters)) {
            (true, _) if world.equi_angular.is_some() => {
                "camera rays are scattered near lights (equi-angular sampling)"
            }
            (true, _) => "cache points tell where camera rays are scattered",
            (false, true) => "null tracking alone finds where camera rays are scattered",
            (false, false) => "nothing scatters between surfaces",
        };
        plan.systems.push(System {
            name: "in-scatter sampling",
            built: in_scatter,
            reason: reason.to_owned(),
            bytes: 0,
        });
        let (bytes, reason) = match lights.linking() {
            None => (0, "no shape names lights".to_owned()),
            Some(linking) => (linking.memory(), link_counts(linking)),
        };
        plan.systems.push(System { name: "light linking", built: lights.linking().is_some(), reason, bytes });
        let reason = match (splits_views, world.shines()) {
            (true, _) => "what shines straight into the camera is looked for by more rays where they disagree",
            (false, true) => "switched off: each path's camera ray alone finds what shines straight into the camera",
            (false, false) => "no surface or environment can be seen to shine",
        };
        let bytes = if splits_views { Splitting::memory_for(film.bounds.area()) } else { 0 };
        plan.systems.push(System { name: "view rays", built: splits_views, reason: reason.to_owned(), bytes });
        plan.built("film", "beauty, variance and layers".to_owned(), memory::of_film(film));
        plan
    }

    /// Bytes of everything that is built.
    pub fn bytes(&self) -> usize {
        self.systems.iter().map(|system| system.bytes).sum()
    }

    /// One line for image headers: `geometry, media, lights; without instances, …`.
    pub fn summary(&self) -> String {
        let names = |built: bool| {
            self.systems.iter().filter(|s| s.built == built).map(|s| s.name).collect::<Vec<_>>().join(", ")
        };
        format!("{}; without {}", names(true), names(false))
    }

    fn built(&mut self, name: &'static str, reason: String, bytes: usize) {
        self.systems.push(System { name, built: true, reason, bytes });
    }

    fn decide(&mut self, name: &'static str, count: usize, what: [&str; 2], bytes: usize) {
        let reason = if count == 0 { format!("the scene has no {}", what[1]) } else { counted(count, what) };
        self.systems.push(System { name, built: count > 0, reason, bytes });
    }

    fn decide_one(&mut self, name: &'static str, built: bool, [yes, no]: [&str; 2]) {
        let reason = if built { yes } else { no }.to_owned();
        self.systems.push(System { name, built, reason, bytes: 0 });
    }
}

/// Textures, and where their images are.
fn textures(materials: &Materials) -> System {
    let count = materials.textures_in_use();
    let mut reason =
        if count == 0 { "the scene has no textures".to_owned() } else { counted(count, ["texture", "textures"]) };
    let images = materials.images_in_use();
    if images > 0 {
        let size = ByteSize(materials.image_bytes());
        reason += &format!(" of {} with {size} at all levels, ", counted(images, ["image", "images"]));
        match materials.texture_cache() {
            None => reason += "in memory",
            Some(cache) => reason += &format!("tile by tile within {}", ByteSize(cache.limit)),
        }
    }
    System { name: "textures", built: count > 0, reason, bytes: materials.memory() }
}

/// Whether media that emit are lights. Their grids of energy are counted with the media, whose bounds follow them.
fn volume_lights(world: &World, emissive: usize) -> System {
    let known = world.media.iter().filter(|m| m.energy().is_some()).count();
    let built = world.lights.volume_count();
    let reason = if built > 0 {
        let cells: usize = world.media.iter().filter_map(|m| m.energy()).map(|energy| energy.len()).sum();
        format!("{} by {cells} cells of energy", counted(built, ["medium", "media"]))
    } else if known > 0 {
        "switched off: what media emit is found by rays that meet it".to_owned()
    } else if emissive > 0 {
        "media that emit everywhere, or nowhere, are found by rays alone".to_owned()
    } else {
        "the scene has no emissive media".to_owned()
    };
    System { name: "volume lights", built: built > 0, reason, bytes: 0 }
}

fn light_selection(world: &World) -> System {
    let over = counted(world.lights.len(), LIGHTS);
    let (built, reason) = match &world.light_choice {
        LightChoice::Selector(LightSelector::None) => (false, "the scene has no lights".to_owned()),
        LightChoice::Selector(LightSelector::Single(_)) | LightChoice::Beside(LightSelector::Single(_), _) => {
            (false, "there is one light: nothing to choose".to_owned())
        }
        LightChoice::Selector(selector) | LightChoice::Beside(selector, _) => {
            (true, format!("{} over {over}", selector_name(selector)))
        }
        LightChoice::CachePoints(cache) => (true, format!("{} cache points over {over}", cache.statistics().points)),
        LightChoice::Pilot => (true, format!("cache points over {over}")),
    };
    System { name: "light selection", built, reason, bytes: world.light_choice.memory() }
}

const SHAPES: [&str; 2] = ["shape", "shapes"];
const LIGHTS: [&str; 2] = ["light", "lights"];

fn selector_name(selector: &LightSelector) -> &'static str {
    match selector {
        LightSelector::None | LightSelector::Single(_) => "none",
        LightSelector::Uniform(_) => "uniform",
        LightSelector::Power(_) => "by power",
        LightSelector::Optimal(_) => "locally optimal",
        LightSelector::Tree(_) => "light tree",
    }
}

fn link_counts(linking: &Linking) -> String {
    let sets = counted(linking.set_count(), ["set of lights", "sets of lights"]);
    let named = counted(linking.named_count(), ["named light", "named lights"]);
    format!("{sets} by object, {named}, {} exclusive", linking.exclusive_count())
}

fn counted(count: usize, [one, many]: [&str; 2]) -> String {
    if count == 1 { format!("1 {one}") } else { format!("{count} {many}") }
}

#[cfg(test)]
mod tests {
    use crate::render::{Job, RenderSettings, load};
    use crate::scene::{Sources, Warnings};

    /// The names of what a scene's plan builds, and its reasons.
    fn plan(text: &str) -> (Vec<&'static str>, Vec<String>) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.pbrt");
        std::fs::write(&path, text).expect("a file");
        let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
        let (scene, timings) = load(&path, &mut sources, &mut warnings).expect("the scene is right");
        let job = Job::prepare(&scene, &RenderSettings::default(), timings, &mut warnings).expect("it can be built");
        let systems = &job.plan.systems;
        (
            systems.iter().filter(|s| s.built).map(|s| s.name).collect(),
            systems.iter().map(|s| s.reason.clone()).collect(),
        )
    }

    #[test]
    fn a_lamp_and_a_ball_get_nothing_else() {
        let (built, reasons) = plan("WorldBegin LightSource \"point\" Shape \"sphere\"");
        assert_eq!(built, ["geometry", "lights", "film"]);
        for reason in ["1 shape with 1 primitive", "the scene has no media", "there is one light: nothing to choose"] {
            assert!(reasons.iter().any(|r| r == reason), "{reason}: {reasons:?}");
        }
    }

    #[test]
    fn everything_is_named_once_it_is_there() {
        let (built, reasons) = plan(
            "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All\n\
             Camera \"perspective\" \"float lensradius\" 0.1 \"float focaldistance\" 3\nWorldBegin\n\
             LightSource \"point\" LightSource \"distant\"\n\
             MakeNamedMedium \"fog\" \"string type\" \"uniformgrid\" \"float density\" [1] \"rgb Le\" [1 1 1]\n\
             AttributeBegin Material \"interface\" MediumInterface \"fog\" \"\" Shape \"sphere\" AttributeEnd\n\
             ObjectBegin \"o\" Shape \"sphere\" \"float alpha\" 0.5 ObjectEnd ObjectInstance \"o\"\n\
             ActiveTransform EndTime Translate 0 1 0 ActiveTransform All ObjectInstance \"o\"",
        );
        let all = ["instances", "motion blur", "moving camera", "depth of field", "opacity", "media", "density bounds"];
        let more = ["medium boundaries", "emission gathering in media", "volume lights", "lights", "light selection"];
        for name in all.iter().chain(&more) {
            assert!(built.contains(name), "{name}: {built:?}");
        }
        assert!(!built.contains(&"volume reader") && !built.contains(&"textures"), "{built:?}");
        for reason in ["2 instances", "1 moving instance", "1 medium", "locally optimal over 3 lights"] {
            assert!(reasons.iter().any(|r| r == reason), "{reason}: {reasons:?}");
        }
    }
}
