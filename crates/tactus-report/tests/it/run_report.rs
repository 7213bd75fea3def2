//! Reports of made-up runs, whole and damaged.
//!
//! With `TACTUS_REPORT_DIR` set, the pages are also written there, to be looked at.

#![allow(
    clippy::unwrap_used,
    clippy::wildcard_enum_match_arm,
    reason = "what is made up here is known to fit"
)]

use std::{env, fs, path::Path};

use crate::synthetic::{Fed, Plan, Press, Run};
use tactus_report::{RespondsTo, RunReport, render_html, run_report};
use tactus_schema::pb::{self, run_event::Event};

fn report(run: &Run) -> RunReport {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    run.record(&path).unwrap();
    run_report(&path).unwrap()
}

fn page(name: &str, report: &RunReport) -> String {
    let html = render_html(report);
    if let Ok(dir) = env::var("TACTUS_REPORT_DIR") {
        fs::write(Path::new(&dir).join(format!("{name}.html")), &html).unwrap();
    }
    html
}

/// The element-centre run of the paper's sensor, with lost frames between two presses.
fn element_centres() -> Run {
    Plan { lost: vec![20, 21, 22, 900], ..Plan::element_centres() }.make()
}

fn events(run: &mut Run) -> impl Iterator<Item = &mut Event> {
    run.fed.iter_mut().filter_map(|fed| match fed {
        Fed::Event(event) => event.event.as_mut(),
        Fed::Info(..) | Fed::Frame(_) | Fed::Stage(_) => None,
    })
}

#[test]
fn an_element_centre_run_gives_its_curves_images_and_losses() {
    let run = element_centres();
    let report = report(&run);
    assert_eq!((report.summary.presses, report.summary.dwells), (48, 240));
    assert_eq!(report.summary.planned, Some([48, 240]));
    assert_eq!(report.summary.exit_status, Some("done"));
    assert_eq!(report.summary.started, "2026-03-25T10:00:00Z");
    let lost: Vec<_> =
        report.losses.iter().map(|loss| (loss.frames, loss.after_seq, loss.next_seq)).collect();
    assert_eq!(lost, [(3, 19, 23), (1, 899, 901)]);

    let response = report.response.as_ref().unwrap();
    let unresponsive: Vec<_> =
        response.unresponsive.iter().map(|s| (s.curve.element, s.answers_to)).collect();
    assert_eq!(unresponsive, [(18, RespondsTo::Element([2, 3])), (22, RespondsTo::Element([2, 7]))]);
    assert_eq!(response.curves.len(), 46);
    // The run's truth: 800 (x + 0.5 x^2), times gains of mean 1 and a spread of 8 %.
    let at_half = response.quadratic.as_ref().unwrap().at(0.5);
    assert!((at_half / 500.0 - 1.0).abs() < 0.05, "{at_half}");

    let html = page("element-centres", &report);
    assert!(html.contains("SIMULATED") && html.contains(">done</span>"));
    assert!(html.contains("<td>18</td><td>(2, 2)</td><td>(2, 3)</td>"), "element 18 is named");
    assert!(html.contains("<td>22</td><td>(2, 6)</td><td>(2, 7)</td>"), "element 22 is named");
    assert_eq!(html.matches("<g transform=\"translate").count(), 242);
    assert!(html.len() < 1_500_000, "{} bytes", html.len());
}

#[test]
fn a_page_loads_nothing() {
    // Neither the name of a drawing's language nor links to its own sections load anything.
    let html = page("short", &report(&Plan { lost: vec![40], ..Plan::short(3) }.make()));
    let html = html.replace("http://www.w3.org/2000/svg", "").replace("href=\"#", "");
    for outside in ["http:", "https:", "//", "url(", "src=", "href=", "<script", "@import", "<link"] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(!html.contains("NaN") && !html.contains("inf "));
}

#[test]
fn what_comes_from_the_recording_is_escaped() {
    let hostile = "<img src=x onerror='alert(\"1\")'>";
    let mut run = Plan { run_id: hostile.into(), experiment: hostile.into(), ..Plan::short(1) }.make();
    for event in events(&mut run) {
        match event {
            Event::Started(started) => {
                started.script_sha256 = hostile.into();
                started.parameters_json = serde_json::json!({ hostile: hostile }).to_string();
            }
            Event::Finished(finished) => finished.message = hostile.into(),
            Event::DwellDone(_) => *event = Event::Log(pb::Log { message: hostile.into() }),
            _ => {}
        }
    }
    let html = page("hostile", &report(&run));
    assert!(!html.contains("<img"), "markup came through");
    assert!(html.matches("&lt;img src=x onerror=&#39;alert(&quot;1&quot;)&#39;&gt;").count() >= 9);
}

#[test]
fn a_press_that_was_begun_again_does_not_count() {
    let mut run = Plan::short(3).make();
    let broken = pb::PressRepeated { press: 1, reason: "frames lost".into() };
    let finish = events(&mut run).find(|event| matches!(event, Event::Finished(_))).unwrap();
    *finish = Event::PressRepeated(broken);
    let report = report(&run);
    let left: Vec<i32> = report.presses.iter().map(|press| press.index).collect();
    assert_eq!(left, [0, 2]);
    assert_eq!((report.summary.presses, report.summary.dwells), (2, 10));
    assert!(report.notes.iter().any(|note| note.contains("left out") && note.ends_with("press 1.")));
}

#[test]
fn rises_are_against_the_last_tare() {
    let mut run = Plan::short(1).make();
    let tare = pb::TareDone { frames: 30, baseline_counts: vec![150.0; 48], ..Default::default() };
    let idle = events(&mut run).find(|event| matches!(event, Event::PhaseChanged(_))).unwrap();
    *idle = Event::TareDone(tare);
    let tared = report(&run).presses[0].dwells[0].total_counts();
    // Without a tare the first frames count, which read 100 at every element.
    let untared = report(&Plan::short(1).make()).presses[0].dwells[0].total_counts();
    assert!((untared - tared - 50.0 * 48.0).abs() < 48.0, "{untared} {tared}");
}

#[test]
fn an_empty_run_says_what_is_missing() {
    let plan = Plan { presses: vec![], idle_s: 0.0, exit_status: None, ..Plan::short(0) };
    let mut run = plan.make();
    run.fed.retain(|fed| matches!(fed, Fed::Event(event) if matches!(event.event, Some(Event::Started(_)))));
    let report = report(&run);
    let html = page("empty", &report);
    for missing in
        ["never closed", "No frame was recorded", "No dwell was done", "stage never reported its position"]
    {
        assert!(html.contains(missing), "{missing}: {:?}", report.notes);
    }
}

#[test]
fn a_recording_cut_off_anywhere_gives_a_report_or_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    Plan::short(6).make().record(&path).unwrap();
    let whole = fs::read(&path).unwrap();
    for share in 1..20 {
        fs::write(&path, &whole[..whole.len() * share / 20]).unwrap();
        let Ok(report) = run_report(&path) else {
            assert!(share < 4, "cut at {share}/20");
            continue;
        };
        assert!(report.notes.iter().any(|note| note.starts_with("The file is readable up to byte")));
        let html = page("cut-off", &report);
        // What stands at the file's end is an index: the run's last event may come before the cut.
        assert_eq!(html.contains("never closed"), report.summary.exit_status.is_none(), "cut at {share}/20");
        assert!(share > 6 || report.summary.exit_status.is_none(), "cut at {share}/20");
        assert!(html.ends_with("</html>\n"));
    }
}

#[test]
fn a_grid_sweep_is_shown_in_aggregate() {
    let presses = (0..2700).map(|n: u32| Press {
        at_mm: [6.4 + 0.1 * f64::from(n % 15), 4.2 + 0.1 * f64::from(n / 15 % 15)],
        depths_mm: vec![[0.3, 0.5, 0.65][n as usize % 3]],
    });
    let plan = Plan {
        experiment: "grid-sweep".into(),
        presses: presses.collect(),
        miswired: vec![],
        ..Plan::short(0)
    };
    let report = report(&plan.make());
    assert_eq!((report.summary.dwells, report.response.is_none()), (2700, true));
    let html = page("grid-sweep", &report);
    assert!(html.contains("300 of 2700 dwells, evenly chosen"));
    assert!(html.contains("Signal against depth"));
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
}

#[test]
fn the_same_recording_gives_the_same_page() {
    let run = Plan::short(2).make();
    assert!(render_html(&report(&run)) == render_html(&report(&run)));
}
