//! What is compared: names for arguments of `lanternfish render`.

use serde::Serialize;

/// A name and what it is on the command line of a render.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Method {
    /// Its name in tables and plots.
    pub name: String,
    /// The arguments.
    pub arguments: Vec<String>,
}

/// The names that need no arguments of the user.
const KNOWN: [(&str, &[&str]); 12] = [
    ("auto", &[]),
    ("uniform", &["--lights", "uniform"]),
    ("power", &["--lights", "power"]),
    ("tree", &["--lights", "tree"]),
    ("optimal", &["--lights", "optimal"]),
    ("cache-points", &["--lights", "cache-points"]),
    ("no-visibility", &["--lights", "cache-points", "--cache-visibility", "off"]),
    ("null", &["--volume-sampling", "null"]),
    ("in-scatter", &["--volume-sampling", "in-scatter"]),
    ("both", &["--volume-sampling", "both"]),
    ("paths", &["--volume-sampling", "paths"]),
    // With lights chosen by what is known without learning, as it was published.
    ("equi-angular", &["--volume-sampling", "equi-angular", "--lights", "tree"]),
];

impl Method {
    /// Of the names that are known.
    pub fn known(name: &str) -> Option<Self> {
        let (name, arguments) = KNOWN.iter().find(|(known, _)| *known == name)?;
        Some(Self { name: (*name).to_owned(), arguments: arguments.iter().map(|&a| a.to_owned()).collect() })
    }

    /// A name that is known, or `NAME=ARGUMENTS`, which are parted at spaces.
    ///
    /// # Errors
    /// Names that are not known, and known ones that shall mean something else.
    pub fn parse(text: &str) -> Result<Self, String> {
        let Some((name, arguments)) = text.split_once('=') else {
            return Self::known(text.trim()).ok_or_else(|| {
                format!("no method is called \"{}\": there are {}, and NAME=ARGUMENTS", text.trim(), names())
            });
        };
        let name = name.trim();
        if name.is_empty() || name.starts_with('-') || Self::known(name).is_some() {
            return Err(format!("\"{name}\" cannot be the name of a method of your own"));
        }
        let arguments = arguments.split_whitespace().map(str::to_owned).collect();
        Ok(Self { name: name.to_owned(), arguments })
    }

    /// A list of them with commas between.
    ///
    /// # Errors
    /// Those of [`Method::parse`], and names that occur twice.
    pub fn parse_list(lists: &[String]) -> Result<Vec<Self>, String> {
        let mut methods: Vec<Self> = vec![];
        for text in lists.iter().flat_map(|list| list.split(',')) {
            let method = Self::parse(text)?;
            if methods.iter().any(|other| other.name == method.name) {
                return Err(format!("the method \"{}\" is there twice", method.name));
            }
            methods.push(method);
        }
        Ok(methods)
    }

    /// Whether each light is asked at each vertex.
    pub fn is_exhaustive(&self) -> bool {
        self.arguments.windows(2).any(|pair| pair == ["--lights", "optimal"])
    }

    /// Its arguments as one would type them.
    pub fn show(&self) -> String {
        self.arguments.join(" ")
    }
}

/// All names that are known.
pub fn names() -> String {
    KNOWN.map(|(name, _)| name).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_hold_names_and_arguments() {
        let lists = ["tree,optimal".to_owned(), "few=--lights cache-points --cache-entries=32,auto".to_owned()];
        let methods = Method::parse_list(&lists).expect("all are right");
        let names: Vec<&str> = methods.iter().map(|method| method.name.as_str()).collect();
        assert_eq!(names, ["tree", "optimal", "few", "auto"]);
        assert_eq!(methods[2].show(), "--lights cache-points --cache-entries=32");
        assert_eq!([0, 1].map(|i| methods[i].is_exhaustive()), [false, true]);
        let refused = |text: &str| Method::parse_list(&[text.to_owned()]).expect_err(text);
        assert!(refused("tree,trie").contains("\"trie\": there are auto, uniform"));
        assert!(refused("tree,tree").contains("twice"));
        for wrong in ["", "=--lights tree", "tree=--lights uniform", "tree,"] {
            refused(wrong);
        }
    }
}
