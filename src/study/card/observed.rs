//! What was observed on hardware, read from the sheet of a [card](super), and whether it agrees with the predictions.

use super::{CARD, CardPush};
use crate::batch;
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_files::assets;
use standfast_stats::rate::clopper_pearson;
use standfast_stats::sheet::{Agreement, agreement};
use std::path::Path;

/// Columns of the sheet.
pub const COLUMNS: [&str; 7] = [
    "push",
    "impulse_n_s",
    "heading_deg",
    "height_m",
    "duration_s",
    "predicted",
    "observed",
];
/// Largest size of a sheet that is read (bytes).
const MOST_BYTES: u64 = 1_000_000;
/// Largest relative difference of a number that was written by another program.
const SAME: f64 = 1e-6;
/// Limits that differ from the predicted ones by no more than this ratio count as the same.
pub const AGREES: f64 = 1.25;
/// Outcomes that are more improbable than this are of other pushes than predicted.
pub const UNLIKELY: f64 = 0.01;

/// The part of a card that is compared.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct PredictedCard {
    pub controller: String,
    limits: OfRobot,
    pub pushes: Vec<CardPush>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct OfRobot {
    robot: String,
}

/// Whether hardware agrees with a prediction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObservedVerdict {
    /// Too few pushes are survived: so few with a probability below 2.5 %.
    Worse,
    /// Too many are.
    Better,
    /// As many as predicted, but others.
    Otherwise,
    /// The interval of the limits lies within [`AGREES`].
    Agrees,
    /// Nothing speaks against the prediction, but the interval is wider.
    CannotBeTold,
}

/// A part of the predicted chances, and how many of its pushes were survived.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrationBin {
    pub range: [f64; 2],
    pub pushes: u64,
    pub expected: f64,
    pub survived: u64,
    /// Clopper and Pearson's interval of the rate.
    pub rate_ci95: [f64; 2],
}

/// A sheet against its card.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observed {
    pub robot: String,
    pub controller: String,
    pub verdict: ObservedVerdict,
    #[serde(flatten)]
    pub agreement: Agreement,
    pub calibration: Vec<CalibrationBin>,
    /// The pushes that were made, and whether each was survived.
    #[serde(skip)]
    pub pushes: Vec<(CardPush, bool)>,
}

/// The sheet of a card, with nothing observed.
pub fn sheet(pushes: &[CardPush]) -> String {
    let mut text = COLUMNS.join(",") + "\n";
    for push in pushes {
        let numbers = numbers(push).map(|number| number.to_string());
        text += &format!("{},{},\n", push.push, numbers.join(","));
    }
    text
}

/// What the sheet has of a push, between its number and what was observed.
fn numbers(push: &CardPush) -> [f64; 5] {
    [
        push.impulse_n_s,
        push.heading_deg,
        push.height_m,
        push.duration_s,
        push.predicted,
    ]
}

impl Observed {
    /// Compares a sheet with the card in a folder. Fails if the folder has no card, or if the sheet is not of this card or
    /// has something else than 0 or 1 in its last column.
    pub fn read(sheet: &Path, folder: &Path) -> Result<Self> {
        let file = sheet.display().to_string();
        let bytes = assets::read(sheet, MOST_BYTES)?;
        let Some(card) = batch::read::<PredictedCard>(&folder.join(CARD))? else {
            let problem = format!(
                "holds no {CARD}; accepted: the folder of the card, behind the sheet if that lies elsewhere"
            );
            return Err(Error::Parts {
                path: folder.into(),
                problem,
            });
        };
        let pushes = pushes(&file, &bytes, &card)?;
        let outcomes: Vec<_> = pushes
            .iter()
            .map(|(push, survived)| (push.chance(), *survived))
            .collect();
        let agreement = agreement(&outcomes);
        Ok(Self {
            robot: card.limits.robot,
            controller: card.controller,
            verdict: verdict(&agreement),
            agreement,
            calibration: calibration(&pushes),
            pushes,
        })
    }
}

fn verdict(agreement: &Agreement) -> ObservedVerdict {
    let within = |end: Option<f64>| end.is_some_and(|end| (1.0 / AGREES..=AGREES).contains(&end));
    match agreement {
        of if of.so_few_p < 0.025 => ObservedVerdict::Worse,
        of if of.so_many_p < 0.025 => ObservedVerdict::Better,
        of if of.so_unlikely_p < UNLIKELY => ObservedVerdict::Otherwise,
        of if of.scale_ci95.into_iter().all(within) => ObservedVerdict::Agrees,
        _ => ObservedVerdict::CannotBeTold,
    }
}

/// Thirds of the predicted chances.
fn calibration(pushes: &[(CardPush, bool)]) -> Vec<CalibrationBin> {
    let mut bins = Vec::new();
    for third in 0..3 {
        let of_bin = |push: &CardPush| ((3.0 * push.predicted) as usize).min(2) == third;
        let within: Vec<_> = pushes.iter().filter(|(push, _)| of_bin(push)).collect();
        let count = within.len() as u64;
        let survived = within.iter().filter(|(_, survived)| *survived).count() as u64;
        bins.push(CalibrationBin {
            range: [third as f64 / 3.0, (third + 1) as f64 / 3.0],
            pushes: count,
            expected: within.iter().map(|(push, _)| push.predicted).sum(),
            survived,
            rate_ci95: clopper_pearson(survived, count, 0.95),
        });
    }
    bins
}

/// The pushes of a sheet and what was observed. Fails with all problems of the sheet.
fn pushes(file: &str, bytes: &[u8], card: &PredictedCard) -> Result<Vec<(CardPush, bool)>> {
    // Programs of offices write semicolons where numbers have a comma.
    let first = bytes
        .split(|byte| *byte == b'\n')
        .next()
        .unwrap_or_default();
    let has_semicolons = first.contains(&b';');
    let mut csv = csv::ReaderBuilder::new()
        .delimiter(if has_semicolons { b';' } else { b',' })
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let syntax = |e: csv::Error| Error::Syntax {
        file: file.into(),
        message: e.to_string(),
    };
    let names = csv.headers().map_err(syntax)?.clone();
    let mut places = [0; COLUMNS.len()];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        *place = names
            .iter()
            .position(|name| name == column)
            .ok_or_else(|| {
                let found: Vec<&str> = names.iter().collect();
                Error::value(
                    file,
                    "line 1",
                    found.join(","),
                    format!("has no column {column}"),
                    COLUMNS.join(","),
                )
            })?;
    }
    let (mut pushes, mut problems) = (Vec::<(CardPush, bool)>::new(), Vec::new());
    for record in csv.records() {
        let record = record.map_err(syntax)?;
        let line = record.position().map_or(0, |position| position.line());
        let cell = |column: usize| &record[places[column]];
        let wrong = |column: usize, problem: &str, accepted: String| {
            let field = format!("line {line}, {}", COLUMNS[column]);
            Error::value(file, field, cell(column), problem, accepted)
        };
        let number = cell(0).parse();
        let known = card.pushes.iter().find(|push| number == Ok(push.push));
        let Some(push) = known else {
            let accepted = format!("1 to {}", card.pushes.len());
            problems.push(wrong(0, "the card has no such push", accepted));
            continue;
        };
        if pushes.iter().any(|(other, _)| other.push == push.push) {
            problems.push(wrong(0, "is there twice", "one line for each push".into()));
        }
        for (i, expected) in numbers(push).into_iter().enumerate() {
            let text = match has_semicolons {
                true => cell(i + 1).replace(',', "."),
                false => cell(i + 1).into(),
            };
            let is_same = |found: f64| (found - expected).abs() <= SAME * expected.abs();
            if !text.parse().is_ok_and(is_same) {
                problems.push(wrong(i + 1, "is not as on the card", expected.to_string()));
            }
        }
        match cell(6) {
            "1" => pushes.push((*push, true)),
            "0" => pushes.push((*push, false)),
            other => {
                let problem = match other {
                    "" => "is missing",
                    _ => "is no outcome",
                };
                let accepted = "1 if the robot stayed up, 0 if it did not; a push that was not made has no line";
                problems.push(wrong(6, problem, accepted.into()));
            }
        }
    }
    if pushes.is_empty() && problems.is_empty() {
        problems.push(Error::value(
            file,
            "line 2",
            "(end)",
            "no push was observed",
            "a line for each push that was made",
        ));
    }
    Error::all(problems)?;
    Ok(pushes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observed(predicted: &[f64], slope: f64, outcomes: &[bool]) -> Vec<(CardPush, bool)> {
        let push = |(i, predicted): (usize, &f64)| CardPush {
            push: i as u64 + 1,
            impulse_n_s: 5.0,
            draw_m: None,
            heading_deg: 0.0,
            height_m: 0.0,
            duration_s: 0.05,
            predicted: *predicted,
            predicted_ci95: [0.0, 1.0],
            lapse: 0.001,
            slope,
            limit_n_s: 5.0,
        };
        let pushes = predicted.iter().enumerate().map(push);
        pushes.zip(outcomes.iter().copied()).collect()
    }

    #[test]
    fn each_verdict_has_its_sheet() {
        let half = [false, true].repeat(8);
        for (predicted, slope, outcomes, expected) in [
            (vec![0.5; 6], 20.0, vec![false; 6], ObservedVerdict::Worse),
            (vec![0.5; 6], 20.0, vec![true; 6], ObservedVerdict::Better),
            (
                vec![0.99, 0.99, 0.01, 0.01],
                20.0,
                vec![false, true, true, false],
                ObservedVerdict::Otherwise,
            ),
            (vec![0.5; 16], 20.0, half.clone(), ObservedVerdict::Agrees),
            // Odds of 3 make a limit that differs by more than a quarter.
            (vec![0.5; 16], 4.0, half, ObservedVerdict::CannotBeTold),
            (
                vec![0.5; 5],
                20.0,
                vec![false; 5],
                ObservedVerdict::CannotBeTold,
            ),
        ] {
            let pushes = observed(&predicted, slope, &outcomes);
            let pushes: Vec<_> = pushes
                .iter()
                .map(|(push, up)| (push.chance(), *up))
                .collect();
            assert_eq!(
                verdict(&agreement(&pushes)),
                expected,
                "{predicted:?} {outcomes:?}"
            );
        }
    }

    #[test]
    fn pushes_are_counted_by_thirds_of_the_predicted_chance() {
        let outcomes = [true, false, true, true, false];
        let bins = calibration(&observed(&[0.33, 0.34, 0.5, 0.67, 1.0], 20.0, &outcomes));
        let counts: Vec<_> = bins.iter().map(|bin| (bin.pushes, bin.survived)).collect();
        assert_eq!(counts, [(1, 1), (2, 1), (2, 1)]);
        assert!((bins[1].expected - 0.84).abs() < 1e-12);
        assert_eq!(bins[0].rate_ci95, clopper_pearson(1, 1, 0.95));
    }
}
