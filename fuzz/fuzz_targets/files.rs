//! Rig files, models and descriptions of links as somebody may write them: refused or read, without a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_schema::Rig;
use tactus_schema::model::Model;
use tactus_wire::declared::RawFormat;

fuzz_target!(|text: &str| {
    // The errors are for a person: they must be printable too.
    let told = [
        Rig::from_toml(text).err().map(|error| error.to_string()),
        Rig::from_json(text).err().map(|error| error.to_string()),
        Model::from_toml(text).err().map(|error| error.to_string()),
        toml::from_str::<RawFormat>(text)
            .ok()
            .and_then(|raw| raw.check().err())
            .map(|error| error.to_string()),
    ];
    assert!(told.iter().flatten().all(|error| !error.is_empty()));
});
