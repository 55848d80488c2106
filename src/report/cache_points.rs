//! Cache points made visible: over the image, those that the camera sees, and all of them as a PLY file for viewers; coloured by radius,
//! from blue (small) to red (large).

use std::path::Path;

use glam::{Vec2, Vec3};
use ply_rs_bw::ply::{
    Addable, DefaultElement, ElementDef, Encoding, Ply, Property, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;

use crate::film::PixelBounds;
use crate::film::image::{Image, write_png};
use crate::geometry::camera::Camera;
use crate::geometry::{Ray, Tracer};
use crate::system::output::{OutputError, write_atomically};

/// Radius of a dot in pixels.
const DOT: f32 = 1.3;
/// What is left of the image under the dots.
const DIMMED: f32 = 0.35;
/// How much of the way to a point must be clear: one that lies on its surface must not be hidden by rounding.
const CLEAR: f32 = 0.999;

/// A cache point: where, in render space, and its radius.
type Point = (Vec3, f32);

/// Writes `beauty`, dimmed, with the points over it that `camera` sees.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_picture(
    path: &Path,
    beauty: &Image,
    bounds: PixelBounds,
    camera: &Camera,
    tracer: &Tracer,
    points: &[Point],
) -> Result<(), OutputError> {
    let mut image = beauty.clone();
    image.pixels.iter_mut().for_each(|value| *value *= DIMMED);
    let scale = RadiusScale::of(points);
    let mut visible: Vec<(f32, Vec2, f32)> =
        points.iter().filter_map(|&(p, radius)| seen(camera, tracer, p).map(|(far, at)| (far, at, radius))).collect();
    // The nearest are drawn last.
    visible.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, at, radius) in visible {
        let colour = scale.colour(radius);
        let span = |centre: f32| (centre - DOT).floor().max(0.0) as u32..=(centre + DOT).ceil().max(0.0) as u32;
        for y in span(at.y) {
            for x in span(at.x) {
                let middle = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                if bounds.contains([x, y]) && middle.distance(at) <= DOT {
                    let first = bounds.index([x, y]) * image.channels;
                    image.pixels[first..first + 3].copy_from_slice(&colour);
                }
            }
        }
    }
    write_png(path, &image, 0.0)
}

/// How far from the camera `p` is and where on the film, if surfaces leave the view free as the shutter opens. Media hide nothing.
fn seen(camera: &Camera, tracer: &Tracer, p: Vec3) -> Option<(f32, Vec2)> {
    let at = camera.project(p)?;
    let Ray { origin, time, opacity_seed, .. } = camera.ray(at, [0.5; 2], 0.0);
    let distance = p.distance(origin);
    let direction = (p - origin) / distance;
    let way = Ray { origin, direction, t_max: CLEAR * distance, time, opacity_seed };
    (!tracer.occluded(&way)).then_some((distance, at))
}

/// Writes the points as vertices with a colour and a property `radius`. Coordinates are those of render space: the camera is at the origin.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_ply(path: &Path, points: &[Point]) -> Result<(), OutputError> {
    let mut ply = Ply::<DefaultElement>::new();
    ply.header.encoding = Encoding::BinaryLittleEndian;
    let mut vertex = ElementDef::new("vertex".to_owned());
    for name in ["x", "y", "z", "radius"] {
        vertex.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(ScalarType::Float)));
    }
    for name in ["red", "green", "blue"] {
        vertex.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(ScalarType::UChar)));
    }
    ply.header.elements.add(vertex);
    let scale = RadiusScale::of(points);
    let vertices = points.iter().map(|&(p, radius)| {
        let mut element = DefaultElement::new();
        for (name, value) in [("x", p.x), ("y", p.y), ("z", p.z), ("radius", radius)] {
            element.insert(name.to_owned(), Property::Float(value));
        }
        for (name, value) in ["red", "green", "blue"].into_iter().zip(scale.colour(radius)) {
            element.insert(name.to_owned(), Property::UChar((value * 255.0) as u8));
        }
        element
    });
    ply.payload.insert("vertex".to_owned(), vertices.collect());
    write_atomically(path, |mut out| {
        Writer::new().write_ply(&mut out, &mut ply).map(drop).map_err(|error| error.to_string())
    })
}

/// Where a radius lies between the smallest and the largest, by logarithm.
struct RadiusScale {
    low: f32,
    range: f32,
}

impl RadiusScale {
    fn of(points: &[Point]) -> Self {
        let logs = points.iter().map(|(_, radius)| radius.max(f32::MIN_POSITIVE).ln());
        let (low, high) = logs.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        Self { low, range: (high - low).max(f32::MIN_POSITIVE) }
    }

    /// Linear RGB: blue, green, red.
    fn colour(&self, radius: f32) -> [f32; 3] {
        let t = ((radius.max(f32::MIN_POSITIVE).ln() - self.low) / self.range).clamp(0.0, 1.0);
        [(2.0 * t - 1.0).max(0.0), 1.0 - (2.0 * t - 1.0).abs(), (1.0 - 2.0 * t).max(0.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::image::{Encoding, read_image};
    use crate::render::{Job, RenderSettings, load};
    use crate::scene::{Sources, Warnings};

    #[test]
    fn colours_run_from_blue_to_red() {
        let scale = RadiusScale::of(&[(Vec3::ZERO, 0.01), (Vec3::ZERO, 1.0)]);
        assert_eq!(
            [0.01, 0.1, 1.0].map(|r| scale.colour(r).map(|c| (c * 10.0).round())),
            [[0.0, 0.0, 10.0], [0.0, 10.0, 0.0], [10.0, 0.0, 0.0]]
        );
        assert!(RadiusScale::of(&[(Vec3::ZERO, 0.0)]).colour(0.0).iter().all(|c| c.is_finite()));
    }

    /// A wall at z = 2 over the left half of the image, and a ball around the point to the right that only bounds a medium.
    #[test]
    fn walls_hide_points_and_media_do_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("scene.pbrt");
        let text = "Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 32 WorldBegin\n\
            Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 -9 2  -9 -9 2  -9 9 2  0 9 2]\n\
            MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" MediumInterface \"fog\" \"\" Material \"interface\"\n\
            Translate 2 0 4 Shape \"sphere\"";
        std::fs::write(&file, text).expect("a file");
        let mut warnings = Warnings::default();
        let (scene, timings) = load(&file, &mut Sources::default(), &mut warnings).expect("the scene is right");
        let job = Job::prepare(&scene, &RenderSettings::default(), timings, &mut warnings).expect("it can be built");
        let (camera, tracer) = (&job.camera, &job.world.tracer);
        let before = camera.ray(Vec2::new(8.5, 20.5), [0.5; 2], 0.0);
        let at = |z: f32| before.origin + before.direction * (z / before.direction.z);
        let other = camera.ray(Vec2::new(24.5, 20.5), [0.5; 2], 0.0);
        let in_fog = other.origin + other.direction * (4.0 / other.direction.z);
        let drawn = |p: Vec3| {
            let beauty = Image { width: 32, height: 32, channels: 3, pixels: vec![0.0; 32 * 32 * 3] };
            let picture = folder.path().join("points.png");
            write_picture(&picture, &beauty, job.film.bounds, camera, tracer, &[(p, 0.5)]).expect("it can be written");
            let lit =
                |x: usize| read_image(&picture, Encoding::Auto).expect("a picture").pixels[(20 * 32 + x) * 3 + 2] > 0.5;
            [lit(8), lit(24)]
        };
        assert_eq!([at(1.0), at(2.0), at(2.1), at(5.0)].map(|p| drawn(p)[0]), [true, true, false, false]);
        assert_eq!((drawn(in_fog), drawn(-in_fog)), ([false, true], [false; 2]));
    }

    #[test]
    fn points_come_back_from_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("points.ply");
        let points = [(Vec3::new(1.0, 2.0, 3.0), 0.5), (Vec3::NEG_ONE, 2.0)];
        write_ply(&path, &points).expect("it can be written");
        let mesh = crate::scene::ply::read(&path);
        let text = std::fs::read(&path).expect("it is there");
        assert!(text.starts_with(b"ply\n") && text.len() > 2 * 19, "{mesh:?}");
    }
}
