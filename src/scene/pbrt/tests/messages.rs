//! Errors and warnings: where they are placed, what they say.

use super::*;

#[test]
fn warnings_name_what_happens() {
    for (text, part) in [
        ("Accelerator \"octree\" WorldBegin", "Accelerator \"octree\""),
        ("ColorSpace \"adobe\" WorldBegin", "unknown colour space \"adobe\""),
        ("WorldBegin TransformBegin TransformEnd", "TransformBegin is deprecated"),
        ("WorldBegin Shape \"a\" \"float r\" 1 \"float r\" 2", "given twice"),
        (
            "WorldBegin Shape \"a\" \"float r metres\" 1",
            "found `float r metres`: the words after these two are ignored",
        ),
        ("WorldBegin Shape \"a\" \"float r\" -1e40", "`-1e40` is too large or not finite: -3.4028235e38 is taken"),
        ("WorldBegin Transform [1 0 0 0.5 0 1 0 0 0 0 1 0 0 0 0 1]", "is 0.5 0 0 1: a perspective: 0 0 0 1 is taken"),
        ("Film \"rgb\" Film \"rgb\" WorldBegin", "Film is given twice"),
        ("WorldBegin AttributeBegin", "never ended"),
        ("WorldBegin AreaLightSource \"diffuse\"", "in force at no shape"),
    ] {
        let found = warnings(text);
        assert!(found.iter().any(|w| w.contains(part)), "{text}: {found:?}");
    }
}

#[test]
fn errors_have_their_place() {
    let mut wrong = Vec::new();
    for (text, expected) in [
        ("", "main.pbrt:1:1: the file ends before WorldBegin"),
        ("WorldBegin\nShpae \"sphere\"", "main.pbrt:2:1: unknown directive `Shpae`"),
        ("# old\rWorldBegin\r\n# comment\r\rShpae", "main.pbrt:5:1: unknown directive `Shpae`"),
        ("WorldBegin Shape \"sphere\r\"", "main.pbrt:1:18: this string has no closing quote"),
        ("WorldBegin\n  \"float x\" 1", "main.pbrt:2:3: expected a directive, found `float x`"),
        ("WorldBegin\nTranslate 1 2 3 4", "main.pbrt:2:17: expected a directive, found the number `4`"),
        ("WorldBegin\nTranslate 1 2\nShape \"a\"", "main.pbrt:3:1: expected a number, found `Shape`"),
        ("WorldBegin\nTranslate 1 2", "main.pbrt:2:14: the file ends where a number should follow"),
        ("Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 2]", "main.pbrt:1:44: expected ] after 16 numbers, found `2`"),
        ("WorldBegin Shape \"a\" \"float x\" [1 2 nan]", "main.pbrt:1:37: expected a number, found `nan`"),
        (
            "WorldBegin Shape \"a\" \"float x\" [1 2 1e400]",
            "main.pbrt:1:37: the number `1e400` is too large or not finite",
        ),
        ("WorldBegin Shape \"a\" \"float x\" -inf", "main.pbrt:1:32: the number `-inf` is too large or not finite"),
        ("WorldBegin Translate 1e400 0 0", "main.pbrt:1:22: the number `1e400` is too large or not finite"),
        (
            "WorldBegin Scale 1e200 1 1 Scale 1e200 1 1",
            "main.pbrt:1:28: the current transformation's numbers become too large",
        ),
        ("WorldBegin Shape \"a\" \"integer x\" 1.5", "main.pbrt:1:34: expected an integer, found `1.5`"),
        ("WorldBegin Shape \"a\" \"integer x\" 3e9", "main.pbrt:1:34: the integer `3e9` does not fit in 32 bits"),
        ("WorldBegin Shape \"a\" \"bool x\" 1", "main.pbrt:1:31: expected true or false, found `1`"),
        ("WorldBegin Shape \"a\" \"string x\" 1", "main.pbrt:1:33: expected a string in quotes, found `1`"),
        ("WorldBegin Shape \"a\" \"float x\" \"1\"", "main.pbrt:1:32: expected a number, found the string \"1\""),
        (
            "WorldBegin Shape \"a\" \"point3 P\" [1 2]",
            "main.pbrt:1:22: point3 values come in groups of 3; 2 numbers do not divide by that",
        ),
        ("WorldBegin Shape \"a\" \"float x\" [1 2", "main.pbrt:1:32: this [ is never closed"),
        ("WorldBegin Shape \"a\" \"float x\" [1 [2", "main.pbrt:1:35: brackets within brackets"),
        ("WorldBegin Shape \"a\" \"float x\" ]", "main.pbrt:1:32: found ] where the parameter's value should stand"),
        ("WorldBegin Shape \"a\" \"float\" 1", "main.pbrt:1:22: expected \"type name\", found \"float\""),
        ("WorldBegin Shape \"a\" \"color x\" [1 1 1]", "main.pbrt:1:22: \"color\" is no parameter type of pbrt-v4"),
        ("WorldBegin Shape \"a\" \"flaot x\" 1", "main.pbrt:1:22: unknown parameter type \"flaot\""),
        ("WorldBegin Shape \"a\" 5", "main.pbrt:1:22: expected a parameter (\"type name\") or a directive, found `5`"),
        (
            "WorldBegin Shape \"a\" \"rgb c\" [1 1]",
            "main.pbrt:1:22: rgb values come in groups of 3; 2 numbers do not divide by that",
        ),
        (
            "WorldBegin Shape \"a\" \"blackbody c\" 0",
            "main.pbrt:1:22: a black body's temperature is in kelvin and above 0, found 0",
        ),
        (
            "WorldBegin Shape \"a\" \"spectrum c\" [500 1 400 1]",
            "main.pbrt:1:22: a spectrum's wavelengths must rise, found 400 after 500",
        ),
        (
            "WorldBegin Shape \"a\" \"spectrum c\" \"metal-Au-et\"",
            "main.pbrt:1:35: \"metal-Au-et\" is neither a named spectrum nor a file",
        ),
        ("WorldBegin Shape \"sphere\n\"", "main.pbrt:1:18: this string has no closing quote"),
        ("WorldBegin Shape \"a\\q\"", "main.pbrt:1:20: unknown escape \\q in a string"),
        ("Shape \"a\"", "main.pbrt:1:1: Shape may stand only after WorldBegin"),
        ("WorldBegin\nCamera \"perspective\"", "main.pbrt:2:1: Camera may stand only before WorldBegin"),
        ("WorldBegin ObjectEnd", "main.pbrt:1:12: ObjectEnd without its begin"),
        (
            "WorldBegin ObjectBegin \"o\" AttributeEnd",
            "main.pbrt:1:28: AttributeEnd where the ObjectBegin of line 1 is still open",
        ),
        ("WorldBegin ObjectBegin \"o\"", "main.pbrt:1:12: this ObjectBegin is never ended"),
        (
            "WorldBegin ObjectBegin \"o\" ObjectBegin \"p\"",
            "main.pbrt:1:28: object definitions cannot nest: \"o\" of line 1 is open",
        ),
        ("WorldBegin ObjectInstance \"o\"", "main.pbrt:1:27: no object is called \"o\""),
        (
            "WorldBegin ObjectBegin \"o\" ObjectInstance \"o\" ObjectEnd",
            "main.pbrt:1:43: no object called \"o\" is defined above",
        ),
        ("WorldBegin NamedMaterial \"m\"", "main.pbrt:1:26: no material is called \"m\""),
        ("WorldBegin MediumInterface \"m\" \"\"", "main.pbrt:1:28: no medium is called \"m\""),
        ("WorldBegin Material \"diffuse\" \"texture reflectance\" \"t\"", "main.pbrt:1:31: no texture is called \"t\""),
        (
            "WorldBegin Texture \"t\" \"float\" \"scale\" \"texture tex\" \"u\"",
            "main.pbrt:1:40: no texture is called \"u\"",
        ),
        (
            "WorldBegin Texture \"t\" \"color\" \"scale\"",
            "main.pbrt:1:24: a texture's type is float or spectrum, found \"color\"",
        ),
        ("WorldBegin MakeNamedMaterial \"m\"", "main.pbrt:1:30: MakeNamedMaterial \"m\" lacks its type"),
        ("Rotate 90 0 0 0", "main.pbrt:1:1: Rotate's axis is zero"),
        (
            "LookAt 0 0 0 0 0 1 0 0 1",
            "main.pbrt:1:1: LookAt's eye and target coincide, or its up vector points along the view or is zero",
        ),
        (
            "Scale 1 1 0 Camera \"perspective\"",
            "main.pbrt:1:13: the camera's transform cannot be inverted: it flattens space",
        ),
        ("ActiveTransform Now", "main.pbrt:1:17: expected StartTime, EndTime or All, found `Now`"),
    ] {
        let found = text_error(text);
        if found != expected {
            wrong.push(format!("{text}\n     found {found}\n  expected {expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn advice_helps() {
    for (main, advice) in [
        ("WorldBegin Shpae \"sphere\"", "did you mean Shape?"),
        (
            "WorldBegin WorldEnd",
            "pbrt-v4 files have no WorldEnd: remove the line; pbrt-v4's own `pbrt --upgrade old.pbrt > new.pbrt` converts files of pbrt-v3",
        ),
        ("WorldBegin Shape \"a\" \"spectrum c\" \"metal-Au-et\"", "did you mean metal-Au-eta?"),
        (
            "WorldBegin Shape \"a\" \"color c\" [1 1 1]",
            "give the colour as linear \"rgb\"; pbrt-v4's own `pbrt --upgrade old.pbrt > new.pbrt` converts files of pbrt-v3",
        ),
    ] {
        let error = text(main).load().0.unwrap_err();
        assert_eq!(error.help.as_deref(), Some(advice), "for {main}");
    }
}
