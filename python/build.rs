//! What the linker is asked for when the module is built to be handed out (`--profile dist`): to put
//! similar functions side by side.
//!
//! A wheel is compressed by Deflate, which looks back over 32 kB, and most of this program is the same
//! code for one type of numbers after the other. Beside each other they take a tenth less. LLD, which
//! is rustc's own linker on x86-64 Linux, can order them so; a linker that cannot is not asked.

use std::env;
use std::path::Path;
use std::process::{Command, Stdio};

const ORDER: &str = "link-arg=-Wl,--bp-compression-sort=both";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let out = variable("OUT_DIR");
    let is_linux = variable("CARGO_CFG_TARGET_OS") == "linux";
    if is_linux && is_dist(Path::new(&out)) && links_with(ORDER, Path::new(&out)) {
        println!("cargo:rustc-cdylib-{ORDER}");
    }
}

/// Whether this is the profile `dist`, which cargo says only in the path `target/dist/build/…/out`.
fn is_dist(out: &Path) -> bool {
    let mut nearest = out.ancestors().take(5).filter_map(Path::file_name);
    nearest.any(|name| name == "dist")
}

/// Whether an empty library links with that option, by the linker and the flags of this build.
fn links_with(option: &str, out: &Path) -> bool {
    let empty = out.join("empty.rs");
    if std::fs::write(&empty, "").is_err() {
        return false;
    }
    let mut rustc = Command::new(variable("RUSTC"));
    rustc.args(["--crate-type", "cdylib", "-C", option]);
    rustc.args(["--target", &variable("TARGET")]);
    if let Ok(linker) = env::var("RUSTC_LINKER") {
        rustc.args(["-C", &format!("linker={linker}")]);
    }
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    rustc.args(flags.split('\u{1f}').filter(|flag| !flag.is_empty()));
    rustc.arg("--out-dir").arg(out).arg(&empty);
    rustc.stdout(Stdio::null()).stderr(Stdio::null());
    rustc.status().is_ok_and(|status| status.success())
}

/// What cargo tells every build script.
fn variable(name: &str) -> String {
    env::var(name).unwrap_or_else(|_| panic!("cargo sets {name} for build scripts"))
}
