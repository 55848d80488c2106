//! Every directive and every parameter that pbrt-v4's file format documents: taken, or named in one clear line that says what is not done. None of
//! them is called unused or unknown, by `info --strict` or by a render.

use std::fmt::Write;
use std::sync::atomic::AtomicBool;

use lanternfish::render::{Budget, Job, RenderSettings, Silent, load};
use lanternfish::scene::lint::lint;
use lanternfish::scene::{Sources, Warnings};

use crate::program::{Folder, HEAD};

/// Files that the scenes name.
fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    let mesh = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float u\nproperty float v\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 -1 0 0 0\n1 -1 0 1 0\n1 1 0 1 1\n-1 1 0 0 1\n4 0 1 2 3\n";
    folder.write("m.ply", mesh).write("part.pbrt", "# nothing").write("s.spd", "400 1\n700 0.5\n");
    folder.write("lens.dat", "100 1 1.5 20\n-100 50 1 20\n");
    let mut pfm = b"PF\n4 4\n-1.0\n".to_vec();
    (0..48).for_each(|i| pfm.extend((0.4f32 + 0.01 * i as f32).to_le_bytes()));
    folder.write("i.pfm", pfm);
    folder
}

/// The warnings of a scene, of what `info --strict` does and of a render, in this process: there are many scenes.
fn said(folder: &Folder, text: &str) -> Vec<String> {
    let path = folder.path("s.pbrt");
    std::fs::write(&path, text).expect("it can be written");
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    let (scene, timings) = load(&path, &mut sources, &mut warnings).unwrap_or_else(|error| panic!("{text}\n{error}"));
    lint(&scene, &mut warnings);
    let settings = RenderSettings::default();
    let job = Job::prepare(&scene, &settings, timings, &mut warnings);
    let mut job = job.unwrap_or_else(|error| panic!("{text}\n{error}"));
    let outcome = job.render(1, Budget::Samples(1), &AtomicBool::new(false), &Silent);
    assert_eq!(outcome.film.rejected().0, 0, "{text}");
    warnings.list().iter().map(|warning| warning.message.clone()).collect()
}

/// What goes wrong in the cases of one test: all of it is told at its end.
struct Wrong(Vec<String>);

impl Drop for Wrong {
    fn drop(&mut self) {
        assert!(std::thread::panicking() || self.0.is_empty(), "{} cases:\n{}", self.0.len(), self.0.join("\n----\n"));
    }
}

impl Wrong {
    /// Wrong unless the warnings are those expected, each in one line.
    fn unless_said(&mut self, folder: &Folder, text: &str, expected: &[&str]) {
        let found = said(folder, text);
        let mut wrong = String::new();
        for line in &found {
            if !expected.iter().any(|part| line.contains(part)) {
                writeln!(wrong, "unexpected: {line}").expect("text");
            }
        }
        for part in expected {
            let count = found.iter().filter(|line| line.contains(part)).count();
            if count != 1 {
                writeln!(wrong, "{count} lines hold {part:?}").expect("text");
            }
        }
        if !wrong.is_empty() {
            self.0.push(format!("{text}\n{wrong}"));
        }
    }
}

#[test]
fn headers() {
    let folder = folder("headers");
    let mut wrong = Wrong(vec![]);
    let film = "\"integer xresolution\" 4 \"integer yresolution\" 3";
    let base = format!("Film \"rgb\" {film} Sampler \"zsobol\" \"integer pixelsamples\" 1\n");
    let shot = "\"float shutteropen\" 0 \"float shutterclose\" 1";
    let screen = "\"float frameaspectratio\" 1.5 \"float screenwindow\" [-1 1 -1 1] \"float lensradius\" 0.01 \"float focaldistance\" 3";
    let cases: Vec<(String, &[&str])> = vec![
        (format!("Camera \"perspective\" \"float fov\" 40 {shot} {screen}\n{base}"), &[]),
        (format!("Camera \"orthographic\" {shot} {screen}\n{base}"), &[]),
        (format!("Camera \"spherical\" {shot} {screen} \"string mapping\" \"equirectangular\"\n{base}"), &[]),
        (
            format!(
                "Camera \"realistic\" {shot} \"string lensfile\" \"lens.dat\" \"float aperturediameter\" 5 \"float focusdistance\" 2 \
                 \"string aperture\" \"square\"\nFilm \"rgb\" {film} \"float diagonal\" 35\nSampler \"sobol\" \"integer pixelsamples\" 1\n"
            ),
            &["thin lens", "aperture"],
        ),
        (
            format!(
                "Film \"rgb\" {film} \"string filename\" \"o.exr\" \"float cropwindow\" [0 1 0 1] \"float diagonal\" 35 \"string sensor\" \"cie1931\" \
                 \"float iso\" 100 \"float whitebalance\" 0 \"float maxcomponentvalue\" 10 \"bool savefp16\" true\n"
            ),
            &["biased"],
        ),
        (
            format!(
                "Film \"rgb\" {film} \"integer pixelbounds\" [0 4 0 3] \"string sensor\" \"canon_eos_5d\" \"float whitebalance\" 5000\n"
            ),
            &["sensor"],
        ),
        (format!("Film \"gbuffer\" {film} \"string coordinatesystem\" \"world\"\n"), &[]),
        (
            format!(
                "Film \"spectral\" {film} \"integer nbuckets\" 16 \"float lambdamin\" 360 \"float lambdamax\" 830\n"
            ),
            &["film type \"spectral\""],
        ),
        (format!("{base}PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\n"), &[]),
        (format!("{base}PixelFilter \"triangle\" \"float xradius\" 1 \"float yradius\" 1\n"), &[]),
        (format!("{base}PixelFilter \"gaussian\" \"float xradius\" 1 \"float yradius\" 1 \"float sigma\" 0.5\n"), &[]),
        (
            format!(
                "{base}PixelFilter \"mitchell\" \"float xradius\" 2 \"float yradius\" 2 \"float B\" 0.3 \"float C\" 0.3\n"
            ),
            &[],
        ),
        (format!("{base}PixelFilter \"sinc\" \"float xradius\" 4 \"float yradius\" 4 \"float tau\" 3\n"), &[]),
        (
            format!(
                "Film \"rgb\" {film} Sampler \"stratified\" \"bool jitter\" true \"integer xsamples\" 1 \"integer ysamples\" 1 \"integer seed\" 1\n"
            ),
            &[],
        ),
        (format!("Film \"rgb\" {film} Sampler \"independent\" \"integer pixelsamples\" 1 \"integer seed\" 1\n"), &[]),
        (format!("Film \"rgb\" {film} Sampler \"pmj02bn\" \"integer pixelsamples\" 1 \"integer seed\" 1\n"), &[]),
        (
            format!(
                "Film \"rgb\" {film} Sampler \"halton\" \"integer pixelsamples\" 1 \"string randomization\" \"permutedigits\" \"integer seed\" 1\n"
            ),
            &[],
        ),
        (
            format!(
                "Film \"rgb\" {film} Sampler \"paddedsobol\" \"integer pixelsamples\" 1 \"string randomization\" \"none\"\n"
            ),
            &[],
        ),
        (
            format!(
                "{base}Integrator \"volpath\" \"integer maxdepth\" 2 \"string lightsampler\" \"bvh\" \"bool regularize\" true\n"
            ),
            &[],
        ),
        (
            format!(
                "{base}Integrator \"path\" \"integer maxdepth\" 2 \"string lightsampler\" \"bvh\" \"bool regularize\" false\n"
            ),
            &[],
        ),
        (
            format!("{base}Integrator \"ambientocclusion\" \"bool cossample\" true \"float maxdistance\" 1\n"),
            &["integrator \"ambientocclusion\""],
        ),
        (format!("{base}Integrator \"ao\" \"bool cossample\" true \"float maxdistance\" 1\n"), &["integrator \"ao\""]),
        (
            format!(
                "{base}Integrator \"bdpt\" \"integer maxdepth\" 2 \"bool regularize\" true \"bool visualizestrategies\" false \"bool visualizeweights\" false\n"
            ),
            &["integrator \"bdpt\""],
        ),
        (
            format!(
                "{base}Integrator \"mlt\" \"integer maxdepth\" 2 \"integer bootstrapsamples\" 9 \"integer chains\" 2 \"integer mutationsperpixel\" 2 \"float largestepprobability\" 0.3 \"float sigma\" 0.01\n"
            ),
            &["integrator \"mlt\""],
        ),
        (
            format!(
                "{base}Integrator \"sppm\" \"integer maxdepth\" 2 \"integer photonsperiteration\" 9 \"float radius\" 1 \"integer seed\" 1\n"
            ),
            &["integrator \"sppm\""],
        ),
        (
            format!(
                "{base}Integrator \"simplepath\" \"integer maxdepth\" 2 \"bool samplebsdf\" true \"bool samplelights\" true\n"
            ),
            &["integrator \"simplepath\""],
        ),
        (format!("{base}Integrator \"randomwalk\" \"integer maxdepth\" 2\n"), &["integrator \"randomwalk\""]),
        (format!("{base}Accelerator \"bvh\" \"integer maxnodeprims\" 4 \"string splitmethod\" \"sah\"\n"), &[]),
        (
            format!(
                "{base}Option \"bool disablepixeljitter\" false\nOption \"bool disabletexturefiltering\" false\nOption \"bool disablewavelengthjitter\" true\n\
                 Option \"float displacementedgescale\" 2\nOption \"string rendercoordsys\" \"cameraworld\"\nOption \"integer seed\" 3\nOption \"bool forcediffuse\" false\n\
                 Option \"bool pixelstats\" false\nOption \"bool wavefront\" true\n"
            ),
            &[],
        ),
        (
            format!(
                "{base}Option \"bool disablepixeljitter\" true\nOption \"bool forcediffuse\" true\nOption \"string msereferenceimage\" \"a.exr\"\nOption \"string msereferenceout\" \"b\"\n"
            ),
            &["disablepixeljitter", "forcediffuse", "msereferenceimage", "msereferenceout"],
        ),
        (
            format!(
                "Identity Translate 0 0 1 Scale 1 1 1 Rotate 1 0 0 1 LookAt 0 0 -5 0 0 0 0 1 0 CoordinateSystem \"c\" CoordSysTransform \"c\"\n\
                 ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1] Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 5 1]\n\
                 TransformTimes 0 1 ActiveTransform StartTime ActiveTransform EndTime Translate 0.1 0 0 ActiveTransform All\nColorSpace \"srgb\"\n\
                 MakeNamedMedium \"air\" \"string type\" \"homogeneous\" MediumInterface \"air\" \"\" Camera \"perspective\"\n{base}"
            ),
            &["\"air\" is not used"],
        ),
    ];
    for (header, expected) in cases {
        let world = "WorldBegin\nLightSource \"infinite\"\nTranslate 0 0 3\nShape \"sphere\"\n";
        wrong.unless_said(&folder, &format!("{header}{world}"), expected);
    }
}

/// Shapes, lights, materials, textures and media, with everything that each may say.
#[test]
fn worlds() {
    let folder = folder("worlds");
    let mut wrong = Wrong(vec![]);
    let head = HEAD.replace("LightSource \"point\" \"point3 from\" [1 2 -3]\n", "");
    let light = "LightSource \"point\" \"point3 from\" [1 2 -3]\n";
    let rough =
        "\"float roughness\" 0.1 \"float uroughness\" 0.1 \"float vroughness\" 0.2 \"bool remaproughness\" true";
    let relief = "\"texture displacement\" \"h\"";
    let heights = "Texture \"h\" \"float\" \"fbm\" \"integer octaves\" 2 \"float roughness\" 0.5\n";
    let place =
        "\"string mapping\" \"uv\" \"float uscale\" 2 \"float vscale\" 2 \"float udelta\" 0.1 \"float vdelta\" 0.1";
    let planar = "\"string mapping\" \"planar\" \"vector3 v1\" [1 0 0] \"vector3 v2\" [0 1 0] \"float udelta\" 0 \"float vdelta\" 0";
    let grid = "\"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \"point3 p0\" [0 0 0] \"point3 p1\" [1 1 1]";
    let eight = "[1 1 1 1 1 1 1 1]";
    let sigma = "\"rgb sigma_a\" [1 1 1] \"rgb sigma_s\" [1 1 1] \"float scale\" 1 \"float g\" 0.1";
    let triangle = "\"point3 P\" [-1 -1 0 1 -1 0 0 1 0] \"integer indices\" [0 1 2] \"normal N\" [0 0 1 0 0 1 0 0 1] \"point2 uv\" [0 0 1 0 0 1]";
    let mut worlds: Vec<(String, &[&str])> = vec![
        (
            format!(
                "{light}Include \"part.pbrt\" Import \"part.pbrt\" AttributeBegin ReverseOrientation Attribute \"shape\" \"float radius\" 0.5 Shape \"sphere\" AttributeEnd\n\
                 ObjectBegin \"o\" Shape \"sphere\" ObjectEnd ObjectInstance \"o\" TransformBegin TransformEnd ColorSpace \"rec2020\" Shape \"sphere\""
            ),
            &["TransformBegin", "TransformEnd"],
        ),
        (format!("{light}Shape \"sphere\" \"float radius\" 1 \"float zmin\" -0.5 \"float zmax\" 0.5 \"float phimax\" 180 \"float alpha\" 0.9"), &[]),
        (format!("{light}Shape \"cylinder\" \"float radius\" 1 \"float zmin\" -0.5 \"float zmax\" 0.5 \"float phimax\" 180"), &[]),
        (format!("{light}Shape \"disk\" \"float radius\" 1 \"float height\" 0.5 \"float innerradius\" 0.5 \"float phimax\" 180"), &[]),
        (format!("{light}Shape \"trianglemesh\" {triangle} \"integer faceIndices\" [0]"), &[]),
        (format!("{light}Shape \"trianglemesh\" {triangle} \"vector3 S\" [1 0 0 1 0 0 1 0 0]"), &["\"S\""]),
        (
            format!(
                "{light}Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"integer indices\" [0 1 2 3] \"normal N\" [0 0 1 0 0 1 0 0 1 0 0 1] \
                 \"point2 uv\" [0 0 1 0 0 1 1 1] \"integer faceIndices\" [0] \"string emissionfilename\" \"i.pfm\""
            ),
            &[],
        ),
        (format!("{light}{heights}Shape \"plymesh\" \"string filename\" \"m.ply\" {relief} \"float displacement.edgelength\" 0.5"), &[]),
        (format!("{light}Shape \"loopsubdiv\" {} \"integer levels\" 1 \"string scheme\" \"loop\"", &triangle[..triangle.find("\"normal").expect("it is there")]), &[]),
        (
            format!(
                "{light}Shape \"curve\" \"string type\" \"ribbon\" \"string basis\" \"bspline\" \"integer degree\" 2 \"point3 P\" [0 0 0 1 0 0 1 1 0] \"float width\" 0.1 \
                 \"float width0\" 0.1 \"float width1\" 0.2 \"normal N\" [0 0 1 0 0 1] \"integer splitdepth\" 3"
            ),
            &[],
        ),
        ("LightSource \"point\" \"rgb I\" [1 1 1] \"float scale\" 1 \"float power\" 3 \"point3 from\" [0 1 0] Shape \"sphere\"".into(), &[]),
        (
            "LightSource \"spot\" \"spectrum I\" \"s.spd\" \"float scale\" 1 \"float power\" 3 \"point3 from\" [0 1 -4] \"point3 to\" [0 0 0] \"float coneangle\" 30 \
             \"float conedeltaangle\" 5 Shape \"sphere\""
                .into(),
            &[],
        ),
        ("LightSource \"goniometric\" \"rgb I\" [1 1 1] \"string filename\" \"i.pfm\" \"float scale\" 1 \"float power\" 3 Shape \"sphere\"".into(), &[]),
        ("LightSource \"projection\" \"string filename\" \"i.pfm\" \"float scale\" 1 \"float power\" 3 \"float fov\" 40 Shape \"sphere\"".into(), &[]),
        ("LightSource \"distant\" \"blackbody L\" 5000 \"float scale\" 1 \"float illuminance\" 3 \"point3 from\" [0 1 0] \"point3 to\" [0 0 0] Shape \"sphere\"".into(), &[]),
        ("LightSource \"infinite\" \"rgb L\" [1 1 1] \"float scale\" 1 \"float illuminance\" 3 \"point3 portal\" [-1 -1 3 1 -1 3 1 1 3 -1 1 3] Shape \"sphere\"".into(), &[]),
        ("LightSource \"infinite\" \"string filename\" \"i.pfm\" \"float scale\" 1 \"float illuminance\" 3 Shape \"sphere\"".into(), &[]),
        ("AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"float scale\" 1 \"float power\" 3 \"bool twosided\" true Shape \"sphere\"".into(), &[]),
        ("AreaLightSource \"diffuse\" \"string filename\" \"i.pfm\" Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]".into(), &[]),
    ];
    for (material, expected) in [
        ("\"diffuse\" \"rgb reflectance\" [1 1 1] {relief}", &[][..]),
        ("\"diffuse\" \"string normalmap\" \"i.pfm\"", &[]),
        (
            "\"diffusetransmission\" \"rgb reflectance\" [0.1 0.1 0.1] \"rgb transmittance\" [0.1 0.1 0.1] \"float scale\" 1 {relief}",
            &[],
        ),
        ("\"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\" {rough} {relief}", &[]),
        ("\"conductor\" \"rgb reflectance\" [0.9 0.8 0.7]", &[]),
        ("\"dielectric\" \"float eta\" 1.4 {rough} {relief}", &[]),
        ("\"thindielectric\" \"float eta\" 1.4 {relief}", &[]),
        (
            "\"coateddiffuse\" \"rgb reflectance\" [1 1 1] {rough} \"float thickness\" 0.1 \"float eta\" 1.4 \"float g\" 0.1 \"rgb albedo\" [0.1 0.1 0.1] \"integer maxdepth\" 4 \
             \"integer nsamples\" 2 {relief}",
            &[],
        ),
        (
            "\"coatedconductor\" \"float interface.roughness\" 0.1 \"float interface.uroughness\" 0.1 \"float interface.vroughness\" 0.1 \"float thickness\" 0.1 \"float interface.eta\" 1.4 \
             \"float conductor.roughness\" 0.1 \"float conductor.uroughness\" 0.1 \"float conductor.vroughness\" 0.1 \"spectrum conductor.eta\" \"metal-Cu-eta\" \
             \"spectrum conductor.k\" \"metal-Cu-k\" \"bool remaproughness\" true \"float g\" 0.1 \"rgb albedo\" [0.1 0.1 0.1] \"integer maxdepth\" 4 \"integer nsamples\" 2 {relief}",
            &[],
        ),
        ("\"coatedconductor\" \"rgb reflectance\" [0.9 0.8 0.7]", &[]),
        (
            "\"hair\" \"rgb sigma_a\" [1 1 1] \"float eta\" 1.5 \"float beta_m\" 0.3 \"float beta_n\" 0.3 \"float alpha\" 2",
            &[],
        ),
        ("\"hair\" \"rgb reflectance\" [0.5 0.5 0.5]", &[]),
        ("\"hair\" \"rgb color\" [0.5 0.5 0.5]", &[]),
        ("\"hair\" \"float eumelanin\" 1 \"float pheomelanin\" 1", &[]),
        (
            "\"subsurface\" \"rgb sigma_a\" [1 1 1] \"rgb sigma_s\" [1 1 1] \"float scale\" 1 \"float g\" 0.1 \"float eta\" 1.4 {rough} {relief}",
            &["\"subsurface\""],
        ),
        ("\"subsurface\" \"rgb reflectance\" [0.5 0.5 0.5] \"rgb mfp\" [1 1 1]", &["\"subsurface\""]),
        ("\"subsurface\" \"string name\" \"Skin1\"", &["is done as"]),
        ("\"measured\" \"string filename\" \"x.bsdf\" {relief}", &["measured"]),
        ("\"interface\"", &["nothing of it is seen"]),
    ] {
        let material = material.replace("{relief}", relief).replace("{rough}", rough);
        let heights = if material.contains("\"h\"") { heights } else { "" };
        worlds.push((format!("{light}{heights}Material {material} Shape \"sphere\""), expected));
    }
    worlds.push((
        format!(
            "{light}MakeNamedMaterial \"a\" \"string type\" \"diffuse\" MakeNamedMaterial \"b\" \"string type\" \"diffuse\"\n\
             MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" 0.3 NamedMaterial \"m\" Shape \"sphere\""
        ),
        &[],
    ));
    let mapped = [place, "\"string mapping\" \"spherical\"", "\"string mapping\" \"cylindrical\"", planar];
    let textures: Vec<(String, &[&str])> = mapped
        .iter()
        .flat_map(|mapping| {
            [
                (format!("\"imagemap\" \"string filename\" \"i.pfm\" \"string wrap\" \"black\" \"string filter\" \"bilinear\" \"string encoding\" \"linear\" \"float scale\" 1 \"bool invert\" false {mapping}"), &[][..]),
                (format!("\"bilerp\" \"rgb v00\" [0 0 0] \"rgb v01\" [1 1 1] \"rgb v10\" [0 1 0] \"rgb v11\" [1 0 0] {mapping}"), &[]),
                (format!("\"checkerboard\" \"integer dimension\" 2 \"rgb tex1\" [0 0 0] \"rgb tex2\" [1 1 1] {mapping}"), &[]),
                (format!("\"dots\" \"rgb inside\" [0 0 0] \"rgb outside\" [1 1 1] {mapping}"), &[]),
            ]
        })
        .chain([
            ("\"constant\" \"rgb value\" [1 1 1]".to_owned(), &[][..]),
            ("\"scale\" \"rgb tex\" [1 1 1] \"float scale\" 0.5".to_owned(), &[]),
            ("\"mix\" \"rgb tex1\" [0 0 0] \"rgb tex2\" [1 1 1] \"float amount\" 0.5".to_owned(), &[]),
            ("\"directionmix\" \"rgb tex1\" [0 0 0] \"rgb tex2\" [1 1 1] \"vector3 dir\" [0 1 0]".to_owned(), &[]),
            ("\"checkerboard\" \"integer dimension\" 3 \"rgb tex1\" [0 0 0] \"rgb tex2\" [1 1 1]".to_owned(), &[]),
            ("\"marble\" \"integer octaves\" 4 \"float roughness\" 0.5 \"float scale\" 1 \"float variation\" 0.2".to_owned(), &[]),
            ("\"ptex\" \"string filename\" \"x.ptx\" \"string encoding\" \"sRGB\" \"float scale\" 1".to_owned(), &["\"ptex\""]),
            ("\"imagemap\" \"string filename\" \"i.pfm\" \"string wrap\" \"octahedralsphere\"".to_owned(), &["octahedralsphere"]),
        ])
        .collect();
    for (texture, expected) in textures {
        worlds.push((format!("{light}Texture \"t\" \"spectrum\" {texture} Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\""), expected));
    }
    for float in [
        "\"constant\" \"float value\" 0.5",
        "\"wrinkled\" \"integer octaves\" 2 \"float roughness\" 0.5",
        "\"windy\"",
        "\"imagemap\" \"string filename\" \"i.pfm\"",
    ] {
        worlds.push((format!("{light}Texture \"t\" \"float\" {float} Shape \"sphere\" \"texture alpha\" \"t\""), &[]));
    }
    for medium in [
        format!("\"homogeneous\" {sigma} \"rgb Le\" [1 1 1] \"float Lescale\" 1"),
        format!(
            "\"uniformgrid\" {grid} {sigma} \"float density\" {eight} \"rgb Le\" [1 1 1] \"float Lescale\" {eight}"
        ),
        format!(
            "\"uniformgrid\" {grid} {sigma} \"float density\" {eight} \"float temperature\" {eight} \"float temperaturescale\" 900 \"float temperatureoffset\" 10"
        ),
        format!(
            "\"rgbgrid\" {grid} \"rgb sigma_a\" [{0}] \"rgb sigma_s\" [{0}] \"rgb Le\" [{0}] \"float Lescale\" 1 \"float scale\" 1 \"float g\" 0",
            "1 1 1 ".repeat(8)
        ),
        format!(
            "\"cloud\" \"point3 p0\" [0 0 0] \"point3 p1\" [1 1 1] {sigma} \"float density\" 1 \"float wispiness\" 1 \"float frequency\" 2"
        ),
    ] {
        let medium = if medium.starts_with("\"cloud\"") { medium.replace("\"float scale\" 1 ", "") } else { medium };
        worlds.push((
            format!("{light}MakeNamedMedium \"m\" \"string type\" {medium}\nMediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\""),
            &[],
        ));
    }
    worlds.push((
        format!("{light}MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"string preset\" \"Skin1\"\nMediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\""),
        &[],
    ));
    worlds.push((
        format!("{light}MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"string preset\" \"skin\" \"rgb sigma_a\" [1 1 1]\nMediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\""),
        &["\"skin\": did you mean Skin1?"],
    ));
    for (world, expected) in worlds {
        wrong.unless_said(&folder, &format!("{head}{world}\n"), expected);
    }
}

/// Everything that may move: it does, or one line says that it stands still.
#[test]
fn what_moves_is_rendered_or_told() {
    let folder = folder("moving");
    let mut wrong = Wrong(vec![]);
    let moving = "ActiveTransform EndTime Translate 0.2 0.1 0 ActiveTransform All\n";
    let light = "LightSource \"point\" \"point3 from\" [1 2 -3]\n";
    let head = HEAD.replace(light, "");
    let triangle = "\"point3 P\" [-1 -1 0 1 -1 0 0 1 0] \"integer indices\" [0 1 2]";
    let shapes = [
        "\"sphere\"".to_owned(),
        "\"disk\"".to_owned(),
        "\"cylinder\"".to_owned(),
        format!("\"trianglemesh\" {triangle}"),
        format!("\"trianglemesh\" {triangle} \"float displacement\" 0.5 \"float edgelength\" 0.5"),
        format!("\"loopsubdiv\" {triangle}"),
        "\"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]".to_owned(),
        "\"plymesh\" \"string filename\" \"m.ply\"".to_owned(),
        "\"curve\" \"point3 P\" [0 0 0 1 0 0 1 1 0 0 1 0] \"float width\" 0.2".to_owned(),
    ];
    for shape in &shapes {
        for (before, after) in
            [("", ""), ("AreaLightSource \"diffuse\" ", ""), ("ObjectBegin \"o\" ", " ObjectEnd ObjectInstance \"o\"")]
        {
            let is_dark = before.starts_with("Area") && shape.starts_with("\"curve");
            let expected: &[&str] =
                if is_dark { &["curves cannot be area lights", "1 of 2 lights emit nothing"] } else { &[] };
            wrong.unless_said(&folder, &format!("{head}{light}{moving}{before}Shape {shape}{after}\n"), expected);
        }
    }
    wrong.unless_said(
        &folder,
        &format!("{head}{light}ObjectBegin \"o\" Shape \"sphere\" ObjectEnd {moving} ObjectInstance \"o\"\n"),
        &[],
    );
    const FROM_INFINITY: &[&str] = &["a moving light from infinity is not supported"];
    for (light, expected) in [
        ("\"point\"", [].as_slice()),
        ("\"point\" \"point3 P\" [0 0 0 1 1 1]", &[]),
        ("\"spot\"", &[]),
        ("\"goniometric\" \"string filename\" \"i.pfm\"", &[]),
        ("\"projection\" \"string filename\" \"i.pfm\"", &[]),
        ("\"distant\"", FROM_INFINITY),
        ("\"infinite\"", FROM_INFINITY),
    ] {
        wrong.unless_said(&folder, &format!("{head}Shape \"sphere\" {moving} LightSource {light}\n"), expected);
    }
    let medium = "\"string type\" \"homogeneous\" MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\"";
    wrong.unless_said(
        &folder,
        &format!("{head}{light}{moving} MakeNamedMedium \"m\" {medium}\n"),
        &["medium \"m\" moves"],
    );
    wrong.unless_said(
        &folder,
        &format!("{head}{light}MakeNamedMedium \"m\" {}\n", medium.replace("Material", &format!("{moving} Material"))),
        &[],
    );
    let texture = |kind: &str| {
        format!(
            "{head}{light}{moving} Texture \"t\" \"spectrum\" {kind} Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"\n"
        )
    };
    wrong.unless_said(&folder, &texture("\"marble\""), &["texture \"t\" moves"]);
    wrong.unless_said(&folder, &texture("\"imagemap\" \"string filename\" \"i.pfm\""), &[]);
    let camera = head.replace("Camera", &format!("{moving}Camera"));
    wrong.unless_said(&folder, &format!("{camera}{light}Shape \"sphere\"\n"), &[]);
    // Times that are no interval.
    for times in ["1 1", "1 0"] {
        let head = head.replace("WorldBegin", &format!("TransformTimes {times}\nWorldBegin"));
        wrong.unless_said(&folder, &format!("{head}{light}{moving}Shape \"sphere\"\n"), &["TransformTimes"]);
    }
}
