//! The directives' names, where each may stand, and suggestions for misspelt ones.

use super::older::UPGRADE;

/// Where a directive may stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// Only before `WorldBegin`.
    Header,
    /// Only after it.
    World,
    /// Everywhere.
    Both,
}

macro_rules! directives {
    ($($name:ident $block:ident,)*) => {
        /// A directive of the format.
        #[allow(missing_docs, reason = "the names are the format's own")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Directive { $($name,)* }

        impl Directive {
            /// Every name.
            pub const NAMES: &[&str] = &[$(stringify!($name),)*];

            /// The directive called `name` exactly.
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $(stringify!($name) => Some(Self::$name),)* _ => None }
            }

            /// Its name.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name),)* }
            }

            /// Where it may stand.
            pub const fn block(self) -> Block {
                match self { $(Self::$name => Block::$block,)* }
            }
        }
    };
}

directives! {
    Accelerator Header,
    ActiveTransform Both,
    AreaLightSource World,
    Attribute Both,
    AttributeBegin World,
    AttributeEnd World,
    Camera Header,
    ColorSpace Both,
    ConcatTransform Both,
    CoordSysTransform Both,
    CoordinateSystem Both,
    Film Header,
    Identity Both,
    Import World,
    Include Both,
    Integrator Header,
    LightSource World,
    LookAt Both,
    MakeNamedMaterial World,
    MakeNamedMedium Both,
    Material World,
    MediumInterface Both,
    NamedMaterial World,
    ObjectBegin World,
    ObjectEnd World,
    ObjectInstance World,
    Option Both,
    PixelFilter Header,
    ReverseOrientation World,
    Rotate Both,
    Sampler Header,
    Scale Both,
    Shape World,
    Texture World,
    Transform Both,
    TransformBegin World,
    TransformEnd World,
    TransformTimes Header,
    Translate Both,
    WorldBegin Header,
}

/// Advice for the unknown directive `word`.
pub fn advice(word: &str) -> String {
    match word {
        "WorldEnd" => format!("pbrt-v4 files have no WorldEnd: remove the line; {UPGRADE}"),
        "SurfaceIntegrator" | "VolumeIntegrator" | "Renderer" | "Volume" | "Texture2" => {
            format!("this is of pbrt-v2 or older; {UPGRADE}")
        }
        _ => did_you_mean(word, Directive::NAMES),
    }
}

/// "did you mean …?" with the nearest of `known`, or a list of them where none is near.
pub fn did_you_mean(word: &str, known: &[&str]) -> String {
    let lower = word.to_ascii_lowercase();
    let nearest = known.iter().map(|k| (distance(&lower, &k.to_ascii_lowercase()), *k)).min();
    match nearest {
        Some((d, name)) if d <= 1 + word.chars().count().min(12) / 4 => format!("did you mean {name}?"),
        _ => format!("known are {}", known.join(", ")),
    }
}

/// The number of insertions, deletions, replacements and swaps of neighbours that turn `a` into `b` (optimal string
/// alignment). Only the first 64 characters count.
fn distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().take(64).collect();
    let b: Vec<char> = b.chars().take(64).collect();
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut row = vec![i + 1];
        for j in 0..b.len() {
            let replaced = last[j] + usize::from(a[i] != b[j]);
            let mut best = replaced.min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                best = best.min(before_last[j - 1] + 1);
            }
            row.push(best);
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_suggestions() {
        for name in Directive::NAMES {
            assert_eq!(Directive::from_name(name).map(Directive::name), Some(*name));
        }
        assert_eq!(advice("Shpae"), "did you mean Shape?");
        assert_eq!(advice("translate"), "did you mean Translate?");
        assert_eq!(advice("AttributeEndd"), "did you mean AttributeEnd?");
        assert!(advice("Qwertzuiop").starts_with("known are"));
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("ab", "ba"), 1);
    }
}
