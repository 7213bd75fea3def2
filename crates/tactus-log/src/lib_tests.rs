use std::io::Write;
use std::sync::{Arc, Mutex};

use super::*;

#[derive(Clone, Default)]
struct Page(Arc<Mutex<Vec<u8>>>);

impl Write for Page {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_line_for_the_journal_begins_with_its_priority() {
    let page = Page::default();
    let written = page.clone();
    let lines = tracing_subscriber::fmt()
        .with_max_level(Level::TRACE)
        .with_writer(move || written.clone())
        .with_ansi(false)
        .with_target(false)
        .without_time()
        .map_event_format(Ranked)
        .finish();
    tracing::subscriber::with_default(lines, || {
        tracing::error!("stopped");
        tracing::warn!("slow");
        tracing::info!(rig = "sim", "ready");
        tracing::debug!("bytes");
    });
    let text = String::from_utf8(page.0.lock().unwrap().clone()).unwrap();
    assert_eq!(text, "<3>ERROR stopped\n<4> WARN slow\n<6> INFO ready rig=\"sim\"\n<7>DEBUG bytes\n");
}
