//! Writes the first sentences of a result. They say which controller recovers most often, and than which others it is
//! better.

use crate::verdict::controller_summary::ControllerSummary;
use crate::verdict::listed::listed;
use crate::verdict::pairs::{self, PairSummary, points};
use standfast_stats::decision::PairVerdict;

/// The controllers that recover most often, in the order of `controllers`.
pub fn leaders<'a>(
    controllers: &'a [ControllerSummary],
    pairs: &[PairSummary],
) -> Vec<&'a ControllerSummary> {
    let behind = pairs
        .iter()
        .filter(|pair| pair.difference > 0.0 || pair.verdict == PairVerdict::Better)
        .filter_map(|pair| {
            controllers
                .iter()
                .position(|controller| controller.name == pair.b)
        });
    let rates: Vec<f64> = controllers
        .iter()
        .map(|controller| controller.count.success_rate)
        .collect();
    pairs::leaders(&rates, behind)
        .into_iter()
        .map(|controller| &controllers[controller])
        .collect()
}

/// One or two sentences. Two controllers count as the same if they differ by less than `margin` (a share). The text is
/// empty if there are no controllers.
pub fn of(controllers: &[ControllerSummary], pairs: &[PairSummary], margin: f64) -> String {
    let leaders = leaders(controllers, pairs);
    let Some(first) = leaders.first() else {
        return String::new();
    };
    let others: Vec<_> = controllers
        .iter()
        .filter(|controller| leaders.iter().all(|leader| leader.name != controller.name))
        .collect();
    let trials = match leaders
        .iter()
        .all(|leader| leader.count.trials == first.count.trials)
    {
        true => format!("{} trials", first.count.trials),
        false => "its trials".into(),
    };
    let rate = format!("{:.1} % of {trials}", 100.0 * first.count.success_rate);
    let names = listed(
        &leaders
            .iter()
            .map(|controller| controller.name.as_str())
            .collect::<Vec<_>>(),
        "and",
    );
    let are_several = leaders.len() > 1;
    let who = match (are_several, others.is_empty()) {
        (false, true) => return format!("{names} recovers from {rate}."),
        (true, true) => return format!("{names} recover equally often: in {rate} each."),
        (false, false) => format!("{names} recovers most often: in {rate}."),
        (true, false) => format!("{names} recover most often: in {rate} each."),
    };
    let (mut beaten, mut same, mut open) = (Vec::new(), Vec::new(), Vec::new());
    for other in others {
        let name = other.name.as_str();
        match verdict_on(other, &leaders, pairs) {
            Some(PairVerdict::Better) => beaten.push(name),
            Some(PairVerdict::Same) => same.push(name),
            Some(PairVerdict::Open) => open.push(name),
            None => {}
        }
    }
    let mut findings = Vec::new();
    if !beaten.is_empty() {
        findings.push(format!("better than {}", listed(&beaten, "and")));
    }
    if !same.is_empty() {
        findings.push(format!(
            "within {} points of {}",
            points(margin),
            listed(&same, "and")
        ));
    }
    if !open.is_empty() {
        findings.push(format!(
            "not shown to be better than {}",
            listed(&open, "or")
        ));
    }
    match findings.is_empty() {
        true => who,
        false => format!(
            "{who} {} {}.",
            if are_several { "They are" } else { "It is" },
            findings.join(", and ")
        ),
    }
}

/// The verdict on another controller that holds for every leader. It is None if a leader is not compared with that
/// controller, as may be in a comparison of two results.
fn verdict_on(
    other: &ControllerSummary,
    leaders: &[&ControllerSummary],
    pairs: &[PairSummary],
) -> Option<PairVerdict> {
    let mut verdicts = Vec::new();
    for leader in leaders {
        let names = [&leader.name, &other.name];
        let pair = pairs
            .iter()
            .find(|pair| names == [&pair.a, &pair.b] || names == [&pair.b, &pair.a])?;
        verdicts.push(match pair.verdict {
            // Of three controllers with different trials, each may be better than the next, in a circle.
            PairVerdict::Better if pair.b == leader.name => PairVerdict::Open,
            verdict => verdict,
        });
    }
    let first = *verdicts.first()?;
    let are_alike = verdicts.iter().all(|verdict| *verdict == first);
    Some(if are_alike { first } else { PairVerdict::Open })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::row;
    use crate::verdict::pairs::{DecisionRule, every_pair};
    use crate::verdict::trial_columns::TrialColumns;
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    fn headline(rows: &TrialColumns, until_resolved: bool, margin: f64) -> String {
        let pairs = every_pair(rows.names.len());
        let pairs = PairSummary::all(
            rows,
            &pairs,
            &[],
            DecisionRule {
                until_resolved,
                margin,
                has_more: true,
                weight_n: 0.0,
            },
        );
        let controllers: Vec<ControllerSummary> = (0..rows.names.len())
            .map(|i| ControllerSummary::new(i, rows, &[], &[], until_resolved))
            .collect();
        of(&controllers, &pairs, margin)
    }

    /// A controller that was stopped early, on easy pushes, may have the higher rate and be the worse one.
    #[test]
    fn the_leader_is_found_on_trials_that_both_controllers_have() {
        let outcome = |has_recovered| if has_recovered { Recovered } else { Fell };
        let mut rows = Vec::new();
        for trial in 0..100_u64 {
            if trial < 25 {
                rows.push(row(trial, "a", 1.0, outcome(trial >= 2)));
            }
            let has_recovered = trial < 25 || !trial.is_multiple_of(5);
            rows.push(row(trial, "b", 1.0, outcome(has_recovered)));
        }
        let rows = crate::fixtures::columns_of_rows(&rows, &["a", "b"]);
        let told = headline(&rows, true, 0.02);
        assert_eq!(
            told,
            "b recovers most often: in 85.0 % of 100 trials. It is not shown to be better than a."
        );
    }

    /// Each controller recovers from the first trials, up to its number in `recovered`, of 200.
    #[test]
    fn it_says_who_recovers_most_and_than_which_it_is_better() {
        for (recovered, expected) in [
            (&[][..], ""),
            (
                &[("catch", 172)],
                "catch recovers from 86.0 % of 200 trials.",
            ),
            (
                &[("hold", 90), ("paper", 100), ("catch", 172)],
                "catch recovers most often: in 86.0 % of 200 trials. It is better than hold and paper.",
            ),
            (
                &[("hold", 90), ("paper", 170), ("catch", 172)],
                "catch recovers most often: in 86.0 % of 200 trials. It is better than hold, and not shown to be better than \
                 paper.",
            ),
            (
                &[("hold", 171), ("paper", 170), ("catch", 172)],
                "catch recovers most often: in 86.0 % of 200 trials. It is not shown to be better than hold or paper.",
            ),
            (
                &[("hold", 90), ("paper", 172), ("catch", 172)],
                "paper and catch recover most often: in 86.0 % of 200 trials each. They are better than hold.",
            ),
            (
                &[("hold", 0), ("paper", 0)],
                "hold and paper recover equally often: in 0.0 % of 200 trials each.",
            ),
            (
                &[
                    ("a", 1),
                    ("b", 2),
                    ("c", 3),
                    ("d", 4),
                    ("e", 5),
                    ("f", 6),
                    ("g", 200),
                ],
                "g recovers most often: in 100.0 % of 200 trials. It is better than 6 controllers.",
            ),
            (
                &[("hold", 0), ("paper", 170), ("twin", 171)],
                "twin recovers most often: in 85.5 % of 200 trials. It is better than hold, and within 10.0 points of paper.",
            ),
        ] {
            let mut rows = Vec::new();
            for trial in 0..200 {
                for (name, count) in recovered {
                    let outcome = if trial < *count { Recovered } else { Fell };
                    rows.push(row(trial, name, 1.0, outcome));
                }
            }
            let names: Vec<&str> = recovered.iter().map(|(name, _)| *name).collect();
            let rows = crate::fixtures::columns_of_rows(&rows, &names);
            let margin = if expected.contains("within 10.0") {
                0.1
            } else {
                0.02
            };
            assert_eq!(headline(&rows, false, margin), expected);
        }
    }
}
