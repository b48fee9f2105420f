//! Tables as columns, from which trials and traces are written as Parquet or CSV files.

use crate::write_atomic;
use parquet::basic::{Compression, GzipLevel, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::{
    properties::WriterProperties, writer::SerializedColumnWriter, writer::SerializedFileWriter,
};
use parquet::schema::types::Type;
use serde_json::{Map, Value, json};
use standfast_core::error::{Error, Result};
use std::{io::Write, path::Path, sync::Arc};

/// The chapter of the guide on the columns of trials and traces.
pub const CHAPTER: &str = include_str!("columns.md");

/// The meaning of a column of trials or traces, from the chapter. It is None for the notes of a controller.
pub fn meaning(name: &str) -> Option<&'static str> {
    let rows = CHAPTER
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once("` | "));
    // `q_ref_JOINT` fits better than `q_JOINT`.
    let best = rows
        .filter(|(pattern, _)| fits(pattern, name))
        .max_by_key(|(pattern, _)| pattern.len());
    best.map(|(_, meaning)| meaning.trim_end_matches(" |"))
}

/// Whether a name matches a pattern, such as `com_[xyz]_m`, `SIDE_sole_[xyz]_m` or `q_JOINT`.
fn fits(pattern: &str, name: &str) -> bool {
    if let Some(rest) = pattern.strip_prefix("SIDE") {
        return ["left", "right"]
            .iter()
            .any(|side| name.strip_prefix(side).is_some_and(|name| fits(rest, name)));
    }
    if let Some(before) = pattern.strip_suffix("JOINT") {
        return name.starts_with(before);
    }
    let Some((before, (letters, after))) = pattern
        .split_once('[')
        .and_then(|(before, rest)| Some((before, rest.split_once(']')?)))
    else {
        return pattern == name;
    };
    name.strip_prefix(before)
        .and_then(|name| name.strip_suffix(after))
        .is_some_and(|letter| letter.len() == 1 && letters.contains(letter))
}

/// The unit at the end of a column's name, in the usual notation. None if there is no unit.
pub fn unit(name: &str) -> Option<&'static str> {
    let name = name.trim_end_matches("_est");
    const UNITS: [(&str, &str); 9] = [
        ("_rad_s", "rad/s"),
        ("_m_s", "m/s"),
        ("_n_m", "N m"),
        ("_n_s", "N s"),
        ("_deg", "deg"),
        ("_m", "m"),
        ("_s", "s"),
        ("_n", "N"),
        ("_ratio", "1"),
    ];
    let of_joint = [
        ("q_ref_", "rad"),
        ("dq_", "rad/s"),
        ("q_", "rad"),
        ("tau_", "N m"),
    ];
    let by_end = UNITS.iter().find(|(end, _)| name.ends_with(end));
    of_joint
        .iter()
        .find(|(start, _)| name.starts_with(start))
        .or(by_end)
        .map(|(_, unit)| *unit)
}

/// A named column; the unit is part of the name.
#[derive(Debug, Clone, PartialEq)]
pub struct DataColumn {
    pub name: String,
    pub data: Data,
}

/// Values of a column, one per row. Values of the `Opt` kinds may be missing (null in Parquet, empty in CSV).
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    F64(Vec<f64>),
    OptF64(Vec<Option<f64>>),
    I64(Vec<i64>),
    Text(Vec<String>),
    OptText(Vec<Option<String>>),
}

impl DataColumn {
    pub fn new(name: impl Into<String>, data: Data) -> Self {
        Self {
            name: name.into(),
            data,
        }
    }

    /// The values as text. A float has the shortest form that reads back to the same bits.
    fn cells(&self) -> Vec<String> {
        match &self.data {
            Data::F64(v) => v.iter().map(f64::to_string).collect(),
            Data::OptF64(v) => v
                .iter()
                .map(|x| x.map(|x| x.to_string()).unwrap_or_default())
                .collect(),
            Data::I64(v) => v.iter().map(i64::to_string).collect(),
            Data::Text(v) => v.clone(),
            Data::OptText(v) => v.iter().map(|x| x.clone().unwrap_or_default()).collect(),
        }
    }
}

/// Writes columns of equal length to a `.csv` or `.parquet` file. It fails for any other extension.
pub fn write(path: &Path, columns: &[DataColumn]) -> Result<()> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("csv") => write_csv(path, columns),
        Some("parquet") => write_atomic(path, &parquet_bytes(columns).map_err(|e| other(path, e))?),
        _ => {
            let problem = "unknown kind of file";
            let accepted = "a name that ends in .csv or .parquet";
            Err(Error::value(
                "output",
                "file",
                path.display(),
                problem,
                accepted,
            ))
        }
    }
}

/// Writes columns of equal length as CSV, with their names in the first line and floats with all their digits.
fn write_csv(path: &Path, columns: &[DataColumn]) -> Result<()> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(columns.iter().map(|c| &c.name))
        .map_err(|e| other(path, e))?;
    let cells: Vec<Vec<String>> = columns.iter().map(DataColumn::cells).collect();
    for row in 0..cells.first().map_or(0, Vec::len) {
        out.write_record(cells.iter().map(|column| &column[row]))
            .map_err(|e| other(path, e))?;
    }
    write_atomic(
        path,
        &out.into_inner().map_err(|e| other(path, e.into_error()))?,
    )
}

/// A Parquet file while it is written, with gzip compression, without host name or time. It is written row group by row
/// group. Its metadata `columns` state for each column, as JSON, its meaning and unit.
pub struct ParquetFile<W: Write + Send>(SerializedFileWriter<W>);

impl<W: Write + Send> ParquetFile<W> {
    /// A file with columns of these names and kinds. Their values are not used.
    pub fn new(to: W, columns: impl IntoIterator<Item = DataColumn>) -> Result<Self, ParquetError> {
        let mut about = Map::new();
        let mut fields = Vec::new();
        for column in columns {
            let (unit, meaning) = (unit(&column.name), meaning(&column.name));
            fields.push(Arc::new(field(&column)?));
            about.insert(column.name, json!({ "unit": unit, "meaning": meaning }));
        }
        let schema = Arc::new(
            Type::group_type_builder("rows")
                .with_fields(fields)
                .build()?,
        );
        let properties = WriterProperties::builder()
            .set_key_value_metadata(Some(vec![KeyValue::new(
                "columns".into(),
                Value::Object(about).to_string(),
            )]))
            .set_compression(Compression::GZIP(GzipLevel::default()))
            .set_created_by(concat!("standfast ", env!("CARGO_PKG_VERSION")).into())
            .build();
        Ok(Self(SerializedFileWriter::new(
            to,
            schema,
            Arc::new(properties),
        )?))
    }

    /// Adds a row group of columns of equal length, in the order of the file's columns.
    pub fn group(
        &mut self,
        columns: impl IntoIterator<Item = DataColumn>,
    ) -> Result<(), ParquetError> {
        let mut group = self.0.next_row_group()?;
        for column in columns {
            let mut writer = group
                .next_column()?
                .expect("the schema has a field per column");
            write_column(&mut writer, &column.data)?;
            writer.close()?;
        }
        group.close().map(|_| ())
    }

    /// Ends the file, and returns the writer.
    pub fn finish(self) -> Result<W, ParquetError> {
        self.0.into_inner()
    }
}

/// The Parquet file for columns of equal length, with one row group.
fn parquet_bytes(columns: &[DataColumn]) -> Result<Vec<u8>, ParquetError> {
    let mut file = ParquetFile::new(Vec::new(), columns.iter().cloned())?;
    file.group(columns.iter().cloned())?;
    file.finish()
}

fn field(column: &DataColumn) -> Result<Type, ParquetError> {
    let (physical, nullable) = match &column.data {
        Data::F64(_) => (Physical::DOUBLE, false),
        Data::OptF64(_) => (Physical::DOUBLE, true),
        Data::I64(_) => (Physical::INT64, false),
        Data::Text(_) => (Physical::BYTE_ARRAY, false),
        Data::OptText(_) => (Physical::BYTE_ARRAY, true),
    };
    let repetition = if nullable {
        Repetition::OPTIONAL
    } else {
        Repetition::REQUIRED
    };
    let text = (physical == Physical::BYTE_ARRAY).then_some(LogicalType::String);
    Type::primitive_type_builder(&column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(text)
        .build()
}

fn write_column(writer: &mut SerializedColumnWriter<'_>, data: &Data) -> Result<(), ParquetError> {
    let text = |s: &String| ByteArray::from(s.as_str());
    match data {
        Data::F64(v) => writer.typed::<DoubleType>().write_batch(v, None, None)?,
        Data::OptF64(v) => {
            let values: Vec<f64> = v.iter().flatten().copied().collect();
            writer
                .typed::<DoubleType>()
                .write_batch(&values, Some(&present(v)), None)?
        }
        Data::I64(v) => writer.typed::<Int64Type>().write_batch(v, None, None)?,
        Data::Text(v) => {
            let values: Vec<_> = v.iter().map(text).collect();
            writer
                .typed::<ByteArrayType>()
                .write_batch(&values, None, None)?
        }
        Data::OptText(v) => {
            let values: Vec<_> = v.iter().flatten().map(text).collect();
            writer
                .typed::<ByteArrayType>()
                .write_batch(&values, Some(&present(v)), None)?
        }
    };
    Ok(())
}

/// Definition levels of a nullable column: 1 for each present value.
fn present<T>(values: &[Option<T>]) -> Vec<i16> {
    values.iter().map(|v| i16::from(v.is_some())).collect()
}

fn other(path: &Path, e: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::Write {
        path: path.into(),
        source: std::io::Error::other(e),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    fn sample() -> Vec<DataColumn> {
        vec![
            DataColumn::new("time_s", Data::F64(vec![0.1, f64::NAN, 1.0 / 3.0])),
            DataColumn::new("fell_at_s", Data::OptF64(vec![None, Some(2.5), None])),
            DataColumn::new("trial", Data::I64(vec![0, 1, -1])),
            DataColumn::new(
                "set",
                Data::Text(vec!["a".into(), "b, \"c\"".into(), "ü".into()]),
            ),
            DataColumn::new(
                "fall_cause",
                Data::OptText(vec![Some("knee".into()), None, None]),
            ),
        ]
    }

    #[test]
    fn parquet_reads_back_value_by_value() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.parquet");
        write(&path, &sample()).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let rows: Vec<Vec<Field>> = reader
            .get_row_iter(None)
            .unwrap()
            .map(|row| {
                row.unwrap()
                    .into_columns()
                    .into_iter()
                    .map(|(_, field)| field)
                    .collect()
            })
            .collect();
        assert_eq!(rows[0][0], Field::Double(0.1));
        assert!(matches!(rows[1][0], Field::Double(x) if x.is_nan()));
        assert_eq!(rows[2][0], Field::Double(1.0 / 3.0));
        assert_eq!(
            (&rows[0][1], &rows[1][1]),
            (&Field::Null, &Field::Double(2.5))
        );
        assert_eq!(rows[2][2], Field::Long(-1));
        assert_eq!(
            (&rows[2][3], &rows[1][4]),
            (&Field::Str("ü".into()), &Field::Null)
        );
        assert_eq!(rows[0][4], Field::Str("knee".into()));
    }

    #[test]
    fn csv_keeps_every_digit_and_quotes() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.csv");
        write(&path, &sample()).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "time_s,fell_at_s,trial,set,fall_cause");
        assert_eq!(lines[2], "NaN,2.5,1,\"b, \"\"c\"\"\",");
        assert_eq!(lines[3], "0.3333333333333333,,-1,ü,");
    }
}
