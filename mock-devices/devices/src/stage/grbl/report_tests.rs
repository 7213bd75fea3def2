use super::*;

#[test]
fn a_report_is_as_the_real_controller_prints_it() {
    let status = Status {
        state: "Run",
        machine_mm: [4.716, 2.8281, -0.9442],
        work_offset_mm: [0.0; 3],
        is_machine_position: true,
        buffers: Some((1, 120)),
        speed_mm_per_s: 109.0 / 60.0,
        number: 2,
    };
    assert_eq!(status.line(), "<Run|MPos:4.716,2.828,-0.944|Bf:14,120|FS:109,0>\r\n");
    let first = Status {
        machine_mm: [-0.0001, 0.0, 0.0],
        is_machine_position: false,
        buffers: None,
        number: 0,
        ..status
    };
    assert_eq!(first.line(), "<Run|WPos:0.000,0.000,0.000|FS:109,0|WCO:0.000,0.000,0.000>\r\n");
    let offset = Status { work_offset_mm: [0.0, 0.5, -2.0], ..first };
    assert_eq!(offset.line(), "<Run|WPos:0.000,-0.500,2.000|FS:109,0|WCO:0.000,0.500,-2.000>\r\n");
    let in_machine_frame = Status { is_machine_position: true, ..offset };
    assert!(in_machine_frame.line().starts_with("<Run|MPos:0.000,0.000,0.000|"));
}
