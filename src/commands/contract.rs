//! Recorded pairs of observation and action, which a policy has to repeat: `check --contract`.

use standfast_core::error::{Error, Result};
use standfast_core::socket::Controller;
use standfast_report::text::unpushed::Contract;
use std::path::Path;

#[cfg(feature = "onnx")]
mod npz;

/// Longest record that is read (bytes).
const MOST_BYTES: u64 = 200_000_000;

/// The number of a line or row, counted from 1, with an observation and then an action.
type RecordedPair = (usize, Vec<f64>);

/// Reads the pairs in a file, and asks `controller` for each action again. Each line of a `.csv` has an observation and
/// then an action; the first line may have names. An `.npz` has two arrays, the observations and the actions, with a
/// row for each. Errors: a pair of another length, no numbers, or a controller that takes no observations.
pub fn repeated(path: &Path, controller: &mut dyn Controller) -> Result<Contract> {
    let file = path.to_string_lossy();
    let size: usize = controller
        .observed()
        .iter()
        .map(|(_, numbers)| numbers.len())
        .sum();
    if size == 0 {
        let accepted = "a controller of kind \"onnx\"";
        return Err(Error::option(
            "--contract",
            path.display(),
            "this controller takes no observations",
            accepted,
        ));
    }
    let bytes = standfast_files::assets::read(path, MOST_BYTES)?;
    let pairs = match path.extension().and_then(|extension| extension.to_str()) {
        #[cfg(feature = "onnx")]
        Some("npz") => npz::pairs(&file, bytes, size)?,
        _ => of_csv(&file, &bytes, size)?,
    };
    let mut contract = Contract {
        pairs: 0,
        actions: 0,
        largest: 0.0,
        first_apart: None,
    };
    for (line, numbers) in pairs {
        let (observed, recorded) = numbers.split_at(size);
        let Some(answered) = controller.answer(observed) else {
            continue;
        };
        let answered = answered.map_err(|problem| {
            bad(
                &file,
                line,
                format!("{size} numbers"),
                &problem,
                "an observation".into(),
            )
        })?;
        if answered.len() != recorded.len() {
            let accepted = format!("{} numbers after the observation", answered.len());
            let stated = format!("{} numbers", recorded.len());
            return Err(bad(
                &file,
                line,
                stated,
                "is no action of this policy",
                accepted,
            ));
        }
        contract.add(line, &answered, recorded);
    }
    if contract.pairs == 0 {
        return Err(Error::value(
            &file,
            "lines",
            "0",
            "has no pairs",
            "an observation and an action in each line",
        ));
    }
    Ok(contract)
}

fn bad(file: &str, line: usize, value: String, problem: &str, accepted: String) -> Error {
    Error::value(file, format!("line {line}"), value, problem, accepted)
}

/// The pairs of a CSV file, for observations of `size` numbers.
fn of_csv(file: &str, bytes: &[u8], size: usize) -> Result<Vec<RecordedPair>> {
    let mut pairs = Vec::new();
    let mut csv = csv::ReaderBuilder::new()
        .has_headers(false)
        .trim(csv::Trim::All)
        .from_reader(bytes);
    for (i, record) in csv.records().enumerate() {
        let record = record.map_err(|e| Error::Syntax {
            file: file.to_string(),
            message: e.to_string(),
        })?;
        let line = record
            .position()
            .map_or(i + 1, |position| position.line() as usize);
        let cells: Vec<Result<f64, _>> = record.iter().map(str::parse).collect();
        // The line holds names, which are no numbers.
        if i == 0 && cells.iter().all(Result::is_err) {
            continue;
        }
        let numbers = cells
            .into_iter()
            .collect::<Result<Vec<f64>, _>>()
            .map_err(|e| {
                let shown = record
                    .iter()
                    .collect::<Vec<_>>()
                    .join(",")
                    .chars()
                    .take(40)
                    .collect();
                bad(file, line, shown, &e.to_string(), "numbers".into())
            })?;
        if numbers.len() <= size {
            let accepted = format!("the {size} numbers of an observation, then those of an action");
            return Err(bad(
                file,
                line,
                format!("{} numbers", numbers.len()),
                "is too short",
                accepted,
            ));
        }
        pairs.push((line, numbers));
    }
    Ok(pairs)
}
