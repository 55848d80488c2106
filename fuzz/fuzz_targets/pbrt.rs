//! Scene text through the whole reader: tokens, parameters, files that include each other, packed files, spectrum files, and what looks for oversights.
//!
//! A file that begins as gzip does is the scene by itself. Any other is cut at bytes of 0 into the scene, two files that it may include as "a" and "b",
//! and a spectrum file "s".

#![no_main]

use std::sync::OnceLock;

use lanternfish::scene::lint::lint;
use lanternfish::scene::{Sources, Warnings, load};
use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;

const NAMES: [&str; 4] = ["scene.pbrt", "a", "b", "s"];

fuzz_target!(|data: &[u8]| {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| TempDir::new().expect("a folder")).path();
    let is_packed = data.starts_with(&[0x1f, 0x8b]);
    let mut parts = data.splitn(if is_packed { 1 } else { NAMES.len() }, |&byte| byte == 0);
    for name in NAMES {
        std::fs::write(folder.join(name), parts.next().unwrap_or_default()).expect("it is written");
    }
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    match load(&folder.join(NAMES[0]), &mut sources, &mut warnings) {
        Ok(scene) => {
            lint(&scene, &mut warnings);
            scene.film.params.warn_unused(&mut warnings);
            assert!(scene.named_files().all(|file| !file.as_os_str().is_empty()));
        }
        Err(error) => {
            // The excerpt that people are shown.
            let shown = error.span.map(|span| sources.line(span.file, span.line).len());
            assert!(
                !error.one_line(&sources).is_empty() && shown.is_none_or(|length| length <= data.len().max(1 << 20))
            );
        }
    }
});
