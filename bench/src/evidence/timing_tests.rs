use super::high_water_kib;

#[test]
fn the_high_water_mark_is_read() {
    let status = "Name:\ttactus\nVmPeak:\t  99 kB\nVmHWM:\t  231596 kB\nVmRSS:\t  12 kB\n";
    assert_eq!(high_water_kib(status), Some(231_596.0));
    assert_eq!(high_water_kib("Name:\ttactus\n"), None);
}
