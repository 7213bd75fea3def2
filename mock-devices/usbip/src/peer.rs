//! A USB device at its end of the cable: answers the host controller's messages, bytes in and bytes out.

use std::collections::BTreeMap;
use std::time::Duration;

use tokio::time::Instant;

use crate::descriptor::IN;
use crate::gadget::{Gadget, Outcome};
use crate::message::{Answers, Decoder, Direction, MessageError, Transfer, TransferStatus, UsbipRequest};
use crate::pipe::Pipe;
use crate::setup::{ENDPOINT_HALT, Recipient, Refused, RequestKind, Setup, standard};

/// A plugged-in device as a state machine; it neither waits nor reads a clock.
///
/// Times never go back. After every call the caller sends [`take_answers`](Self::take_answers) to the kernel and
/// [`take_heard`](Self::take_heard) to the devices behind, and calls [`wake`](Self::wake) when
/// [`next_wake`](Self::next_wake) has come.
pub(crate) struct Peer {
    gadget: Gadget,
    decoder: Decoder,
    answers: Answers,
    /// Endpoints that send, by address.
    pipes: BTreeMap<u8, Pipe>,
    /// Endpoints that receive: address, function, whether halted.
    ears: BTreeMap<u8, Ear>,
    /// Functions with an idle packet: since when a host has waited for data.
    starved_since: BTreeMap<usize, Instant>,
    heard: Vec<(usize, Vec<u8>)>,
}

#[derive(Debug)]
struct Ear {
    function: usize,
    is_halted: bool,
}

impl Peer {
    /// A device that was just plugged in.
    pub(crate) fn new(gadget: Gadget) -> Self {
        let (mut pipes, mut ears) = (BTreeMap::new(), BTreeMap::new());
        for (function, endpoint) in gadget.endpoints() {
            if endpoint.address & IN != 0 {
                pipes.insert(endpoint.address, Pipe::new(endpoint.packet_bytes));
            } else {
                ears.insert(endpoint.address, Ear { function, is_halted: false });
            }
        }
        Self {
            gadget,
            decoder: Decoder::default(),
            answers: Answers::default(),
            pipes,
            ears,
            starved_since: BTreeMap::new(),
            heard: Vec::new(),
        }
    }

    /// Takes bytes from the kernel.
    ///
    /// # Errors
    /// If they are no request. The connection cannot be used any more.
    pub(crate) fn receive(&mut self, bytes: &[u8], now: Instant) -> Result<(), MessageError> {
        self.decoder.push(bytes);
        while let Some(request) = self.decoder.next_request()? {
            match request {
                UsbipRequest::Submit(transfer) => self.submit(transfer),
                UsbipRequest::Unlink { seq, victim } => self.unlink(seq, victim),
            }
        }
        self.wake(now);
        Ok(())
    }

    /// Takes bytes of the device behind a function. Without a host they are lost.
    pub(crate) fn send(&mut self, function: usize, bytes: &[u8], now: Instant) {
        let Some(pipe) = self.gadget.data_address(function).and_then(|address| self.pipes.get_mut(&address))
        else {
            return;
        };
        let Some(function) = self.gadget.function(function).filter(|function| function.is_open()) else {
            return;
        };
        for packet in function.packets(bytes) {
            pipe.push(packet, now);
        }
        self.wake(now);
    }

    /// Does everything that is due.
    pub(crate) fn wake(&mut self, now: Instant) {
        self.fill_silence(now);
        for pipe in self.pipes.values_mut() {
            pipe.serve(now, &mut self.answers);
        }
        self.note_silence(now);
    }

    /// When something is due next.
    pub(crate) fn next_wake(&mut self) -> Option<Instant> {
        let silences: Vec<_> =
            self.starved_since.iter().map(|(function, since)| (*function, *since)).collect();
        let idle = silences.into_iter().filter_map(|(function, since)| {
            self.gadget.function(function)?.idle_packet().map(|(after, _)| since + after)
        });
        let idle = idle.min();
        self.pipes.values().filter_map(Pipe::next_wake).chain(idle).min()
    }

    /// Halts a function's sending endpoint: its transfers stall until the host clears the halt.
    pub(crate) fn halt(&mut self, function: usize, now: Instant) {
        if let Some(pipe) = self.data_pipe(function) {
            pipe.halt();
        }
        self.wake(now);
    }

    /// Limits a function to one answered transfer per this time.
    pub(crate) fn slow_down(&mut self, function: usize, slowness: Duration, now: Instant) {
        if let Some(pipe) = self.data_pipe(function) {
            pipe.slow_down(slowness);
        }
        self.wake(now);
    }

    /// Number of packets of all functions that no host fetched in time.
    pub(crate) fn lost(&self) -> u64 {
        self.pipes.values().map(Pipe::lost).sum()
    }

    /// Takes the bytes for the kernel.
    pub(crate) fn take_answers(&mut self) -> Vec<u8> {
        self.answers.take()
    }

    /// Takes the bytes for the devices behind, with the index of the function.
    pub(crate) fn take_heard(&mut self) -> Vec<(usize, Vec<u8>)> {
        std::mem::take(&mut self.heard)
    }

    fn submit(&mut self, Transfer { seq, endpoint, flow, setup }: Transfer) {
        match (endpoint, flow) {
            (0, Direction::In(room)) => {
                let data = self.control(setup, &[]);
                match data {
                    Ok(mut data) => {
                        data.truncate(room);
                        self.answers.sent(seq, TransferStatus::Done, &data);
                    }
                    Err(Refused) => self.answers.sent(seq, TransferStatus::Stalled, &[]),
                }
            }
            (0, Direction::Out(data)) => match self.control(setup, &data) {
                Ok(_) => self.answers.taken(seq, TransferStatus::Done, data.len()),
                Err(Refused) => self.answers.taken(seq, TransferStatus::Stalled, 0),
            },
            (number, Direction::In(room)) => match self.pipes.get_mut(&(IN | number)) {
                Some(pipe) => pipe.ask(seq, room),
                None => self.answers.sent(seq, TransferStatus::Stalled, &[]),
            },
            (number, Direction::Out(data)) => match self.ears.get(&number) {
                Some(Ear { function, is_halted: false }) => {
                    self.answers.taken(seq, TransferStatus::Done, data.len());
                    self.heard.push((*function, data));
                }
                Some(Ear { is_halted: true, .. }) | None => {
                    self.answers.taken(seq, TransferStatus::Stalled, 0);
                }
            },
        }
    }

    fn unlink(&mut self, seq: u32, victim: u32) {
        let waited = self.pipes.values_mut().any(|pipe| pipe.unlink(victim));
        // A transfer that does not wait has been answered already.
        self.answers.unlinked(seq, if waited { TransferStatus::Unlinked } else { TransferStatus::Done });
    }

    fn control(&mut self, setup: Setup, data: &[u8]) -> Result<Vec<u8>, Refused> {
        if (setup.kind(), setup.recipient()) == (Some(RequestKind::Standard), Some(Recipient::Endpoint)) {
            return self.endpoint_request(setup);
        }
        match self.gadget.control(setup, data)? {
            Outcome::Data(data) => {
                self.hang_up_where_closed();
                Ok(data)
            }
            Outcome::Heard(function, bytes) => {
                self.heard.push((function, bytes));
                Ok(Vec::new())
            }
            Outcome::Renewed => {
                for pipe in self.pipes.values_mut() {
                    pipe.clear_halt();
                    pipe.clear();
                }
                for ear in self.ears.values_mut() {
                    ear.is_halted = false;
                }
                Ok(Vec::new())
            }
        }
    }

    /// Requests about the halt of one endpoint (USB 2.0, sections 9.4.1, 9.4.5 and 9.4.9).
    fn endpoint_request(&mut self, setup: Setup) -> Result<Vec<u8>, Refused> {
        let address = setup.index_low();
        let is_halt = setup.value == ENDPOINT_HALT;
        let change = match setup.request {
            standard::GET_STATUS => None,
            standard::CLEAR_FEATURE if is_halt => Some(false),
            standard::SET_FEATURE if is_halt => Some(true),
            _ => return Err(Refused),
        };
        let is_halted = if address & !IN == 0 {
            // The control endpoint never stays halted.
            false
        } else if let Some(pipe) = self.pipes.get_mut(&address) {
            match change {
                Some(true) => pipe.halt(),
                Some(false) => pipe.clear_halt(),
                None => {}
            }
            pipe.is_halted()
        } else {
            let ear = self.ears.get_mut(&address).ok_or(Refused)?;
            ear.is_halted = change.unwrap_or(ear.is_halted);
            ear.is_halted
        };
        Ok(if setup.is_in() { vec![is_halted.into(), 0] } else { Vec::new() })
    }

    /// Discards data for a host that has just closed, so that the next gets none of it.
    fn hang_up_where_closed(&mut self) {
        let numbers: Vec<_> = self.functions().collect();
        for number in numbers {
            if self.gadget.function(number).is_some_and(|function| !function.is_open())
                && let Some(pipe) = self.data_pipe(number)
            {
                pipe.clear();
            }
        }
    }

    /// Sends the idle packets that are due.
    fn fill_silence(&mut self, now: Instant) {
        let silences: Vec<_> =
            self.starved_since.iter().map(|(function, since)| (*function, *since)).collect();
        for (number, since) in silences {
            let idle = self.gadget.function(number).and_then(|function| function.idle_packet());
            if let Some((after, packet)) = idle
                && now >= since + after
                && let Some(pipe) = self.data_pipe(number)
            {
                pipe.push(packet, now);
                self.starved_since.remove(&number);
            }
        }
    }

    fn note_silence(&mut self, now: Instant) {
        let numbers: Vec<_> = self.functions().collect();
        for number in numbers {
            let has_idle =
                self.gadget.function(number).is_some_and(|function| function.idle_packet().is_some());
            if has_idle && self.data_pipe(number).is_some_and(|pipe| pipe.is_starved()) {
                self.starved_since.entry(number).or_insert(now);
            } else {
                self.starved_since.remove(&number);
            }
        }
    }

    fn functions(&self) -> impl Iterator<Item = usize> {
        (0..).take_while(|number| self.gadget.data_address(*number).is_some())
    }

    fn data_pipe(&mut self, function: usize) -> Option<&mut Pipe> {
        self.gadget.data_address(function).and_then(|address| self.pipes.get_mut(&address))
    }
}

#[cfg(test)]
#[path = "peer_tests.rs"]
mod tests;
