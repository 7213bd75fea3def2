//! A virtual rig at pseudo-terminals; see [`tactus_mock::cli`].

use clap::Parser;
use tactus_mock::cli::Cli;

fn main() -> anyhow::Result<()> {
    Cli::parse().run()
}
