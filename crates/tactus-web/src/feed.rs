//! Turns the board into messages for the pages. Each message is written once, however many pages there are.

use axum::body::Bytes;
use tactus_schema::pb;
use tokio::sync::broadcast;

use crate::board::Board;

/// Messages that a page may be behind: two seconds of frames. A slower page misses the oldest, and gets the whole board anew.
const BEHIND_MAX: usize = 64;
/// Calls of [`Feed::tell`] after which the view is told although it has not changed: pages see that this program lives.
const TELLS_PER_PULSE: u32 = 10;

/// The board, and what its pages were told of it.
#[derive(Debug)]
pub(crate) struct Feed {
    pub(crate) board: Board,
    pages: broadcast::Sender<Bytes>,
    told_rig: String,
    told_view: String,
    /// Number of the first log entry that was not told.
    told_log: u64,
    tells: u32,
    #[cfg(feature = "foxglove")]
    pub(crate) channels: crate::foxglove::Channels,
}

impl Feed {
    pub(crate) fn new(board: Board) -> Self {
        // Drop-oldest: nothing waits for a page.
        let (pages, _) = broadcast::channel(BEHIND_MAX);
        Self {
            board,
            pages,
            told_rig: String::new(),
            told_view: String::new(),
            told_log: 0,
            tells: 0,
            #[cfg(feature = "foxglove")]
            channels: crate::foxglove::Channels::default(),
        }
    }

    /// Takes a frame, and passes it on if it is new.
    pub(crate) fn on_frame(&mut self, frame: pb::Frame, missed: u64) {
        let is_new = self.board.on_frame(frame, missed);
        #[cfg(feature = "foxglove")]
        if is_new {
            self.channels.on_frame(&self.board);
        }
        if is_new
            && self.pages.receiver_count() > 0
            && let Some(json) = self.board.frame_json()
        {
            self.send(message("frame", &json));
        }
    }

    /// Takes a report of the stage.
    pub(crate) fn on_stage(&mut self, stage: pb::StageState) {
        self.board.stage = Some(stage);
        #[cfg(feature = "foxglove")]
        self.channels.on_stage(&self.board);
    }

    /// Tells what has changed since the last call, and the view now and then in any case.
    pub(crate) fn tell(&mut self) {
        #[cfg(feature = "foxglove")]
        self.channels.tell(&self.board);
        if self.pages.receiver_count() == 0 {
            return;
        }
        self.tells += 1;
        let rig = self.board.rig_json().to_string();
        if rig != self.told_rig {
            self.send(message("rig", &rig));
            self.told_rig = rig;
        }
        let view = self.board.view_json().to_string();
        if view != self.told_view || self.tells >= TELLS_PER_PULSE {
            self.send(message("view", &view));
            self.told_view = view;
            self.tells = 0;
        }
        let next = self.board.log.next();
        if self.told_log < next {
            let entries = self.board.log.json_from(self.told_log).to_string();
            self.send(message("log", &entries));
            self.told_log = next;
        }
    }

    /// All of the board but the last minutes.
    pub(crate) fn whole(&self) -> Bytes {
        let board = &self.board;
        let mut text = String::new();
        text += &as_event("rig", &board.rig_json().to_string());
        text += &as_event("view", &board.view_json().to_string());
        text += &as_event("log", &board.log.json_from(0).to_string());
        if let Some(frame) = board.frame_json() {
            text += &as_event("frame", &frame);
        }
        text.into()
    }

    /// All of the board, and the messages that follow.
    pub(crate) fn join(&self) -> (Bytes, broadcast::Receiver<Bytes>) {
        (self.whole(), self.pages.subscribe())
    }

    fn send(&self, message: Bytes) {
        // Nobody looks.
        let _unseen = self.pages.send(message);
    }
}

/// A server-sent event. JSON has no line breaks.
fn as_event(name: &str, json: &str) -> String {
    format!("event: {name}\ndata: {json}\n\n")
}

fn message(name: &str, json: &str) -> Bytes {
    as_event(name, json).into()
}

#[cfg(test)]
#[path = "feed_tests.rs"]
mod tests;
