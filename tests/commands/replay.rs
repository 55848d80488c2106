//! A sample that is replayed is the sample of the image, whatever was learned before it and however many threads there are.
//!
//! What the image got is the difference of the sums over one sample more and one less. Single precision in the image leaves that 1e-5 of the
//! pixel's sum. Nothing here is left to chance.

use std::sync::atomic::AtomicBool;

use crate::common::{CUBE, Options, boundary, grid_medium, prepare_text, render_text};
use crate::program::Folder;
use lanternfish::film::RejectedSample;
use lanternfish::integrator::record::Event;
use lanternfish::render::{LightSelection, Replay, ReplayError, Silent, VolumeSampling};

/// 20 × 18 pixels, so four tiles: lamps and a veil over a floor, and smoke where `smoke` says so.
fn scene(smoke: bool) -> String {
    let lights: String = (0..40)
        .map(|i| {
            let (x, z) = (f64::from(i % 8) - 3.5, f64::from(i / 8) - 2.0);
            format!("LightSource \"point\" \"rgb I\" [1 2 {}] \"point3 from\" [{x} 2 {z}]\n", 0.1 * f64::from(i))
        })
        .collect();
    let smoke = if smoke {
        let values: Vec<String> = (0..64).map(|i| format!("{:.3}", f64::from(i * 37 % 64) / 63.0)).collect();
        grid_medium(4, &values.join(" "), "\"rgb sigma_a\" [0.1 0.2 0.3] \"rgb sigma_s\" [1 1 1]")
            + &boundary("g", "", CUBE)
    } else {
        String::new()
    };
    format!(
        "LookAt 0 1 -6  0 0 0  0 1 0
         Camera \"perspective\" \"float fov\" 40
         Film \"rgb\" \"integer xresolution\" 20 \"integer yresolution\" 18
         PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5
         Sampler \"zsobol\" Integrator \"volpath\" \"integer maxdepth\" 4
         WorldBegin\n{lights}{smoke}
         Material \"diffuse\" \"rgb reflectance\" [0.7 0.5 0.3]
         Shape \"trianglemesh\" \"point3 P\" [-5 -1 -5  5 -1 -5  5 -1 5  -5 -1 5] \"integer indices\" [0 1 2 0 2 3]
         Translate 0.5 0 -1.5 Shape \"sphere\" \"float radius\" 0.3\n"
    )
}

fn replay(text: &str, options: &Options, pixel: [u32; 2], sample: u32) -> Result<Replay, ReplayError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().expect("threads");
    pool.install(|| {
        let mut job = prepare_text(text, options);
        let sample = RejectedSample { pixel, sample };
        job.replay(options.seed, sample, &[], Some(options.spp), &AtomicBool::new(false), &Silent)
    })
}

/// The sum of a pixel's samples.
fn sum(text: &str, options: &Options, pixel: [u32; 2]) -> [f64; 3] {
    let image = render_text(text, options).film.beauty();
    let place = (pixel[1] as usize * image.width + pixel[0] as usize) * 3;
    std::array::from_fn(|c| f64::from(image.pixels[place + c]) * f64::from(options.spp))
}

#[test]
fn a_replayed_sample_is_the_images() {
    let (auto, cache) = (LightSelection::Auto, LightSelection::CachePoints);
    let kinds = [
        ("surfaces", false, auto, VolumeSampling::Auto),
        ("surfaces, learned", false, cache, VolumeSampling::Auto),
        ("smoke", true, LightSelection::Uniform, VolumeSampling::Null),
        ("smoke, learned", true, cache, VolumeSampling::Auto),
        ("smoke, points drawn", true, auto, VolumeSampling::Both),
        ("smoke, what pays is found out", true, auto, VolumeSampling::Auto),
    ];
    for (what, smoke, lights, volume_sampling) in kinds {
        let text = scene(smoke);
        let options = Options { lights, volume_sampling, ..Options::default() };
        for (pixel, sample) in [([10, 9], 0), ([3, 12], 5), ([17, 14], 9), ([9, 17], 11)] {
            let [fewer, more] = [sample, sample + 1]
                .map(|spp| if spp == 0 { [0.0; 3] } else { sum(&text, &Options { spp, ..options.clone() }, pixel) });
            let replays = [1, 2, 3].map(|threads| {
                let options = Options { spp: sample + 1, threads, ..options.clone() };
                replay(&text, &options, pixel, sample).expect("the sample is there")
            });
            let value = replays[0].result.beauty.0.to_array();
            for c in 0..3 {
                let (got, expected) = (f64::from(value[c]), more[c] - fewer[c]);
                let allowed = 1e-5 * more[c] + 1e-9;
                assert!((got - expected).abs() <= allowed, "{what}, {pixel:?} {sample}: {got} instead of {expected}");
            }
            for replay in &replays {
                assert_eq!(replay.result, replays[0].result, "{what}: threads have a say in it");
                assert_eq!(replay.record, replays[0].record, "{what}");
                let last = replay.record.events.iter().rev().find_map(|event| match event {
                    Event::End { so_far } => Some(*so_far),
                    _ => None,
                });
                assert_eq!(last, Some(replay.result.beauty), "{what}: the path's end is its value");
                assert_eq!(replay.record.first_fault, None);
            }
        }
    }
}

#[test]
fn samples_that_are_not_there_are_named() {
    let text = scene(false);
    let options = Options { spp: 4, ..Options::default() };
    assert_eq!(replay(&text, &options, [20, 3], 0).err(), Some(ReplayError::Pixel(20, 3)));
    assert_eq!(replay(&text, &options, [3, 3], 4).err(), Some(ReplayError::Sample { sample: 4, taken: 0..4 }));
}

#[test]
fn the_program_replays() {
    let folder = Folder::new("replay");
    folder.write("smoke.pbrt", scene(true));
    let run =
        folder.run(&["render", "--replay", "10,9,5", "smoke.pbrt", "--spp", "8", "--lights", "cache-points"]).code(0);
    for words in
        ["pixel 10,9 sample 5, of the pass that begins with sample 4", "value", "path:", "bounce 1", "end, with"]
    {
        assert!(run.out.contains(words), "{words} in\n{}", run.out);
    }
    assert!(!folder.path("smoke.exr").exists(), "no image is written");
    folder.run(&["render", "--replay", "10,9,8", "smoke.pbrt", "--spp", "8"]).code(2).says("there is no sample 8");
    folder.run(&["render", "--replay", "99,9,5", "smoke.pbrt", "--spp", "8"]).code(2).says("there is no pixel 99,9");
    folder.run(&["render", "--replay", "99,9", "smoke.pbrt"]).code(2);
    folder.run(&["render", "--passes", "1,1", "smoke.pbrt"]).code(2);
}
