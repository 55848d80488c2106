//! The medium of a scene that shows a .vdb file: the one written by code, or any other that is to stand in its place, fitted to
//! the same box and brought to as much density and heat.

use std::fs::File;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::GalleryError;
use super::text::SceneText;
use crate::scene::SceneErrorKind;
use crate::system::output::write_atomically;

/// Names that grids of temperature go by.
#[cfg(feature = "openvdb")]
const HOT: [&str; 6] = ["temperature", "heat", "flame", "flames", "fire", "temp"];

/// A file that is not the project's own.
#[derive(Clone, Debug)]
pub struct OwnVolume {
    path: PathBuf,
    /// The file's name in the scene's folder.
    file: String,
    /// The box of its active voxels, in the file's units.
    bounds: [DVec3; 2],
    density: Channel,
    temperature: Option<Channel>,
}

/// A grid's name and its largest value.
#[derive(Clone, Debug, PartialEq)]
struct Channel {
    name: String,
    largest: f32,
}

fn unreadable(path: &Path, reason: impl std::fmt::Display) -> GalleryError {
    GalleryError::Volume(SceneErrorKind::File { path: path.to_owned(), reason: reason.to_string() })
}

/// The file's name, for use within a scene's text.
fn name_of(path: &Path) -> Result<String, GalleryError> {
    let name = path
        .file_name()
        .and_then(|name| name.to_str())
        .filter(|name| name.to_ascii_lowercase().ends_with(".vdb") && !name.contains(char::is_control));
    name.map(str::to_owned).ok_or_else(|| unreadable(path, "its name must be text that ends in .vdb"))
}

/// As a string in a scene's text.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

impl OwnVolume {
    /// Looks into the file: its grids of density and temperature, and the box they fill.
    ///
    /// # Errors
    /// What cannot be read, is no .vdb file, or holds no grid of numbers above 0.
    #[cfg(feature = "openvdb")]
    pub fn read(path: &Path) -> Result<Self, GalleryError> {
        use crate::medium::grid::field::AnyGrid;
        use crate::medium::grid::file;

        struct Found {
            name: String,
            largest: f32,
            bounds: [DVec3; 2],
        }
        let file = name_of(path)?;
        let mut found: Vec<Found> = vec![];
        for mut grid in file::read(path).map_err(GalleryError::Volume)? {
            let Some(AnyGrid::Scalar(values)) = file::voxels(&mut grid) else { continue };
            let (Some((first, last)), Some(map)) =
                (grid.header.index_bounds, file::place(&grid, &glam::DAffine3::IDENTITY))
            else {
                continue;
            };
            // A voxel's value reaches to the middles of its neighbours.
            let reach = [first.map(|i| f64::from(i) - 1.0), last.map(|i| f64::from(i) + 1.0)];
            let corner = |i: usize| map.to_render(DVec3::from_array([0, 1, 2].map(|axis| reach[i >> axis & 1][axis])));
            let bounds = [1, 2, 3, 4, 5, 6, 7]
                .into_iter()
                .map(corner)
                .fold([corner(0); 2], |[low, high], p| [low.min(p), high.max(p)]);
            let largest = values.largest();
            let usable = largest > 0.0 && (bounds[1] - bounds[0]).min_element() > 0.0 && bounds[1].is_finite();
            if usable
                && grid.header.index == 0
                && !grid.header.name.contains(char::is_control)
                && !found.iter().any(|f| f.name == grid.header.name)
            {
                found.push(Found { name: grid.header.name.clone(), largest, bounds });
            }
        }
        let is_hot = |f: &&Found| HOT.iter().any(|name| f.name.eq_ignore_ascii_case(name));
        let hot = HOT.iter().find_map(|name| found.iter().find(|f| f.name.eq_ignore_ascii_case(name)));
        let dense = found.iter().find(|f| f.name == "density").or_else(|| found.iter().find(|f| !is_hot(f))).or(hot);
        let Some(dense) = dense else {
            return Err(unreadable(path, "it holds no grid of numbers above 0"));
        };
        let channel = |f: &Found| Channel { name: f.name.clone(), largest: f.largest };
        Ok(Self {
            path: path.to_owned(),
            file,
            bounds: dense.bounds,
            density: channel(dense),
            temperature: hot.map(channel),
        })
    }

    /// Refuses: this build cannot read .vdb files.
    #[cfg(not(feature = "openvdb"))]
    pub fn read(path: &Path) -> Result<Self, GalleryError> {
        name_of(path).and(Err(GalleryError::NoVolumes))
    }

    /// Copies the file into the scene's folder.
    pub fn copy_to(&self, folder: &Path) -> Result<(), GalleryError> {
        // Opened first: it may be the file that is replaced.
        let mut source = File::open(&self.path).map_err(|error| unreadable(&self.path, error))?;
        Ok(write_atomically(&folder.join(&self.file), |file| {
            std::io::copy(&mut source, file).map(drop).map_err(|error| error.to_string())
        })?)
    }

    /// How much larger the file is to be, so that it fits into `region`, and where it lies then: on the middle of its floor.
    fn fitted(&self, region: [Vec3; 2]) -> (f64, [DVec3; 2]) {
        let [low, high] = region.map(Vec3::as_dvec3);
        let [from, to] = self.bounds;
        let scale = ((high - low) / (to - from)).min_element();
        let half = 0.5 * scale * (to - from);
        let middle = (0.5 * (low + high)).with_y(low.y + half.y);
        (scale, [middle - half, middle + half])
    }
}

/// A medium of a density and perhaps a temperature grid within a box.
pub struct GridMedium<'a> {
    /// Its name.
    pub name: &'a str,
    /// The file written by code.
    pub file: &'a str,
    /// Where it lies.
    pub region: [Vec3; 2],
    /// The highest temperature in kelvin, if it glows.
    pub hottest: Option<f32>,
    /// What else there is to say about it.
    pub parameters: &'a str,
    /// The medium around it; empty for none.
    pub outside: &'a str,
}

impl GridMedium<'_> {
    /// Adds the medium and its boundary, with the file `own` in place of the one written by code.
    pub fn add(&self, t: &mut SceneText, own: Option<&OwnVolume>) {
        let Self { name, file, region, hottest, parameters, outside } = self;
        let [low, high] = match own {
            None => {
                t.add(format_args!(
                    "MakeNamedMedium \"{name}\" \"string type\" \"openvdb\" \"string filename\" \"{file}\""
                ));
                if hottest.is_some() {
                    t.add(format_args!("  \"string temperature\" \"temperature\""));
                }
                t.add(format_args!("  {parameters}"));
                *region
            }
            Some(own) => {
                let (scale, place) = own.fitted(*region);
                let to = place[0] - scale * own.bounds[0];
                t.block(|t| {
                    t.add(format_args!("Translate {} {} {} Scale {scale} {scale} {scale}", to.x, to.y, to.z));
                    t.add(format_args!(
                        "MakeNamedMedium \"{name}\" \"string type\" \"openvdb\" \"string filename\" {}",
                        quoted(&own.file)
                    ));
                    let Channel { name, largest } = &own.density;
                    t.add(format_args!(
                        "  \"string density\" {} \"float densityscale\" {}",
                        quoted(name),
                        1.0 / largest
                    ));
                    if let Some(hottest) = hottest {
                        // Without a grid of temperatures it glows where it is dense, less hot: that is all over.
                        let (Channel { name, largest }, hottest) = match &own.temperature {
                            Some(temperature) => (temperature, *hottest),
                            None => (&own.density, 0.75 * hottest),
                        };
                        t.add(format_args!(
                            "  \"string temperature\" {} \"float temperaturescale\" {}",
                            quoted(name),
                            hottest / largest
                        ));
                    }
                    t.add(format_args!("  {parameters}"));
                });
                place.map(DVec3::as_vec3)
            }
        };
        t.block(|t| {
            t.add(format_args!("Material \"interface\" MediumInterface \"{name}\" \"{outside}\""));
            t.cuboid(low, high);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(bounds: [DVec3; 2]) -> OwnVolume {
        let density = Channel { name: "density".to_owned(), largest: 4.0 };
        OwnVolume { path: "a/b.vdb".into(), file: "b.vdb".to_owned(), bounds, density, temperature: None }
    }

    #[test]
    fn a_volume_fills_its_box_as_far_as_it_can_and_stands_on_its_floor() {
        let own = volume([DVec3::new(-10.0, 100.0, 0.0), DVec3::new(10.0, 110.0, 5.0)]);
        let (scale, [low, high]) = own.fitted([Vec3::new(1.0, 2.0, 3.0), Vec3::new(5.0, 6.0, 7.0)]);
        assert!((scale - 0.2).abs() < 1e-12);
        assert!((low - DVec3::new(1.0, 2.0, 4.5)).length() < 1e-9, "{low}");
        assert!((high - DVec3::new(5.0, 4.0, 5.5)).length() < 1e-9, "{high}");
    }

    #[test]
    fn names_that_scene_text_cannot_hold_are_refused() {
        assert_eq!(quoted(r#"a"b\c"#), r#""a\"b\\c""#);
        assert_eq!(name_of(Path::new("/x/smoke.VDB")).expect("a good name"), "smoke.VDB");
        for name in ["smoke.exr", "a\nb.vdb", ".."] {
            assert!(name_of(Path::new(name)).is_err(), "{name:?}");
        }
    }
}
