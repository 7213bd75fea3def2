//! The page on adding an effect and the module's table show what is there.

use super::REGISTRY;

const PAGE: &str = include_str!("../../../docs/adding-an-effect.md");

/// The page's blocks of code that are not run, in their order.
fn shown() -> Vec<&'static str> {
    let blocks = PAGE.split("\n```rust,ignore\n").skip(1);
    blocks.map(|block| &block[..=block.find("\n```").unwrap()]).collect()
}

#[test]
fn the_page_shows_the_file_the_line_and_the_tests_as_they_are() {
    let [file, line, tests] = shown()[..] else { panic!("three blocks: {}", shown().len()) };
    assert_eq!(file, include_str!("effect/saturation.rs"), "the file");
    assert!(include_str!("effect.rs").contains(line), "the line {line:?}");
    assert_eq!(tests, include_str!("effect/saturation_tests.rs"), "its tests");
}

#[test]
fn the_modules_table_has_every_effect() {
    let rows: Vec<&str> =
        include_str!("effect.rs").lines().filter(|line| line.starts_with("//! | ")).collect();
    for definition in REGISTRY {
        let name = format!("`{}`", definition.name);
        assert!(rows.iter().any(|row| row.contains(&name)), "{name}");
    }
}
