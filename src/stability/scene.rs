//! Scenes as text: what the suite and the tests of the renderer write them with.

use crate::cache_points::CacheSettings;
use crate::geometry::Backend;
use crate::render::{LightSelection, RenderSettings, VolumeLights, VolumeSampling};

/// Bounces without limit in practice.
pub const FOREVER: u32 = 2_000_000_000;

/// An environment of radiance 1.
pub const DOME: &str = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";

/// Glass without refraction hides the surrounding from light sampling: paths find it by themselves, and where nothing is absorbed
/// each must bring back exactly 1.
pub const SHELL: &str =
    "AttributeBegin Material \"dielectric\" \"float eta\" 1 Shape \"sphere\" \"float radius\" 3 AttributeEnd\n";

/// A closed box from −1 to 1, normals outwards.
pub const CUBE: &str =
    "Shape \"trianglemesh\" \"point3 P\" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1  -1 -1 1  1 -1 1  1 1 1  -1 1 1]
 \"integer indices\" [0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  3 7 6 3 6 2  0 4 7 0 7 3  1 2 6 1 6 5]\n";

/// Numbers as a scene file has them.
pub fn list(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(" ")
}

/// `shape` as a boundary that light does not notice between two media.
pub fn boundary(inside: &str, outside: &str, shape: &str) -> String {
    format!("AttributeBegin MediumInterface \"{inside}\" \"{outside}\" Material \"interface\" {shape} AttributeEnd\n")
}

/// A medium that is the same everywhere.
pub fn homogeneous(name: &str, sigma_a: [f64; 3], sigma_s: [f64; 3], more: &str) -> String {
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}] {more}\n",
        list(&sigma_a),
        list(&sigma_s)
    )
}

/// A medium of type `uniformgrid`: `n` values of density along each axis of the box `low` to `high`.
pub fn grid(name: &str, n: usize, values: &[f64], [low, high]: [[f64; 3]; 2], more: &str) -> String {
    assert_eq!(values.len(), n * n * n);
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"uniformgrid\" \"integer nx\" {n} \"integer ny\" {n} \"integer nz\" {n}
         \"point3 p0\" [{}] \"point3 p1\" [{}] \"float density\" [{}] {more}\n",
        list(&low),
        list(&high),
        list(values)
    )
}

/// "rgb sigma_a" and "rgb sigma_s" of one grey value each.
pub fn grey(absorption: f64, scattering: f64) -> String {
    format!("\"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}]", list(&[absorption; 3]), list(&[scattering; 3]))
}

/// A lamp of any shape that shines to both sides and is black itself.
pub fn lamp(radiance: f64, shape: &str) -> String {
    format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{}] \"bool twosided\" true
         Material \"diffuse\" \"rgb reflectance\" [0 0 0] {shape} AttributeEnd\n",
        list(&[radiance; 3])
    )
}

/// A point light.
pub fn point(intensity: f64, from: [f64; 3]) -> String {
    format!("LightSource \"point\" \"rgb I\" [{}] \"point3 from\" [{}]\n", list(&[intensity; 3]), list(&from))
}

/// A mesh of triangles.
pub fn mesh(points: &[[f64; 3]], indices: &[u32]) -> String {
    let points: Vec<f64> = points.iter().flatten().copied().collect();
    let indices: Vec<String> = indices.iter().map(u32::to_string).collect();
    format!("Shape \"trianglemesh\" \"point3 P\" [{}] \"integer indices\" [{}]\n", list(&points), indices.join(" "))
}

/// A square image of a world: where from, how wide, how many pixels and bounces. A box filter of one pixel, and the volumetric path tracer.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    /// The camera's place.
    pub from: [f64; 3],
    /// What it looks at.
    pub to: [f64; 3],
    /// Degrees across the image.
    pub fov: f64,
    /// Pixels a side.
    pub size: u32,
    /// Bounces at most.
    pub depth: u32,
}

/// The middle of the world, from a little before it.
impl Default for Shot {
    fn default() -> Self {
        Self { from: [0.0, 0.0, -4.0], to: [0.0; 3], fov: 30.0, size: 8, depth: 5 }
    }
}

impl Shot {
    /// The whole scene file.
    pub fn text(&self, world: &str) -> String {
        self.text_with("", "", world)
    }

    /// The same with directives before the camera, such as `MediumInterface`, and more parameters of the camera.
    pub fn text_with(&self, before: &str, camera: &str, world: &str) -> String {
        let Self { from, to, fov, size, depth } = self;
        // An up vector that is not parallel to the view.
        let up = if (from[0] - to[0]).abs() < 1e-9 && (from[2] - to[2]).abs() < 1e-9 { "0 0 1" } else { "0 1 0" };
        format!(
            "LookAt {}  {}  {up}\n{before}\n\
             Camera \"perspective\" \"float fov\" {fov:e} {camera}\n\
             Film \"rgb\" \"integer xresolution\" {size} \"integer yresolution\" {size}\n\
             PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\n\
             Sampler \"zsobol\"\n\
             Integrator \"volpath\" \"integer maxdepth\" {depth}\nWorldBegin\n{world}\n",
            list(from),
            list(to)
        )
    }
}

/// How a scene is rendered.
#[derive(Clone, Copy, Debug)]
pub struct How {
    /// Samples a pixel.
    pub spp: u32,
    /// Seed.
    pub seed: u32,
    /// How lights are chosen.
    pub lights: LightSelection,
    /// How scattering points are sampled.
    pub volume_sampling: VolumeSampling,
    /// Whether media that emit are lights.
    pub volume_lights: VolumeLights,
    /// Who traces rays.
    pub backend: Backend,
}

/// Candidates for cache points. The number that suits larger images takes many times as long as an image of the suite; it is the same with
/// fewer, only noisier.
const FEW_CANDIDATES: u32 = 2000;

impl How {
    /// With so many samples a pixel, and the defaults else.
    pub const fn spp(spp: u32) -> Self {
        let (lights, volume_sampling) = (LightSelection::Auto, VolumeSampling::Auto);
        Self { spp, seed: 1, lights, volume_sampling, volume_lights: VolumeLights::Auto, backend: Backend::DEFAULT }
    }

    /// As settings.
    pub fn settings(&self) -> RenderSettings {
        RenderSettings {
            lights: self.lights,
            volume_sampling: self.volume_sampling,
            volume_lights: self.volume_lights,
            backend: Some(self.backend),
            cache: CacheSettings { candidates: Some(FEW_CANDIDATES), ..CacheSettings::default() },
            ..RenderSettings::default()
        }
    }

    /// As options of the command line.
    pub fn flags(&self) -> String {
        let Self { spp, seed, lights, volume_sampling, volume_lights, backend } = self;
        let word = |value: &dyn erased::Word| value.word();
        format!(
            "--spp {spp} --seed {seed} --lights {} --volume-sampling {} --volume-lights {} --backend {} --cache-candidates {FEW_CANDIDATES}",
            word(lights),
            word(volume_sampling),
            word(volume_lights),
            word(backend)
        )
    }
}

/// Names that the command line gives to values.
mod erased {
    /// A value that has one.
    pub trait Word {
        /// It.
        fn word(&self) -> String;
    }

    impl<T: clap::ValueEnum> Word for T {
        fn word(&self) -> String {
            self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
        }
    }
}
