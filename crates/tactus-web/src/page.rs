//! The files of the page. They are parts of this program: nothing is built or fetched.

/// A file of the page.
#[derive(Debug)]
pub(crate) struct File {
    pub(crate) path: &'static str,
    pub(crate) kind: &'static str,
    pub(crate) text: &'static str,
}

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const TEXT: &str = "text/plain; charset=utf-8";

macro_rules! files {
    ($($kind:ident $path:literal),* $(,)?) => {
        &[
            File { path: "/", kind: HTML, text: include_str!("../page/index.html") },
            $(File { path: concat!("/", $path), kind: $kind, text: include_str!(concat!("../page/", $path)) }),*
        ]
    };
}

/// All of them. `vendor/` has others' libraries, with their licences.
pub(crate) const FILES: &[File] = files![
    STYLE "style.css",
    SCRIPT "stop.js",
    SCRIPT "main.js",
    SCRIPT "preact.js",
    SCRIPT "lab.js",
    SCRIPT "commands.js",
    SCRIPT "colour.js",
    SCRIPT "array.js",
    SCRIPT "place.js",
    SCRIPT "traces.js",
    SCRIPT "run.js",
    SCRIPT "runs.js",
    SCRIPT "start.js",
    SCRIPT "log.js",
    STYLE "vendor/uPlot.min.css",
    SCRIPT "vendor/uPlot.esm.js",
    SCRIPT "vendor/preact.module.js",
    SCRIPT "vendor/hooks.module.js",
    SCRIPT "vendor/htm.module.js",
    TEXT "vendor/LICENCES.txt",
];

#[cfg(test)]
#[path = "page_tests.rs"]
mod tests;
