use std::collections::BTreeSet;

use super::*;
use crate::descriptor::Speed;
use crate::function::Function;
use crate::function::acm::Acm;
use crate::function::bulk::Bulk;
use crate::function::ftdi::Ftdi;
use crate::identity::Identity;

/// A host controller on the test bench.
struct Host {
    peer: Peer,
    now: Instant,
    seq: u32,
    /// Numbers of the transfers whose answers have data behind them.
    reads: BTreeSet<u32>,
}

/// How a transfer ended: its number, its status, its length, its data.
#[derive(Debug, PartialEq, Eq)]
struct Ended(u32, i32, usize, Vec<u8>);

impl Host {
    fn of(speed: Speed, functions: Vec<Box<dyn Function>>) -> Self {
        let gadget = Gadget::new(Identity::own(5, "virtual rig", "SIM"), speed, functions);
        Self { peer: Peer::new(gadget), now: Instant::now(), seq: 0, reads: BTreeSet::new() }
    }

    fn with_bulk() -> Self {
        Self::of(Speed::High, vec![Box::new(Bulk::new(Speed::High, 4))])
    }

    fn with_ftdi() -> Self {
        Self::of(Ftdi::SPEED, vec![Box::new(Ftdi::new())])
    }

    /// Sends a request; gives its number.
    fn request(&mut self, kind: u32, words: [u32; 3], setup: [u8; 8], data: &[u8]) -> u32 {
        self.seq += 1;
        let [direction, endpoint, at_20] = words;
        let length = if kind == 1 { at_20 } else { 0 };
        let victim = if kind == 2 { at_20 } else { 0 };
        let header = [kind, self.seq, 0, direction, endpoint, victim, length, 0, 0, 0];
        let bytes: Vec<u8> =
            header.into_iter().flat_map(u32::to_be_bytes).chain(setup).chain(data.iter().copied()).collect();
        if kind == 1 && direction == 1 {
            self.reads.insert(self.seq);
        }
        self.peer.receive(&bytes, self.now).unwrap();
        self.seq
    }

    fn ask(&mut self, endpoint: u32, room: u32) -> u32 {
        self.request(1, [1, endpoint, room], [0; 8], &[])
    }

    fn tell(&mut self, endpoint: u32, data: &[u8]) -> u32 {
        self.request(1, [0, endpoint, u32::try_from(data.len()).unwrap()], [0; 8], data)
    }

    fn unlink(&mut self, victim: u32) -> u32 {
        self.request(2, [0, 0, victim], [0; 8], &[])
    }

    fn control(&mut self, setup: [u8; 8]) -> Ended {
        let direction = u32::from(setup[0] >> 7);
        let room = u32::from(setup[6]);
        self.request(1, [direction, 0, if direction == 1 { room } else { 0 }], setup, &[]);
        self.ended().pop().unwrap()
    }

    fn passes(&mut self, ms: u64) {
        self.now += Duration::from_millis(ms);
        self.peer.wake(self.now);
    }

    fn device_sends(&mut self, bytes: &[u8]) {
        self.peer.send(0, bytes, self.now);
    }

    fn ended(&mut self) -> Vec<Ended> {
        let mut bytes = self.peer.take_answers();
        let mut found = Vec::new();
        while !bytes.is_empty() {
            let word = |at: usize| u32::from_be_bytes(*bytes[at..].first_chunk().unwrap());
            let (seq, status, length) = (word(4), word(20).cast_signed(), word(24) as usize);
            let data_bytes = if self.reads.contains(&seq) { length } else { 0 };
            let data = bytes[48..48 + data_bytes].to_vec();
            bytes.drain(..48 + data_bytes);
            found.push(Ended(seq, status, length, data));
        }
        found
    }
}

#[test]
fn a_read_waits_until_the_device_sends() {
    let mut host = Host::with_bulk();
    let seq = host.ask(1, 512);
    host.passes(60_000);
    assert_eq!(host.ended(), []);
    host.device_sends(b"abcd");
    assert_eq!(host.ended(), [Ended(seq, 0, 4, b"abcd".to_vec())]);
}

#[test]
fn a_read_is_taken_back_once_and_nothing_is_lost() {
    let mut host = Host::with_bulk();
    let read = host.ask(1, 512);
    let unlink = host.unlink(read);
    assert_eq!(host.ended(), [Ended(unlink, -104, 0, Vec::new())]);
    let again = host.unlink(read);
    assert_eq!(host.ended(), [Ended(again, 0, 0, Vec::new())], "there is nothing to take back");
    host.device_sends(b"abcd");
    let seq = host.ask(1, 512);
    assert_eq!(host.ended(), [Ended(seq, 0, 4, b"abcd".to_vec())]);
}

#[test]
fn what_the_host_writes_is_heard() {
    let mut host = Host::with_bulk();
    let seq = host.tell(1, b"acquire");
    assert_eq!(host.ended(), [Ended(seq, 0, 7, Vec::new())]);
    assert_eq!(host.peer.take_heard(), [(0, b"acquire".to_vec())]);
    let nowhere = host.tell(7, b"x");
    assert_eq!(host.ended(), [Ended(nowhere, -32, 0, Vec::new())]);
}

#[test]
fn a_halt_lasts_until_the_host_clears_it() {
    let mut host = Host::with_bulk();
    let waits = host.ask(1, 512);
    host.peer.halt(0, host.now);
    assert_eq!(host.ended(), [Ended(waits, -32, 0, Vec::new())]);
    let get_status = [0x82, 0, 0, 0, 0x81, 0, 2, 0];
    assert_eq!(host.control(get_status).3, [1, 0]);
    let clear = [0x02, 1, 0, 0, 0x81, 0, 0, 0];
    assert_eq!(host.control(clear).1, 0);
    assert_eq!(host.control(get_status).3, [0, 0]);
    host.device_sends(b"abcd");
    let seq = host.ask(1, 512);
    assert_eq!(host.ended(), [Ended(seq, 0, 4, b"abcd".to_vec())]);
}

#[test]
fn the_host_halts_an_endpoint_that_hears_and_a_configuration_renews_all() {
    let mut host = Host::with_bulk();
    assert_eq!(host.control([0x02, 3, 0, 0, 0x01, 0, 0, 0]).1, 0);
    let refused = host.tell(1, b"x");
    assert_eq!(host.ended(), [Ended(refused, -32, 0, Vec::new())]);
    assert_eq!(host.control([0x00, 9, 1, 0, 0, 0, 0, 0]).1, 0);
    let heard = host.tell(1, b"x");
    assert_eq!(host.ended(), [Ended(heard, 0, 1, Vec::new())]);
    assert_eq!(host.control([0x02, 3, 0, 0, 0x09, 0, 0, 0]).1, -32, "there is no such endpoint");
    assert_eq!(host.control([0x02, 3, 1, 0, 0x01, 0, 0, 0]).1, -32, "there is no such feature");
}

#[test]
fn descriptors_are_cut_to_the_hosts_room_and_what_is_unknown_stalls() {
    let mut host = Host::with_bulk();
    assert_eq!(host.control([0x80, 6, 0, 1, 0, 0, 8, 0]).2, 8);
    assert_eq!(host.control([0xC0, 0x42, 0, 0, 0, 0, 8, 0]).1, -32);
}

#[test]
fn an_ftdi_breaks_its_silence_after_the_latency_timer() {
    let mut host = Host::with_ftdi();
    let seq = host.ask(1, 512);
    host.passes(15);
    assert_eq!(host.ended(), []);
    assert_eq!(host.peer.next_wake(), Some(host.now + Duration::from_millis(1)));
    host.passes(1);
    assert_eq!(host.ended(), [Ended(seq, 0, 2, vec![0x31, 0x60])]);
    assert_eq!(host.peer.next_wake(), None, "nobody asks");
}

#[test]
fn an_ftdis_full_packet_waits_for_more_or_for_the_timer() {
    let mut host = Host::with_ftdi();
    assert_eq!(host.control([0x40, 1, 0x01, 0x01, 0, 0, 0, 0]).1, 0);
    let seq = host.ask(1, 512);
    host.device_sends(&[7; 62]);
    assert_eq!(host.ended(), []);
    host.passes(16);
    assert_eq!(host.ended(), [Ended(seq, 0, 66, [&[0x31, 0x60][..], &[7; 62], &[0x31, 0x60]].concat())]);
}

#[test]
fn where_no_host_has_opened_what_the_device_sends_is_lost() {
    let mut host = Host::of(Speed::High, vec![Box::new(Acm::new(Speed::High))]);
    let seq = host.ask(1, 512);
    host.device_sends(b"early");
    assert_eq!(host.ended(), []);
    assert_eq!(host.control([0x21, 0x22, 3, 0, 0, 0, 0, 0]).1, 0);
    host.device_sends(b"heard");
    assert_eq!(host.ended(), [Ended(seq, 0, 5, b"heard".to_vec())]);
    host.device_sends(b"unread");
    assert_eq!(host.control([0x21, 0x22, 0, 0, 0, 0, 0, 0]).1, 0);
    assert_eq!(host.control([0x21, 0x22, 3, 0, 0, 0, 0, 0]).1, 0);
    let again = host.ask(1, 512);
    assert_eq!(host.ended(), [], "nothing old is left for the next host");
    host.device_sends(b"new");
    assert_eq!(host.ended(), [Ended(again, 0, 3, b"new".to_vec())]);
}

#[test]
fn slowed_down_it_wants_to_be_woken() {
    let mut host = Host::with_bulk();
    host.peer.slow_down(0, Duration::from_millis(50), host.now);
    let (first, second) = (host.ask(1, 512), host.ask(1, 512));
    host.device_sends(b"abcdefgh");
    assert_eq!(host.ended(), [Ended(first, 0, 4, b"abcd".to_vec())]);
    assert_eq!(host.peer.next_wake(), Some(host.now + Duration::from_millis(50)));
    host.passes(50);
    assert_eq!(host.ended(), [Ended(second, 0, 4, b"efgh".to_vec())]);
}
