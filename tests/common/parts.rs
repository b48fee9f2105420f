//! Reads the parts of results, and changes them as a forger would.

use serde_json::Value;
use standfast::files::columns::{Data, DataColumn, is_whole, read_parquet, sealed_bytes, texts};
use standfast::study::store::manifest::Manifest;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A row of a part, by the names of the columns. A value that is missing is null.
pub type Row = BTreeMap<String, Value>;

/// The rows of a part. A float has the bits of the part.
pub fn rows(part: &Path) -> Vec<Row> {
    let bytes = fs::read(part).unwrap();
    assert!(is_whole(&bytes), "{}", part.display());
    let (columns, count) = read_parquet(bytes).unwrap();
    let mut rows = vec![Row::new(); count];
    for DataColumn { name, data, .. } in &columns {
        for (i, row) in rows.iter_mut().enumerate() {
            row.insert(name.clone(), value(data, i));
        }
    }
    rows
}

fn value(data: &Data, i: usize) -> Value {
    match data {
        Data::Number(values) => values[i].into(),
        // All numbers are floats, as in other files that the tests read.
        Data::Whole(values) => values[i].map(|whole| whole as f64).into(),
        Data::Text(values) => values[i].as_deref().into(),
    }
}

/// Changes the numbers of a column in a part, and makes its hash anew.
pub fn forge(part: &Path, column: &str, change: impl Fn(f64) -> f64) {
    let bytes = fs::read(part).unwrap();
    let (mut columns, _) = read_parquet(bytes.clone()).unwrap();
    for column in columns.iter_mut().filter(|other| other.name == column) {
        let Data::Number(values) = &mut column.data else {
            panic!("{} does not hold numbers", column.name);
        };
        for value in values.iter_mut().flatten() {
            *value = change(*value);
        }
    }
    write(part, &columns, &texts(bytes).unwrap()["part"]);
}

/// Changes the manifest of a result folder, and all that guards the manifest: the seal, the hash, and the hash in every
/// part.
pub fn forge_manifest(folder: &Path, change: impl FnOnce(&mut Manifest)) {
    let mut manifest = Manifest::read(folder).unwrap();
    change(&mut manifest);
    manifest.config_hash = manifest.hash().unwrap();
    manifest.write(folder).unwrap();
    for entry in fs::read_dir(folder.join("parts")).unwrap() {
        let path = entry.unwrap().path();
        if path
            .extension()
            .is_some_and(|extension| extension == "parquet")
        {
            relabel(&path, |label| {
                label["config_hash"] = manifest.config_hash.clone().into()
            });
        }
    }
}

/// Changes the label of a part, and makes its hash anew.
pub fn relabel(part: &Path, change: impl FnOnce(&mut Value)) {
    let bytes = fs::read(part).unwrap();
    let (columns, _) = read_parquet(bytes.clone()).unwrap();
    let mut label: Value = serde_json::from_str(&texts(bytes).unwrap()["part"]).unwrap();
    change(&mut label);
    write(part, &columns, &label.to_string());
}

fn write(part: &Path, columns: &[DataColumn], label: &str) {
    let bytes = sealed_bytes(columns, &[("part", label.into())]).unwrap();
    fs::write(part, bytes).unwrap();
}
