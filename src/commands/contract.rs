//! Recorded pairs of observation and action, which a policy has to repeat: `check --contract`.

use crate::error::{Error, Result};
use crate::render::text::alone::Contract;
use crate::robot::Controller;
use std::path::Path;

/// Longest record that is read (bytes).
const MOST_BYTES: u64 = 200_000_000;

/// Reads the pairs in a file, and asks `controller` for each action again. A line has an observation and then an action; the
/// first line may have names. Errors: a line of another length, no numbers, or a controller that takes no observations.
pub fn repeated(path: &Path, controller: &dyn Controller) -> Result<Contract> {
    let file = path.to_string_lossy();
    let sizes: usize = controller.observed().iter().map(|(_, numbers)| numbers.len()).sum();
    if sizes == 0 {
        let accepted = "a controller of kind \"onnx\"";
        return Err(Error::option("--contract", path.display(), "this controller takes no observations", accepted));
    }
    let bytes = crate::assets::read(path, MOST_BYTES)?;
    let bad = |line: usize, value: String, problem: String, accepted: String| {
        Error::value(&file, format!("line {line}"), value, problem, accepted)
    };
    let mut found = Contract { pairs: 0, actions: 0, largest: 0.0, first_apart: None };
    let mut csv = csv::ReaderBuilder::new().has_headers(false).trim(csv::Trim::All).from_reader(&bytes[..]);
    for (i, record) in csv.records().enumerate() {
        let record = record.map_err(|e| Error::Syntax { file: file.to_string(), message: e.to_string() })?;
        let line = record.position().map_or(i + 1, |position| position.line() as usize);
        let cells: Vec<Result<f64, _>> = record.iter().map(str::parse).collect();
        // Names, which are no numbers.
        if i == 0 && cells.iter().all(Result::is_err) {
            continue;
        }
        let numbers = match cells.into_iter().collect::<Result<Vec<f64>, _>>() {
            Ok(numbers) => numbers,
            Err(e) => {
                let shown = record.iter().collect::<Vec<_>>().join(",").chars().take(40).collect();
                return Err(bad(line, shown, e.to_string(), "numbers".into()));
            }
        };
        if numbers.len() <= sizes {
            let accepted = format!("the {sizes} numbers of an observation, then those of an action");
            return Err(bad(line, format!("{} numbers", numbers.len()), "is too short".into(), accepted));
        }
        let (observed, recorded) = numbers.split_at(sizes);
        let Some(answered) = controller.answer(observed) else { continue };
        let answered =
            answered.map_err(|problem| bad(line, format!("{sizes} numbers"), problem, "an observation".into()))?;
        if answered.len() != recorded.len() {
            let accepted = format!("{} numbers after the observation", answered.len());
            return Err(bad(
                line,
                format!("{} numbers", recorded.len()),
                "is no action of this policy".into(),
                accepted,
            ));
        }
        found.add(line, &answered, recorded);
    }
    if found.pairs == 0 {
        return Err(Error::value(&file, "lines", "0", "has no pairs", "an observation and an action in each line"));
    }
    Ok(found)
}
