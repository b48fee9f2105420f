//! Made-up campaigns and results, for the unit tests of this crate and of those that tell of them.
#![allow(dead_code, reason = "each crate uses its part")]

use standfast_sim::episode::Outcome::{Fell, Recovered};
use standfast_sim::episode::{Outcome, Record, Totals};
use standfast_sim::{Push, Variation};
use standfast_study::ask::spec::{Campaign, Overrides};
use standfast_study::store::manifest::{Manifest, part_trials};
use standfast_study::store::row::TrialRow;
use standfast_study::verdict::gates::Gates;
use standfast_study::verdict::pairs::every_pair;
use standfast_study::verdict::so_far::{SoFar, SuccessTally};
use standfast_study::verdict::summary::Summary;
use standfast_study::verdict::trial_columns::TrialColumns;

/// A built-in campaign with these values set.
pub fn campaign(name: &str, set: &[&str]) -> Campaign {
    let set = set.iter().map(|s| s.to_string()).collect();
    Campaign::load(
        name,
        &Overrides {
            set,
            ..Overrides::default()
        },
    )
    .unwrap()
}

/// Manifest of the campaign `smoke` with these changes.
pub fn manifest(controllers: &[&str], overrides: Overrides) -> Manifest {
    let campaign = Campaign::load("smoke", &overrides).unwrap();
    Manifest {
        standfast: "0".into(),
        config_hash: "0123456789abcdef".into(),
        totals: Vec::new(),
        inputs: Vec::new(),
        not_kept: Default::default(),
        trained_otherwise: Default::default(),
        robot: None,
        robot_sha256: String::new(),
        engines: vec![campaign.episode.engine.with_version(); controllers.len()],
        part_trials: part_trials(&campaign),
        controllers: controllers
            .iter()
            .map(|controller| controller.to_string())
            .collect(),
        campaign,
    }
}

/// A record with an outcome, whose numbers are made up.
pub fn record(outcome: Outcome) -> Record {
    Record {
        outcome,
        end_s: 2.0,
        fell_at_s: outcome.is_lost().then_some(1.5),
        fall_cause: (outcome.is_lost() || matches!(outcome, Outcome::Diverged | Outcome::Failed))
            .then(|| "left_knee, at the ground".into()),
        settled_at_s: (outcome == Outcome::Recovered).then_some(1.25),
        home_at_s: (outcome == Outcome::Recovered).then_some(1.75),
        com_speed_at_push_m_s: Some(0.001),
        peak_tilt_deg: 1.0 / 3.0,
        peak_torque_n_m: 4.0,
        peak_torque_ratio: 0.5,
        torque_limited_s: 0.004,
        peak_joint_speed_rad_s: 2.0,
        peak_sole_force_n: Some(60.0),
        peak_dcm_outside_m: 1e-300,
        peak_slip_m: 0.003,
        promise_margin: Some(-0.25),
        promise_margin_est: Some(0.25),
        totals: Totals([("gain_switches".to_string(), 3.0)].into()),
        ..Record::default()
    }
}

/// A change of a row, in one expression.
pub trait Changed {
    /// The row after a change.
    fn with(self, change: impl FnOnce(&mut Self)) -> Self;
}

impl Changed for TrialRow {
    fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

/// A trial with one push.
pub fn row(trial: u64, controller: &str, impulse_n_s: f64, outcome: Outcome) -> TrialRow {
    let push = Push {
        impulse_n_s,
        ..Push::default()
    };
    TrialRow::new(
        trial,
        controller,
        &[push],
        Some(2.0),
        Variation::default(),
        record(outcome),
    )
}

/// A trial for each pair of outcomes of the controllers "a" and "b".
pub fn rows(outcomes: &[[Outcome; 2]]) -> Vec<TrialRow> {
    let mut rows = Vec::new();
    for (trial, [a, b]) in (0..).zip(outcomes) {
        rows.push(row(trial, "a", 1.0, *a));
        rows.push(row(trial, "b", 1.0, *b));
    }
    rows
}

/// Columns of rows in the order of trials, with the settings of the campaign `standard`.
pub fn columns_of_rows(rows: &[TrialRow], names: &[impl ToString]) -> TrialColumns {
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    let mut columns = TrialColumns::new(&names, &campaign("standard", &[]).episode);
    columns.push(rows);
    columns
}

/// Columns with a trial for each pair of outcomes of the controllers "a" and "b".
pub fn columns_of_outcomes(outcomes: &[[Outcome; 2]]) -> TrialColumns {
    columns_of_rows(&rows(outcomes), &["a", "b"])
}

/// The summary of a campaign with controllers "a" and "b", with a trial for each pair of outcomes and impulses from 1 to 2
/// N s. The campaign is `smoke`, changed by `set`.
pub fn summary(outcomes: &[[Outcome; 2]], set: &[&str], gates: &[&str]) -> Summary {
    let overrides = Overrides {
        set: set.iter().map(|s| s.to_string()).collect(),
        gates: gates.iter().map(|s| s.to_string()).collect(),
        trials: Some(outcomes.len() as u64),
        ..Overrides::default()
    };
    let manifest = manifest(&["a", "b"], overrides);
    let mut rows = TrialColumns::new(&manifest.controllers, &manifest.campaign.episode);
    rows.push(&impulse_rows(outcomes));
    let gates = Gates::new(&manifest, None).unwrap();
    Summary::new(&manifest, &rows, String::new(), &every_pair(2), &gates)
}

/// The trials of [`summary`].
pub fn summary_columns(outcomes: &[[Outcome; 2]]) -> TrialColumns {
    columns_of_rows(&impulse_rows(outcomes), &["a", "b"])
}

fn impulse_rows(outcomes: &[[Outcome; 2]]) -> Vec<TrialRow> {
    let mut rows = Vec::new();
    for (trial, [a, b]) in (0..).zip(outcomes) {
        let impulse_n_s = 1.0 + trial as f64 / outcomes.len() as f64;
        rows.push(row(trial, "a", impulse_n_s, *a));
        rows.push(row(trial, "b", impulse_n_s, *b));
    }
    rows
}

/// A summary and its trials, of controllers "a", "b" and "c". Controller "b" was stopped after 25 of 100 trials. "a" and "c"
/// recover from nine of ten pushes, "b" from one of five.
pub fn ragged(gates: &[&str]) -> (Summary, TrialColumns) {
    let overrides = Overrides {
        gates: gates.iter().map(|s| s.to_string()).collect(),
        trials: Some(200),
        until_resolved: true,
        ..Overrides::default()
    };
    let manifest = manifest(&["a", "b", "c"], overrides);
    let mut rows = Vec::new();
    for trial in 0..100_u64 {
        for (controller, has_recovered) in [
            ("a", trial % 10 != 3),
            ("b", trial.is_multiple_of(5)),
            ("c", trial % 10 != 7),
        ] {
            if controller != "b" || trial < 25 {
                let outcome = if has_recovered { Recovered } else { Fell };
                rows.push(row(trial, controller, 1.0 + trial as f64 / 50.0, outcome));
            }
        }
    }
    let rows = columns_of_rows(&rows, &manifest.controllers);
    let gates = Gates::new(&manifest, None).unwrap();
    (
        Summary::new(&manifest, &rows, String::new(), &every_pair(3), &gates),
        rows,
    )
}

/// The state after so many trials with so many controllers. Controller i recovers from all trials but every (i + 2)nd.
pub fn so_far(controllers: usize, trials: u64, name: impl Fn(usize) -> String) -> SoFar {
    let names: Vec<String> = (0..controllers).map(name).collect();
    let mut rows = Vec::new();
    for trial in 0..trials {
        for (controller, name) in names.iter().enumerate() {
            let is_lost = trial.is_multiple_of(controller as u64 + 2);
            let outcome = if is_lost { Fell } else { Recovered };
            rows.push(row(trial, name, 1.0, outcome));
        }
    }
    let mut tally = SuccessTally::new(&names);
    tally.add(&rows);
    SoFar::new(&tally, 0.02)
}
