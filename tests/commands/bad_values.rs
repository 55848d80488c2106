//! Values that make no sense, in every directive, through the built program: named in an error or a warning with their place, or rendered
//! in good order (`program/faults.rs` says what that is).

use crate::program::faults::*;
use crate::program::{Folder, HEAD};

#[test]
fn nonsensical_settings() {
    let with = |line: &str| format!("{line}\n{}", &HEAD[HEAD.find("WorldBegin").expect("it is there")..]);
    let folder = Folder::new("settings");
    let mut faults = Faults::default();
    for (text, fate) in [
        ("Camera \"perspective\" \"float fov\" 0", Refused("fov")),
        ("Camera \"perspective\" \"float fov\" -20", Refused("fov")),
        ("Camera \"perspective\" \"float fov\" 180", Refused("fov")),
        ("Camera \"perspective\" \"float fov\" 1e30", Refused("fov")),
        ("Camera \"perspective\" \"float fov\" nan", Refused("nan")),
        ("Camera \"perspective\" \"float lensradius\" -1", Refused("lensradius")),
        ("Camera \"perspective\" \"float lensradius\" 1 \"float focaldistance\" 0", Refused("focaldistance")),
        ("Camera \"perspective\" \"float shutteropen\" 1 \"float shutterclose\" 0", Refused("shutter")),
        ("Camera \"perspective\" \"float screenwindow\" [0 0 0 0]", Refused("screenwindow")),
        ("Camera \"perspective\" \"float frameaspectratio\" 0", Refused("frameaspectratio")),
        ("Camera \"nonsense\"", Refused("nonsense")),
        ("LookAt 0 0 0 0 0 0 0 1 0\nCamera \"perspective\"", Refused("LookAt")),
        ("LookAt 0 0 0 0 1 0 0 1 0\nCamera \"perspective\"", Refused("LookAt")),
        ("Scale 0 1 1\nCamera \"perspective\"", Refused("scene.pbrt")),
        ("Transform [0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1]\nCamera \"perspective\"", Refused("scene.pbrt")),
        ("Translate 1e38 1e38 1e38\nTranslate 1e38 1e38 1e38\nCamera \"perspective\"", Orderly),
        ("Film \"rgb\" \"integer xresolution\" 0", Refused("xresolution")),
        ("Film \"rgb\" \"integer xresolution\" -5", Refused("xresolution")),
        ("Film \"rgb\" \"integer xresolution\" 100000 \"integer yresolution\" 100000", Limit("pixels")),
        ("Film \"rgb\" \"integer xresolution\" 16777215 \"integer yresolution\" 16", Limit("memory")),
        ("Film \"rgb\" \"integer xresolution\" 2147483648", Refused("2147483648")),
        ("Film \"rgb\" \"float cropwindow\" [0.5 0.5 0 1]", Refused("crop")),
        (
            "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6 \"float cropwindow\" [0 1]",
            Warned("it is ignored"),
        ),
        (
            "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6 \"integer pixelbounds\" 3",
            Warned("they are ignored"),
        ),
        ("Camera \"perspective\" \"float screenwindow\" [0 1]", Warned("the whole window is taken")),
        ("Camera \"orthographic\" \"float focaldistance\" 0", Renders),
        ("Film \"rgb\" \"float iso\" 0", Refused("iso")),
        ("PixelFilter \"gaussian\" \"float xradius\" 0", Refused("xradius")),
        ("PixelFilter \"gaussian\" \"float sigma\" -1", Refused("sigma")),
        ("PixelFilter \"box\" \"float xradius\" 1e30", Orderly),
        ("Sampler \"zsobol\" \"integer pixelsamples\" 0", Refused("pixelsamples")),
        ("Sampler \"zsobol\" \"integer pixelsamples\" -3", Refused("pixelsamples")),
        ("Sampler \"zsobol\" \"integer pixelsamples\" 2147483648", Refused("2147483648")),
        ("Integrator \"volpath\" \"integer maxdepth\" -1", Refused("maxdepth")),
        ("Integrator \"volpath\" \"float maxdepth\" 3", Refused("maxdepth")),
    ] {
        folder.write("scene.pbrt", with(text));
        let tiny = ["Film", "Sampler"].iter().any(|d| text.starts_with(d));
        if !tiny {
            folder.write("scene.pbrt", with(&format!("{text}\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6\nSampler \"zsobol\" \"integer pixelsamples\" 2")));
        }
        faults.render(&folder, text, fate);
    }
}

/// A triangle with something more.
macro_rules! triangle {
    ($more:literal) => {
        concat!("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] ", $more)
    };
}

#[test]
fn nonsensical_shapes() {
    each(&[
        ("Shape \"sphere\" \"float radius\" -1", Refused("radius")),
        ("Shape \"sphere\" \"float radius\" 0", Refused("radius")),
        ("Shape \"sphere\" \"float radius\" 1e30", Orderly),
        ("Shape \"sphere\" \"float radius\" 1e-30", Orderly),
        ("Shape \"sphere\" \"float phimax\" 0", Orderly),
        ("Shape \"sphere\" \"float zmin\" 2 \"float zmax\" 1", Orderly),
        ("Shape \"disk\" \"float radius\" -1", Refused("radius")),
        ("Shape \"disk\" \"float radius\" 1 \"float innerradius\" 2", Refused("innerradius")),
        ("Shape \"trianglemesh\"", Warned("\"P\" is missing")),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2147483647]",
            Warned("the shape is left out"),
        ),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 -1]",
            Warned("the shape is left out"),
        ),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]",
            Warned("the shape is left out"),
        ),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1]", Warned("cut off")),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point3 P\" [0 0 0]",
            Warned("the shape is left out"),
        ),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1] \"integer indices\" [0 1 2]", Refused("groups of 3")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 nan 0 0 0 1 0] \"integer indices\" [0 1 2]", Refused("nan")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1e999 0 0 0 1 0] \"integer indices\" [0 1 2]", Refused("1e999")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]", Renders),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal3 N\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]",
            Renders,
        ),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal3 N\" [0 0 1] \"integer indices\" [0 1 2]",
            Warned("\"N\" has 1 values"),
        ),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 uv\" [0 0] \"integer indices\" [0 1 2]",
            Warned("\"uv\" has 1 values"),
        ),
        ("Shape \"trianglemesh\" \"point3 P\" [-3e38 0 0 3e38 0 0 0 3e38 0] \"integer indices\" [0 1 2]", Orderly),
        ("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0 0 0 0]", Renders),
        ("Shape \"curve\" \"point3 P\" [0 0 0 0 0 0 0 0 0 0 0 0]", Orderly),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"float width\" -1", Orderly),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0]", Warned("control points")),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"integer degree\" 99", Warned("degree")),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"integer splitdepth\" 1000", Orderly),
        (triangle!("\"texture displacement\" \"nothing\""), Refused("nothing")),
        (triangle!("\"string displacement\" \"nothing\""), Refused("displacement")),
        (triangle!("\"rgb displacement\" [1 1 1]"), Refused("displacement")),
        (triangle!("\"float displacement\" [1 2]"), Refused("displacement")),
        (triangle!("\"float displacement\" 1e30"), Refused("beyond")),
        (triangle!("\"float displacement\" -0.5"), Renders),
        (triangle!("\"float displacement\" 0"), Renders),
        (triangle!("\"float displacement\" 1 \"float displacement.edgelength\" 0"), Refused("edgelength")),
        (triangle!("\"float displacement\" 1 \"float edgelength\" -1"), Refused("edgelength")),
        (triangle!("\"float displacement\" 1 \"float edgelength\" 1e-6"), Limit("more than")),
        (triangle!("\"float displacement\" 1 \"float edgelength\" 1e-38"), Limit("more than")),
        (triangle!("\"float displacement\" 1 \"float edgelength\" 1e38"), Renders),
        (triangle!("\"float edgelength\" 1"), Warned("edgelength")),
        ("Shape \"sphere\" \"float displacement\" 1", Warned("displacement")),
        ("Scale 1 1 0\nShape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"float displacement\" 1", Renders),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0] \"float displacement\" 1", Renders),
        ("Shape \"nonsense\"", Warned("nonsense")),
        ("Scale 0 1 1\nShape \"sphere\"", Refused("scene.pbrt")),
        ("Scale 0 0 0\nShape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]", Orderly),
        ("Rotate 30 0 0 0\nShape \"sphere\"", Orderly),
        ("Scale 1e30 1e30 1e30\nScale 1e30 1e30 1e30\nShape \"sphere\"", Orderly),
        ("Scale 1e-30 1e-30 1e-30\nScale 1e-30 1e-30 1e-30\nShape \"sphere\"", Orderly),
        ("ActiveTransform EndTime\nScale 0 0 0\nActiveTransform All\nShape \"sphere\"", Refused("flattened")),
        ("ObjectBegin \"a\"\nObjectInstance \"a\"\nObjectEnd\nObjectInstance \"a\"", Orderly),
        ("ObjectInstance \"nothing\"", Refused("nothing")),
        (
            "ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nActiveTransform EndTime\nScale -1 1 1\nObjectInstance \"a\"",
            Refused("inside out"),
        ),
        (
            "ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nScale 1e-30 1 1\nObjectInstance \"a\"",
            Refused("units away"),
        ),
        (
            "ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nScale 1e-13 1e-13 1e-13\nObjectInstance \"a\"",
            Refused("shrunk"),
        ),
        ("ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nScale 1e-10 1e-10 1e-10\nObjectInstance \"a\"", Renders),
        ("Scale 1e10 1e10 1e10\nShape \"sphere\" \"float radius\" 1e10", Refused("beyond")),
        ("# \u{e9}\nShape \"sphere\"", Renders),
        ("Attribute \"shape\" \"float zork\" 1\nShape \"sphere\"", Renders),
        (
            "AreaLightSource \"diffuse\"\nMaterial \"interface\"\nShape \"sphere\"",
            Warned("area light on a shape of material"),
        ),
        ("ObjectBegin \"a\"\nObjectEnd\nObjectInstance \"a\"", Renders),
        ("ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nScale 0 0 0\nObjectInstance \"a\"", Warned("flattened")),
        (
            "ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nActiveTransform EndTime\nScale 0 1 1\nObjectInstance \"a\"",
            Refused("flattened"),
        ),
        (
            "ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nScale 1e15 1e15 1e15\nScale 1e15 1e15 1e15\nObjectInstance \"a\"",
            Refused("instance"),
        ),
        ("ActiveTransform EndTime\nTranslate 1e30 0 0\nActiveTransform All\nShape \"sphere\"", Refused("beyond")),
        ("AttributeEnd", Warned("AttributeEnd without its begin")),
        ("CoordSysTransform \"nowhere\"\nShape \"sphere\"", Warned("nowhere")),
        ("ObjectEnd", Refused("ObjectEnd")),
        ("WorldBegin\nWorldBegin", Refused("WorldBegin")),
        ("Include \"scene.pbrt\"", Refused("scene.pbrt")),
    ]);
}

/// What pbrt-v4 passes over with a warning: so does a render, with the place, unless it is a strict one.
#[test]
fn faults_that_are_passed_over_are_refused_by_strict_renders() {
    let folder = Folder::new("passed-over");
    let line = HEAD.lines().count() + 1;
    let place = format!("scene.pbrt:{line}");
    for (text, said) in [
        ("AttributeEnd", "AttributeEnd"),
        ("CoordSysTransform \"nowhere\"", "nowhere"),
        (triangle!("\"integer indices\" [0 1 2 0]"), "indices"),
        (triangle!("\"point2 uv\" [0 0]"), "uv"),
        (triangle!("\"integer indices\" [0 1 9]"), "the shape is left out"),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0]", "the shape is left out"),
        (triangle!("\"normal3 N\" [0 0 1]"), "\"N\""),
    ] {
        folder.write("scene.pbrt", format!("{HEAD}{text}\nShape \"sphere\"\n"));
        let render = ["render", "scene.pbrt", "-o", "out.exr"];
        folder.run(&render).code(0).says(&place).says(said);
        std::fs::remove_file(folder.path("out.exr")).expect("an image was written");
        folder.run(&[&render[..], &["--strict"]].concat()).code(3).says(&place).says(said).says("--strict");
        assert!(!folder.listing().contains_key("out.exr"), "{text}");
        folder.run(&["info", "scene.pbrt", "--strict"]).code(3).says(&place).says(said);
    }
}

#[test]
fn nonsensical_lights() {
    each(&[
        ("LightSource \"point\" \"rgb I\" [-1 -1 -1]", Orderly),
        ("LightSource \"point\" \"rgb I\" [1e38 1e38 1e38] \"float scale\" 1e38", Orderly),
        ("LightSource \"point\" \"blackbody I\" 0", Orderly),
        ("LightSource \"point\" \"blackbody I\" -5", Refused("scene.pbrt")),
        ("LightSource \"point\" \"float power\" -5", Orderly),
        ("LightSource \"point\" \"point3 from\" [0 0 -5]\nShape \"sphere\"", Renders),
        ("LightSource \"spot\" \"point3 from\" [0 0 0] \"point3 to\" [0 0 0]", Refused("scene.pbrt")),
        ("LightSource \"spot\" \"float coneangle\" 0", Orderly),
        ("LightSource \"spot\" \"float coneangle\" 400", Orderly),
        ("LightSource \"distant\" \"point3 from\" [0 0 0] \"point3 to\" [0 0 0]", Refused("scene.pbrt")),
        ("LightSource \"infinite\" \"rgb L\" [1 1]", Refused("groups of 3")),
        ("LightSource \"nonsense\"", Warned("nonsense")),
        ("Scale 0 0 0\nLightSource \"point\"", Orderly),
        ("AreaLightSource \"nonsense\"\nShape \"sphere\"", Warned("nonsense")),
        (
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nShape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]",
            Renders,
        ),
        ("AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nShape \"disk\" \"float radius\" 1e-30", Orderly),
        (
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"float power\" 5\nShape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]",
            Renders,
        ),
        ("AreaLightSource \"diffuse\" \"string filename\" \"missing.png\"\nShape \"sphere\"", Orderly),
    ]);
}

#[test]
fn nonsensical_materials() {
    each(&[
        ("Material \"nonsense\"\nShape \"sphere\"", Orderly),
        ("NamedMaterial \"nothing\"\nShape \"sphere\"", Refused("nothing")),
        ("Material \"diffuse\" \"texture reflectance\" \"nothing\"\nShape \"sphere\"", Refused("nothing")),
        ("Material \"diffuse\" \"rgb reflectance\" [1e30 -1 5]\nShape \"sphere\"", Orderly),
        ("Material \"dielectric\" \"float eta\" 0\nShape \"sphere\"", Orderly),
        ("Material \"dielectric\" \"float eta\" -1.5\nShape \"sphere\"", Orderly),
        ("Material \"dielectric\" \"float eta\" 1e30\nShape \"sphere\"", Orderly),
        ("Material \"dielectric\" \"spectrum eta\" \"nothing\"\nShape \"sphere\"", Refused("nothing")),
        ("Material \"conductor\" \"float roughness\" -1\nShape \"sphere\"", Orderly),
        ("Material \"conductor\" \"float roughness\" 1e30\nShape \"sphere\"", Orderly),
        ("Material \"coateddiffuse\" \"float thickness\" -1\nShape \"sphere\"", Orderly),
        (
            "Material \"coatedconductor\" \"float interface.eta\" -1 \"float conductor.roughness\" 1e30\nShape \"sphere\"",
            Orderly,
        ),
        ("Material \"coatedconductor\" \"float thickness\" 1e30 \"float albedo\" 1\nShape \"sphere\"", Orderly),
        ("Material \"thindielectric\" \"float eta\" 0\nShape \"sphere\"", Orderly),
        ("Material \"diffusetransmission\" \"rgb transmittance\" [1e30 -1 5]\nShape \"sphere\"", Orderly),
        ("Material \"diffusetransmission\" \"float scale\" -1\nShape \"sphere\"", Refused("scale")),
        ("Material \"hair\" \"float beta_m\" 5\nShape \"sphere\"", Refused("beta_m")),
        ("Material \"hair\" \"float eta\" -5 \"rgb sigma_a\" [1e38 0 1]\nShape \"sphere\"", Orderly),
        ("Material \"hair\" \"rgb sigma_a\" [-1 0 1]\nShape \"sphere\"", Refused("sigma_a")),
        ("Material \"subsurface\" \"rgb sigma_a\" [1 1 1]\nShape \"sphere\"", Refused("sigma_s")),
        ("Material \"subsurface\" \"float g\" 3\nShape \"sphere\"", Refused("\"g\"")),
        ("Material \"measured\" \"string filename\" \"missing.bsdf\"\nShape \"sphere\"", Warned("not read")),
        ("Material \"diffuse\" \"string normalmap\" \"missing.png\"\nShape \"sphere\"", Warned("missing.png")),
        ("Material \"diffuse\" \"float normalmap\" 1\nShape \"sphere\"", Refused("normalmap")),
        ("Material \"diffuse\" \"texture displacement\" \"nothing\"\nShape \"sphere\"", Refused("nothing")),
        ("Material \"diffuse\" \"float displacement\" 1e38\nShape \"sphere\"", Orderly),
        (
            "Material \"coateddiffuse\" \"integer maxdepth\" 2147483647 \"integer nsamples\" 2147483647\nShape \"sphere\"",
            Refused("maxdepth"),
        ),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"mix\" \"string materials\" [\"a\" \"a\"]\nNamedMaterial \"a\"\nShape \"sphere\"",
            Refused("\"a\""),
        ),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"mix\" \"string materials\" [\"b\" \"b\"]\nMakeNamedMaterial \"b\" \"string type\" \"mix\" \"string materials\" [\"a\" \"a\"]\nNamedMaterial \"a\"\nShape \"sphere\"",
            Refused("scene.pbrt"),
        ),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"mix\"\nNamedMaterial \"a\"\nShape \"sphere\"",
            Refused("materials"),
        ),
        ("MakeNamedMaterial \"a\"\nNamedMaterial \"a\"\nShape \"sphere\"", Refused("type")),
        (
            "Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"t\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"",
            Refused("\"t\""),
        ),
        ("Texture \"t\" \"nonsense\" \"constant\"", Refused("nonsense")),
        (
            "Texture \"t\" \"float\" \"nonsense\"\nMaterial \"diffuse\"\nShape \"sphere\" \"texture alpha\" \"t\"",
            Orderly,
        ),
        (
            "Texture \"t\" \"spectrum\" \"imagemap\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"",
            Refused("filename"),
        ),
        ("Shape \"sphere\" \"float alpha\" -3", Orderly),
        ("Shape \"sphere\" \"texture alpha\" \"nothing\"", Refused("nothing")),
    ]);
}

#[test]
fn nonsensical_media() {
    let inside = "\nMaterial \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\" \"float radius\" 2";
    let medium = |parameters: &str| format!("MakeNamedMedium \"m\" \"string type\" {parameters}{inside}");
    let grids = |more: &str| medium(&format!("\"nanovdb\" \"string filename\" \"grids.nvdb\" {more}"));
    let folder = Folder::new("media");
    folder.write("grids.nvdb", include_bytes!("../data/nanovdb/grids-zip.nvdb"));
    let mut faults = Faults::default();
    let mut cases = vec![
        (medium("\"nonsense\""), Refused("nonsense")),
        (medium("\"cloud\" \"float frequency\" 0.1"), Renders),
        (medium("\"cloud\" \"float frequency\" -1"), Refused("frequency")),
        (medium("\"cloud\" \"point3 p1\" [0 1 1] \"float frequency\" 0.1"), Refused("no volume")),
        (medium("\"nanovdb\""), Refused("filename")),
        (medium("\"nanovdb\" \"string filename\" \"nothing.nvdb\""), Refused("nothing.nvdb")),
        (grids("\"string gridname\" \"shell\" \"float LeScale\" 2"), Renders),
        (grids("\"string gridname\" \"smoke\""), Refused("the file has no grid \"smoke\"")),
        (grids("\"string temperaturename\" \"density\""), Renders),
        (grids("\"string temperaturename\" \"heat\""), Warned("the medium does not glow")),
        (grids("\"float LeScale\" 2 \"float Lescale\" 2"), Warned("\"Lescale\" is given too")),
        (grids("\"float LeScale\" -2"), Refused("\"LeScale\"")),
        (medium("\"openvdb\""), Refused("openvdb")),
        (format!("MakeNamedMedium \"m\"{inside}"), Refused("type")),
        (inside.to_owned(), Refused("\"m\"")),
        ("MediumInterface \"nothing\" \"\"\nMaterial \"interface\"\nShape \"sphere\"".to_owned(), Refused("nothing")),
        (medium("\"homogeneous\" \"float g\" 1"), Renders),
        (medium("\"homogeneous\" \"float g\" -1"), Renders),
        (medium("\"homogeneous\" \"float g\" 1.5"), Refused("\"g\"")),
        (medium("\"homogeneous\" \"float scale\" -1"), Refused("scale")),
        (medium("\"homogeneous\" \"rgb sigma_s\" [-1 -1 -1] \"rgb sigma_a\" [-1 -1 -1]"), Orderly),
        (medium("\"uniformgrid\""), Refused("density")),
        (medium("\"uniformgrid\" \"float density\" [1 1 1] \"integer nx\" 2"), Refused("density")),
        (medium("\"uniformgrid\" \"float density\" [1] \"integer nx\" 0"), Refused("nx")),
        (medium("\"uniformgrid\" \"float density\" [1] \"integer nx\" -7"), Refused("nx")),
        (
            medium(
                "\"uniformgrid\" \"float density\" [1] \"integer nx\" 2147483647 \"integer ny\" 2147483647 \"integer nz\" 2147483647",
            ),
            Refused("density"),
        ),
        (
            medium(
                "\"uniformgrid\" \"float density\" [0 0 0 0 0 0 0 0] \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2",
            ),
            Renders,
        ),
        (
            medium(
                "\"uniformgrid\" \"float density\" [-1 1 1e38 1 1 1 1 1] \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2",
            ),
            Refused("extinction"),
        ),
        (medium("\"uniformgrid\" \"float density\" [nan]"), Refused("nan")),
        (
            medium("\"uniformgrid\" \"float density\" [1] \"point3 p0\" [0 0 0] \"point3 p1\" [0 0 0]"),
            Refused("volume"),
        ),
        (
            medium(
                "\"uniformgrid\" \"float density\" [1] \"point3 p0\" [-3e38 -3e38 -3e38] \"point3 p1\" [3e38 3e38 3e38]",
            ),
            Orderly,
        ),
        (
            format!(
                "AttributeBegin\nScale 0 1 1\nMakeNamedMedium \"m\" \"string type\" \"uniformgrid\" \"float density\" [1]\nAttributeEnd{inside}"
            ),
            Refused("scene.pbrt"),
        ),
        (medium("\"rgbgrid\""), Refused("sigma")),
        (medium("\"rgbgrid\" \"rgb sigma_s\" [1 1 1 1 1 1]"), Refused("sigma_s")),
        (
            medium("\"rgbgrid\" \"rgb sigma_s\" [1e38 1e38 1e38] \"rgb sigma_a\" [1e38 1e38 1e38]"),
            Refused("extinction"),
        ),
        (medium("\"rgbgrid\" \"rgb sigma_s\" [1 1 1] \"float Lescale\" 2 \"rgb Le\" [1 1 1]"), Refused("Le")),
    ];
    for strength in ["0", "1e-9", "1e-30", "1e9", "1e30", "3e38"] {
        let coefficients =
            format!("\"rgb sigma_s\" [{strength} {strength} {strength}] \"rgb sigma_a\" [{strength} 0 {strength}]");
        let fate = |is_too_much| if is_too_much { Refused("\"m\"") } else { Renders };
        cases.push((medium(&format!("\"homogeneous\" {coefficients}")), fate(strength == "3e38")));
        cases.push((
            medium(&format!("\"homogeneous\" {coefficients} \"float scale\" {strength} \"rgb Le\" [1 1 1]")),
            fate(strength.ends_with('0') && !strength.contains('-') && strength != "0" || strength == "3e38"),
        ));
        cases.push((medium(&format!("\"uniformgrid\" {coefficients} \"float density\" [1 2 3 4 0 0 0 1] \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \"point3 p0\" [-2 -2 -2] \"point3 p1\" [2 2 2]")), fate(["1e9", "1e30", "3e38"].contains(&strength))));
    }
    for (text, fate) in &cases {
        let text = format!("{HEAD}{text}\n");
        folder.write("scene.pbrt", &text);
        faults.render(&folder, &text, *fate);
    }
}

/// More media in one place than are followed: the image is wrong, and says so, behind boundaries and behind glass.
#[test]
fn too_many_media_in_one_place_are_told() {
    let folder = Folder::new("overlap");
    let mut faults = Faults::default();
    let head = HEAD.replace("WorldBegin", "Integrator \"volpath\" \"integer maxdepth\" 200\nWorldBegin");
    for material in ["\"interface\"", "\"dielectric\" \"float eta\" 1"] {
        let shells: String = (0..40)
            .map(|i| {
                let radius = 1.0 - 0.001 * f64::from(i);
                format!(
                    "MakeNamedMedium \"m{i}\" \"string type\" \"homogeneous\" \"float scale\" 1e-3\nMediumInterface \"m{i}\" \"\"\n\
                     Material {material}\nShape \"sphere\" \"float radius\" {radius}\n"
                )
            })
            .collect();
        folder.write("scene.pbrt", format!("{head}{shells}"));
        faults.render(&folder, material, Warned("left one out"));
    }
}

/// Names that name each other twice double at every level: textures, mixes, objects.
#[test]
fn what_doubles_at_every_level_is_bounded() {
    let levels = |count: usize, first: &str, line: &dyn Fn(usize) -> String, last: &str| {
        let lines: Vec<String> = (1..count).map(line).collect();
        format!("{first}\n{}\n{last}", lines.join("\n"))
    };
    let image = "Texture \"t0\" \"float\" \"imagemap\" \"string filename\" \"junk.png\"";
    let scale = |i: usize| {
        let below = i - 1;
        format!("Texture \"t{i}\" \"float\" \"scale\" \"texture tex\" \"t{below}\" \"texture scale\" \"t{below}\"")
    };
    let rough = |top: usize| format!("Material \"conductor\" \"texture roughness\" \"t{top}\"\nShape \"sphere\"");
    let mix = |i: usize| {
        let below = i - 1;
        format!("MakeNamedMaterial \"m{i}\" \"string type\" \"mix\" \"string materials\" [\"m{below}\" \"m{below}\"]")
    };
    let object = |i: usize| {
        let below = i - 1;
        format!("ObjectBegin \"o{i}\" ObjectInstance \"o{below}\" ObjectInstance \"o{below}\" ObjectEnd")
    };
    let folder = Folder::new("doubling");
    image::GrayImage::from_pixel(2, 2, image::Luma([99])).save(folder.path("junk.png")).expect("a picture");
    let mut faults = Faults::default();
    for (what, text, fate) in [
        ("few textures", levels(5, image, &scale, &rough(4)), Renders),
        ("textures", levels(40, image, &scale, &rough(39)), Limit("look-ups")),
        ("deep textures", levels(20_000, image, &scale, &rough(19_999)), Limit("within each other")),
        (
            "mixes",
            levels(
                20_000,
                "MakeNamedMaterial \"m0\" \"string type\" \"diffuse\"",
                &mix,
                "NamedMaterial \"m40\"\nMediumInterface \"\" \"\"\nShape \"sphere\"",
            ),
            Renders,
        ),
        (
            "objects",
            levels(40, "ObjectBegin \"o0\" Shape \"sphere\" ObjectEnd", &object, "ObjectInstance \"o39\""),
            Limit("parts"),
        ),
        (
            "deep objects",
            levels(20_000, "ObjectBegin \"o0\" Shape \"sphere\" ObjectEnd", &object, "ObjectInstance \"o9\""),
            Limit("objects within each other"),
        ),
    ] {
        folder.write("scene.pbrt", format!("{HEAD}{text}\n"));
        faults.render(&folder, what, fate);
    }
}
