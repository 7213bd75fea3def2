//! Finds the contract's columns in a file, and checks their types.

use parquet::{
    basic::{ConvertedType, LogicalType, Type as PhysicalType},
    schema::types::{ColumnDescriptor, SchemaDescriptor},
};

use super::error::TableError;

/// The type of a column in the contract.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ColumnType {
    Text,
    Int32,
    Int64,
    Float64,
    ListOfFloat32,
}

impl ColumnType {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Text => "string",
            Self::Int32 => "int32",
            Self::Int64 => "int64",
            Self::Float64 => "float64",
            Self::ListOfFloat32 => "list<float32>",
        }
    }
}

/// The contract's columns, in its order.
pub(super) const CONTRACT: [(&str, ColumnType); 11] = [
    ("run", ColumnType::Text),
    ("press", ColumnType::Int32),
    ("phase", ColumnType::Text),
    ("t_ns", ColumnType::Int64),
    ("x_mm", ColumnType::Float64),
    ("y_mm", ColumnType::Float64),
    ("z_mm", ColumnType::Float64),
    ("covering_mm", ColumnType::Float64),
    ("indenter", ColumnType::Text),
    ("temperature_c", ColumnType::Float64),
    ("counts", ColumnType::ListOfFloat32),
];

/// What is wrong with a column.
pub(super) enum Misfit {
    Missing,
    Type(String),
}

impl Misfit {
    pub(super) fn into_error(
        self,
        path: &std::path::Path,
        column: &'static str,
        expected: &'static str,
    ) -> TableError {
        let path = path.to_owned();
        match self {
            Self::Missing => TableError::ColumnMissing { path, column, expected },
            Self::Type(found) => TableError::ColumnType { path, column, found, expected },
        }
    }
}

/// Finds a column of the contract; gives the index of its leaf.
pub(super) fn find(schema: &SchemaDescriptor, name: &str, kind: ColumnType) -> Result<usize, Misfit> {
    let leaves: Vec<usize> =
        (0..schema.num_columns()).filter(|&leaf| schema.get_column_root(leaf).name() == name).collect();
    let &[leaf] = leaves.as_slice() else {
        return Err(if leaves.is_empty() { Misfit::Missing } else { Misfit::Type("a struct".into()) });
    };
    let column = schema.column(leaf);
    let found = type_name(&column);
    let all_null = name == "temperature_c" && found == "null";
    if found == kind.name() || all_null { Ok(leaf) } else { Err(Misfit::Type(found)) }
}

/// The type of a leaf in the words of the contract, or, of types that it does not know, in Parquet's.
pub(super) fn type_name(column: &ColumnDescriptor) -> String {
    let plain = plain_type_name(column);
    match column.max_rep_level() {
        0 if column.path().parts().len() == 1 => plain,
        0 => "a struct".into(),
        1 => format!("list<{plain}>"),
        _ => "a list of lists".into(),
    }
}

fn plain_type_name(column: &ColumnDescriptor) -> String {
    let logical = column.logical_type_ref();
    let converted = column.converted_type();
    let unannotated = logical.is_none() && converted == ConvertedType::NONE;
    match (column.physical_type(), logical) {
        (_, Some(LogicalType::Unknown)) => "null".into(),
        (_, Some(LogicalType::Integer(integer))) => {
            format!("{}int{}", if integer.is_signed { "" } else { "u" }, integer.bit_width)
        }
        (_, Some(logical)) => format!("{logical:?}").to_lowercase(),
        (PhysicalType::BYTE_ARRAY, None) if converted == ConvertedType::UTF8 => "string".into(),
        (PhysicalType::INT32, None) if unannotated || converted == ConvertedType::INT_32 => "int32".into(),
        (PhysicalType::INT64, None) if unannotated || converted == ConvertedType::INT_64 => "int64".into(),
        (PhysicalType::FLOAT, None) if unannotated => "float32".into(),
        (PhysicalType::DOUBLE, None) if unannotated => "float64".into(),
        (PhysicalType::BOOLEAN, None) if unannotated => "bool".into(),
        (PhysicalType::BYTE_ARRAY, None) if unannotated => "binary".into(),
        (physical, None) if unannotated => physical.to_string().to_lowercase(),
        (_, None) => converted.to_string().to_lowercase(),
    }
}
