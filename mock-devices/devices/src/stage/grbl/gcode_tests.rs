use super::*;

#[test]
fn a_whole_line() {
    let block = Block::parse("N7G90G21G1X1.5Y-2.Z+.25F600").unwrap();
    assert_eq!(
        block,
        Block {
            motion: Some(MotionMode::Feed),
            relative: Some(false),
            feed_mm_per_min: Some(600.0),
            axes_mm: [Some(1.5), Some(-2.0), Some(0.25)],
            ..Block::default()
        }
    );
    assert_eq!(Block::parse(""), Ok(Block::default()));
    assert_eq!(Block::parse("G4P0.5"), Ok(Block { dwell: true, dwell_s: Some(0.5), ..Block::default() }));
}

#[test]
fn what_grbl_refuses_is_refused_with_its_number() {
    for (line, number) in [
        ("1X", 1),
        ("XG1", 2),
        ("X1.2.3", 2),
        ("X--1", 2),
        ("G1X1F-5", 4),
        ("G38.2Z-1", 20),
        ("G20", 20),
        ("M3", 20),
        ("G0G1X1", 21),
        ("G90G91", 21),
        ("X1X2", 25),
        ("G1é", 1),
    ] {
        assert_eq!(Block::parse(line), Err(GrblError(number)), "{line}");
    }
}
