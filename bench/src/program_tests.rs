use super::{kib, processor_s};

#[test]
fn the_high_water_mark_is_read() {
    let status = "Name:\ttactus\nVmPeak:\t  99 kB\nVmHWM:\t  231596 kB\nVmRSS:\t  12 kB\n";
    assert_eq!(kib(status, "VmHWM:"), Some(231_596.0));
    assert_eq!(kib("Name:\ttactus\n", "VmHWM:"), None);
}

#[test]
fn the_processors_time_is_read_past_a_name_with_spaces() {
    let stat = "77 (a (b) c) S 1 77 77 0 -1 4194304 9 8 7 6 1234 66 5 4 20 0 3 0 99 1 2";
    assert_eq!(processor_s(stat), Some(13.0));
    assert_eq!(processor_s("77 (a) S 1"), None);
}
