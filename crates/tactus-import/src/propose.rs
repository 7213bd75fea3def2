//! A mapping to start from, by the names of the columns of a file.

use std::{fmt, path::Path};

use crate::{
    ImportError,
    columns::{Column, Columns},
    mapping::{FileForm, NUMBER, SCHEMA},
};

/// Columns whose ranges the proposal lists.
const LISTED: usize = 40;

/// Columns whose names differ in one number.
struct Family {
    /// With `{n}` for the number.
    pattern: String,
    first: usize,
    elements: usize,
}

/// The text of a mapping for a file: what the names of its columns say, and as comments what only the lab knows.
///
/// # Errors
/// If the file cannot be read.
pub fn propose(file: &Path) -> Result<String, ImportError> {
    let form = form_of(file)?;
    let columns = Columns::read(file, &form)?;
    let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(fmt::from_fn(|f| mapping(f, &name, &form, &columns)).to_string())
}

fn mapping(f: &mut fmt::Formatter<'_>, name: &str, form: &FileForm, columns: &Columns) -> fmt::Result {
    writeln!(
        f,
        "# A mapping for {name}: which column is what. Complete the lines that begin with #?, then\n#     tactus import --map THIS.toml {name}\nschema = {SCHEMA:?}"
    )?;
    if form.delimiter != b',' {
        let [delimiter, decimal] = [char::from(form.delimiter), form.decimal].map(String::from);
        writeln!(f, "\n[file]\ndelimiter = {delimiter:?}\ndecimal = {decimal:?}")?;
    }
    let family = family(columns.names());
    time(f, columns)?;
    for axis in ["x", "y", "z"] {
        position(f, columns, axis)?;
    }
    counts(f, family.as_ref())?;
    rig(f, columns, family.as_ref())?;
    writeln!(f, "\n# The file's columns:")?;
    for name in columns.names().iter().take(LISTED) {
        match columns.get("", name).ok().and_then(Column::range) {
            Some([least, most]) => writeln!(f, "#     {name}: {least} to {most}")?,
            None => writeln!(f, "#     {name}: no numbers")?,
        }
    }
    match columns.names().len().checked_sub(LISTED) {
        None | Some(0) => Ok(()),
        Some(more) => writeln!(f, "#     and {more} more"),
    }
}

/// The delimiter that divides the first line most often, and the decimal sign of the second.
fn form_of(file: &Path) -> Result<FileForm, ImportError> {
    let form = FileForm::default();
    if file.extension().is_some_and(|one| one == "npz" || one == "mcap") {
        return Ok(form);
    }
    let text = std::fs::read(file).map_err(|source| ImportError::Io {
        action: "read",
        path: file.to_owned(),
        source,
    })?;
    let is_comment = |line: &&[u8]| line.first().is_some_and(|first| Some(*first) == form.comment);
    let first = text.split(|byte| *byte == b'\n').find(|line| !is_comment(line)).unwrap_or_default();
    let count = |delimiter: u8| first.split(|byte| *byte == delimiter).count();
    let delimiter =
        [b',', b';', b'\t'].into_iter().max_by_key(|delimiter| (count(*delimiter), *delimiter == b','));
    let delimiter = delimiter.unwrap_or(b',');
    let numbers =
        text.split(|byte| *byte == b'\n').filter(|line| !is_comment(line)).nth(1).unwrap_or_default();
    let decimal = if delimiter != b',' && numbers.contains(&b',') { ',' } else { '.' };
    Ok(FileForm { delimiter, decimal, ..form })
}

fn time(f: &mut fmt::Formatter<'_>, columns: &Columns) -> fmt::Result {
    let found = found(columns, &["time", "timestamp", "t", "stamp", "log_time"]);
    f.write_str("\n[time]\n")?;
    match found {
        Some((name, unit)) => {
            writeln!(f, "column = {name:?}")?;
            asked(
                f,
                "unit",
                unit.filter(|unit| ["s", "ms", "us", "ns"].contains(unit)),
                "s\", \"ms\", \"us\" or \"ns",
            )
        }
        None => f.write_str(
            "#? column = \"...\"\n#? unit = \"s\"\n#? or, if no column says when: rate_hz = 30.0\n",
        ),
    }
}

fn position(f: &mut fmt::Formatter<'_>, columns: &Columns, axis: &str) -> fmt::Result {
    let names: &[&str] = if axis == "z" { &["z", "depth", "height", "indentation"] } else { &[axis] };
    writeln!(f, "\n[{axis}]")?;
    let Some((name, unit)) = found(columns, names) else {
        f.write_str("#? column = \"...\"\n#? unit = \"mm\"\n")?;
        if axis != "z" {
            f.write_str("#? or, if it never changed: at_mm = 0.0\n")?;
        }
        return Ok(());
    };
    writeln!(f, "column = {name:?}")?;
    asked(
        f,
        "unit",
        unit.filter(|unit| ["mm", "um", "m", "inch"].contains(unit)),
        "mm\", \"um\", \"m\" or \"inch",
    )?;
    if axis == "z" {
        f.write_str("#? direction = 1    # 1 if the column grows upwards, -1 if it grows with the depth\n")?;
        f.write_str("#? origin = 0.0     # what the column says where the tip just touches the covering\n")?;
    }
    Ok(())
}

fn counts(f: &mut fmt::Formatter<'_>, family: Option<&Family>) -> fmt::Result {
    f.write_str("\n[counts]\n")?;
    match family {
        Some(Family { pattern, first, .. }) => writeln!(f, "columns = {pattern:?}\nfirst = {first}")?,
        None => {
            f.write_str("#? columns = \"ch{n}\"    # {n} is the number of the element\n#? first = 0\n")?;
        }
    }
    f.write_str("#? order = \"row-major\"    # or \"column-major\", or the list of numbers, row by row\n")?;
    f.write_str("#? zero = \"raw\"           # or \"subtracted\", if the reading at rest was taken off\n")
}

fn rig(f: &mut fmt::Formatter<'_>, columns: &Columns, family: Option<&Family>) -> fmt::Result {
    f.write_str("\n# The rig; or rig = \"my-rig.toml\" before the first table.\n[rig]\n#? name = \"my-rig\"\n#? indenter = \"tip\"\n\n[rig.array]\n")?;
    let elements =
        family.map_or(String::new(), |family| format!("    # {} elements in all", family.elements));
    let readings: Vec<&Column> = family.map_or_else(Vec::new, |family| {
        let of = |number: usize| columns.get("", &family.pattern.replace(NUMBER, &number.to_string())).ok();
        (family.first..family.first + family.elements).filter_map(of).collect()
    });
    let most = readings.iter().filter_map(|column| column.range()).map(|[_, most]| most).reduce(f64::max);
    let most = most.map_or(String::new(), |most| format!("    # the greatest reading here is {most}"));
    let step = if readings.iter().all(|column| column.is_whole()) {
        ""
    } else {
        "#? step_counts = 1.0    # step of the converter; the readings are no whole numbers\n"
    };
    writeln!(
        f,
        "#? rows = 6{elements}\n#? cols = 8\n#? pitch_mm = [2.0, 2.0]\n#? element_mm = [1.8, 1.8]\n#? full_scale_counts = 4095{most}\n{step}\n\
         [rig.registration]\n#? origin_mm = [0.0, 0.0]    # the array's first corner in the stage's coordinates, about\n\n\
         [rig.covering]\n#? thickness_mm = 1.0\n\n\
         [rig.indenters]\n#? tip = {{ shape = \"cylinder\", diameter_mm = 1.0 }}"
    )
}

/// A key, or the question for it.
fn asked(f: &mut fmt::Formatter<'_>, key: &str, value: Option<&str>, choices: &str) -> fmt::Result {
    match value {
        Some(value) => writeln!(f, "{key} = {value:?}"),
        None => writeln!(f, "#? {key} = \"{choices}\""),
    }
}

/// The first column with one of these words in its name, and the unit behind it.
fn found<'a>(columns: &'a Columns, words: &[&str]) -> Option<(&'a str, Option<&'a str>)> {
    let is_number = |name: &str| columns.get("", name).is_ok_and(|column| !column.is_text());
    words.iter().find_map(|word| {
        let named =
            |name: &&String| is_number(name) && parts(name).any(|part| part.eq_ignore_ascii_case(word));
        let name = columns.names().iter().find(named)?;
        let unit = parts(name).last().filter(|last| !last.eq_ignore_ascii_case(word));
        Some((name.as_str(), unit))
    })
}

/// The largest family of columns that differ in one number, from the least number on.
fn family(names: &[String]) -> Option<Family> {
    let mut best: Option<Family> = None;
    for name in names {
        for (at, digits) in numbers(name) {
            let pattern = format!("{}{NUMBER}{}", &name[..at], &name[at + digits.len()..]);
            let Ok(first) = digits.parse::<usize>() else { continue };
            let has = |number: usize| names.contains(&pattern.replace(NUMBER, &number.to_string()));
            if first.checked_sub(1).is_some_and(has) {
                continue;
            }
            let most = first.saturating_add(names.len());
            let elements = (first..most).take_while(|number| has(*number)).count();
            if elements > best.as_ref().map_or(1, |best| best.elements) {
                best = Some(Family { pattern, first, elements });
            }
        }
    }
    best
}

/// The numbers in a name, with where they begin.
fn numbers(name: &str) -> Vec<(usize, &str)> {
    let is_digit = |c: char| c.is_ascii_digit();
    let starts = name.char_indices().filter(|(at, c)| is_digit(*c) && !name[..*at].ends_with(is_digit));
    starts.map(|(at, _)| (at, name[at..].split(|c| !is_digit(c)).next().unwrap_or_default())).collect()
}

/// The words and numbers in a name.
fn parts(name: &str) -> impl Iterator<Item = &str> {
    name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty())
}
