//! Embree and the native backend render the same image: at equal seeds they differ by rounding alone.

#![cfg(feature = "embree")]

use crate::common::{
    CUBE, Options, Shot, View, boundary, difference, image_mean, prepare_text, render_job, shuffled_grid,
};
use lanternfish::geometry::recording::RecordingTracer;
use lanternfish::geometry::{Backend, Tracer};

fn compare(name: &str, shot: &Shot, world: &str) {
    let render = |backend| shot.render(world, &Options { spp: 64, backend, ..Options::default() });
    let (embree, native) = (render(Backend::Embree), render(Backend::Native));
    let rmse = difference(&embree.film, &native.film);
    let (mean, error) = image_mean(&embree.film);
    println!("{name}: relative RMSE {rmse:.2e}; mean {:.4} ± {:.4}", mean[0], error[0]);
    assert!(mean.iter().all(|m| *m > 0.0), "{name}: black");
    assert!(rmse < 1e-3, "{name}: relative RMSE {rmse:e}");
}

fn shot() -> Shot {
    Shot { from: [0.0, 0.8, -5.0], to: [0.0, 0.1, 0.0], fov: 45.0, size: 32, depth: 5 }
}

const LIGHTS: &str = "LightSource \"point\" \"rgb I\" [6 5 4] \"point3 from\" [-1 2.5 -2]
    LightSource \"infinite\" \"rgb L\" [0.2 0.2 0.3]
    AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [8 6 4] \"bool twosided\" true
    Shape \"trianglemesh\" \"point3 P\" [-1 2 -1 1 2 -1 1 2 1 -1 2 1] \"integer indices\" [0 1 2 0 2 3] AttributeEnd\n";
const FLOOR: &str = "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]
    Shape \"trianglemesh\" \"point3 P\" [-5 -1 -5 5 -1 -5 5 -1 5 -5 -1 5] \"integer indices\" [0 2 1 0 3 2] AttributeEnd\n";

#[test]
fn surfaces_instances_and_motion() {
    let world = format!(
        "{LIGHTS}{FLOOR}ObjectBegin \"o\" Material \"diffuse\" \"rgb reflectance\" [0.3 0.6 0.4] Scale 0.3 0.3 0.3 {CUBE}
         Material \"dielectric\" Translate 0 2.2 0 {CUBE} ObjectEnd
         AttributeBegin Translate -1 -0.5 0 Rotate 30 0 1 0 ObjectInstance \"o\" AttributeEnd
         AttributeBegin Translate 1 0 0.5 Scale 1 -1.3 0.7 Rotate 50 1 1 0 ObjectInstance \"o\" AttributeEnd
         AttributeBegin ActiveTransform EndTime Translate 0.3 0.5 0 Rotate 60 0 1 1 ActiveTransform All ObjectInstance \"o\" AttributeEnd
         AttributeBegin Translate 0 0 -1.2 Material \"conductor\" \"float roughness\" 0.1 Scale 0.2 0.2 0.2 {} \"float alpha\" 0.5 AttributeEnd\n",
        CUBE.trim_end()
    );
    compare("surfaces", &shot(), &world);
}

#[test]
fn volumes() {
    let world = format!(
        "{LIGHTS}{FLOOR}{}MakeNamedMedium \"h\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.1 0.2 0.1] \"rgb sigma_s\" [1 0.8 0.6] \"float g\" 0.6
         {}{}",
        shuffled_grid("g", "\"rgb sigma_a\" [0.1 0.2 0.4] \"rgb sigma_s\" [4 3 2] \"float g\" 0.3 \"rgb Le\" [0.2 0.1 0.1]"),
        boundary("g", "", &format!("Scale 0.9 0.9 0.9 {CUBE}")),
        boundary("h", "", "Translate 0.5 0.3 0 Shape \"sphere\" \"float radius\" 0.8"),
    );
    compare("volumes", &shot(), &world);
}

#[test]
fn quadrics_and_patches() {
    let world = format!(
        "{LIGHTS}{FLOOR}AttributeBegin Translate -0.9 -0.3 0 Material \"dielectric\" Shape \"sphere\" \"float radius\" 0.7 AttributeEnd
         AttributeBegin Translate 0.9 -0.4 0 Material \"coateddiffuse\" Rotate 40 1 0 1 Shape \"sphere\" \"float radius\" 0.6 \"float zmax\" 0.3 AttributeEnd
         AttributeBegin Translate 0 0.5 0.8 Material \"conductor\" \"float roughness\" 0.2 Rotate 30 1 0 0 Shape \"disk\" \"float radius\" 0.6 \"float innerradius\" 0.2 AttributeEnd
         AttributeBegin Material \"diffuse\" Shape \"bilinearmesh\" \"point3 P\" [-0.4 -1 -1  0.4 -0.8 -1.2  -0.3 -0.2 -1  0.5 -0.3 -0.6] AttributeEnd\n"
    );
    compare("quadrics", &shot(), &world);
}

/// What a benchmark records is what a render does, in a scene without media and in one with a fog.
#[test]
fn a_recorder_changes_nothing() {
    let lamp = "LightSource \"point\" \"point3 from\" [0 3 -2] Shape \"sphere\" \"float radius\" 0.5\n";
    let fog = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.1 0.1 0.1]\n".to_owned()
        + &boundary("fog", "", CUBE);
    for world in [lamp.to_owned(), lamp.to_owned() + &fog] {
        let text = shot().text(&world);
        let options = Options::default();
        let plain = render_job(&mut prepare_text(&text, &options), &options);
        let mut job = prepare_text(&text, &options);
        job.world.tracer = Tracer::Recording(Box::new(RecordingTracer::new(job.world.tracer)));
        let recorded = render_job(&mut job, &options);
        assert_eq!(recorded.counters, plain.counters);
        assert_eq!(plain.counters.boundary_rays > 0, world.len() > lamp.len());
        let Tracer::Recording(recorder) = job.world.tracer else { unreachable!("it was put there") };
        let asked = recorder.finish().1.len() as u64;
        assert_eq!(asked, plain.counters.closest_rays + plain.counters.shadow_rays);
    }
}
