use super::*;

#[test]
fn every_line_is_a_fault_and_every_fault_comes() {
    let span = Duration::from_secs(100);
    let schedule = Schedule::random(1, span, 3000, 48);
    let script = schedule.script().unwrap();
    assert_eq!(script.faults.len(), 3000);
    assert!(script.faults.iter().all(|fault| fault.at <= span));
    for line in PASSING {
        let start = line.split('{').next().unwrap();
        assert!(schedule.faults.iter().any(|(_, fault)| fault.starts_with(start)), "{line}");
    }
}

#[test]
fn another_seed_gives_other_faults() {
    let span = Duration::from_secs(10);
    assert_ne!(Schedule::random(1, span, 5, 48), Schedule::random(2, span, 5, 48));
}

#[test]
fn what_a_schedule_hides_is_its_greatest_lie_and_all_lost_steps() {
    let faults =
        ["stage lie 0.1", "stage lost-steps 0.02", "sensor clear", "stage lie -0.2", "stage lost-steps 0.03"];
    let faults = faults.map(|line| (Duration::ZERO, line.to_owned())).to_vec();
    assert!((Schedule { faults }.hidden_mm() - 0.2 - 0.05 * 3_f64.sqrt()).abs() < 1e-12);
    assert!(Schedule::default().hidden_mm() < 1e-12);
}
