//! The systems that a scene may leave out, and what makes it need each.
//!
//! Text for scene files stands where `Translate` and `Scale` have made a unit cube of the place that is out of the way. In it `{triangle}` is a triangle,
//! `{boundary}` the closed boundary of the medium `lean`, `{texture}` and `{volume}` are names of files, `{size}` is the length of the cube's edges.

use super::facts::{CACHE_POINTS, Facts, Part};

/// What makes a scene need a system.
#[derive(Debug)]
pub struct System {
    /// The name of the part ([`Facts`]).
    pub name: &'static str,
    /// What is added, in words.
    pub how: &'static str,
    /// Whether the scene has no use for it, but for what [`System::is_idle_in`] tells: it must cost next to nothing. Otherwise it is used wherever it can be.
    pub is_idle: bool,
    /// Whether a light comes with it. One light more is nothing to cache points; without them every vertex asks every light, and there it is in use.
    pub is_light: bool,
    /// Text before the scene's.
    pub before: &'static str,
    /// Text within its world.
    pub within: &'static str,
    /// Arguments of the render.
    pub arguments: &'static [&'static str],
}

/// A triangle.
pub const TRIANGLE: &str = "Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0] \"integer indices\" [0 1 2]";
/// A tetrahedron around the medium `lean`: triangles, so that nothing but the medium is new.
pub const BOUNDARY: &str = "Material \"interface\" MediumInterface \"lean\" \"\"\nShape \"trianglemesh\" \"point3 P\" \
     [0 0 0  1 0 0  0 1 0  0 0 1] \"integer indices\" [0 2 1  0 1 3  0 3 2  1 2 3]";

/// Of a system that comes with something tiny in the world.
const fn idle(name: &'static str, how: &'static str, within: &'static str) -> System {
    System { name, how, is_idle: true, is_light: false, before: "", within, arguments: &[] }
}

/// Two lamps too faint to be seen.
const LAMPS: &str = "LightSource \"point\" \"point3 P\" [0 0 0  1 0 0] \"float scale\" 1e-9";

/// All of them.
const SYSTEMS: [System; 19] = [
    idle("displacement", "a tiny displaced triangle", "{triangle} \"float displacement\" 0.1"),
    idle(
        "instances",
        "a tiny object, placed once",
        "ObjectBegin \"lean\"\n{triangle}\nObjectEnd\nObjectInstance \"lean\"",
    ),
    idle(
        "motion blur",
        "a tiny triangle that moves",
        "ActiveTransform EndTime\nTranslate 1 0 0\nActiveTransform All\n{triangle}",
    ),
    System {
        name: "moving camera",
        how: "the camera moves by a hair",
        is_idle: false,
        is_light: false,
        before: "ActiveTransform EndTime\nTranslate {size} 0 0\nActiveTransform All",
        within: "",
        arguments: &[],
    },
    idle("opacity", "a tiny triangle that is half transparent", "{triangle} \"float alpha\" 0.5"),
    idle(
        "textures",
        "a tiny triangle with a texture",
        "Texture \"lean\" \"spectrum\" \"imagemap\" \"string filename\" \"{texture}\"\nMaterial \"diffuse\" \"texture reflectance\" \"lean\"\n{triangle}",
    ),
    idle(
        "relief",
        "a tiny triangle with a bump map",
        "Texture \"lean\" \"float\" \"imagemap\" \"string filename\" \"{texture}\"\nMaterial \"diffuse\" \"texture displacement\" \"lean\"\n{triangle}",
    ),
    idle(
        "media",
        "a tiny, uniform, absorbing medium with its boundary",
        "MakeNamedMedium \"lean\" \"string type\" \"homogeneous\" \"float sigma_a\" 1 \"float sigma_s\" 0\n{boundary}",
    ),
    idle(
        "density bounds",
        "a tiny, absorbing medium given by a grid",
        "MakeNamedMedium \"lean\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \"float density\" [1 1 1 1 1 1 1 1] \
         \"float sigma_a\" 1 \"float sigma_s\" 0\n{boundary}",
    ),
    idle(
        "volume reader",
        "a tiny, absorbing medium from a .vdb file",
        "MakeNamedMedium \"lean\" \"string type\" \"openvdb\" \"string filename\" \"{volume}\" \"float sigma_a\" 1 \"float sigma_s\" 0\n{boundary}",
    ),
    idle(
        "medium boundaries",
        "a tiny, uniform, absorbing medium with its boundary",
        "MakeNamedMedium \"lean\" \"string type\" \"homogeneous\" \"float sigma_a\" 1 \"float sigma_s\" 0\n{boundary}",
    ),
    idle(
        "emission gathering in media",
        "a tiny, uniform medium that glows faintly",
        "MakeNamedMedium \"lean\" \"string type\" \"homogeneous\" \"float sigma_a\" 1 \"float sigma_s\" 0 \"rgb Le\" [1e-9 1e-9 1e-9]\n{boundary}",
    ),
    System {
        is_light: true,
        ..idle(
            "volume lights",
            "a tiny, faint flame given by a grid",
            "MakeNamedMedium \"lean\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \"float density\" [1 1 1 1 1 1 1 1] \
         \"float sigma_a\" 1 \"float sigma_s\" 0 \"rgb Le\" [1e-9 1e-9 1e-9]\n{boundary}",
        )
    },
    idle(
        "in-scatter sampling",
        "a tiny, uniform medium that scatters",
        "MakeNamedMedium \"lean\" \"string type\" \"homogeneous\" \"float sigma_a\" 1 \"float sigma_s\" 1\n{boundary}",
    ),
    System { is_idle: false, is_light: true, ..idle("light selection", "two lamps too faint to be seen", LAMPS) },
    System {
        name: CACHE_POINTS,
        how: "--lights cache-points",
        is_idle: false,
        is_light: false,
        before: "",
        within: LAMPS,
        arguments: &["--lights", "cache-points"],
    },
    idle("light linking", "a tiny triangle that no light lights", "{triangle} \"string lights\" []"),
    idle("spheres, disks", "a tiny sphere", "Translate 0.5 0.5 0.5\nShape \"sphere\" \"float radius\" 0.4"),
    idle("curves", "a tiny curve", "Shape \"curve\" \"point3 P\" [0 0 0  1 0 0  0 1 0  1 1 0] \"float width\" 0.1"),
];

impl System {
    /// Whether it has nothing to do in a scene of these facts.
    pub fn is_idle_in(&self, facts: &Facts) -> bool {
        self.is_idle && (!self.is_light || facts.has(CACHE_POINTS))
    }
}

/// The systems that a scene leaves out and that it can be made to need, with why it leaves each out.
pub fn left_out(facts: &Facts) -> impl Iterator<Item = (&'static System, &Part)> {
    SYSTEMS.iter().filter_map(|system| {
        let part = facts.parts.iter().find(|part| part.name == system.name && !part.is_built)?;
        // Media come with boundaries.
        let is_told = system.name == "medium boundaries" && !facts.has("media");
        (!is_told).then_some((system, part))
    })
}

/// The parts that a scene leaves out and that nothing here makes it need.
pub fn beyond(facts: &Facts) -> impl Iterator<Item = &'static str> {
    facts
        .parts
        .iter()
        .filter(|part| !part.is_built)
        .map(|part| part.name)
        .filter(|name| SYSTEMS.iter().all(|system| system.name != *name))
}
