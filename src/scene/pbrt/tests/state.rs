//! The graphics state: transforms, attributes, materials, objects.

use glam::{DMat4, DVec3};

use super::*;
use crate::math::Rgb;
use crate::math::spectrum::Spectrum;
use crate::scene::{MaterialIndex, MediumInterface, ParamValue};

#[test]
fn an_empty_world_has_the_formats_defaults() {
    let scene = scene("WorldBegin");
    let kinds = [&scene.camera, &scene.film, &scene.filter, &scene.sampler, &scene.integrator].map(|e| e.kind.as_str());
    assert_eq!(kinds, ["perspective", "rgb", "gaussian", "zsobol", "volpath"]);
    assert_eq!(scene.camera_transform.start, DMat4::IDENTITY);
    assert_eq!(scene.transform_times, [0.0, 1.0]);
    assert_eq!(scene.materials.len(), 1);
}

fn first_shape_transform(text: &str) -> DMat4 {
    scene(&format!("WorldBegin\n{text}\nShape \"sphere\"")).shapes[0].transform.start
}

#[test]
fn transforms_compose_from_the_right() {
    let at = |text: &str, p: [f64; 3]| first_shape_transform(text).transform_point3(p.into());
    let close =
        |found: DVec3, wanted: [f64; 3]| assert!((found - DVec3::from(wanted)).length() < 1e-12, "{found}, {wanted:?}");
    close(at("Translate 1 2 3 Scale 2 2 2", [1.0, 0.0, 0.0]), [3.0, 2.0, 3.0]);
    close(at("Scale 2 2 2 Translate 1 2 3", [1.0, 0.0, 0.0]), [4.0, 4.0, 6.0]);
    close(at("Rotate 90 0 0 1", [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    close(at("Transform [1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1]", [0.0; 3]), [5.0, 6.0, 7.0]);
    close(at("Scale 2 2 2 ConcatTransform [1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1]", [0.0; 3]), [10.0, 12.0, 14.0]);
    close(at("Scale 2 2 2 Identity", [1.0; 3]), [1.0; 3]);
    close(at("Translate 1 0 0 CoordinateSystem \"a\" Identity CoordSysTransform \"a\"", [0.0; 3]), [1.0, 0.0, 0.0]);
    close(at("Translate 1 0 0 CoordSysTransform \"world\"", [0.0; 3]), [0.0; 3]);
    // LookAt maps the eye to the origin, the target onto +z; x points to the right of a left-handed frame.
    close(at("LookAt 1 2 3  1 2 8  0 1 0", [1.0, 2.0, 3.0]), [0.0; 3]);
    close(at("LookAt 1 2 3  1 2 8  0 1 0", [2.0, 2.0, 8.0]), [1.0, 0.0, 5.0]);
}

/// As in pbrt-v4.
#[test]
fn ends_without_begins_and_unknown_systems_are_passed_over() {
    let text = "WorldBegin Translate 1 0 0 AttributeEnd CoordSysTransform \"nowhere\" Shape \"sphere\"";
    assert_eq!(scene(text).shapes[0].transform.start.transform_point3(DVec3::ZERO), DVec3::X);
    let expected = [
        "AttributeEnd without its begin: it is ignored",
        "no coordinate system is called \"nowhere\": known are world: this CoordSysTransform is ignored",
    ];
    assert_eq!(warnings(text), expected);
    // An imported file ends no block of the file that imports it.
    let parts: [(&str, &[u8]); 2] =
        [("a.pbrt", b"WorldBegin AttributeBegin Import \"b.pbrt\" AttributeEnd"), ("b.pbrt", b"AttributeEnd")];
    let (scene, _, warnings) = Files::new(&parts).load();
    assert!(scene.is_ok() && warnings.list().len() == 1, "{warnings:?}");
}

/// As in pbrt-v4: `CoordSysTransform` sets both keys whichever are active, `TransformBegin` saves the whole graphics state.
#[test]
fn named_systems_and_transform_blocks_are_pbrts() {
    let still = scene(
        "WorldBegin Translate 5 0 0 CoordinateSystem \"a\" Identity ActiveTransform EndTime CoordSysTransform \"a\" Shape \"sphere\"",
    );
    assert!(!still.shapes[0].transform.is_animated());
    let both = scene("WorldBegin TransformBegin Translate 1 0 0 Material \"conductor\" TransformEnd Shape \"sphere\"");
    assert_eq!(both.shapes[0].transform.start, DMat4::IDENTITY);
    assert_eq!(both.materials[both.shapes[0].material.0 as usize].entity.kind, "diffuse");
}

#[test]
fn the_camera_stores_world_to_camera_and_names_its_system() {
    let scene = scene(
        "MediumInterface \"\" \"air\" LookAt 0 0 -5  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40 WorldBegin\n\
         CoordSysTransform \"camera\" Shape \"sphere\" MakeNamedMedium \"air\" \"string type\" \"homogeneous\"",
    );
    assert!((scene.camera_position() - DVec3::new(0.0, 0.0, -5.0)).length() < 1e-12);
    assert_eq!(scene.camera_medium, "air");
    // The medium interface outlives WorldBegin, the transform does not.
    let shape = &scene.shapes[0];
    assert!((shape.transform.start.transform_point3(DVec3::ZERO) - DVec3::new(0.0, 0.0, -5.0)).length() < 1e-12);
    assert_eq!(
        shape.medium_interface.as_deref(),
        Some(&MediumInterface { inside: String::new(), outside: "air".into() })
    );
}

#[test]
fn motion() {
    let scene = scene(
        "TransformTimes 0 2 WorldBegin AttributeBegin ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Translate 0 1 0\n\
         Shape \"sphere\" AttributeEnd ActiveTransform StartTime Translate 0 0 1 Shape \"disk\"",
    );
    assert_eq!(scene.transform_times, [0.0, 2.0]);
    let [sphere, disk] = &scene.shapes[..] else { panic!("two shapes") };
    assert_eq!(sphere.transform.start, DMat4::from_translation(DVec3::new(0.0, 1.0, 0.0)));
    assert_eq!(sphere.transform.end, DMat4::from_translation(DVec3::new(1.0, 1.0, 0.0)));
    assert_eq!(disk.transform.start, DMat4::from_translation(DVec3::new(0.0, 0.0, 1.0)));
    assert_eq!(disk.transform.end, DMat4::IDENTITY);
}

#[test]
fn attribute_blocks_restore_everything() {
    let scene = scene(
        "WorldBegin Material \"diffuse\" Shape \"a\"\n\
         AttributeBegin Translate 1 0 0 ReverseOrientation AreaLightSource \"diffuse\" Material \"conductor\"\n\
         MediumInterface \"m\" Attribute \"shape\" \"float radius\" 3 ColorSpace \"rec2020\"\n\
         Shape \"b\" Shape \"c\" \"float radius\" 4 AttributeEnd Shape \"d\" LightSource \"point\" \"rgb I\" [1 0 0]\n\
         MakeNamedMedium \"m\" \"string type\" \"homogeneous\"",
    );
    let [a, b, c, d] = &scene.shapes[..] else { panic!("four shapes") };
    assert_eq!([a, b, c, d].map(|s| s.reverse_orientation), [false, true, true, false]);
    assert_eq!([a, b, c, d].map(|s| s.area_light), [None, Some(0), Some(0), None]);
    assert_eq!([a, b, c, d].map(|s| s.material.0), [1, 2, 2, 1]);
    assert_eq!([a, b, c, d].map(|s| s.entity.params.float("radius", 1.0).unwrap()), [1.0, 3.0, 4.0, 1.0]);
    assert_eq!(b.medium_interface.as_deref(), Some(&MediumInterface { inside: "m".into(), outside: "m".into() }));
    assert_eq!(d.medium_interface, None);
    assert_eq!(d.transform.start, DMat4::IDENTITY);
    assert_eq!(scene.lights[0].entity.params.spectrum("I").unwrap(), Some(&Spectrum::Rgb(Rgb::new(1.0, 0.0, 0.0))));
    assert_eq!(scene.area_lights.len(), 1);
}

#[test]
fn attribute_defaults_are_never_called_unused() {
    let scene = scene("WorldBegin Attribute \"shape\" \"float a\" 1 Shape \"sphere\" \"float b\" 2");
    let mut warnings = Warnings::default();
    scene.shapes[0].entity.params.warn_unused(&mut warnings);
    let messages: Vec<&str> = warnings.list().iter().map(|w| w.message.as_str()).collect();
    assert_eq!(messages, ["parameter \"b\" of Shape \"sphere\" is not used"]);
}

#[test]
fn materials_may_be_named_before_they_are_made() {
    let scene = scene(
        "WorldBegin NamedMaterial \"late\" Shape \"a\" MakeNamedMaterial \"early\" \"string type\" \"conductor\" NamedMaterial \"early\"\n\
         Shape \"b\" MakeNamedMaterial \"late\" \"string type\" \"mix\" \"string materials\" [\"early\" \"early\"]",
    );
    let names = scene.shapes.iter().map(|s| scene.materials[s.material.0 as usize].name.as_deref());
    assert_eq!(names.collect::<Vec<_>>(), [Some("late"), Some("early")]);
    assert_eq!(scene.materials[1].entity.kind, "conductor");
    assert_eq!(scene.shapes[0].material, MaterialIndex(2));
}

#[test]
fn objects_may_be_instanced_before_they_are_defined() {
    let scene = scene(
        "WorldBegin ObjectInstance \"late\" ObjectBegin \"early\" Shape \"disk\" ObjectEnd ObjectInstance \"early\"\n\
         ObjectBegin \"late\" Shape \"sphere\" ObjectInstance \"early\" ObjectEnd ObjectInstance \"late\" ObjectInstance \"late\"",
    );
    let names = scene.instances.iter().map(|i| scene.objects[i.object as usize].name.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["late", "early", "late", "late"]);
    assert_eq!(scene.objects[1].instances[0].object, 0);
    // Within an object only what is above it is known: objects that hold each other cannot be stated.
    let circle =
        "WorldBegin ObjectBegin \"a\" ObjectInstance \"b\" ObjectEnd ObjectBegin \"b\" ObjectInstance \"a\" ObjectEnd";
    assert!(text(circle).error().contains("no object called \"b\" is defined above"));
}

#[test]
fn objects_and_instances() {
    let text = "WorldBegin Translate 1 0 0 ObjectBegin \"o\" Translate 0 1 0 AreaLightSource \"diffuse\" Shape \"sphere\" Shape \"disk\" ObjectEnd\n\
                Scale 2 2 2 ObjectInstance \"o\" ObjectInstance \"o\"";
    let scene = scene(text);
    assert!(scene.shapes.is_empty());
    let object = &scene.objects[0];
    assert_eq!((object.name.as_str(), object.shapes.len()), ("o", 2));
    assert_eq!(object.shapes[0].transform.start, DMat4::from_translation(DVec3::new(1.0, 1.0, 0.0)));
    assert_eq!(object.shapes[0].area_light, None);
    assert_eq!(scene.instances.len(), 2);
    let expected = DMat4::from_translation(DVec3::X) * DMat4::from_scale(DVec3::splat(2.0));
    assert_eq!(scene.instances[1].transform.start, expected);
    let warnings = warnings(text);
    assert!(warnings.iter().any(|w| w.contains("inside object definitions")), "{warnings:?}");
}

#[test]
fn matrices_may_be_multiples_of_affine_ones() {
    let shape = |text: &str| scene(&format!("WorldBegin {text} Shape \"a\"")).shapes[0].transform.start;
    let twice = shape("Transform [2 0 0 0 0 2 0 0 0 0 2 0 6 0 0 2]");
    assert_eq!(twice, DMat4::from_translation(DVec3::new(3.0, 0.0, 0.0)));
    assert_eq!(shape("ConcatTransform [-4 0 0 0 0 -4 0 0 0 0 -4 0 -12 0 0 -4]"), twice);
    // Perspective is dropped.
    assert_eq!(shape("Transform [1 0 0 0.5 0 1 0 0 0 0 1 0 3 0 0 1]"), twice);
    assert_eq!(shape("Transform [1 0 0 0 0 1 0 0 0 0 1 0 3 0 0 0]"), twice);
}

#[test]
fn a_texture_counts_before_a_number_of_the_same_name() {
    for text in ["\"float alpha\" 0.5 \"texture alpha\" \"t\"", "\"texture alpha\" \"t\" \"float alpha\" 0.5"] {
        let text = format!("WorldBegin Texture \"t\" \"float\" \"constant\" Shape \"a\" {text}");
        let alpha = scene(&text).shapes[0].entity.params.get("alpha").expect("it is there").value.clone();
        assert_eq!(alpha, ParamValue::Texture("t".to_owned()));
        let said = warnings(&text);
        assert!(said.len() == 1 && said[0].contains("given twice"), "{said:?}");
    }
}
