//! The line of a key in the text of a TOML file.

use toml::Spanned;
use toml::de::DeTable;

/// The line, from 1, of a path such as `effect.covariate[0].unit`; of a key that is missing, that of the table which should have it. `None` if that is
/// missing too.
pub(super) fn line_of(text: &str, path: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut table = Some(document.get_ref());
    let mut found = None;
    for part in path.split('.') {
        let (key, index) = part.split_once('[').unwrap_or((part, ""));
        let Some((key, value)) = table.and_then(|table| table.iter().find(|(name, _)| name.get_ref() == key))
        else {
            break;
        };
        let index = index.trim_end_matches(']').parse::<usize>().ok();
        let item = index.and_then(|index| value.get_ref().as_array()?.get(index));
        found = Some(item.map_or(key.span(), Spanned::span));
        table = item.unwrap_or(value).get_ref().as_table();
    }
    found.map(|found| 1 + text.get(..found.start).unwrap_or_default().matches('\n').count())
}
