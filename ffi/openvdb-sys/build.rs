//! Compiles the shim against the installed OpenVDB and links it. What is missing is named with its Debian package.

use std::path::{Path, PathBuf};

fn include_folders() -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = std::env::var_os("OPENVDB_INCLUDE_DIR").map(PathBuf::from).into_iter().collect();
    folders.extend(["/usr/include", "/usr/local/include"].map(PathBuf::from));
    folders
}

fn find_header(header: &str) -> Option<PathBuf> {
    include_folders().into_iter().find(|folder| folder.join(header).is_file())
}

fn library_folders() -> Vec<PathBuf> {
    let arch = std::env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::var_os("OPENVDB_LIB_DIR").map(PathBuf::from).into_iter().collect();
    folders.push(Path::new("/usr/lib").join(format!("{arch}-linux-gnu")));
    folders.extend(["/usr/lib64", "/usr/lib", "/usr/local/lib"].map(PathBuf::from));
    folders
}

/// The `-l` name of the installed Imath: it carries its version on Debian 12 and 13 (`Imath-3_1`), not everywhere.
fn imath() -> Option<String> {
    let mut found = Vec::new();
    for folder in library_folders() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if let Some(stem) = name.strip_prefix("lib").and_then(|n| n.strip_suffix(".so"))
                && stem.starts_with("Imath")
            {
                found.push(stem.to_owned());
            }
        }
    }
    found.sort();
    found.pop()
}

fn has_library(name: &str) -> bool {
    library_folders().iter().any(|folder| folder.join(format!("lib{name}.so")).is_file())
}

fn main() {
    for file in ["build.rs", "src/shim.cpp", "src/shim.h"] {
        println!("cargo:rerun-if-changed={file}");
    }
    println!("cargo:rerun-if-env-changed=OPENVDB_INCLUDE_DIR");
    println!("cargo:rerun-if-env-changed=OPENVDB_LIB_DIR");
    let mut missing = Vec::new();
    for (header, package) in [
        ("openvdb/openvdb.h", "libopenvdb-dev"),
        ("boost/version.hpp", "libboost-dev"),
        ("Imath/half.h", "libimath-dev"),
        ("tbb/tbb.h", "libtbb-dev"),
    ] {
        if find_header(header).is_none() {
            missing.push((header.to_owned(), package));
        }
    }
    let imath = imath();
    for (library, package) in [("openvdb", "libopenvdb-dev"), ("tbb", "libtbb-dev")] {
        if !has_library(library) {
            missing.push((format!("lib{library}.so"), package));
        }
    }
    if imath.is_none() {
        missing.push(("libImath*.so".to_owned(), "libimath-dev"));
    }
    if !missing.is_empty() {
        eprintln!("OpenVDB, or something it needs, is not installed:");
        for (what, package) in &missing {
            eprintln!("  {what} (Debian package {package})");
        }
        let mut packages: Vec<_> = missing.iter().map(|(_, package)| *package).collect();
        packages.sort_unstable();
        packages.dedup();
        eprintln!("Install with: apt-get install {}", packages.join(" "));
        eprintln!("Or build without .vdb files: --no-default-features --features embree");
        std::process::exit(1);
    }

    let mut build = cc::Build::new();
    // Debug information of OpenVDB's templates is fifteen times the code and takes as long to write.
    build.cpp(true).std("c++17").opt_level(2).debug(false).file("src/shim.cpp").warnings(false);
    for folder in include_folders() {
        if folder.is_dir() && folder != Path::new("/usr/include") {
            build.include(&folder);
        }
    }
    if let Some(folder) = find_header("Imath/half.h") {
        build.include(folder.join("Imath"));
    }
    build.compile("lanternfish_openvdb_shim");
    for folder in library_folders().iter().filter(|f| f.is_dir()) {
        println!("cargo:rustc-link-search=native={}", folder.display());
    }
    println!("cargo:rustc-link-lib=dylib=openvdb");
    println!("cargo:rustc-link-lib=dylib={}", imath.unwrap_or_default());
    println!("cargo:rustc-link-lib=dylib=tbb");
}
