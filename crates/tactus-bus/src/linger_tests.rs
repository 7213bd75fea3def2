use std::{
    io::{Read as _, Write as _},
    net::{TcpListener, TcpStream},
};

use super::*;

#[cfg(target_endian = "little")]
#[test]
fn addresses_are_read_as_the_table_writes_them() {
    let loopback: SocketAddr = "127.0.0.1:7447".parse().unwrap();
    assert_eq!(address("0100007F:1D17"), Some(loopback));
    assert_eq!(address("0000000000000000FFFF00000100007F:1D17"), Some(loopback));
    assert_eq!(address("00000000000000000000000001000000:0050"), Some("[::1]:80".parse().unwrap()));
    for nonsense in ["", "0100007F", "0100007F:", "0100:1D17", "0100007G:1D17", "0100007F:1D17F"] {
        assert_eq!(address(nonsense), None, "{nonsense}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn bytes_that_the_other_end_has_no_room_for_wait_until_it_reads() {
    for host in ["127.0.0.1:0", "[::1]:0"] {
        let Ok(listener) = TcpListener::bind(host) else { continue };
        let mut writes = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (mut reads, _) = listener.accept().unwrap();
        let ends = [(writes.local_addr().unwrap(), writes.peer_addr().unwrap())];
        assert!(!have_waiting_bytes(&ends));
        writes.set_nonblocking(true).unwrap();
        let (block, mut written) = (vec![0; 65_536], 0);
        while let Ok(bytes) = writes.write(&block) {
            written += bytes;
        }
        assert!(have_waiting_bytes(&ends));
        let mut taken = vec![0; written];
        reads.read_exact(&mut taken).unwrap();
        while have_waiting_bytes(&ends) {
            std::thread::yield_now();
        }
    }
}
