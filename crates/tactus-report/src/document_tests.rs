use std::fmt;

use super::{Column, Table, document, notes};

const HOSTILE: &str = "<img src=x>";

#[test]
fn titles_cells_and_notes_are_escaped() {
    let mut table = Table::new(&[Column::Name("a < b"), Column::Number("n"), Column::Prose("why")]);
    table.row([HOSTILE, "1", HOSTILE]);
    let said = [HOSTILE.to_owned()];
    let page =
        document(HOSTILE, fmt::from_fn(|f| write!(f, "{table}").and_then(|()| notes(f, "Notes", &said))));
    assert!(!page.contains("<img"));
    assert_eq!(page.matches("&lt;img src=x&gt;").count(), 4);
    assert!(page.contains("<th>a &lt; b</th>") && page.contains("<td class=\"n\">1</td>"));
}

#[test]
fn no_notes_leave_no_heading() {
    assert_eq!(fmt::from_fn(|f| notes(f, "Notes", &[])).to_string(), "");
}
