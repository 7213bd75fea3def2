use tactus_discover::Stage;

use super::*;

#[test]
fn a_range_is_told_in_rough_words() {
    for (range_s, words) in [
        ([0.4, 3.1], "up to 4 s left"),
        ([3.7, 8.2], "3 to 9 s left"),
        ([9.9, 10.1], "9 to 15 s left"),
        ([42.0, 43.0], "40 to 45 s left"),
        ([44.0, 119.0], "40 to 120 s left"),
        ([44.0, 121.0], "40 s to 3 min left"),
        ([300.0, 3599.0], "5 to 60 min left"),
        ([3601.0, 7201.0], "60 min to 3 h left"),
    ] {
        assert_eq!(in_words(range_s), words);
    }
}

#[test]
fn words_never_tell_less_than_the_range() {
    let seconds = |[number, unit]: [String; 2]| -> f64 {
        let unit_s = match unit.as_str() {
            "s" => 1.0,
            "min" => 60.0,
            _ => 3600.0,
        };
        number.parse::<f64>().unwrap_or(f64::NAN) * unit_s
    };
    for tenths in 1..200_000 {
        let time_s = 0.1 * f64::from(tenths);
        assert!(seconds(rounded(time_s, f64::floor)) <= time_s, "{time_s}");
        assert!(seconds(rounded(time_s, f64::ceil)) >= time_s, "{time_s}");
    }
}

#[test]
fn the_share_never_falls() {
    let progress = DiscoveryProgress::new(true);
    let mut before = 0;
    for stage in [
        Stage::Base,
        Stage::Scoring { names: 0 },
        Stage::Comparing { left: 1 },
        // A class has lost its place: the search goes back.
        Stage::Scoring { names: 0 },
        Stage::Fitting { names: 1 },
        Stage::Judging,
        Stage::Planning { questions: 1 },
    ] {
        progress.show(&Progress { what: String::new(), stage });
        assert!(progress.bar.position() >= before, "{stage:?}");
        before = progress.bar.position();
    }
    assert!((500..1000).contains(&before), "{before}");
}
