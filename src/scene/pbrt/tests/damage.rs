//! No text brings the parser down; how fast it reads.

use proptest::prelude::*;

use super::*;

#[test]
fn deep_nesting_is_limited_not_fatal() {
    let deep = format!("WorldBegin {}", "AttributeBegin ".repeat(70_000));
    assert!(text_error(&deep).contains("blocks within each other"));
    let many =
        format!("WorldBegin Shape \"a\" {}", (0..5000).map(|i| format!("\"float p{i}\" 1 ")).collect::<String>());
    assert!(text_error(&many).contains("4096 parameters"));
}

/// A scene that uses most of the grammar: the start for mutations.
const SAMPLE: &str = r#"Option "seed" 3
LookAt 0 -6 2 0 0 1 0 0 1
Camera "perspective" "float fov" [ 40 ]
Film "rgb" "integer xresolution" 64 "string filename" "a\"b.exr"
ActiveTransform EndTime Rotate 30 0 0 1 ActiveTransform All
WorldBegin
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [.1 .2 .3]
Texture "t" "spectrum" "constant" "rgb value" [1 0.5 0]
AttributeBegin
  Attribute "shape" "float radius" 2
  AreaLightSource "diffuse" "blackbody L" 3000 "bool twosided" true
  Material "diffuse" "texture reflectance" "t"
  MediumInterface "fog" ""
  Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]
AttributeEnd
ObjectBegin "o" Shape "sphere" ObjectEnd
Scale 2 2 2 ObjectInstance "o"
NamedMaterial "m" Shape "disk"
MakeNamedMaterial "m" "string type" "dielectric" "spectrum eta" "glass-BK7"
LightSource "distant" "spectrum L" [400 1 700 2] "point3 from" [0 0 1]
"#;

fn survives(bytes: &[u8]) {
    let files = Files::new(&[("main.pbrt", bytes)]);
    let (scene, sources, _) = files.load();
    if let Err(error) = scene {
        // Rendering the place must not fail either.
        let _ = error.one_line(&sources);
        if let Some(span) = error.span {
            assert!(span.line >= 1 && span.column >= 1);
            let _ = sources.line(span.file, span.line);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        survives(&bytes);
    }

    #[test]
    fn mutated_scenes_never_panic(
        cut in any::<prop::sample::Index>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>(), 0..4u8), 1..8),
    ) {
        let mut bytes = SAMPLE.as_bytes().to_vec();
        for (place, other, value, kind) in edits {
            let (i, j) = (place.index(bytes.len()), other.index(bytes.len()));
            match kind {
                0 => bytes[i] = value,
                1 => bytes.swap(i, j),
                2 => { let part = bytes[i.min(j)..i.max(j)].to_vec(); bytes.splice(i..i, part); }
                _ => { bytes.drain(i.min(j)..(i.max(j)).min(i.min(j) + 9)); }
            }
            if bytes.is_empty() { bytes.push(b' '); }
        }
        if cut.index(3) == 0 { let end = cut.index(bytes.len()); bytes.truncate(end); }
        survives(&bytes);
    }

    #[test]
    fn shuffled_words_never_panic(words in prop::collection::vec(0..64usize, 0..60)) {
        let all: Vec<&str> = SAMPLE.split_ascii_whitespace().collect();
        let text: Vec<&str> = words.into_iter().map(|w| all[w % all.len()]).collect();
        survives(format!("WorldBegin {}", text.join(" ")).as_bytes());
    }
}

#[test]
fn the_sample_is_valid() {
    assert_eq!(scene(SAMPLE).shapes.len(), 2);
}

/// Prints how fast inline meshes are read: `cargo test --release --lib scene::pbrt::tests::damage::speed -- --ignored
/// --nocapture`.
#[test]
#[ignore = "a measurement"]
fn speed() {
    use std::fmt::Write;
    let mut main = String::from("WorldBegin Shape \"trianglemesh\" \"point3 P\" [");
    for i in 0..3_000_000u32 {
        let _ = write!(main, " {:.6}", f64::from(i.wrapping_mul(2_654_435_761)) * 1e-7 - 200.0);
    }
    main.push_str("] \"integer indices\" [");
    for i in 0..3_000_000u32 {
        let _ = write!(main, " {}", i % 1_000_000);
    }
    main.push(']');
    let files = text(&main);
    let start = std::time::Instant::now();
    assert_eq!(files.load().0.unwrap().shapes[0].entity.params.vec3s("P").unwrap().len(), 1_000_000);
    let seconds = start.elapsed().as_secs_f64();
    println!("{:.1} MB in {seconds:.3} s: {:.0} MB/s", main.len() as f64 * 1e-6, main.len() as f64 * 1e-6 / seconds);
}
