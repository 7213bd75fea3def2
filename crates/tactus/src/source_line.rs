//! The line of a script that a message is about, with a caret below its place.

/// Longest part of a line that is shown, in characters.
const CHARS_MAX: usize = 120;

/// A message, followed by the line of the script that it names as `NAME.star:LINE` or `NAME.star:LINE:COLUMN`. Without such a place it
/// stays as it is.
pub(crate) fn with_source_line(message: &str, name: &str, source: &str) -> String {
    match shown(message, name, source) {
        Some(shown) => format!("{message}\n{shown}"),
        None => message.to_owned(),
    }
}

fn shown(message: &str, name: &str, source: &str) -> Option<String> {
    let (_, place) = message.split_once(&format!("{name}.star:"))?;
    let mut numbers = place.split(':').map(|part| {
        let digits = part.len() - part.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        part.get(..digits)?.parse::<usize>().ok()
    });
    let line = numbers.next()??;
    let text = source.lines().nth(line.checked_sub(1)?)?;
    let indent = text.chars().take_while(|c| c.is_whitespace()).count();
    let column = numbers.next().flatten().map_or(indent, |column| column.saturating_sub(1));
    let text: String = text.chars().take(CHARS_MAX).map(|c| if c.is_control() { ' ' } else { c }).collect();
    let margin = " ".repeat(line.to_string().len());
    let caret = if column < CHARS_MAX { format!("{}^", " ".repeat(column)) } else { String::new() };
    Some(format!("  {line} | {text}\n  {margin} | {caret}"))
}

#[cfg(test)]
#[path = "source_line_tests.rs"]
mod tests;
