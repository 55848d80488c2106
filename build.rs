//! Records what this binary was built from, for image headers and `--version`.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let target = std::env::var("TARGET").unwrap_or_default();
    println!("cargo:rustc-env=LANTERNFISH_TARGET={target}");
}
