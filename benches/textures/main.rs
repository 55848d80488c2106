//! What it costs to have less memory than images on surfaces take: a corridor full of pictures, rendered with enough memory for all of them, with a tenth of
//! that, and with a tenth where the tiles are there from an earlier render.
//!
//!     cargo bench --bench textures -- [--pictures N] [--texels N] [--size WxH] [--spp N] [--levels auto|finest] [--rounds N] [--seed N]
//!     cargo bench --bench textures -- --large [--limit MIB] [--pictures N] [--texels N] [--size WxH] [--spp N] [--seed N]
//!
//! Each render is a process of its own; the three take turns, and whoever goes first in one round goes last in the next. Ratios are means over the rounds with 95 %
//! confidence intervals. `--levels finest` looks everything up in the images themselves, as if there were no levels of detail: then what a render looks at does not
//! fit into a tenth by far. `--large` renders once, pictures that take 20 GB within `--limit` (2 GiB unless stated) of memory for the whole process; tiles of as
//! much go to the temporary folder meanwhile.

#[path = "../common/mod.rs"]
mod common;
mod gallery;
mod run;

use std::path::Path;

use common::{argument, flag, text_argument};
use gallery::Gallery;
use lanternfish::bench::ratio::Ratio;
use lanternfish::film::exr::read_exr_layers;
use run::{Cost, fail, render};
use serde::Serialize;

/// What is compared, the first being what others are compared with.
const WAYS: [&str; 3] = ["enough", "a tenth", "a tenth, tiles kept"];

#[derive(Serialize)]
struct Report {
    command: String,
    seed: u32,
    pictures: u32,
    texels: u32,
    /// Of all pictures at all levels.
    bytes: u64,
    results: Vec<Measured>,
}

#[derive(Serialize)]
struct Measured {
    way: &'static str,
    /// `--texture-memory`, in bytes.
    limit: u64,
    /// In each round.
    costs: Vec<Cost>,
    /// Of seconds, from start to end, of seconds of tracing, and of processor seconds, to those where memory is enough.
    ratios: Option<[Ratio; 3]>,
    is_same: Option<bool>,
}

fn main() {
    let is_large = flag("large");
    let (pictures, texels) = if is_large { (300, 4096) } else { (64, 512) };
    let gallery = Gallery {
        pictures: argument("pictures", pictures).max(1) as u32,
        texels: argument("texels", texels).clamp(1, 16384) as u32,
        seed: argument("seed", 1) as u32,
    };
    println!("{}\nseed {}", common::command(), gallery.seed);
    let (pictures, texels) = (gallery.pictures, gallery.texels);
    println!(
        "{pictures} pictures of {texels} × {texels} RGB texels: {} MiB with all levels",
        mebibytes(gallery.bytes())
    );
    let folder = tempfile::tempdir().unwrap_or_else(|error| fail(&format!("no temporary folder: {error}")));
    let scene = gallery.write(folder.path());
    let scene = scene.unwrap_or_else(|error| fail(&format!("the gallery cannot be written: {error}")));
    let results =
        if is_large { vec![large(&gallery, folder.path(), &scene)] } else { compare(&gallery, folder.path(), &scene) };
    let (command, seed, bytes) = (common::command(), gallery.seed, gallery.bytes());
    common::write_json("bench-textures", &Report { command, seed, pictures, texels, bytes, results });
}

/// What the command line says of every render.
fn common_arguments(spp: u64) -> Vec<String> {
    let levels = text_argument("levels").unwrap_or_else(|| "auto".to_owned());
    let size = text_argument("size").unwrap_or_else(|| "640x360".to_owned());
    let spp = argument("spp", spp).to_string();
    let seed = argument("seed", 1).to_string();
    ["--texture-levels", &levels, "--resolution", &size, "--spp", &spp, "--seed", &seed].map(str::to_owned).into()
}

fn compare(gallery: &Gallery, folder: &Path, scene: &Path) -> Vec<Measured> {
    let arguments = common_arguments(16);
    let limits = [gallery.bytes(), gallery.bytes() / 10, gallery.bytes() / 10];
    let tiles = folder.join("tiles");
    let outputs = ["enough.exr", "tenth.exr", "kept.exr"].map(|name| folder.join(name));
    let one = |way: usize| {
        let limit = format!("{}B", limits[way]);
        let tiles = tiles.to_string_lossy();
        let mut all: Vec<&str> = arguments.iter().map(String::as_str).collect();
        all.extend(["--texture-memory", &limit]);
        if way == 2 {
            all.extend(["--texture-cache", &tiles]);
        }
        render(scene, &outputs[way], &all)
    };
    // Cuts the tiles that the third finds, and has all files in the system's memory.
    one(2);
    let mut costs: [Vec<Cost>; 3] = Default::default();
    for round in 0..argument("rounds", 5).max(1) {
        let order = if round % 2 == 0 { [0, 1, 2] } else { [2, 1, 0] };
        order.into_iter().for_each(|way| costs[way].push(one(way)));
    }
    let ratios = |way: usize| {
        let of = |seconds: fn(&Cost) -> f64| {
            Ratio::of(costs[way].iter().zip(&costs[0]).map(|(cost, enough)| seconds(cost) / seconds(enough)))
        };
        (way > 0).then(|| [of(|cost| cost.seconds), of(|cost| cost.rendering_seconds), of(|cost| cost.cpu_seconds)])
    };
    let expected = pixels(&outputs[0]);
    let measured = (0..3).map(|way| Measured {
        way: WAYS[way],
        limit: limits[way],
        costs: costs[way].clone(),
        ratios: ratios(way),
        is_same: Some(pixels(&outputs[way]) == expected),
    });
    let measured: Vec<Measured> = measured.collect();
    println!("\nmemory               limit MiB  held MiB  hit rate %  tiles read  peak MiB  seconds  tracing");
    measured.iter().for_each(Measured::print);
    println!("\nratios to enough     seconds                 tracing                 processor seconds       image");
    for Measured { way, ratios, is_same, .. } in &measured {
        if let Some(ratios) = ratios {
            let [all, tracing, cpu] = ratios.map(|ratio| ratio.show());
            let same = if *is_same == Some(true) { "the same to the bit" } else { "ANOTHER" };
            println!("{way:20} {all:23} {tracing:23} {cpu:23} {same}");
        }
    }
    measured
}

fn large(gallery: &Gallery, folder: &Path, scene: &Path) -> Measured {
    let limit = argument("limit", 2048) << 20;
    let tiles = folder.join("tiles");
    let [whole, images] = [limit, limit / 4 * 3].map(|bytes| format!("{bytes}B"));
    let kept = tiles.to_string_lossy();
    let mut arguments = common_arguments(16);
    let memory = ["--memory-limit", &whole, "--texture-memory", &images, "--texture-cache", &kept];
    arguments.extend(memory.map(str::to_owned));
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let cost = render(scene, &folder.join("large.exr"), &arguments);
    let files = std::fs::read_dir(&tiles).map(|files| files.flatten().collect()).unwrap_or_else(|_| vec![]);
    let size: u64 = files.iter().filter_map(|file| file.metadata().ok()).map(|metadata| metadata.len()).sum();
    println!(
        "{} of {} pictures were looked at; their tiles take {} MiB",
        files.len(),
        gallery.pictures,
        mebibytes(size)
    );
    println!("\nmemory               limit MiB  held MiB  hit rate %  tiles read  peak MiB  seconds  tracing");
    let measured = Measured { way: "large", limit: limit / 4 * 3, costs: vec![cost], ratios: None, is_same: None };
    measured.print();
    let peak = measured.costs[0].peak_memory;
    println!("the process had at most {} MiB of {} in memory", mebibytes(peak), mebibytes(limit));
    assert!(peak <= limit, "that is more than it was allowed");
    measured
}

impl Measured {
    fn print(&self) {
        let mean = |of: fn(&Cost) -> f64| self.costs.iter().map(of).sum::<f64>() / self.costs.len() as f64;
        let peak = self.costs.iter().map(|cost| cost.peak_memory).max().unwrap_or(0);
        let cache = self.costs.last().and_then(|cost| cost.cache);
        let [held, rate, reads] = cache.map_or([(); 3].map(|()| "–".to_owned()), |cache| {
            [mebibytes(cache.held), format!("{:.3}", 100.0 * cache.hit_rate), cache.reads.to_string()]
        });
        let (limit, peak) = (mebibytes(self.limit), mebibytes(peak));
        let (seconds, tracing) = (mean(|cost| cost.seconds), mean(|cost| cost.rendering_seconds));
        let way = self.way;
        println!("{way:20} {limit:>9}  {held:>8}  {rate:>10}  {reads:>10}  {peak:>8}  {seconds:>7.2}  {tracing:>7.2}");
    }
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / f64::from(1 << 20))
}

/// All channels of an image, bit by bit.
fn pixels(path: &Path) -> Vec<(String, Vec<u32>)> {
    let image = read_exr_layers(path).unwrap_or_else(|error| fail(&error.to_string()));
    image.channels.into_iter().map(|(name, values)| (name, values.into_iter().map(f32::to_bits).collect())).collect()
}
