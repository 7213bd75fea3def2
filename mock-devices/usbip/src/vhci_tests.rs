use super::*;

/// As Linux 6.1 prints it, shortened.
const STATUS: &str = "\
hub port sta spd dev      sockfd local_busid
hs  0000 006 003 00010001 000012 0-0
hs  0001 004 000 00000000 000000 0-0
hs  0002 005 000 00000000 000000 0-0
hs  0003 004 000 00000000 000000 0-0
ss  0015 004 000 00000000 000000 0-0
";

#[test]
fn ports_for_our_speeds_that_are_free() {
    assert_eq!(free_ports(STATUS).collect::<Vec<_>>(), [1, 3]);
    assert_eq!(free_ports("hs\nnonsense 1 004\nhs x 004").count(), 0);
}

#[test]
fn an_order_names_port_socket_device_and_speed() {
    assert_eq!(attach_order(3, 12, Speed::High), "3 12 65540 3");
    assert_eq!(attach_order(0, 5, Speed::Full), "0 5 65537 2");
}
