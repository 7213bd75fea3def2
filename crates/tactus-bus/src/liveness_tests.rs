use super::*;

fn id(number: u8) -> ZenohId {
    format!("{number:x}0").parse().unwrap()
}

fn known(announcements: &[(Announced<'_>, SampleKind)]) -> Known {
    let mut known = Known::default();
    for (announced, kind) in announcements {
        known.on_token(announced, *kind);
    }
    known
}

#[test]
fn keys_of_tokens_are_read_and_others_are_not() {
    assert_eq!(announced("tactus/sim/alive"), Some(Announced::Alive("sim")));
    assert_eq!(announced("tactus/sim/service/a1"), Some(Announced::Instance("sim", "a1".parse().unwrap())));
    for key in
        ["tactus/sim", "tactus/sim/alive/x", "tactus/sim/service", "tactus/sim/service/no", "sim/alive"]
    {
        assert_eq!(announced(key), None, "{key}");
    }
}

#[test]
fn the_first_instance_speaks_until_it_ends_and_its_last_words_are_still_believed() {
    let rogue = (Announced::Instance("sim", id(2)), SampleKind::Put);
    let mut known = known(&[(Announced::Instance("sim", id(1)), SampleKind::Put), rogue]);
    assert_eq!(known.believes("sim", &id(1)), Some(true));
    assert_eq!(known.believes("sim", &id(2)), Some(false));
    assert_eq!(known.believes("other", &id(1)), None);
    known.on_token(&Announced::Instance("sim", id(2)), SampleKind::Delete);
    known.on_token(&Announced::Instance("sim", id(1)), SampleKind::Delete);
    assert_eq!(known.believes("sim", &id(3)), None, "nobody speaks for it");
    known.on_token(&Announced::Instance("sim", id(3)), SampleKind::Put);
    assert_eq!(known.believes("sim", &id(3)), Some(true));
    assert_eq!(known.believes("sim", &id(1)), Some(true));
}

#[test]
fn the_service_that_a_client_is_connected_to_is_believed_before_one_that_was_announced_first() {
    let rogue = (Announced::Instance("sim", id(2)), SampleKind::Put);
    let mut known = known(&[rogue, (Announced::Instance("sim", id(1)), SampleKind::Put)]);
    known.prefer(&[id(1)]);
    assert_eq!(known.believes("sim", &id(1)), Some(true));
    assert_eq!(known.believes("sim", &id(2)), Some(false));
}

#[test]
fn what_a_client_asks_for_has_no_number_on_the_bus() {
    // Why: crate::topic::heard.
    for key in ANNOUNCEMENTS.into_iter().chain([NOBODY]) {
        assert!(zenoh::key_expr::KeyExpr::try_from(key).unwrap().is_wild(), "{key}");
    }
}

#[test]
fn the_announcements_are_both_tokens_and_nobody_is_neither() {
    let keys = Keys::new("bench");
    let tokens = [keys.alive(), keys.instance("1f")];
    for (announced, token) in ANNOUNCEMENTS.into_iter().zip(&tokens) {
        let key = |key: &str| zenoh::key_expr::KeyExpr::try_from(key.to_owned()).unwrap();
        assert!(key(announced).includes(&key(token)));
        assert!(!key(NOBODY).intersects(&key(token)));
    }
}

#[tokio::test]
async fn a_service_that_is_seen_only_after_a_command_was_sent_to_it_is_seen_to_end() {
    let (to_known, known) = watch::channel(Known::default());
    let trust = Trust { rig: "sim".to_owned(), known };
    let mut ended = Box::pin(trust.ended());
    let mut says = async |kind| {
        to_known.send_modify(|known| known.on_token(&Announced::Instance("sim", id(1)), kind));
        tokio::select! {
            biased;
            () = &mut ended => true,
            () = std::future::ready(()) => false,
        }
    };
    assert!(!says(SampleKind::Put).await);
    assert!(says(SampleKind::Delete).await);
}
