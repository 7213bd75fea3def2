//! Short programs that use the crates of Tactus; each is one file in `examples/`. README.md there lists them.
