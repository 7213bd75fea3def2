use super::kib;

#[test]
fn the_high_water_mark_is_read() {
    let status = "Name:\ttactus\nVmPeak:\t  99 kB\nVmHWM:\t  231596 kB\nVmRSS:\t  12 kB\n";
    assert_eq!(kib(status, "VmHWM:"), Some(231_596.0));
    assert_eq!(kib("Name:\ttactus\n", "VmHWM:"), None);
}
