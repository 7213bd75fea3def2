//! A sending endpoint: packets for the host, and transfers that wait for them.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;

use crate::message::{Answers, TransferStatus};

/// Packets that no host fetches are dropped after this time, as by firmware with little memory: a later host reads no
/// old data.
const KEPT: Duration = Duration::from_secs(1);

/// Greatest number of waiting bytes; beyond it the oldest packets are dropped.
const WAITING_BYTES_MAX: usize = 256 * 1024;

/// Packets on their way to the host.
///
/// A transfer takes packet after packet until a short one, or until its room is full (USB 2.0, section 5.8.3).
/// Until then it waits, and its packets stay here: a cancelled transfer loses no data.
#[derive(Debug)]
pub(crate) struct Pipe {
    packet_bytes: usize,
    packets: VecDeque<(Instant, Vec<u8>)>,
    waiting_bytes: usize,
    transfers: VecDeque<Waiting>,
    is_halted: bool,
    /// Least time between answers.
    slowness: Duration,
    /// No answer before this time.
    busy_until: Option<Instant>,
    lost: u64,
}

#[derive(Debug)]
struct Waiting {
    seq: u32,
    room: usize,
}

impl Pipe {
    /// An endpoint whose packets have at most this many bytes.
    pub(crate) fn new(packet_bytes: u16) -> Self {
        Self {
            packet_bytes: packet_bytes.into(),
            packets: VecDeque::new(),
            waiting_bytes: 0,
            transfers: VecDeque::new(),
            is_halted: false,
            slowness: Duration::ZERO,
            busy_until: None,
            lost: 0,
        }
    }

    /// Adds a packet for the host.
    pub(crate) fn push(&mut self, packet: Vec<u8>, now: Instant) {
        self.waiting_bytes += packet.len();
        self.packets.push_back((now, packet));
        while self.waiting_bytes > WAITING_BYTES_MAX {
            self.lose_oldest();
        }
    }

    /// Adds a transfer of the host.
    pub(crate) fn ask(&mut self, seq: u32, room: usize) {
        self.transfers.push_back(Waiting { seq, room });
    }

    /// Cancels a transfer; false if it does not wait here.
    pub(crate) fn unlink(&mut self, seq: u32) -> bool {
        let before = self.transfers.len();
        self.transfers.retain(|transfer| transfer.seq != seq);
        self.transfers.len() < before
    }

    /// Lets every transfer fail until [`clear_halt`](Self::clear_halt).
    pub(crate) fn halt(&mut self) {
        self.is_halted = true;
    }

    /// Ends a halt.
    pub(crate) fn clear_halt(&mut self) {
        self.is_halted = false;
    }

    /// True while it has halted.
    pub(crate) fn is_halted(&self) -> bool {
        self.is_halted
    }

    /// Answers at most one transfer per this time; zero means no limit.
    pub(crate) fn slow_down(&mut self, slowness: Duration) {
        self.slowness = slowness;
        self.busy_until = None;
    }

    /// Discards packets that were not fetched.
    pub(crate) fn clear(&mut self) {
        self.packets.clear();
        self.waiting_bytes = 0;
    }

    /// True if a transfer waits for packets, the first or an ending one.
    pub(crate) fn is_starved(&self) -> bool {
        !self.is_halted && self.transfers.front().is_some_and(|transfer| self.extent(transfer.room).is_none())
    }

    /// Number of packets that no host fetched in time.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }

    /// When a transfer that must wait now can be answered.
    pub(crate) fn next_wake(&self) -> Option<Instant> {
        self.busy_until.filter(|_| !self.transfers.is_empty() && !self.packets.is_empty())
    }

    /// Answers all transfers that can be answered now.
    pub(crate) fn serve(&mut self, now: Instant, answers: &mut Answers) {
        while self.packets.front().is_some_and(|(since, _)| now.duration_since(*since) > KEPT) {
            self.lose_oldest();
        }
        while let Some(transfer) = self.transfers.front() {
            let seq = transfer.seq;
            if self.is_halted {
                answers.sent(seq, TransferStatus::Stalled, &[]);
            } else if self.busy_until.is_some_and(|until| now < until) {
                return;
            } else {
                let room = transfer.room;
                let Some((packets, bytes)) = self.extent(room) else { return };
                self.waiting_bytes -= bytes;
                let data: Vec<u8> = self.packets.drain(..packets).flat_map(|(_, packet)| packet).collect();
                if bytes > room {
                    answers.sent(seq, TransferStatus::Overflow, &[]);
                } else {
                    answers.sent(seq, TransferStatus::Done, &data);
                }
                self.busy_until = (!self.slowness.is_zero()).then(|| now + self.slowness);
            }
            self.transfers.pop_front();
        }
    }

    /// How many packets a transfer takes, and their bytes; `None` while it is incomplete.
    fn extent(&self, room: usize) -> Option<(usize, usize)> {
        let (mut packets, mut bytes) = (0, 0);
        if room == 0 {
            return Some((packets, bytes));
        }
        for (_, packet) in &self.packets {
            packets += 1;
            bytes += packet.len();
            if bytes >= room || packet.len() < self.packet_bytes {
                return Some((packets, bytes));
            }
        }
        None
    }

    fn lose_oldest(&mut self) {
        if let Some((_, packet)) = self.packets.pop_front() {
            self.waiting_bytes -= packet.len();
            self.lost += 1;
        }
    }
}

#[cfg(test)]
#[path = "pipe_tests.rs"]
mod tests;
