//! One viewer: its requests and what it gets, without the connection.

use axum::extract::ws::Message;
use serde::Deserialize;
use serde_json::json;
use tactus_report::viewer::Channel;

use super::channels::{Channels, Data, Told, What};
use crate::board::Board;

/// Subscriptions of a viewer at most; it wants one for each channel.
const SUBSCRIPTIONS_MAX: usize = 16;
/// Binary messages with data of a channel.
const MESSAGE_DATA: u8 = 1;

/// What a viewer has subscribed to.
#[derive(Debug, Default)]
pub(crate) struct Viewer {
    subscriptions: Vec<Subscription>,
    missed: u64,
}

#[derive(Debug)]
struct Subscription {
    /// The viewer's name for it.
    id: u32,
    channel: Channel,
    /// Number of the first message that it did not get when it subscribed.
    from: u64,
}

/// A request; viewers have others, which change or ask something.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
enum Request {
    Subscribe { subscriptions: Vec<Wish> },
    Unsubscribe { subscription_ids: Vec<u32> },
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Wish {
    id: u32,
    channel_id: usize,
}

impl Viewer {
    /// The answers to a request.
    pub(crate) fn on_request(&mut self, text: &str, channels: &Channels, board: &Board) -> Vec<Message> {
        match serde_json::from_str(text) {
            Ok(Request::Subscribe { subscriptions }) => {
                subscriptions.into_iter().flat_map(|wish| self.subscribe(&wish, channels, board)).collect()
            }
            Ok(Request::Unsubscribe { subscription_ids }) => {
                self.subscriptions.retain(|subscription| !subscription_ids.contains(&subscription.id));
                Vec::new()
            }
            Err(error) => vec![complaint(&format!("this server only shows its channels: {error}"))],
        }
    }

    fn subscribe(&mut self, wish: &Wish, channels: &Channels, board: &Board) -> Vec<Message> {
        let &Wish { id, channel_id } = wish;
        let Some(channel) = Channel::ALL.into_iter().find(|channel| *channel as usize == channel_id) else {
            return vec![complaint(&format!("there is no channel {channel_id}"))];
        };
        if self.subscriptions.len() == SUBSCRIPTIONS_MAX {
            return vec![complaint(&format!("a viewer has at most {SUBSCRIPTIONS_MAX} subscriptions"))];
        }
        if self.subscriptions.iter().any(|subscription| subscription.id == id) {
            return vec![complaint(&format!("subscription {id} is there already"))];
        }
        let (present, from) = channels.present(channel, board);
        self.subscriptions.push(Subscription { id, channel, from });
        present.iter().map(|data| with_id(id, data)).collect()
    }

    /// What the viewer gets of what is told to all.
    pub(crate) fn on_told(&self, told: &Told) -> Vec<Message> {
        match &told.what {
            What::Text(text) => vec![Message::text(text.as_str())],
            What::Data(data) => {
                let wants = |one: &&Subscription| one.channel == data.channel && one.from <= told.number;
                self.subscriptions.iter().filter(wants).map(|one| with_id(one.id, data)).collect()
            }
        }
    }

    /// The viewer was too slow.
    pub(crate) fn on_missed(&mut self, messages: u64) -> Message {
        self.missed += messages;
        let message =
            format!("this viewer is too slow: it missed {} messages of all channels so far", self.missed);
        status(1, &message, "missed")
    }
}

fn with_id(id: u32, Data { at, message, .. }: &Data) -> Message {
    let at_ns = u64::try_from(at.ns()).unwrap_or(0);
    let mut bytes = Vec::with_capacity(13 + message.len());
    bytes.push(MESSAGE_DATA);
    bytes.extend(id.to_le_bytes());
    bytes.extend(at_ns.to_le_bytes());
    bytes.extend_from_slice(message);
    Message::binary(bytes)
}

fn complaint(text: &str) -> Message {
    status(2, text, "request")
}

/// News for the viewer's list of problems; it replaces that of the same id. Level 1 is a warning, 2 an error.
fn status(level: u8, message: &str, id: &str) -> Message {
    Message::text(json!({ "op": "status", "level": level, "message": message, "id": id }).to_string())
}

#[cfg(test)]
#[path = "viewer_tests.rs"]
mod tests;
