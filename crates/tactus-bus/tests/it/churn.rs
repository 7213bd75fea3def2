//! Clients come and go while the service publishes.
//!
//! Clients that subscribe to the topic's plain key crash the service in one run of six: see `topic::heard`.

use crate::lab::{Service, event, open, refused};
use tactus_bus::{Client, History};
use tactus_schema::pb;

/// Clients at a time.
const CLIENTS: u64 = 8;
/// How often each of them comes.
const VISITS: u64 = 30;
/// Messages of each visit: so many that the service still sends them to a client that has left.
const EVENTS: u64 = 1_000;

#[tokio::test(flavor = "multi_thread")]
async fn clients_that_come_and_go_do_not_harm_a_service_that_publishes() {
    let Service { bus, mut calls, endpoint } = open("bench", &[]).await;
    tokio::spawn(async move { while calls.commands.recv().await.is_some() {} });
    let visit = |client: u64| {
        let (endpoint, publisher) = (endpoint.clone(), bus.publisher());
        async move {
            for nth in 0..VISITS {
                let first = (client * VISITS + nth) * EVENTS;
                let client = Client::connect(&endpoint, Some("bench")).await.unwrap();
                let mut events = client.subscribe::<pb::RunEvent>(History::None).await.unwrap();
                refused(&client).await;
                for seq in first..first + EVENTS {
                    publisher.publish(&event(seq));
                }
                events.recv().await.unwrap();
            }
        }
    };
    let visits: Vec<_> = (0..CLIENTS).map(|client| tokio::spawn(visit(client))).collect();
    for visit in visits {
        visit.await.unwrap();
    }
    bus.close().await.unwrap();
}
