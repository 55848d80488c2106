//! What tells a file of an older pbrt: types that pbrt-v3 has (its file format documentation) and pbrt-v4 has not. Said once for a scene, since there
//! one thing leads to the next, with the way out.

use crate::scene::SceneError;

/// The way out.
pub const UPGRADE: &str = "pbrt-v4's own `pbrt --upgrade old.pbrt > new.pbrt` converts files of pbrt-v3";

/// Whether `error` tells the way out.
pub fn says_so(error: &SceneError) -> bool {
    error.help.as_deref().is_some_and(|help| help.contains(UPGRADE))
}

/// Types by the directive that names them; those of named materials, media and textures are with their kind.
const TYPES: [(&str, &[&str]); 10] = [
    ("AreaLightSource", &["area"]),
    ("Camera", &["environment"]),
    ("Film", &["image"]),
    ("Integrator", &["directlighting", "whitted"]),
    ("LightSource", &["exinfinite"]),
    (
        "Material",
        &[
            "disney",
            "fourier",
            "glass",
            "kdsubsurface",
            "matte",
            "metal",
            "mirror",
            "plastic",
            "shinymetal",
            "substrate",
            "translucent",
            "uber",
        ],
    ),
    ("MakeNamedMedium", &["heterogeneous"]),
    ("Sampler", &["02sequence", "adaptive", "bestcandidate", "lowdiscrepancy", "maxmindist", "random"]),
    ("Shape", &["cone", "heightfield", "hyperboloid", "nurbs", "paraboloid"]),
    ("Texture", &["uv"]),
];

/// Whether this type is one of pbrt-v3 alone.
pub fn is_older(directive: &str, kind: &str) -> bool {
    TYPES.iter().any(|(name, kinds)| *name == directive && kinds.contains(&kind))
}

/// Advice about a type that is not known, with the way out where it is one of pbrt-v3.
pub fn with_upgrade(directive: &str, kind: &str, advice: &str) -> String {
    if is_older(directive, kind) { format!("{advice}; {UPGRADE}") } else { advice.to_owned() }
}
