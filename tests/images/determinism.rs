//! One seed, one image: bit for bit, at any number of threads, whole or in parts.

use std::path::Path;

use crate::common::{CUBE, Options, Shot, View, boundary, shuffled_grid};
use lanternfish::cache_points::CacheSettings;
use lanternfish::cache_points::gather::Gathering;
use lanternfish::cache_points::learn::VisibilityRule;
use lanternfish::film::{ChannelImage, FilmOverrides};
use lanternfish::render::{LightSelection, ViewRays, VolumeSampling};

/// Everything whose randomness could depend on the order of work: media, opacity, motion, textures, many lights.
pub fn scene(texture: &Path) -> String {
    let texture = texture.display();
    let grid = shuffled_grid(
        "g",
        "\"rgb sigma_a\" [0.1 0.2 0.4] \"rgb sigma_s\" [2 1.5 1] \"float g\" 0.4 \"rgb Le\" [0.1 0.1 0.1]",
    );
    format!(
        "LightSource \"point\" \"rgb I\" [6 3 2] \"point3 from\" [-1 2 -2]
         LightSource \"infinite\" \"rgb L\" [0.2 0.2 0.3]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [8 6 4] Translate 1 1.6 0 Shape \"sphere\" \"float radius\" 0.2 AttributeEnd
         Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{texture}\"
         Texture \"holes\" \"float\" \"imagemap\" \"string filename\" \"{texture}\"
         AttributeBegin Translate 0 -1 0 Rotate 90 1 0 0 Material \"diffuse\" \"texture reflectance\" \"t\"
         Shape \"trianglemesh\" \"point3 P\" [-3 -3 0 3 -3 0 3 3 0 -3 3 0] \"point2 uv\" [0 0 4 0 4 4 0 4] \"integer indices\" [0 1 2 0 2 3] AttributeEnd
         AttributeBegin Translate 0 0 -1.5 Material \"diffuse\" Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 0 -1 0 0 1 0 -1 1 0]
         \"point2 uv\" [0 0 1 0 1 1 0 1] \"integer indices\" [0 1 2 0 2 3] \"texture alpha\" \"holes\" AttributeEnd
         AttributeBegin ActiveTransform EndTime Translate 0.4 0.3 0 Rotate 40 0 1 0 ActiveTransform All
         Material \"conductor\" \"float roughness\" 0.2 Shape \"sphere\" \"float radius\" 0.5 AttributeEnd
         AttributeBegin Material \"coateddiffuse\" Translate 1 -0.5 0 Shape \"sphere\" \"float radius\" 0.4 AttributeEnd
         {grid}ObjectBegin \"o\" {} ObjectEnd
         ObjectInstance \"o\"
         AttributeBegin Translate 0.5 0.5 0 Scale 0.5 0.5 0.5 ObjectInstance \"o\" AttributeEnd\n",
        boundary("g", "", CUBE)
    )
}

/// Lights enough that there is something to learn about them: some below the floor, some in the sphere.
pub fn crowd() -> String {
    let lamp = |i: i32| {
        let (x, y, z) = (0.5 * f64::from(i % 7) - 1.5, 0.6 * f64::from(i % 5) - 1.3, 0.5 * f64::from(i % 6) - 1.0);
        match i % 3 {
            0 => format!(
                "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [3 4 5] Translate {x} {y} {z} Shape \"sphere\" \"float radius\" 0.05 AttributeEnd\n"
            ),
            _ => format!("LightSource \"point\" \"rgb I\" [0.4 0.3 0.2] \"point3 from\" [{x} {y} {z}]\n"),
        }
    };
    (0..40).map(lamp).collect()
}

/// A picture with a few levels of grey and colour.
pub fn picture(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("picture.png");
    let image =
        image::RgbImage::from_fn(16, 16, |x, y| image::Rgb([(x * 16) as u8, (y * 16) as u8, ((x ^ y) * 16) as u8]));
    image.save(&path).expect("the picture can be written");
    path
}

fn render(options: &Options) -> ChannelImage {
    render_with("", options)
}

/// With more in the scene.
fn render_with(more: &str, options: &Options) -> ChannelImage {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let world = format!("{more}{}", scene(&picture(folder.path())));
    // Three tiles by three, the last ones cut.
    let shot = Shot { from: [0.0, 0.6, -4.5], to: [0.0, 0.1, 0.0], fov: 45.0, size: 40, depth: 4 };
    let outcome = shot.render(&world, options);
    assert_eq!(outcome.film.rejected().0, 0);
    outcome.film.channels()
}

/// Compares bit by bit; says where the first difference is.
#[track_caller]
pub fn same_bits(what: &str, a: &ChannelImage, b: &ChannelImage) {
    assert_eq!(a.bounds, b.bounds);
    assert_eq!(a.channels.len(), b.channels.len());
    for ((name, a), (_, b)) in a.channels.iter().zip(&b.channels) {
        let differs = a.iter().zip(b).position(|(x, y)| x.to_bits() != y.to_bits());
        assert_eq!(differs, None, "{what}: channel {name} differs");
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let one = render(&Options { spp: 8, threads: 1, ..Options::default() });
    for threads in [2, 3] {
        same_bits(&format!("{threads} threads"), &one, &render(&Options { spp: 8, threads, ..Options::default() }));
    }
    let native = Options { spp: 4, backend: lanternfish::geometry::Backend::Native, ..Options::default() };
    same_bits("native", &render(&Options { threads: 1, ..native.clone() }), &render(&Options { threads: 3, ..native }));
}

/// Points, what they learn in six passes, the tree and its draws, resampling: none of it depends on who comes first.
#[test]
fn threads_do_not_change_a_bit_of_what_is_chosen_or_learned() {
    let base = Options { spp: 32, ..Options::default() };
    let points = |gathering, visibility| Options {
        lights: LightSelection::CachePoints,
        cache: CacheSettings { gathering, visibility, ..CacheSettings::default() },
        ..base.clone()
    };
    let ways = [
        ("tree", Options { lights: LightSelection::Tree, ..base.clone() }),
        // Beside a selector, and given up or not by what the first passes show.
        (
            "in-scatter",
            Options { lights: LightSelection::Optimal, volume_sampling: VolumeSampling::Both, ..base.clone() },
        ),
        ("auto", base.clone()),
        ("clusters", points(Gathering::Hierarchy, VisibilityRule::Clusters)),
        (
            "lists, resampled",
            Options { light_candidates: Some(4), ..points(Gathering::Lists, VisibilityRule::Threshold) },
        ),
    ];
    let crowd = crowd();
    let images = ways.map(|(what, way)| {
        let one = render_with(&crowd, &Options { threads: 1, ..way.clone() });
        for threads in [2, 3] {
            let several = render_with(&crowd, &Options { threads, ..way.clone() });
            same_bits(&format!("{what}, {threads} threads"), &one, &several);
        }
        one
    });
    // Each chooses in its own way, and learning is not idle.
    let idle = render_with(&crowd, &points(Gathering::Hierarchy, VisibilityRule::Off));
    for (a, b) in
        [(0, 1), (1, 2), (2, 3), (3, 4)].map(|(a, b)| (&images[a], &images[b])).into_iter().chain([(&images[3], &idle)])
    {
        assert!(a.channel("R") != b.channel("R"));
    }
}

#[test]
fn seeds_make_different_images() {
    let (a, b) =
        (render(&Options { spp: 2, ..Options::default() }), render(&Options { spp: 2, seed: 2, ..Options::default() }));
    // Pixels that see nothing but the sky have no variance, and rightly the same value.
    let noisy = a.channel("variance.R").expect("the variance");
    let (a, b) = (a.channel("R").expect("the beauty"), b.channel("R").expect("the beauty"));
    let (mut same, mut count) = (0, 0);
    for ((x, y), _) in a.iter().zip(b).zip(noisy).filter(|(_, v)| **v > 0.0) {
        same += usize::from(x == y);
        count += 1;
    }
    assert!(count > 500 && same < count / 100, "{same} of {count} pixels are the same");
}

#[test]
fn crops_are_cut_from_the_same_image() {
    // What cache points learn, where in-scatter sampling pays and which camera rays are split depends on what is seen.
    let (volume_sampling, view_rays) = (VolumeSampling::Null, ViewRays::Off);
    let base = Options { spp: 8, volume_sampling, view_rays, ..Options::default() };
    let whole = render(&base);
    // Not along the borders of tiles.
    let film = FilmOverrides { crop: Some([0.25, 0.7, 0.175, 0.9]), ..FilmOverrides::default() };
    let part = render(&Options { film, ..base });
    assert!(part.bounds.area() < whole.bounds.area() / 2);
    for ((name, a), (_, b)) in whole.channels.iter().zip(&part.channels) {
        for pixel in part.bounds.pixels() {
            let (x, y) = (a[whole.bounds.index(pixel)], b[part.bounds.index(pixel)]);
            assert_eq!(x.to_bits(), y.to_bits(), "{name} at {pixel:?}: {x} and {y}");
        }
    }
}
