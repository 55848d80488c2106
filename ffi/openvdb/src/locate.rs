//! Where the worker program is.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::types::VdbError;

/// The environment variable that names the worker's executable.
pub const WORKER_VARIABLE: &str = "LANTERNFISH_VDB";

/// The worker's name, where nothing else names it.
pub const WORKER_NAME: &str = "lanternfish-vdb";

static WORKER: OnceLock<PathBuf> = OnceLock::new();

/// Names the worker's executable, for programs that do not lie beside it (test harnesses, say). The first call counts;
/// [`WORKER_VARIABLE`] goes before it.
pub fn set_worker(program: impl Into<PathBuf>) {
    WORKER.get_or_init(|| program.into());
}

/// The worker's executable.
pub(crate) fn worker() -> Result<PathBuf, VdbError> {
    match (std::env::var_os(WORKER_VARIABLE), WORKER.get()) {
        (Some(program), _) if !program.is_empty() => Ok(program.into()),
        (_, Some(program)) => Ok(program.clone()),
        _ => {
            let running = std::env::current_exe().map_err(|e| missing(format!("where to look is unknown: {e}")))?;
            beside(&running)
        }
    }
}

fn missing(reason: String) -> VdbError {
    let reason = format!("{reason} (the environment variable {WORKER_VARIABLE} can say where it is)");
    VdbError::Reader { program: WORKER_NAME.into(), reason }
}

/// The worker in the folder of the executable `running`, or in the one above if the former is cargo's `deps`: a folder
/// above any other may be anyone's.
fn beside(running: &Path) -> Result<PathBuf, VdbError> {
    let folder = running.parent();
    let above = folder.filter(|f| f.file_name() == Some(OsStr::new("deps"))).and_then(Path::parent);
    let mut name = OsString::from(WORKER_NAME);
    name.push(std::env::consts::EXE_SUFFIX);
    let folders: Vec<&Path> = folder.into_iter().chain(above).collect();
    let found = folders.iter().map(|f| f.join(&name)).find(|program| program.is_file());
    found.ok_or_else(|| {
        let places: Vec<String> = folders.iter().map(|f| f.display().to_string()).collect();
        missing(format!("it is not in {}", places.join(" nor in ")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_looked_for_beside_the_program_and_above_deps() {
        let folder = tempfile::tempdir().expect("a folder");
        let (bin, deps) = (folder.path().join("bin"), folder.path().join("bin/deps"));
        std::fs::create_dir_all(&deps).expect("folders");
        let text = beside(&deps.join("tests-1234")).expect_err("nothing is there").to_string();
        for part in [WORKER_NAME, WORKER_VARIABLE, &bin.display().to_string(), &deps.display().to_string()] {
            assert!(text.contains(part), "{part}: {text}");
        }
        std::fs::write(folder.path().join(WORKER_NAME), "").expect("written");
        assert!(beside(&bin.join("lanternfish")).is_err(), "the folder above counts for deps only");
        std::fs::write(bin.join(WORKER_NAME), "").expect("written");
        for running in [bin.join("lanternfish"), deps.join("tests-1234")] {
            assert_eq!(beside(&running).expect("there"), bin.join(WORKER_NAME));
        }
    }
}
