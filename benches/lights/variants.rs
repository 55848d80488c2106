//! What is compared: the ways of selecting lights (columns of the table), and the defaults with one thing changed (ablations); or the ways of sampling
//! scattering points.

/// A name and what it is on the command line.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Variant {
    pub name: &'static str,
    pub arguments: &'static [&'static str],
}

const fn variant(name: &'static str, arguments: &'static [&'static str]) -> Variant {
    Variant { name, arguments }
}

pub const UNIFORM: Variant = variant("uniform", &["--lights", "uniform"]);
pub const OPTIMAL: Variant = variant("optimal", &["--lights", "optimal"]);
pub const NO_VISIBILITY: Variant = variant("no visibility", &["--lights", "cache-points", "--cache-visibility", "off"]);
pub const DEFAULTS: Variant = variant("cache points", &["--lights", "cache-points"]);
pub const TREE: Variant = variant("tree", &["--lights", "tree"]);

/// Cache points as Li et al. 2024 have them, as far as the program's options go.
pub const PAPER: Variant = variant(
    "paper's rule",
    &[
        "--lights",
        "cache-points",
        "--cache-visibility",
        "threshold",
        "--cache-gathering",
        "lists",
        "--light-candidates",
        "1",
        "--cache-no-normals",
    ],
);

const COLUMNS: [Variant; 7] = [
    UNIFORM,
    OPTIMAL,
    NO_VISIBILITY,
    PAPER,
    DEFAULTS,
    TREE,
    variant("tree without splitting", &["--lights", "tree", "--splitting", "0"]),
];

/// The defaults with one thing said. Where that is the default already, it shows how far equal things come out unequal.
const ABLATIONS: [Variant; 15] = [
    variant("visibility off", &["--lights", "cache-points", "--cache-visibility", "off"]),
    variant("visibility threshold", &["--lights", "cache-points", "--cache-visibility", "threshold"]),
    variant("visibility root", &["--lights", "cache-points", "--cache-visibility", "root"]),
    variant("visibility clusters", &["--lights", "cache-points", "--cache-visibility", "clusters"]),
    variant("gathering lists", &["--lights", "cache-points", "--cache-gathering", "lists"]),
    variant("no normals", &["--lights", "cache-points", "--cache-no-normals"]),
    variant("no alike", &["--lights", "cache-points", "--cache-no-alike"]),
    variant("no near clusters", &["--lights", "cache-points", "--cache-no-near-clusters"]),
    variant("1 candidate", &["--lights", "cache-points", "--light-candidates", "1"]),
    variant("4 candidates", &["--lights", "cache-points", "--light-candidates", "4"]),
    variant("32 entries", &["--lights", "cache-points", "--cache-entries", "32"]),
    variant("64 entries", &["--lights", "cache-points", "--cache-entries", "64"]),
    variant("256 entries", &["--lights", "cache-points", "--cache-entries", "256"]),
    variant("no refining", &["--lights", "cache-points", "--cache-no-refining"]),
    variant("no rehearsal", &["--lights", "cache-points", "--cache-no-rehearsal"]),
];

/// The defaults, where ways of sampling scattering points are compared.
pub const AUTO: Variant = variant("auto", &[]);
pub const NULL: Variant = variant("null", &["--volume-sampling", "null"]);

const SAMPLING: [Variant; 8] = [
    AUTO,
    NULL,
    variant("in-scatter", &["--volume-sampling", "in-scatter"]),
    variant("both", &["--volume-sampling", "both"]),
    variant("paths", &["--volume-sampling", "paths"]),
    variant("null by the tree", &["--volume-sampling", "null", "--lights", "tree"]),
    variant("equi-angular by the tree", &["--volume-sampling", "equi-angular", "--lights", "tree"]),
    NULL_WITHOUT_FIRES,
];

/// Null tracking, where what media emit is found by chance.
pub const NULL_WITHOUT_FIRES: Variant =
    variant("null without volume lights", &["--volume-sampling", "null", "--volume-lights", "off"]);

/// What all others are compared with.
pub const fn defaults(sampling: bool) -> Variant {
    if sampling { AUTO } else { DEFAULTS }
}

/// The columns of the table.
pub fn columns(sampling: bool) -> Vec<Variant> {
    if sampling { SAMPLING.to_vec() } else { COLUMNS.to_vec() }
}

const BEAMS: Variant = variant("no beams", &["--lights", "cache-points", "--cache-no-beams"]);

/// The ablations of a scene.
pub fn ablations(scene: &str, sampling: bool) -> Vec<Variant> {
    if sampling {
        return vec![];
    }
    let beams = (scene == "beams").then_some(BEAMS);
    ABLATIONS.into_iter().chain(beams).collect()
}
