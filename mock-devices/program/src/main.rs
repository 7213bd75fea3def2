//! `tactus-mock`: virtual devices.

fn main() -> anyhow::Result<()> {
    tactus_mock::main()
}
