//! An archive of `NumPy` arrays: the first dimension is the frame. An array with more dimensions gives a column for each number of a
//! frame, `name[0]`, `name[1]`, ..., row-major.

mod archive;

use std::{fs, path::Path};

use tactus_record::meter;

use super::{Column, Columns, Places, file_error};
use crate::ImportError;

pub(super) fn read(path: &Path) -> Result<Columns, ImportError> {
    let bytes =
        fs::read(path).map_err(|source| ImportError::Io { action: "read", path: path.to_owned(), source })?;
    let broken = |problem: String| file_error(path, problem);
    let mut arrays = Vec::new();
    for (name, file) in archive::files(&bytes).map_err(|problem| broken(problem.to_owned()))? {
        let name = name.trim_end_matches(".npy").to_owned();
        let array = file.contents().map_err(|problem| broken(format!("array {name:?}: {problem}")))?;
        let array = Array::parse(&array).ok_or_else(|| {
            broken(format!(
                "array {name:?} is not a C-ordered array of numbers or texts in NumPy's format 1 to 3: save it with \
                 np.ascontiguousarray"
            ))
        })?;
        arrays.push((name, array));
    }
    meter::count(bytes.len() as u64);
    // Single values and lists of another length, such as settings, are no columns.
    let rows = arrays.iter().filter_map(|(_, array)| array.shape.first()).copied().max().unwrap_or(0);
    let columns = arrays.into_iter().filter(|(_, array)| array.shape.first() == Some(&rows));
    Columns::new(path, columns.flat_map(|(name, array)| array.into_columns(&name)).collect(), Places::Rows)
}

struct Array {
    shape: Vec<usize>,
    values: Column,
}

impl Array {
    fn parse(bytes: &[u8]) -> Option<Self> {
        let rest = bytes.strip_prefix(b"\x93NUMPY")?;
        let (&[major, _minor], rest) = rest.split_first_chunk()?;
        let (length, rest) = if major == 1 {
            let (length, rest) = rest.split_first_chunk()?;
            (usize::from(u16::from_le_bytes(*length)), rest)
        } else {
            let (length, rest) = rest.split_first_chunk()?;
            (usize::try_from(u32::from_le_bytes(*length)).ok()?, rest)
        };
        let (head, data) = rest.split_at_checked(length)?;
        let head = std::str::from_utf8(head).ok()?;
        let kind = value(head, "'descr':")?.trim().trim_matches('\'').to_owned();
        if !value(head, "'fortran_order':")?.trim_start().starts_with("False") {
            return None;
        }
        let inner = value(head, "'shape':")?.trim_start().strip_prefix('(')?;
        let numbers = inner.split(')').next()?.split(',').map(str::trim).filter(|one| !one.is_empty());
        let shape: Vec<usize> = numbers.map(|number| number.parse().ok()).collect::<Option<_>>()?;
        let count = shape.iter().try_fold(1_usize, |product, one| product.checked_mul(*one))?;
        let values = decode(&kind, data, count)?;
        (values.numbers.len() == count).then_some(Self { shape, values })
    }

    fn into_columns(self, name: &str) -> Vec<(String, Column)> {
        let Self { shape, values } = self;
        let width: usize = shape[1..].iter().product();
        if shape.len() == 1 {
            return vec![(name.to_owned(), values)];
        }
        let column =
            |at: usize| Column::of_numbers(values.numbers.iter().copied().skip(at).step_by(width).collect());
        (0..width).map(|at| (format!("{name}[{at}]"), column(at))).collect()
    }
}

/// What follows a key of the header, a Python dictionary.
fn value<'a>(head: &'a str, key: &str) -> Option<&'a str> {
    let rest = head.split_once(key)?.1;
    if key == "'shape':" { Some(rest) } else { rest.split(',').next() }
}

/// Numbers of any width, in either byte order; texts of the kind `U`.
fn decode(kind: &str, data: &[u8], count: usize) -> Option<Column> {
    let (order, kind) = kind.split_at_checked(1)?;
    let is_big = order == ">";
    if let Some(width) = kind.strip_prefix('U') {
        let width: usize = width.parse().ok()?;
        let mut texts = Column::default();
        for cell in data.chunks_exact(width.checked_mul(4)?.max(1)).take(count) {
            let (letters, _) = cell.as_chunks::<4>();
            let read = |letter: &[u8; 4]| {
                if is_big { u32::from_be_bytes(*letter) } else { u32::from_le_bytes(*letter) }
            };
            let text: String =
                letters.iter().map(read).take_while(|one| *one != 0).map_while(char::from_u32).collect();
            texts.push(&text, '.');
        }
        return Some(texts);
    }
    macro_rules! numbers {
        ($number:ty) => {{
            let (chunks, _) = data.as_chunks::<{ size_of::<$number>() }>();
            let read = |one: &[u8; size_of::<$number>()]| {
                if is_big { <$number>::from_be_bytes(*one) } else { <$number>::from_le_bytes(*one) }
            };
            #[allow(
                clippy::cast_lossless,
                clippy::cast_precision_loss,
                reason = "counts and times have at most 53 bits"
            )]
            let numbers = chunks.iter().take(count).map(|one| read(one) as f64).collect();
            Some(Column::of_numbers(numbers))
        }};
    }
    match kind {
        "f4" => numbers!(f32),
        "f8" => numbers!(f64),
        "i1" => numbers!(i8),
        "i2" => numbers!(i16),
        "i4" => numbers!(i32),
        "i8" => numbers!(i64),
        "u1" | "b1" => numbers!(u8),
        "u2" => numbers!(u16),
        "u4" => numbers!(u32),
        "u8" => numbers!(u64),
        _ => None,
    }
}
