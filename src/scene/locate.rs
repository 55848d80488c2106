//! Files by the names that scenes have for them, which exporters on other systems write with backslashes.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// The file called `name` beside `folder`, unless the name is absolute. Where there is none and the name has backslashes, they are read as slashes, also those
/// that began an escape (`\t`) without being meant so.
pub fn locate(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    match with_slashes(name) {
        Cow::Owned(slashed) if !path.exists() => {
            let slashed = folder.join(slashed);
            if slashed.exists() { slashed } else { path }
        }
        _ => path,
    }
}

/// `name` with slashes in place of backslashes, also of those that began an escape.
pub fn with_slashes(name: &str) -> Cow<'_, str> {
    if !name.contains(|c: char| c == '\\' || escaped(c).is_some()) {
        return name.into();
    }
    let mut slashed = String::with_capacity(name.len() + 1);
    for c in name.chars() {
        match escaped(c) {
            Some(letter) => slashed.extend(['/', letter]),
            None => slashed.push(if c == '\\' { '/' } else { c }),
        }
    }
    slashed.into()
}

/// The letter behind the backslash that stands for this character in a string.
fn escaped(c: char) -> Option<char> {
    Some(match c {
        '\u{8}' => 'b',
        '\u{c}' => 'f',
        '\n' => 'n',
        '\r' => 'r',
        '\t' => 't',
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backslashes_are_slashes_where_no_file_has_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("a")).expect("a folder");
        for name in ["a/tree.ply", "a/x.ply", "b\\x.ply"] {
            std::fs::write(at(name), "").expect("a file");
        }
        for (name, expected) in [
            ("a/x.ply", "a/x.ply"),
            ("a\\x.ply", "a/x.ply"),
            ("a\tree.ply", "a/tree.ply"),
            ("b\\x.ply", "b\\x.ply"),
            // What is nowhere keeps the name it has.
            ("c\\x.ply", "c\\x.ply"),
        ] {
            assert_eq!(locate(folder.path(), name), at(expected));
        }
        assert_eq!(locate(folder.path(), "/no\\where"), Path::new("/no\\where"));
    }
}
