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

#[test]
fn a_long_page_lists_its_sections() {
    let of = |sections: usize| {
        let section = |nth| format!("<section>\n<h2>Part {nth}</h2>\n</section>\n");
        let sections: String = (0..sections).map(section).collect();
        document("t", format!("<header>\n</header>\n<p>lead</p>\n{sections}"))
    };
    assert!(!of(5).contains("<nav"));
    let page = of(6);
    assert!(
        page.contains("</header>\n<nav class=\"contents\">\n<a href=\"#section-0\">Part 0</a>\n"),
        "{page}"
    );
    assert!(page.contains("</nav>\n<p>lead</p>\n<section id=\"section-0\">\n<h2>Part 0</h2>"), "{page}");
    assert_eq!(page.matches("<a href").count(), 6);
}
