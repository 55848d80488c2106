//! How often paths through haze ask cache points: look-ups, and vertices that made do with the one of the vertex before, a path.

use std::fmt::Write as _;
use std::sync::atomic::AtomicBool;

use lanternfish::render::{Budget, LightSelection, RenderSettings, Silent, VolumeSampling};
use serde::Serialize;

use super::scene::prepare;

#[derive(Serialize)]
pub struct LookupResult {
    pub sampling: VolumeSampling,
    pub lookups_per_path: f64,
    pub reuses_per_path: f64,
    pub medium_vertices_per_path: f64,
}

/// A hundred lamps in a ball of haze with a floor.
fn lamps() -> String {
    let mut text = "LookAt 0 1 -5 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 50
        Film \"rgb\" \"integer xresolution\" 64 \"integer yresolution\" 64
        Integrator \"volpath\" \"integer maxdepth\" 5\nWorldBegin
        MakeNamedMedium \"haze\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.01 0.01 0.02] \"rgb sigma_s\" [0.2 0.2 0.3] \"float g\" 0.5
        AttributeBegin MediumInterface \"haze\" \"\" Material \"interface\" Shape \"sphere\" \"float radius\" 4 AttributeEnd
        AttributeBegin Translate 0 -1 0 Rotate 90 1 0 0 Material \"diffuse\" Shape \"disk\" \"float radius\" 4 AttributeEnd\n"
        .to_owned();
    for i in 0..100 {
        let [x, y, z] = [i % 10, i / 10, i * 37 % 100].map(f64::from);
        let [x, y, z] = [0.4 * x - 1.8, 0.2 * y - 0.8, 0.03 * z - 1.0];
        writeln!(text, "LightSource \"point\" \"rgb I\" [1 1 1] \"point3 from\" [{x} {y} {z}]").expect("strings grow");
    }
    text
}

pub fn measure(seed: u64) -> Vec<LookupResult> {
    println!("look-ups of cache points, a hundred lamps in haze (extinction 0.21 to 0.32), 16 samples a pixel:");
    let samplings = [VolumeSampling::Null, VolumeSampling::Both, VolumeSampling::Auto];
    samplings
        .map(|sampling| {
            let settings = RenderSettings {
                lights: LightSelection::CachePoints,
                volume_sampling: sampling,
                ..RenderSettings::default()
            };
            let mut job = prepare(&lamps(), &settings);
            let counters = job.render(seed as u32, Budget::Samples(16), &AtomicBool::new(false), &Silent).counters;
            let a_path = |count: u64| count as f64 / counters.paths as f64;
            let result = LookupResult {
                sampling,
                lookups_per_path: a_path(counters.cache_lookups),
                reuses_per_path: a_path(counters.cache_reuses),
                medium_vertices_per_path: a_path(counters.medium_vertices),
            };
            println!(
                "  {sampling:?}: {:.2} look-ups and {:.2} reuses a path, which has {:.2} vertices in haze",
                result.lookups_per_path, result.reuses_per_path, result.medium_vertices_per_path
            );
            result
        })
        .into()
}
