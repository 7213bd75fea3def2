use super::*;

fn at_s(seconds: f64) -> MonoTime {
    MonoTime::default().after(Duration::from_secs_f64(seconds))
}

fn secret(number: u8) -> Secret {
    Secret([number; 16])
}

fn held_by(holder: &str) -> NotHolder {
    NotHolder::Held { holder: holder.to_owned() }
}

#[test]
fn one_holds_it_until_it_is_given_back() {
    let mut lease = Lease::default();
    assert_eq!(lease.check(&[], at_s(0.0)), Err(NotHolder::Missing));
    lease.acquire("ada", secret(1), at_s(0.0)).unwrap();
    assert_eq!(lease.acquire("bob", secret(2), at_s(1.0)), Err(held_by("ada")));
    assert_eq!(lease.check(&[2; 16], at_s(1.0)), Err(held_by("ada")));
    assert_eq!(lease.check(&[], at_s(1.0)), Err(held_by("ada")));
    assert_eq!(lease.check(&[1; 15], at_s(1.0)), Err(held_by("ada")), "a part of the secret");
    assert_eq!(lease.check(&[1; 17], at_s(1.0)), Err(held_by("ada")), "more than the secret");
    lease.check(&[1; 16], at_s(1.0)).unwrap();
    assert_eq!(lease.holder(at_s(1.0)), Some(("ada", Duration::from_secs(4))));
    assert_eq!(lease.release(&[2; 16], at_s(1.0)), Err(held_by("ada")));
    lease.release(&[1; 16], at_s(1.0)).unwrap();
    assert_eq!(lease.holder(at_s(1.0)), None);
    lease.acquire("bob", secret(2), at_s(1.0)).unwrap();
}

#[test]
fn it_ends_five_seconds_after_the_last_renewal_and_is_not_revived() {
    let mut lease = Lease::default();
    lease.acquire("ada", secret(1), at_s(0.0)).unwrap();
    lease.renew(&[1; 16], at_s(4.9)).unwrap();
    lease.check(&[1; 16], at_s(9.8)).unwrap();
    assert_eq!(lease.check(&[1; 16], at_s(9.9)), Err(NotHolder::Stale));
    assert_eq!(lease.renew(&[1; 16], at_s(9.9)), Err(NotHolder::Stale));
    lease.acquire("bob", secret(2), at_s(9.9)).unwrap();
    assert_eq!(lease.check(&[1; 16], at_s(10.0)), Err(held_by("bob")));
}

#[test]
fn a_takeover_says_from_whom_and_makes_the_old_lease_stale() {
    let mut lease = Lease::default();
    assert_eq!(lease.take_over("ada", secret(1), at_s(0.0)), None);
    assert_eq!(lease.take_over("bob", secret(2), at_s(1.0)), Some("ada".to_owned()));
    assert_eq!(lease.check(&[1; 16], at_s(1.0)), Err(held_by("bob")));
    assert_eq!(lease.renew(&[1; 16], at_s(1.0)), Err(held_by("bob")));
    lease.check(&[2; 16], at_s(1.0)).unwrap();
    assert_eq!(lease.take_over("eve", secret(3), at_s(7.0)), None, "bob's had ended");
}

#[test]
fn a_secret_is_not_shown() {
    assert_eq!(format!("{:?}", secret(7)), "Secret");
}
