//! Tables as columns: trials and traces are written as Parquet or CSV files, and trials are read again.

use crate::{sha256_hex, write_atomic};
use bytes::Bytes;
use parquet::basic::{Compression, GzipLevel, LogicalType, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;
use serde_json::{Map, Value, json};
use standfast_core::error::{Error, Result};
use std::collections::BTreeMap;
use std::ops::Range;
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
    /// Whether values may be missing (null in Parquet, empty in CSV).
    pub may_miss: bool,
}

/// Values of a column, one per row.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    Number(Vec<Option<f64>>),
    Whole(Vec<Option<i64>>),
    Text(Vec<Option<String>>),
}

impl DataColumn {
    pub fn new(name: impl Into<String>, data: Data, may_miss: bool) -> Self {
        Self {
            name: name.into(),
            data,
            may_miss,
        }
    }

    /// The values as text. A float has the shortest form that reads back to the same bits.
    fn cells(&self) -> Vec<String> {
        fn texts<T: ToString>(values: &[Option<T>]) -> Vec<String> {
            let text = |value: &Option<T>| value.as_ref().map(T::to_string).unwrap_or_default();
            values.iter().map(text).collect()
        }
        match &self.data {
            Data::Number(values) => texts(values),
            Data::Whole(values) => texts(values),
            Data::Text(values) => texts(values),
        }
    }
}

/// Writes columns of equal length to a `.csv` or `.parquet` file. It fails for any other extension.
pub fn write(path: &Path, columns: &[DataColumn]) -> Result<()> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("csv") => write_csv(path, columns),
        Some("parquet") => {
            let about = [(ABOUT, about(columns))];
            write_atomic(
                path,
                &parquet_bytes(columns, &about).map_err(|e| other(path, e))?,
            )
        }
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

/// A Parquet file while it is written, without host name or time. It is written row group by row group.
pub struct ParquetFile<W: Write + Send>(SerializedFileWriter<W>);

impl<W: Write + Send> ParquetFile<W> {
    /// A file with gzip compression and with columns of these names and kinds. Their values are not used.
    pub fn new(to: W, columns: &[DataColumn]) -> Result<Self, ParquetError> {
        Self::with(to, columns, Compression::GZIP(GzipLevel::default()))
    }

    fn with(to: W, columns: &[DataColumn], compression: Compression) -> Result<Self, ParquetError> {
        let fields: Result<_, ParquetError> = columns
            .iter()
            .map(|column| field(column).map(Arc::new))
            .collect();
        let schema = Type::group_type_builder("rows").with_fields(fields?);
        let properties = WriterProperties::builder()
            .set_compression(compression)
            .set_created_by(concat!("standfast ", env!("CARGO_PKG_VERSION")).into())
            .build();
        let (schema, properties) = (Arc::new(schema.build()?), Arc::new(properties));
        Ok(Self(SerializedFileWriter::new(to, schema, properties)?))
    }

    /// Adds a row group of columns of equal length, in the order of the file's columns.
    pub fn group(&mut self, columns: &[DataColumn]) -> Result<(), ParquetError> {
        let mut group = self.0.next_row_group()?;
        for column in columns {
            let mut writer = group
                .next_column()?
                .expect("the schema has a field per column");
            write_column(&mut writer, column)?;
            writer.close()?;
        }
        group.close().map(|_| ())
    }

    /// Adds a text to the metadata of the file.
    pub fn state(&mut self, key: &str, text: String) {
        self.0
            .append_key_value_metadata(KeyValue::new(key.into(), text));
    }

    /// Ends the file, and returns the writer.
    pub fn finish(self) -> Result<W, ParquetError> {
        self.0.into_inner()
    }
}

/// The Parquet file for columns of equal length, with one row group and these texts in its metadata.
fn parquet_bytes(
    columns: &[DataColumn],
    texts: &[(&str, String)],
) -> Result<Vec<u8>, ParquetError> {
    bytes_of(ParquetFile::new(Vec::new(), columns)?, columns, texts)
}

fn bytes_of(
    mut file: ParquetFile<Vec<u8>>,
    columns: &[DataColumn],
    texts: &[(&str, String)],
) -> Result<Vec<u8>, ParquetError> {
    file.group(columns)?;
    for (key, text) in texts {
        file.state(key, text.clone());
    }
    file.finish()
}

/// The key of [`about`] in the metadata of a file.
pub const ABOUT: &str = "columns";

/// For each column, as JSON, its meaning and unit.
pub fn about(columns: &[DataColumn]) -> String {
    let mut about = Map::new();
    for DataColumn { name, .. } in columns {
        about.insert(
            name.clone(),
            json!({ "unit": unit(name), "meaning": meaning(name) }),
        );
    }
    Value::Object(about).to_string()
}

/// The texts in the metadata of a Parquet file, by their keys.
pub fn texts(bytes: impl Into<Bytes>) -> Result<BTreeMap<String, String>, ParquetError> {
    let file = SerializedFileReader::new(bytes.into())?;
    let mut texts = BTreeMap::new();
    let stated = file.metadata().file_metadata().key_value_metadata();
    for KeyValue { key, value } in stated.into_iter().flatten() {
        texts.insert(key.clone(), value.clone().unwrap_or_default());
    }
    Ok(texts)
}

/// The columns of the first row group of a Parquet file, and its number of rows.
pub fn read_parquet(bytes: impl Into<Bytes>) -> Result<(Vec<DataColumn>, usize), ParquetError> {
    let file = SerializedFileReader::new(bytes.into())?;
    let group = file.get_row_group(0)?;
    let rows = group.metadata().num_rows() as usize;
    let schema = file.metadata().file_metadata().schema_descr();
    let mut columns = Vec::new();
    for (i, column) in schema.columns().iter().enumerate() {
        let may_miss = column.max_def_level() > 0;
        let data = match group.get_column_reader(i)? {
            ColumnReader::DoubleColumnReader(of) => Data::Number(read(of, rows, may_miss)?),
            ColumnReader::Int64ColumnReader(of) => Data::Whole(read(of, rows, may_miss)?),
            ColumnReader::ByteArrayColumnReader(of) => {
                let text = |bytes: Option<ByteArray>| {
                    let text = bytes.map(|bytes| bytes.as_utf8().map(String::from));
                    text.transpose()
                };
                let texts = read(of, rows, may_miss)?.into_iter().map(text);
                Data::Text(texts.collect::<Result<_, _>>()?)
            }
            _ => return Err(ParquetError::General("a column of another kind".into())),
        };
        columns.push(DataColumn::new(column.name(), data, may_miss));
    }
    Ok((columns, rows))
}

/// The values of a column, some of which may be missing. Fails if there are not so many.
fn read<T: DataType>(
    mut column: ColumnReaderImpl<T>,
    rows: usize,
    may_miss: bool,
) -> Result<Vec<Option<T::T>>, ParquetError> {
    let (mut present, mut values) = (Vec::new(), Vec::new());
    while column
        .read_records(rows, Some(&mut present), None, &mut values)?
        .0
        > 0
    {}
    if !may_miss {
        present = vec![1; values.len()];
    }
    let mut values = values.into_iter();
    let place = |is_there| if is_there == 0 { None } else { values.next() };
    let values: Vec<_> = present.into_iter().map(place).collect();
    match values.len() == rows {
        true => Ok(values),
        false => Err(ParquetError::EOF("a column is too short".into())),
    }
}

/// The key of the hash in the metadata of a sealed file, and what precedes its 64 digits there.
const SEAL: (&str, &str) = ("sha256", "sha256:");
const NO_DIGITS: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// A Parquet file of columns of equal length, in one row group without compression, with these texts and the SHA-256 of all
/// its bytes in its metadata. For the hash, its own digits are zeros.
pub fn sealed_bytes(
    columns: &[DataColumn],
    texts: &[(&str, String)],
) -> Result<Vec<u8>, ParquetError> {
    let seal = (SEAL.0, format!("{}{NO_DIGITS}", SEAL.1));
    let file = ParquetFile::with(Vec::new(), columns, Compression::UNCOMPRESSED)?;
    let mut bytes = bytes_of(file, columns, &[texts, &[seal]].concat())?;
    let sha256 = sha256_hex(&bytes);
    let place = place_of_seal(&bytes).expect("it was just written");
    bytes[place].copy_from_slice(sha256.as_bytes());
    Ok(bytes)
}

/// Whether a file is as [`sealed_bytes`] made it. The reader of Parquet files may panic over others.
pub fn is_whole(bytes: &[u8]) -> bool {
    let Some(place) = place_of_seal(bytes) else {
        return false;
    };
    let mut unsealed = bytes.to_vec();
    unsealed[place.clone()].copy_from_slice(NO_DIGITS.as_bytes());
    bytes[place] == *sha256_hex(&unsealed).as_bytes()
}

/// The place of the digits of the hash in a sealed file.
fn place_of_seal(bytes: &[u8]) -> Option<Range<usize>> {
    let before = SEAL.1.as_bytes();
    let found = bytes
        .windows(before.len())
        .rposition(|window| window == before)?;
    let first = found + before.len();
    let place = first..first + NO_DIGITS.len();
    bytes.get(place.clone()).map(|_| place)
}

fn field(column: &DataColumn) -> Result<Type, ParquetError> {
    let (physical, logical) = match &column.data {
        Data::Number(_) => (Physical::DOUBLE, None),
        Data::Whole(_) => (Physical::INT64, None),
        Data::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let repetition = match column.may_miss {
        true => Repetition::OPTIONAL,
        false => Repetition::REQUIRED,
    };
    Type::primitive_type_builder(&column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical)
        .build()
}

fn write_column(
    writer: &mut SerializedColumnWriter<'_>,
    column: &DataColumn,
) -> Result<(), ParquetError> {
    fn put<T: DataType, V>(
        writer: &mut SerializedColumnWriter<'_>,
        values: &[Option<V>],
        may_miss: bool,
        value: fn(&V) -> T::T,
    ) -> Result<(), ParquetError> {
        // Definition levels of a nullable column: 1 for each present value.
        let present: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
        let values: Vec<T::T> = values.iter().flatten().map(value).collect();
        let present = may_miss.then_some(&present[..]);
        let written = writer.typed::<T>().write_batch(&values, present, None);
        written.map(drop)
    }
    let may_miss = column.may_miss;
    match &column.data {
        Data::Number(v) => put::<DoubleType, _>(writer, v, may_miss, |x| *x),
        Data::Whole(v) => put::<Int64Type, _>(writer, v, may_miss, |x| *x),
        Data::Text(v) => put::<ByteArrayType, _>(writer, v, may_miss, |x| x.as_str().into()),
    }
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

    fn sample() -> Vec<DataColumn> {
        let numbers = [0.1, f64::NAN, 1.0 / 3.0].map(Some);
        let words = ["a", "b, \"c\"", "ü"].map(|word| Some(word.into()));
        let causes = [Some("knee".into()), None, None];
        vec![
            DataColumn::new("time_s", Data::Number(numbers.into()), false),
            DataColumn::new("fell_at_s", Data::Number(vec![None, Some(2.5), None]), true),
            DataColumn::new("trial", Data::Whole([0, 1, -1].map(Some).into()), false),
            DataColumn::new("set", Data::Text(words.into()), false),
            DataColumn::new("fall_cause", Data::Text(causes.into()), true),
        ]
    }

    /// Compared as text, since NaN is not equal to itself.
    #[test]
    fn parquet_reads_back_value_by_value() {
        let bytes = parquet_bytes(&sample(), &[("part", "one".into())]).unwrap();
        assert_eq!(texts(bytes.clone()).unwrap()["part"], "one");
        let (columns, rows) = read_parquet(bytes).unwrap();
        assert_eq!(
            (format!("{columns:?}"), rows),
            (format!("{:?}", sample()), 3)
        );
    }

    #[test]
    fn a_change_of_any_byte_breaks_the_seal() {
        let bytes = sealed_bytes(&sample(), &[("part", "sha256:".into())]).unwrap();
        assert!(is_whole(&bytes));
        read_parquet(bytes.clone()).unwrap();
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 1 << (at % 8);
            assert!(!is_whole(&changed), "byte {at}");
        }
        assert!(!is_whole(&bytes[..bytes.len() - 1]) && !is_whole(b""));
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
