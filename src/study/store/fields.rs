//! The columns of a row: its fields and the fields of the structs in it, one after the other.

use csv::StringRecord;
use serde::de::value::Error;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error as _, IntoDeserializer, SeqAccess,
    Visitor,
};
use standfast_files::columns::{Data, DataColumn};
use standfast_sim::episode::Totals;

/// A field, which is a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    pub name: &'static str,
    pub kind: FieldKind,
    /// Whether a value may be missing.
    pub is_optional: bool,
}

/// The kind of the values of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FieldKind {
    Count,
    Number,
    /// Text, or a name out of several.
    Word,
}

/// Lists the fields of a row, by what its deserialization asks for. A row holds counts, numbers, words, options of
/// them, and structs of all these.
pub fn fields<T: DeserializeOwned>() -> Vec<Field> {
    let mut lister = Lister::default();
    T::deserialize(&mut lister).expect("a row holds what a column can hold");
    lister.fields
}

/// The cells of rows as columns. The last field has a column for each of `totals` instead.
pub fn columns<'a>(
    fields: &'a [Field],
    totals: &'a [String],
    rows: &'a [StringRecord],
) -> impl Iterator<Item = DataColumn> + 'a {
    let last = fields.len() - 1;
    let of_controllers: Vec<Totals> = rows
        .iter()
        .map(|row| Totals::read(&row[last]).unwrap_or_default())
        .collect();
    fields[..last]
        .iter()
        .enumerate()
        .map(move |(i, field)| column(field, rows.iter().map(move |row| &row[i])))
        .chain(totals.iter().map(move |name| {
            let values = of_controllers
                .iter()
                .map(|totals| totals.0.get(name).copied());
            DataColumn::new(name, Data::OptF64(values.collect()))
        }))
}

/// The column of a field with these cells.
fn column<'a>(field: &Field, cells: impl Iterator<Item = &'a str>) -> DataColumn {
    let some = |cell: &'a str| (!cell.is_empty()).then_some(cell);
    let data = match (field.kind, field.is_optional) {
        (FieldKind::Count, _) => Data::I64(cells.map(parsed).collect()),
        (FieldKind::Number, false) => Data::F64(cells.map(parsed).collect()),
        (FieldKind::Number, true) => {
            Data::OptF64(cells.map(|cell| some(cell).map(parsed)).collect())
        }
        (FieldKind::Word, false) => Data::Text(cells.map(String::from).collect()),
        (FieldKind::Word, true) => {
            Data::OptText(cells.map(|cell| some(cell).map(String::from)).collect())
        }
    };
    DataColumn::new(field.name, data)
}

/// The value of a cell that was written as one.
fn parsed<T: std::str::FromStr<Err: std::fmt::Debug>>(cell: &str) -> T {
    cell.parse().expect("a cell holds a value of its field")
}

/// Deserializes a row without input, and notes which fields it asks for.
#[derive(Default)]
struct Lister {
    fields: Vec<Field>,
    /// Name of the field that is being read.
    name: &'static str,
    is_optional: bool,
}

impl Lister {
    fn note(&mut self, kind: FieldKind) {
        let is_optional = std::mem::take(&mut self.is_optional);
        self.fields.push(Field {
            name: self.name,
            kind,
            is_optional,
        });
    }
}

impl<'de> Deserializer<'de> for &mut Lister {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        Err(Error::custom(format!(
            "{} is of a kind that no column has",
            self.name
        )))
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.note(FieldKind::Count);
        visitor.visit_u32(0)
    }

    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.note(FieldKind::Count);
        visitor.visit_u64(0)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.note(FieldKind::Number);
        visitor.visit_f64(0.0)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.note(FieldKind::Word);
        visitor.visit_str("")
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.note(FieldKind::Word);
        visitor.visit_enum(variants[0].into_deserializer())
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.is_optional = true;
        visitor.visit_some(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_seq(InTurn {
            lister: self,
            names: names.iter(),
        })
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 f32 char str bytes byte_buf unit unit_struct newtype_struct seq tuple tuple_struct map
        identifier ignored_any
    }
}

/// The fields of a struct in turn.
struct InTurn<'a> {
    lister: &'a mut Lister,
    names: std::slice::Iter<'static, &'static str>,
}

impl<'de> SeqAccess<'de> for InTurn<'_> {
    type Error = Error;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Error> {
        let Some(name) = self.names.next() else {
            return Ok(None);
        };
        self.lister.name = name;
        seed.deserialize(&mut *self.lister).map(Some)
    }
}
