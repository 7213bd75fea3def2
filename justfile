# What CI runs, each by itself. `just` alone lists them.

set shell := ["bash", "-euo", "pipefail", "-c"]

tools := justfile_directory() / "target" / "tools"
venv := tools / "venv"

# List the recipes.
default:
    @just --list --unsorted

# Everything that CI checks, quick things first.
ci: fmt lint docs deny test validate systemd python

# The README's second command.
test:
    cargo test --workspace

# The programs, with the very features that the tests use, so that nothing is built twice.
build:
    cargo test --workspace --no-run --quiet

# Formatting.
fmt:
    cargo fmt --all --check

# Lints; warnings are errors.
lint:
    cargo clippy --workspace --all-targets -- -D warnings

# The documentation builds without a broken link.
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --document-private-items

# Licences, sources and doubles of the dependencies.
deny: deny-tool
    PATH="{{ tools }}/bin:$PATH" cargo deny check licenses bans sources

# Build cargo-deny once.
deny-tool:
    test -x {{ tools }}/bin/cargo-deny || \
        CARGO_PROFILE_RELEASE_OPT_LEVEL=1 CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 \
        cargo install --locked cargo-deny --version 0.20.2 --no-default-features \
        --root {{ tools }} --target-dir {{ tools }}/build

# Every shipped configuration, rig and script goes through the constructor that the service uses.
validate: build
    target/debug/tactus validate config/*.toml config/rigs/*.toml experiments/*.star

# The unit file: known keys only, and a sandbox.
systemd:
    systemd/verify.sh

# Stock Python tools read our recordings, tables and bus.
python: build python-tools
    {{ venv }}/bin/pytest -q tests/python
    TACTUS_PULSE=$PWD/target/debug/examples/pulse {{ venv }}/bin/pytest -q clients/python/tests

# A virtual environment with the stock tools.
python-tools:
    test -d {{ venv }} || python3 -m venv {{ venv }}
    {{ venv }}/bin/pip install --quiet --requirement tests/python/requirements.txt --editable clients/python

# The messages, after a change of tactus.proto.
proto:
    cargo xtask proto

# Build times from nothing, and the slowest crates.
build-times:
    cargo build --release --timings
