use super::super::outcome::tests::set;
use super::*;

#[test]
fn a_row_counts_the_sets_of_its_campaign() {
    let right = set(&[Some("backlash")], &[("backlash", &[])], "explained");
    let twin = set(&[Some("backlash")], &[("hysteresis", &["backlash"])], "explained");
    let wrong = set(&[Some("backlash")], &[("imprint", &[])], "explained");
    let silent = Outcome { campaign: Campaign::Outside, ..set(&[None], &[], "failed") };
    let text = summary(&[right, twin, wrong, silent]);
    let cells = |name: &str| -> Vec<&str> {
        let line = text.lines().find(|line| line.starts_with(name)).unwrap_or_default();
        line.split_whitespace().take(8).collect()
    };
    assert_eq!(cells("names"), ["names", "3", "3", "1", "2", "1.33", "1", "0"], "{text}");
    assert_eq!(cells("outside"), ["outside", "1", "0", "-", "-", "-", "0", "1"], "{text}");
    assert!(text.contains("MiB  median"), "{text}");
}
