//! `tactus devices` lists whatever is plugged into the test machine.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use tactus_e2e::{repository, tactus};
use tempfile::TempDir;

#[test]
fn what_is_there_is_told_for_machines_and_for_people() {
    let folder = TempDir::new().unwrap();
    let said = tactus(folder.path(), &["devices", "--json"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let told = said.json();
    let devices = told["devices"].as_array().unwrap();
    assert_eq!(told["hint"].is_string(), devices.is_empty(), "{told}");
    for device in devices {
        assert!(device["transport"].as_str().unwrap().starts_with("{ kind = \""), "{device}");
        assert!(["free", "denied", "held"].contains(&device["access"].as_str().unwrap()), "{device}");
    }
    let aloud = tactus(folder.path(), &["devices"]);
    assert_eq!(aloud.code, Some(0), "{aloud:?}");
    let begins = if devices.is_empty() { "no device was found that a rig could use" } else { "KIND" };
    assert!(aloud.out.starts_with(begins), "{aloud:?}");
}

#[test]
fn what_a_rig_means_and_is_not_there_is_told() {
    let folder = TempDir::new().unwrap();
    let rig = fs::read_to_string(repository("config/rigs/sim.toml")).unwrap().replacen(
        "transport = { kind = \"embedded\" }",
        "transport = { kind = \"usb\", vid = 0x1209, pid = 0xffff, serial = \"none\", interface = 3, endpoint_in = 0x85 }",
        1,
    );
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    fs::write(folder.path().join("tactusd.toml"), "rig = \"rig.toml\"\n").unwrap();
    for arguments in [["--rig", "rig.toml"], ["--config", "tactusd.toml"]] {
        let said = tactus(folder.path(), &[&["devices"], arguments.as_slice()].concat());
        assert_eq!(said.code, Some(3), "{said:?}");
        assert!(said.out.contains("The sensor of rig \"sim\" is not there: usb:1209:ffff/none"), "{said:?}");
        assert!(said.out.contains("The stage of rig \"sim\" is simulated: it needs no device"), "{said:?}");
        let said = tactus(folder.path(), &[&["devices", "--json"], arguments.as_slice()].concat());
        assert_eq!(said.json()["missing"][0]["role"], "sensor");
    }
    let said = tactus(folder.path(), &["devices", "--rig", "none.toml"]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.err.contains("none.toml"), "{said:?}");
}

#[test]
fn a_rig_is_named_by_its_name_too_and_one_that_is_not_there_is_an_error() {
    let folder = TempDir::new().unwrap();
    fs::create_dir_all(folder.path().join("config/rigs")).unwrap();
    let rig = fs::read_to_string(repository("config/rigs/pty.toml")).unwrap();
    fs::write(folder.path().join("config/rigs/pty.toml"), &rig).unwrap();
    fs::create_dir_all(folder.path().join("mock")).unwrap();
    fs::write(folder.path().join("mock/sensor"), "").unwrap();
    let said = tactus(folder.path(), &["devices", "--rig", "bench"]);
    assert_eq!(said.code, Some(3), "{said:?}");
    assert!(said.out.contains("The sensor of rig \"bench\" is there: mock/sensor"), "{said:?}");
    assert!(said.out.contains("The stage of rig \"bench\" is not there: mock/stage"), "{said:?}");
    let told = tactus(folder.path(), &["devices", "--rig", "bench", "--json"]).json();
    assert_eq!((&told["named"][0]["there"], &told["named"][1]["there"]), (&true.into(), &false.into()));
    let said = tactus(folder.path(), &["devices", "--rig", "nosuch"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("no rig \"nosuch\"") && said.err.contains("there is: bench"), "{said:?}");
}

#[test]
fn a_rig_file_that_is_none_is_noted_and_the_others_are_looked_at() {
    let folder = TempDir::new().unwrap();
    fs::create_dir_all(folder.path().join("config/rigs")).unwrap();
    fs::write(folder.path().join("config/rigs/broken.toml"), "name = 7\n").unwrap();
    let said = tactus(folder.path(), &["devices", "--json"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.json()["notes"][0].as_str().unwrap().contains("broken.toml"), "{said:?}");
}
