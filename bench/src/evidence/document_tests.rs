use super::super::outcome::tests::set;
use super::*;

#[test]
fn only_the_text_between_the_marks_is_replaced() {
    let [begin, end] = Part::Evidence.marks();
    let document = format!("before\n{begin}\nold\n{end}\nafter\n");
    let Some(after) = into_document(&document, Part::Evidence, "new\n") else { panic!("it has the marks") };
    assert_eq!(after, format!("before\n{begin}\n\nnew\n\n{end}\nafter\n"));
    assert_eq!(into_document(&after, Part::Evidence, "new"), Some(after.clone()));
    assert_eq!(into_document(&after, Part::Active, "new"), None);
}

#[test]
fn a_missed_target_says_by_how_much() {
    let right = set(&[Some("backlash")], &[("backlash", &[])], "explained");
    let wrong = set(&[Some("backlash")], &[("imprint", &[])], "explained");
    let text = document(&Scores::new(&[right.clone(), right, wrong.clone(), wrong]), &[], None);
    let line = text.lines().find(|line| line.contains("16 and more: named exactly")).unwrap_or_default();
    assert!(line.contains("| 50.0 % |") && line.ends_with("| **missed by 45.0 points** |"), "{line}");
    let none = text.lines().find(|line| line.contains("both named")).unwrap_or_default();
    assert!(none.contains("| - |") && none.ends_with("| - |"), "{none}");
}

#[test]
fn false_alarms_stand_beside_the_level_of_the_tests() {
    let alarm = Outcome { campaign: Campaign::FalseAlarms, ..set(&[], &[], "unexplained") };
    let text = document(&Scores::new(&[alarm]), &[], None);
    let nominal = format!("a nominal level of {}", percent(ALPHA));
    let line = text.lines().find(|line| line.starts_with("| false alarms")).unwrap_or_default();
    assert!(line.contains(&nominal) && line.contains("at most 2.8 %"), "{line}");
    assert!(text.lines().any(|line| line.contains("five tests") && line.contains(&nominal)), "{text}");
}

#[test]
fn a_miss_shows_the_hidden_and_the_named_effect() {
    let right = set(&[Some("backlash")], &[("backlash", &[])], "explained");
    let twin = set(&[Some("backlash")], &[("hysteresis", &["backlash"])], "explained");
    let text = misses(&[right, twin]);
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(text.contains("backlash [made-up] z 40.0 -> hysteresis (or backlash) | explained"), "{text}");
}
