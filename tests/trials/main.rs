//! The real service against kills, stops, a disk that hangs, and a long time. Trials measure how long things take, so they are apart from the other
//! end-to-end tests, which keep the machine busy.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a test that cannot go on fails; a measurement is printed"
)]

mod bench;
mod disk;
mod kill_trials;
mod soak;
mod stop_trials;
