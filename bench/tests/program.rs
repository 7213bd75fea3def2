//! The program `tactus-bench`. `cargo test` builds it, which CI starts, because of this file.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::process::Command;

#[test]
fn the_scene_for_the_peers_has_an_image_for_each_pose() {
    let output = Command::new(env!("CARGO_BIN_EXE_tactus-bench"))
        .args(["scene", "--tool", "cylinder"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let scene: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let (poses, images) = (scene["poses"].as_array().unwrap(), scene["images"].as_array().unwrap());
    assert_eq!((poses.len(), images.len()), (64, 64));
    assert!(images.iter().all(|image| image.as_array().unwrap().len() == 48));
}
