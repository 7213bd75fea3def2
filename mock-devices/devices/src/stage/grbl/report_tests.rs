use super::*;

#[test]
fn a_report_is_as_the_real_controller_prints_it() {
    let status = Status {
        state: "Run",
        position_mm: [4.716, 2.8281, -0.9442],
        is_machine_position: true,
        buffers: Some((1, 120)),
        speed_mm_per_s: 109.0 / 60.0,
        number: 2,
    };
    assert_eq!(status.line(), "<Run|MPos:4.716,2.828,-0.944|Bf:14,120|FS:109,0>\r\n");
    let first = Status {
        position_mm: [-0.0001, 0.0, 0.0],
        is_machine_position: false,
        buffers: None,
        number: 0,
        ..status
    };
    assert_eq!(first.line(), "<Run|WPos:0.000,0.000,0.000|FS:109,0|WCO:0.000,0.000,0.000>\r\n");
}
