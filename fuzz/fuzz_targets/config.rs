//! Any text as the service's configuration, as the rig file that it names, and as the file that keeps the covering: it is read or refused
//! with a message, and a covering that is read is a thickness.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tactus_engine::CoveringMemory as _;
use tactus_fuzz::Scratch;
use tactus_runner::config::{RigFiles, ServiceConfig};
use tactus_runner::covering_file::CoveringFile;

/// The shipped rig beside the configuration, so that one which names it is read to its end.
static SCRATCH: LazyLock<Scratch> = LazyLock::new(|| {
    let scratch = Scratch::new();
    scratch.file("sim.toml", include_bytes!("../../config/rigs/sim.toml"));
    scratch
});

fuzz_target!(|text: &str| {
    let path = SCRATCH.file("any.covering.toml", text.as_bytes());
    let folder = path.parent().expect("a file is in a folder");
    if let Err(error) = ServiceConfig::load(&path) {
        assert!(!error.to_string().is_empty());
    }
    if let Err(error) = RigFiles::of(text, Path::new("any.toml")) {
        assert!(!error.to_string().is_empty());
    }
    match CoveringFile::of("any", folder).recall() {
        Ok(thickness_mm) => {
            let thickness_mm = thickness_mm.expect("the file is there");
            assert!(thickness_mm > 0.0 && thickness_mm.is_finite());
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
