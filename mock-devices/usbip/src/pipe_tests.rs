use super::*;

/// What a pipe answers: transfer, status, data.
fn served(pipe: &mut Pipe, now: Instant) -> Vec<(u32, i32, Vec<u8>)> {
    let mut answers = Answers::default();
    pipe.serve(now, &mut answers);
    let mut bytes = answers.take();
    let mut found = Vec::new();
    while !bytes.is_empty() {
        let word = |at: usize| u32::from_be_bytes(*bytes[at..].first_chunk().unwrap());
        let (seq, status, length) = (word(4), word(20).cast_signed(), word(24) as usize);
        found.push((seq, status, bytes[48..48 + length].to_vec()));
        bytes.drain(..48 + length);
    }
    found
}

#[test]
fn a_transfer_waits_until_there_is_something() {
    let now = Instant::now();
    let mut pipe = Pipe::new(4);
    pipe.ask(1, 16);
    assert_eq!(served(&mut pipe, now), []);
    assert!(pipe.is_starved());
    pipe.push(b"abc".to_vec(), now);
    assert_eq!(served(&mut pipe, now), [(1, 0, b"abc".to_vec())]);
    assert!(!pipe.is_starved());
}

#[test]
fn a_short_packet_ends_a_transfer_and_so_does_a_full_one() {
    let now = Instant::now();
    let mut pipe = Pipe::new(4);
    pipe.ask(1, 16);
    pipe.push(b"full".to_vec(), now);
    assert_eq!(served(&mut pipe, now), [], "more may follow");
    pipe.push(b"end".to_vec(), now);
    assert_eq!(served(&mut pipe, now), [(1, 0, b"fullend".to_vec())]);
    for packet in [b"full".to_vec(), Vec::new(), b"full".to_vec(), b"more".to_vec()] {
        pipe.push(packet, now);
    }
    pipe.ask(2, 16);
    pipe.ask(3, 8);
    let ends = [(2, 0, b"full".to_vec()), (3, 0, b"fullmore".to_vec())];
    assert_eq!(served(&mut pipe, now), ends, "an empty packet ends one, no room the other");
}

#[test]
fn a_transfer_taken_back_takes_nothing_along() {
    let now = Instant::now();
    let mut pipe = Pipe::new(4);
    pipe.ask(1, 16);
    pipe.push(b"full".to_vec(), now);
    assert!(served(&mut pipe, now).is_empty() && pipe.unlink(1) && !pipe.unlink(1));
    pipe.push(b"end".to_vec(), now);
    pipe.ask(2, 16);
    assert_eq!(served(&mut pipe, now), [(2, 0, b"fullend".to_vec())]);
}

#[test]
fn more_than_there_is_room_for_is_an_overflow() {
    let now = Instant::now();
    let mut pipe = Pipe::new(4);
    pipe.push(b"abc".to_vec(), now);
    pipe.ask(1, 2);
    assert_eq!(served(&mut pipe, now), [(1, -75, Vec::new())]);
}

#[test]
fn a_halted_endpoint_stalls_every_transfer_and_keeps_its_packets() {
    let now = Instant::now();
    let mut pipe = Pipe::new(4);
    pipe.ask(1, 4);
    pipe.halt();
    pipe.push(b"a".to_vec(), now);
    assert_eq!(served(&mut pipe, now), [(1, -32, Vec::new())]);
    pipe.ask(2, 4);
    assert_eq!(served(&mut pipe, now), [(2, -32, Vec::new())]);
    pipe.clear_halt();
    pipe.ask(3, 4);
    assert_eq!(served(&mut pipe, now), [(3, 0, b"a".to_vec())]);
}

#[test]
fn slowed_down_it_answers_one_at_a_time() {
    let now = Instant::now();
    let mut pipe = Pipe::new(4);
    pipe.slow_down(Duration::from_millis(50));
    for seq in 1..=3 {
        pipe.ask(seq, 4);
        pipe.push(vec![b'0'], now);
    }
    let numbers =
        |found: Vec<(u32, i32, Vec<u8>)>| found.into_iter().map(|(seq, ..)| seq).collect::<Vec<_>>();
    assert_eq!(numbers(served(&mut pipe, now)), [1]);
    let next = now + Duration::from_millis(50);
    assert_eq!(pipe.next_wake(), Some(next));
    assert!(served(&mut pipe, next - Duration::from_millis(1)).is_empty());
    assert_eq!(numbers(served(&mut pipe, next)), [2]);
    pipe.slow_down(Duration::ZERO);
    assert_eq!(numbers(served(&mut pipe, next)), [3]);
    assert_eq!(pipe.next_wake(), None);
}

#[test]
fn what_nobody_fetches_is_lost_after_a_while() {
    let now = Instant::now();
    let mut pipe = Pipe::new(4);
    pipe.push(b"old".to_vec(), now);
    let later = now + KEPT + Duration::from_millis(1);
    pipe.push(b"new".to_vec(), later);
    pipe.ask(1, 4);
    assert_eq!(served(&mut pipe, later), [(1, 0, b"new".to_vec())]);
    assert_eq!(pipe.lost(), 1);
    for _ in 0..=WAITING_BYTES_MAX / 4 {
        pipe.push(b"many".to_vec(), later);
    }
    assert_eq!((pipe.lost(), pipe.waiting_bytes), (2, WAITING_BYTES_MAX));
}
