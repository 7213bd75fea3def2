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
