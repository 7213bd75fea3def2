//! The bus as any client sees it.

use tokio::runtime::Runtime;
use tokio::time::timeout;

use crate::DEADLINE;

/// Waits for what a future gives; only a hang takes as long as the deadline.
///
/// # Panics
/// If that takes until the deadline.
pub fn within<T>(runtime: &Runtime, future: impl Future<Output = T>) -> T {
    runtime.block_on(async { timeout(DEADLINE, future).await }).expect("an answer before the deadline")
}

/// A plain client of the bus.
///
/// # Panics
/// If there is no bus at the endpoint.
pub async fn raw_session(endpoint: &str) -> zenoh::Session {
    let mut config = zenoh::Config::default();
    config.insert_json5("mode", "\"client\"").expect("zenoh knows the setting");
    config.insert_json5("scouting/multicast/enabled", "false").expect("zenoh knows the setting");
    config.insert_json5("connect/endpoints", &format!("[\"{endpoint}\"]")).expect("zenoh knows the setting");
    zenoh::open(config).await.expect("a bus at the endpoint")
}
