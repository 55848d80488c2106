//! Makes the bindings from the header that is installed, because the layouts of Embree's structs differ between versions
//! and even between build options of one version (`RTCRayHit` is 80 bytes in 3.13 and 96 in 4.3): bindings made elsewhere
//! let the library write past the end of what Rust allocated.
//!
//! Embree 4 is preferred, 3.13 is the fallback; `cfg(embree4)` or `cfg(embree3)` says which it was. `EMBREE_DIR` may name a
//! prefix (with `include/` and `lib/`) to look in first.

use std::path::{Path, PathBuf};

const NO_EMBREE: &str = "Embree's headers were not found (embree4/rtcore.h or embree3/rtcore.h).\n\
    Debian 12 and 13: install libembree-dev. Elsewhere: set EMBREE_DIR to the prefix that holds include/ and lib/.\n\
    Or build without Embree: cargo build --no-default-features";

const NO_CLANG: &str = "bindgen could not read Embree's header; it needs libclang with its own headers.\n\
    Debian 12: install libclang1-14 and libclang-common-14-dev. Debian 13: install libclang1-19 and libclang-common-19-dev.\n\
    Or build without Embree: cargo build --no-default-features";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=EMBREE_DIR");
    println!("cargo::rustc-check-cfg=cfg(embree3)");
    println!("cargo::rustc-check-cfg=cfg(embree4)");

    let chosen = std::env::var_os("EMBREE_DIR").map(PathBuf::from);
    let prefixes: Vec<PathBuf> =
        chosen.iter().cloned().chain(["/usr/local", "/usr"].into_iter().map(PathBuf::from)).collect();
    // A chosen prefix wins over the version; among the system's prefixes the version wins over the place.
    let found = find(&prefixes[..chosen.iter().count()]).or_else(|| find(&prefixes));
    let Some((prefix, major)) = found else {
        fail(NO_EMBREE);
    };

    let include = prefix.join("include");
    let header = include.join(format!("embree{major}/rtcore.h"));
    println!("cargo::rerun-if-changed={}", header.display());
    println!("cargo::rustc-cfg=embree{major}");
    println!("cargo::metadata=major={major}");
    if prefix != Path::new("/usr") {
        println!("cargo::rustc-link-search=native={}", prefix.join("lib").display());
    }
    println!("cargo::rustc-link-lib=embree{major}");

    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join("bindings.rs");
    let wanted = "rtc.*|RTC.*";
    // Without libclang bindgen panics instead of returning an error; both end in the same message.
    let generated = std::panic::catch_unwind(|| {
        bindgen::Builder::default()
            .header(header.to_string_lossy())
            .clang_arg(format!("-I{}", include.display()))
            .allowlist_function(wanted)
            .allowlist_type(wanted)
            .allowlist_var(wanted)
            .prepend_enum_name(false)
            .generate_comments(false)
            .generate()
            .map_err(|error| error.to_string())
    });
    match generated {
        Ok(Ok(bindings)) => {
            if let Err(error) = bindings.write_to_file(&out) {
                fail(&format!("{} could not be written: {error}", out.display()));
            }
        }
        Ok(Err(error)) => fail(&format!("{NO_CLANG}\n{error}")),
        Err(_) => fail(NO_CLANG),
    }
}

/// The first prefix with a header, and the header's major version; any place's 4 before any place's 3.
fn find(prefixes: &[PathBuf]) -> Option<(PathBuf, u32)> {
    [4, 3].into_iter().find_map(|major| {
        let has = |prefix: &&PathBuf| prefix.join(format!("include/embree{major}/rtcore.h")).is_file();
        prefixes.iter().find(has).map(|prefix| (prefix.clone(), major))
    })
}

/// Ends the build with each line of `message` as an error.
fn fail(message: &str) -> ! {
    for line in message.lines() {
        println!("cargo::error={line}");
    }
    std::process::exit(1);
}
