//! The list of a long page's sections.

/// Pages with fewer sections have no list.
const SECTIONS_LEAST: usize = 6;

const SECTION: &str = "<section>\n";
const HEADER_END: &str = "</header>\n";

/// The body of a page with a link to each of its sections below the header, if there are many. A section's heading is its first `<h2>`.
pub(super) fn listed(body: String) -> String {
    let mut parts = body.split(SECTION);
    let (head, sections) = (parts.next().unwrap_or_default(), parts.collect::<Vec<_>>());
    let Some((header, lead)) = head.split_once(HEADER_END) else { return body };
    if sections.len() < SECTIONS_LEAST {
        return body;
    }
    let heading = |section: &str| {
        let (heading, _) = section.split_once("<h2>")?.1.split_once("</h2>")?;
        Some(heading.to_owned())
    };
    let numbered = || sections.iter().enumerate();
    let links: Vec<String> = numbered()
        .filter_map(|(nth, section)| Some(format!("<a href=\"#section-{nth}\">{}</a>\n", heading(section)?)))
        .collect();
    let rest: Vec<String> =
        numbered().map(|(nth, section)| format!("<section id=\"section-{nth}\">\n{section}")).collect();
    let (links, rest) = (links.concat(), rest.concat());
    format!("{header}{HEADER_END}<nav class=\"contents\">\n{links}</nav>\n{lead}{rest}")
}
