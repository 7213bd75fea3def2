//! Many rigs on one node.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{sync::Arc, time::Duration};

use tactus_bus::{
    BusConfig, BusError, Client, CommandCall, Credentials, Endpoint, History, Node, ask_all, stop,
};
use tactus_schema::{
    key::{Command, Keys},
    pb,
};
use tokio::sync::mpsc;

use crate::lab::{frame, free_endpoint};

/// Longer than any test runs.
const PATIENCE: Duration = Duration::from_hours(1);

/// A node for these rigs, and where all their stops arrive.
async fn node(rigs: &[&str]) -> (Arc<Node>, mpsc::Receiver<Box<CommandCall>>, Endpoint) {
    let keys: Vec<_> = rigs.iter().map(|&rig| Keys::new(rig)).collect();
    loop {
        let endpoint = free_endpoint();
        let config = BusConfig { listen: vec![endpoint.clone()], ..BusConfig::default() };
        match Node::open(&config, &keys).await {
            Ok((node, stops)) => return (node, stops, endpoint),
            // Somebody else took the port meanwhile.
            Err(BusError::Open { .. } | BusError::Stop { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

/// Answers each command with the rig that it came to.
async fn answer(mut commands: mpsc::Receiver<Box<CommandCall>>) {
    while let Some(call) = commands.recv().await {
        let rig = call.rig.as_deref().unwrap_or("all").to_owned();
        call.reply.reply(pb::CommandReply { ok: true, rig, ..Default::default() });
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn each_rig_has_its_keys_and_a_client_chooses() {
    let (node, _stops, endpoint) = node(&["left", "right"]).await;
    let (left, commands) = node.serve(Keys::new("left")).await.unwrap();
    tokio::spawn(answer(commands));
    let (right, commands) = node.serve(Keys::new("right")).await.unwrap();
    tokio::spawn(answer(commands));
    let again = node.serve(Keys::new("left")).await.unwrap_err();
    assert!(matches!(&again, BusError::Served { rig } if rig == "left"), "{again}");
    drop(node);

    // Only one is ready. Nevertheless nobody who names none gets it.
    let alive = left.declare_alive().await.unwrap();
    let error = Client::connect(&endpoint, None).await.unwrap_err();
    assert!(matches!(&error, BusError::SeveralRigs { rigs, .. } if rigs == &["left", "right"]), "{error}");
    let client = Client::connect(&endpoint, Some("right")).await.unwrap();
    let request = pb::CommandRequest { who: "test".into(), ..Default::default() };
    assert_eq!(client.command(Command::Status, &request, PATIENCE).await.unwrap().rig, "right");
    let all = ask_all(&endpoint, &Credentials::default(), Command::Status, &request, PATIENCE).await.unwrap();
    let all: Vec<_> = all.into_iter().map(|(rig, reply)| (rig, reply.unwrap().rig)).collect();
    assert_eq!(all, [("left".into(), "left".into()), ("right".into(), "right".into())]);

    // Each hears its own frames, and one that leaves takes nothing with it.
    for seq in 0..3 {
        left.publisher().publish_frame(&frame(seq));
        right.publisher().publish_frame(&frame(10 + seq));
    }
    let mut frames = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    for seq in 10..13 {
        assert_eq!(frames.recv().await.unwrap().seq, seq);
    }
    drop(alive);
    left.close().await.unwrap();
    right.publisher().publish_frame(&frame(13));
    assert_eq!(frames.recv().await.unwrap().seq, 13);
    right.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_without_a_name_is_one_call_for_all_and_each_rig_answers() {
    let (node, mut stops, endpoint) = node(&["left", "right"]).await;
    let (left, _left_commands) = node.serve(Keys::new("left")).await.unwrap();
    let (right, _right_commands) = node.serve(Keys::new("right")).await.unwrap();
    drop(node);
    let (told, mut heard) = mpsc::unbounded_channel();
    tokio::spawn(async move {
        while let Some(call) = stops.recv().await {
            let names = match &call.rig {
                Some(rig) => vec![rig.to_string()],
                None => vec!["left".to_owned(), "right".to_owned()],
            };
            // Nobody listens if the test has failed.
            let _told = told.send(call.rig);
            let of = |rig| pb::CommandReply { ok: true, rig, ..Default::default() };
            call.reply.reply_for_all(names.into_iter().map(of).collect());
        }
    });
    let request = pb::CommandRequest { who: "test".into(), ..Default::default() };
    for (rig, wanted) in [(None, vec!["left", "right"]), (Some("right"), vec!["right"])] {
        let answers = stop(&endpoint, rig, &request, &Credentials::default(), PATIENCE).await.unwrap();
        let answered: Vec<_> = answers.iter().map(|reply| reply.rig.as_str()).collect();
        assert_eq!(answered, wanted);
        assert_eq!(heard.recv().await.unwrap().as_deref(), rig);
        // By datagram and on the bus.
        assert_eq!(heard.recv().await.unwrap().as_deref(), rig);
    }
    left.close().await.unwrap();
    right.close().await.unwrap();
}
