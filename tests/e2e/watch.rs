//! `tactus watch` at a real terminal.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use tactus_e2e::{ServiceUnderTest, Terminal, repository};

/// Keeps a screen for people to look at.
fn keep(name: &str, screen: &str) {
    let folder = repository("target/screens");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(format!("{name}.txt")), screen).unwrap();
}

fn watch(lab: &ServiceUnderTest, size: [u16; 2]) -> Terminal {
    Terminal::start("tactus", lab.folder.path(), &["--endpoint", &lab.endpoint, "watch"], size)
}

#[test]
fn it_uses_the_room_that_the_terminal_has_and_follows_its_size() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let mut run = lab.start_tactus(&["run", "element-centres"]);
    lab.wait_until_pressing();
    let mut view = watch(&lab, [80, 24]);
    let all = [
        "SIMULATED",
        "counts above zero",
        "stage, mm",
        "depth ",
        "rise above zero",
        "log, UTC",
        " run: ",
        "presses",
    ];
    for size in [[80, 24], [120, 40], [200, 60], [80, 24]] {
        view.resize(size);
        let is_whole = |screen: &str| {
            let last = usize::from(size[1]) - 1;
            screen.lines().nth(last).is_some_and(|keys| keys.starts_with("q quit"))
        };
        let screen =
            view.wait_until(|screen| is_whole(screen) && all.iter().all(|text| screen.contains(text)));
        assert!(!screen.contains("no room"), "{screen}");
        keep(&format!("watch-{}x{}", size[0], size[1]), &screen);
    }
    // It says what does not fit.
    view.resize([80, 18]);
    keep("watch-80x18", &view.wait_for(&["no room for log"]));
    view.resize([40, 10]);
    keep("watch-40x10", &view.wait_for(&["no room for image"]));
    view.resize([80, 24]);
    view.wait_for(&all);
    // Traces of chosen elements: the cursor begins at element 0.
    view.type_keys("\u{1b}[C\u{1b}[A ");
    view.wait_for(&["● 9: "]);
    view.type_keys("+");
    view.wait_for(&["30 s"]);
    view.type_keys("S");
    keep("watch-stopped", &view.wait_for(&["STOP by watch"]));
    run.wait_for("stopped");
    view.type_keys("q");
    assert_eq!(view.wait(), Some(0));
}
