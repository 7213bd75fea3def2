use proptest::prelude::*;

use super::Lines;

fn lines(pieces: &[&[u8]]) -> (Vec<String>, u64) {
    let mut lines = Lines::default();
    let mut found = Vec::new();
    for piece in pieces {
        lines.push(piece, |line| found.push(line.to_owned()));
    }
    (found, lines.dropped())
}

#[test]
fn either_end_ends_a_line() {
    assert_eq!(
        lines(&[b"ok\r\nerror:9\n\r\n  ok \rrest"]),
        (vec!["ok".into(), "error:9".into(), "ok".into()], 0)
    );
}

#[test]
fn what_cannot_be_a_line_is_dropped_alone() {
    let stream = [&[b'x'; 300][..], b"\nok\n\xFF\xFE\nok\n\xC3\xA9\nok\n"].concat();
    assert_eq!(lines(&[&stream]), (vec!["ok".to_owned(); 3], 3));
}

proptest! {
    #[test]
    fn cuts_never_matter(stream in "[a-c\r\n]{0,60}", cut: prop::sample::Index) {
        let stream = stream.as_bytes();
        let (head, tail) = stream.split_at(cut.index(stream.len() + 1));
        prop_assert_eq!(lines(&[head, tail]), lines(&[stream]));
    }
}
