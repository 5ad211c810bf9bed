//! The table as Parquet: one row group, all columns optional, texts as UTF-8, no compression.

use super::columns::{Cells, Column};
use crate::population::SCHEMA;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The file's bytes. Its metadata have the version of the schema (`gmlc.schema`) and the units of the columns as JSON
/// (`gmlc.units`).
pub(super) fn parquet(columns: &[Column], count: usize) -> Result<Vec<u8>> {
    let fields = columns.iter().map(field).collect::<Result<Vec<_>>>()?;
    let schema = Type::group_type_builder("scans").with_fields(fields).build()?;
    let units: BTreeMap<&str, &str> =
        columns.iter().filter(|c| !c.unit.is_empty()).map(|c| (c.name.as_str(), c.unit.as_str())).collect();
    let notes = vec![
        KeyValue::new("gmlc.schema".to_owned(), SCHEMA.to_string()),
        KeyValue::new("gmlc.units".to_owned(), serde_json::to_string(&units).unwrap_or_default()),
    ];
    let properties = WriterProperties::builder().set_key_value_metadata(Some(notes)).build();
    let mut file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    if count > 0 {
        let mut group = file.next_row_group()?;
        for column in columns {
            let Some(mut writer) = group.next_column()? else { break };
            write(&mut writer, column)?;
            writer.close()?;
        }
        group.close()?;
    }
    file.into_inner()
}

fn field(column: &Column) -> Result<Arc<Type>> {
    let (physical, logical) = match column.cells {
        Cells::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Cells::Number(_) => (Physical::DOUBLE, None),
        Cells::Whole(_) => (Physical::INT64, None),
        Cells::Flag(_) => (Physical::BOOLEAN, None),
    };
    let builder = Type::primitive_type_builder(&column.name, physical).with_repetition(Repetition::OPTIONAL);
    builder.with_logical_type(logical).build().map(Arc::new)
}

fn write(writer: &mut SerializedColumnWriter<'_>, column: &Column) -> Result<()> {
    match &column.cells {
        Cells::Text(cells) => {
            let cells: Vec<Option<ByteArray>> =
                cells.iter().map(|cell| cell.as_ref().map(|text| ByteArray::from(text.as_str()))).collect();
            put::<ByteArrayType>(writer, &cells)
        }
        Cells::Number(cells) => put::<DoubleType>(writer, cells),
        Cells::Whole(cells) => put::<Int64Type>(writer, cells),
        Cells::Flag(cells) => put::<BoolType>(writer, cells),
    }
}

/// Values that are there, and for every row whether it has one.
fn put<T: DataType>(writer: &mut SerializedColumnWriter<'_>, cells: &[Option<T::T>]) -> Result<()> {
    let values: Vec<T::T> = cells.iter().flatten().cloned().collect();
    let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    writer.typed::<T>().write_batch(&values, Some(&levels), None).map(drop)
}
