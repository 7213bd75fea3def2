use super::{Merge, Numbered};

/// A message of publisher `a` or `b`; the item is its number.
fn message(publisher: char, number: u32) -> Numbered<char, (char, u32)> {
    Numbered { origin: Some((publisher, number)), item: (publisher, number) }
}

fn messages(publisher: char, numbers: impl IntoIterator<Item = u32>) -> Vec<Numbered<char, (char, u32)>> {
    numbers.into_iter().map(|number| message(publisher, number)).collect()
}

/// The merged messages if `before` arrives before the history, and `after` after it.
fn check(
    before: Vec<Numbered<char, (char, u32)>>,
    past: Vec<Numbered<char, (char, u32)>>,
    after: Vec<Numbered<char, (char, u32)>>,
) -> (Vec<(char, u32)>, u64) {
    let mut merge = Merge::awaiting_history();
    let mut out = Vec::new();
    for message in before {
        merge.present(message, |item| out.push(item));
    }
    assert!(out.is_empty(), "nothing is passed on before the past");
    merge.join(past, |item| out.push(item));
    for message in after {
        merge.present(message, |item| out.push(item));
    }
    (out, merge.missed())
}

fn numbers(publisher: char, numbers: impl IntoIterator<Item = u32>) -> Vec<(char, u32)> {
    numbers.into_iter().map(|number| (publisher, number)).collect()
}

#[test]
fn whatever_the_overlap_each_message_comes_once() {
    // The past ends at `end`; the present is heard from `heard` on; the past arrives after `arrived`.
    for end in 0..8 {
        for heard in 0..=end {
            for arrived in heard..10 {
                let (out, missed) =
                    check(messages('a', heard..arrived), messages('a', 0..end), messages('a', arrived..10));
                assert_eq!(out, numbers('a', 0..10), "end {end}, heard {heard}, arrived {arrived}");
                assert_eq!(missed, 0);
            }
        }
    }
}

#[test]
fn without_a_past_the_present_begins_where_it_is_heard() {
    assert_eq!(check(messages('a', 7..9), vec![], messages('a', 9..12)), (numbers('a', 7..12), 0));
}

#[test]
fn what_is_missing_is_counted() {
    let (out, missed) = check(messages('a', [6, 9]), messages('a', 2..5), messages('a', [10, 14]));
    assert_eq!(out, numbers('a', [2, 3, 4, 6, 9, 10, 14]));
    assert_eq!(missed, 1 + 2 + 3);
}

#[test]
fn publishers_are_counted_apart() {
    let (out, missed) = check(messages('b', [0]), messages('a', 5..8), messages('b', [1, 2]));
    assert_eq!(out, [numbers('a', 5..8), numbers('b', 0..3)].concat());
    assert_eq!(missed, 0);
}

#[test]
fn numbers_go_on_after_the_largest() {
    let around = [u32::MAX - 1, u32::MAX, 0, 1];
    assert_eq!(check(vec![], messages('a', around), messages('a', around)), (numbers('a', around), 0));
}

#[test]
fn a_publisher_that_does_not_count_is_passed_on_as_it_comes() {
    let mut merge = Merge::<char, u32>::awaiting_history();
    let mut out = Vec::new();
    merge.present(Numbered { origin: None, item: 1 }, |item| out.push(item));
    merge.join(vec![], |item| out.push(item));
    merge.present(Numbered { origin: None, item: 1 }, |item| out.push(item));
    assert_eq!((out, merge.missed()), (vec![1, 1], 0));
}
