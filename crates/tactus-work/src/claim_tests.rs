use std::{fs, path::Path, sync::mpsc::channel, thread, time::Duration};

use tempfile::TempDir;

use super::{Asked, Claim, Claims, Seen};

/// So long that no test sees its end.
const HOUR: Duration = Duration::from_hours(1);
/// So short that the next look is after its end.
const NONE: Duration = Duration::ZERO;

fn mine(claims: &Claims, seen: Option<Seen>) -> Claim<'_> {
    match claims.ask("a/piece", seen).unwrap() {
        Asked::Mine(claim) => claim,
        Asked::Taken(seen) => panic!("{seen:?}"),
    }
}

fn taken(claims: &Claims, seen: Option<Seen>) -> Seen {
    match claims.ask("a/piece", seen).unwrap() {
        Asked::Mine(claim) => panic!("{claim:?}"),
        Asked::Taken(seen) => seen,
    }
}

fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder.join("a")).unwrap();
    let mut files: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    files.sort();
    files
}

/// What is left of a worker that died in the piece.
fn die(folder: &Path, lease: Duration) {
    let claims = Claims::new(folder, lease);
    std::mem::forget(mine(&claims, None));
}

#[test]
fn a_piece_is_one_workers_until_it_lets_go() {
    let folder = TempDir::new().unwrap();
    let [one, other] = [(); 2].map(|()| Claims::new(folder.path(), HOUR));
    let claim = mine(&one, None);
    let seen = taken(&other, None);
    let seen = taken(&other, Some(seen));
    assert!(!claim.is_lost().unwrap());
    drop(claim);
    assert!(files(folder.path()).is_empty());
    let claim = mine(&other, Some(seen));
    taken(&one, None);
    claim.done().unwrap();
    assert!(files(folder.path()).is_empty());
}

#[test]
fn the_piece_of_a_dead_worker_is_taken_over_once() {
    let folder = TempDir::new().unwrap();
    die(folder.path(), NONE);
    let [one, other] = [(); 2].map(|()| Claims::new(folder.path(), HOUR));
    let (seen_by_one, seen_by_other) = (taken(&one, None), taken(&other, None));
    let claim = mine(&one, Some(seen_by_one));
    let seen = taken(&other, Some(seen_by_other));
    assert_eq!(files(folder.path()), ["piece.0", "piece.1"]);
    assert!(!claim.is_lost().unwrap());
    claim.done().unwrap();
    assert!(files(folder.path()).is_empty());
    mine(&other, Some(seen));
}

#[test]
fn who_judged_a_claim_that_has_gone_meanwhile_has_nothing() {
    let folder = TempDir::new().unwrap();
    die(folder.path(), NONE);
    let [one, other, third] = [(); 3].map(|()| Claims::new(folder.path(), HOUR));
    let (seen_by_one, seen_by_other) = (taken(&one, None), taken(&other, None));
    mine(&one, Some(seen_by_one)).done().unwrap();
    let claim = mine(&third, None);
    taken(&other, Some(seen_by_other));
    assert_eq!(files(folder.path()), ["piece.0"]);
    assert!(!claim.is_lost().unwrap());
}

#[test]
fn a_worker_that_was_silent_for_too_long_sees_that_it_has_lost_its_piece() {
    let folder = TempDir::new().unwrap();
    let [silent, other] = [NONE, HOUR].map(|lease| Claims::new(folder.path(), lease));
    let claim = mine(&silent, None);
    let seen = taken(&other, None);
    let others = mine(&other, Some(seen));
    assert!(claim.is_lost().unwrap());
    // Renewing is no way to have it back.
    silent.renew(&claim.file).unwrap();
    drop(claim);
    assert_eq!(files(folder.path()), ["piece.1"]);
    assert!(!others.is_lost().unwrap());
    others.done().unwrap();
    assert!(files(folder.path()).is_empty());
}

#[test]
fn a_claim_that_is_renewed_is_not_stale() {
    let folder = TempDir::new().unwrap();
    let [busy, other] = [(); 2].map(|()| Claims::new(folder.path(), NONE));
    let claim = mine(&busy, None);
    let mut seen = taken(&other, None);
    for _ in 0..3 {
        busy.renew(&claim.file).unwrap();
        seen = taken(&other, Some(seen));
    }
    mine(&other, Some(seen));
}

#[test]
fn claims_are_renewed_while_the_other_end_is_there() {
    let folder = TempDir::new().unwrap();
    let claims = Claims::new(folder.path(), Duration::from_millis(4));
    let claim = mine(&claims, None);
    let text = || fs::read(&claim.file.path).unwrap();
    let first = text();
    thread::scope(|scope| {
        let (works, over) = channel();
        scope.spawn(|| claims.renew_until(&{ over }));
        while text() == first {
            thread::yield_now();
        }
        drop(works);
    });
}

#[test]
fn a_claim_that_was_cut_off_before_its_text_is_one() {
    let folder = TempDir::new().unwrap();
    fs::create_dir(folder.path().join("a")).unwrap();
    fs::write(folder.path().join("a/piece.0"), "").unwrap();
    let claims = Claims::new(folder.path(), NONE);
    let seen = taken(&claims, None);
    mine(&claims, Some(seen));
}
