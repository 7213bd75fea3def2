//! Any text as a rig file, a model, a draft or a description of a link: it is read or refused without a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_schema::model::Model;
use tactus_schema::{DraftFile, Rig};
use tactus_wire::declared::RawFormat;

fuzz_target!(|text: &str| {
    // Formatting an error must not panic either.
    let messages = [
        Rig::from_toml(text).err().map(|error| error.to_string()),
        Rig::from_json(text).err().map(|error| error.to_string()),
        Model::from_toml(text).err().map(|error| error.to_string()),
        DraftFile::from_toml(text).err().map(|error| error.to_string()),
        toml::from_str::<RawFormat>(text)
            .ok()
            .and_then(|raw| raw.check().err())
            .map(|error| error.to_string()),
    ];
    assert!(messages.iter().flatten().all(|message| !message.is_empty()));
});
