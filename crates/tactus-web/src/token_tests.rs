use std::os::unix::fs::PermissionsExt as _;

use super::*;

#[test]
fn a_token_is_new_each_time_and_only_the_whole_one_is_right() {
    let token = Token::new().unwrap();
    let text = token.fragment()[1..].to_owned();
    assert_eq!(text.len(), 32);
    assert!(token.is(text.as_bytes()));
    for wrong in [
        "",
        &text[..31],
        &format!("{text}0"),
        &text.to_uppercase().replace('0', "1"),
        "0".repeat(32).as_str(),
    ] {
        assert!(wrong == text || !token.is(wrong.as_bytes()), "{wrong}");
    }
    assert!(!Token::new().unwrap().is(text.as_bytes()));
    assert_eq!(format!("{token:?}"), "Token");
}

#[test]
fn its_file_is_for_the_owner_and_the_group() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("token");
    Token::new().unwrap().write(&path).unwrap();
    let token = Token::new().unwrap();
    // An older one is replaced.
    token.write(&path).unwrap();
    assert!(token.is(fs::read_to_string(&path).unwrap().trim().as_bytes()));
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o7137, 0);
}
