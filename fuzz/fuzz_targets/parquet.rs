//! Any bytes as a measurement table. It is read in bounded memory or refused, the readers agree with each other, and what was read
//! can be written and read alike.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::{Scratch, memory};
use tactus_record::table::{self, Table, TableWriter};
use tactus_record::{RowsError, rows};
use tactus_schema::table::{RIG_METADATA_KEY, Row};

/// Most memory to read a file of a few kilobytes.
const READ_MAX_BYTES: usize = 512 << 20;

static SCRATCH: LazyLock<Scratch> = LazyLock::new(Scratch::new);

fuzz_target!(
    init: {
        // The reader turns panics of the library's decoders into errors, so a panic alone is no defect here. One that nobody catches
        // still ends the target.
        std::panic::set_hook(Box::new(|panic| {
            let is_decoder = panic.location().is_some_and(|at| at.file().contains("/parquet-"));
            if !is_decoder {
                eprintln!("{panic}");
            }
        }));
    },
    |input: &[u8]| {
        let path = SCRATCH.file("any.parquet", input);
        memory::within(READ_MAX_BYTES, || check(&path));
    }
);

fn check(path: &Path) {
    let validated = table::validate(path).map_err(|error| error.to_string());
    let table = table::read(path).map_err(|error| error.to_string());
    let mut seen = 0;
    let visited = rows::visit(&[path], |_, _| seen += 1);
    match (validated, table) {
        (Err(error), Err(same)) => {
            assert!(!error.is_empty());
            assert_eq!(error, same);
            assert!(visited.is_err(), "{error}");
        }
        (Ok(validated), Ok(table)) => {
            assert_eq!(validated.rows, table.len() as u64);
            assert_eq!(validated.runs, table.runs().len() as u64);
            // A table without rows has no run; all others give each row.
            assert_eq!(table.rows().count(), table.len());
            match visited {
                Ok(_) => assert_eq!(seen, table.len()),
                Err(RowsError::RunTwice { .. }) => {}
                Err(error) => panic!("{error}"),
            }
            written(&table);
        }
        (validated, table) => panic!("{:?} against {:?}", validated.err(), table.err()),
    }
}

/// Writes the rows and reads them again.
fn written(table: &Table) {
    let path = SCRATCH.free("written.parquet");
    let rig_json = &table.head().metadata[RIG_METADATA_KEY];
    let mut writer = TableWriter::create(&path, rig_json).expect("the rig was read");
    for row in table.rows() {
        writer.push(row).expect("the row was read");
    }
    writer.finish().expect("the rows are sound");
    let again = table::read(&path).expect("what was written");
    let texts = |table: &Table| table.rows().map(|row| format!("{:?}", Row::from(row))).collect::<Vec<_>>();
    assert_eq!(texts(table), texts(&again));
}
