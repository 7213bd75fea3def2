//! Subscribes to the live frames of a rig and prints the largest reading of each.
//!
//! ```text
//! cargo run --package tactus-examples --example subscribe -- [tcp/HOST:PORT [FRAMES]]
//! ```
//!
//! Without arguments it listens to the service on this machine and ends after 100 frames.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;

use tactus_bus::{Client, Endpoint, History};
use tactus_schema::pb;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let endpoint: Endpoint = arguments.next().map_or_else(|| Ok(Endpoint::default()), |text| text.parse())?;
    let frames: usize = arguments.next().map_or(Ok(100), |text| text.parse())?;

    let client = Client::connect(&endpoint, None).await?;
    println!("rig {}", client.rig());
    let mut subscription = client.subscribe::<pb::Frame>(History::None).await?;
    for _ in 0..frames {
        let Some(frame) = subscription.recv().await else { return Err("the service has gone".into()) };
        let largest = frame.counts.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        println!("frame {:6}  largest reading {largest:7.1} counts", frame.seq);
    }
    client.close().await?;
    Ok(())
}
