//! Sentences on pairs of controllers, and on gates.

use crate::replay_command;
use crate::text::layout::{signed, wrapped};
use standfast_stats::mcnemar::PairedCounts;
use standfast_study::Summary;
use standfast_study::verdict::baseline::BaselineId;
use standfast_study::verdict::evidence::Status;
use standfast_study::verdict::gates::GateResult;
use standfast_study::verdict::headline::leaders;
use standfast_study::verdict::pairs::{PairSummary, is_worth_a_line, p_value, rounded};
use std::path::Path;

/// The verdicts, one paragraph for each pair, and a note on their intervals.
pub(super) fn verdicts(summary: &Summary) -> String {
    let shown = shown(summary);
    if shown.is_empty() {
        return String::new();
    }
    let sentences: String = shown
        .iter()
        .map(|pair| wrapped(" - ", &pair.words))
        .collect();
    let more = match summary.pairs.len() - shown.len() {
        0 => String::new(),
        more => format!(
            " {more} more pairs, those without {}, are in summary.json.",
            leader(summary)
        ),
    };
    format!(
        "\n{sentences}{}",
        wrapped(" ", &(about_pairs(summary) + &more))
    )
}

/// A note on the confidence of the intervals and on p, which holds for all pairs.
pub fn about_pairs(summary: &Summary) -> String {
    let (several, count) = (summary.pairs.len() > 1, summary.pairs.len());
    let together = if several {
        format!(" for all {count} pairs together")
    } else {
        String::new()
    };
    let times = if several {
        format!(" times {count}")
    } else {
        String::new()
    };
    match summary.stopping.until_resolved {
        true => format!("The intervals hold at 95 %{together}, however often one looks."),
        false => format!(
            "The intervals hold at 95 %{together}; p is that of the exact McNemar test{times}."
        ),
    }
}

/// The pairs that are shown: all or, if there are too many, the pairs of one controller. In a sweep this is the
/// unchanged controller, otherwise the one that recovers most often.
pub fn shown(summary: &Summary) -> Vec<&PairSummary> {
    let (controllers, pairs) = (summary.controllers.len(), &summary.pairs);
    // In a comparison of two results, each controller has its partner, so the pairs of one controller would not
    // suffice.
    let all = pairs.len() != controllers * controllers.saturating_sub(1) / 2;
    let leader = leader(summary);
    pairs
        .iter()
        .filter(|pair| {
            all || is_worth_a_line(pairs.len(), |name| name == leader, (&pair.a, &pair.b))
        })
        .collect()
}

/// The controller whose pairs are shown if there are too many.
fn leader(summary: &Summary) -> &str {
    match &summary.reference {
        Some(reference) => reference,
        None => leaders(&summary.controllers, &summary.pairs)
            .first()
            .map_or("", |controller| &controller.name),
    }
}

/// A p-value without "p =".
pub fn p_cell(p: f64) -> String {
    p_value(p)
        .trim_start_matches("p ")
        .trim_start_matches("= ")
        .into()
}

/// How gates are judged, and the baseline with which gates compare.
pub fn about_gates(summary: &Summary) -> String {
    let level = level(
        summary
            .gates
            .first()
            .map_or(0.95, |gate| gate.judged.confidence),
    );
    let about = format!(
        "A gate passes if the whole of its {level} interval reaches what is required, and fails if none of it does."
    );
    baseline(summary).map_or(about.clone(), |baseline| format!("{about} {baseline}"))
}

/// The status of a gate, in a few words.
pub fn status(gate: &GateResult) -> &'static str {
    match (gate.judged.status, gate.passes) {
        (Status::Passed, _) => "passed",
        (Status::Failed, _) => "FAILED",
        (Status::Unresolved, true) => "unresolved",
        (Status::Unresolved, false) => "unresolved, counts as FAILED",
    }
}

/// The value of a gate in its unit: a rate in %, or a difference in points with its sign.
pub fn in_unit(gate: &GateResult, share: f64) -> String {
    if gate.is_difference {
        signed(100.0 * share, 1)
    } else {
        format!("{:.1}", 100.0 * share)
    }
}

/// The unit of a gate: % for a rate, points for a difference.
pub fn unit(gate: &GateResult) -> &'static str {
    if gate.is_difference { "points" } else { "%" }
}

/// A confidence (a share) in percent with all its digits.
fn level(confidence: f64) -> String {
    let percent = format!("{:.6}", 100.0 * confidence);
    format!("{} %", percent.trim_end_matches('0').trim_end_matches('.'))
}

/// A sentence on the result with which gates compare. None without a baseline.
pub fn baseline(summary: &Summary) -> Option<String> {
    let BaselineId {
        name,
        standfast,
        config_hash,
        trials,
    } = summary.baseline.as_ref()?;
    let hash = &config_hash[..config_hash.len().min(12)];
    Some(format!(
        "The baseline is {name}, with {trials} trials, by standfast {standfast}, configuration {hash}."
    ))
}

/// For every gate that does not pass, a sentence and the command that replays a trial that was lost. `folder` is the
/// result folder.
pub fn failed_gates(summary: &Summary, folder: &Path) -> Vec<String> {
    let mut texts = Vec::new();
    for gate in summary.gates.iter().filter(|gate| !gate.passes) {
        let mark = if gate.judged.status == Status::Unresolved {
            "gate unresolved: "
        } else {
            "gate failed: "
        };
        let mut text = wrapped(mark, &gate_words(gate)).trim_end().to_string();
        if let Some(trial) = gate.lost_trial {
            // The command has a line of its own, however long, so that it can be copied.
            let command = replay_command(summary, &gate.controller, trial, folder);
            text += &format!("\nto replay a trial that it lost:\n  {command}");
        }
        texts.push(text);
    }
    texts
}

/// A gate and what was observed, in words.
pub fn gate_words(gate: &GateResult) -> String {
    format!("{}: {}", gate.judged.name, gate_seen(gate))
}

/// The observation for a gate, in sentences: the value with its interval, the required value, and what would resolve
/// the gate.
pub fn gate_seen(gate: &GateResult) -> String {
    let (judged, unit) = (&gate.judged, unit(gate));
    let [seen, asked] = [judged.observed, judged.required].map(|share| in_unit(gate, share));
    let [least, most] = judged.interval.map(|share| in_unit(gate, share));
    let more = judged.more_trials.map(|more| match judged.sequential {
        true => format!(" If this is the true value, about {} more trials would resolve it.", rounded(more)),
        false => format!(
            " If this is the true value, a new campaign with another seed and about {} trials would resolve it.",
            rounded(more)
        ),
    });
    let differ = gate.counts.map(|counts| {
        let PairedCounts {
            only_a: won,
            only_b: lost,
            ..
        } = counts;
        format!(" It alone recovered from {won} of them, and the other side alone from {lost}.")
    });
    let fails = match gate.passes || judged.status == Status::Failed {
        true => "",
        false => " In this campaign, an unresolved gate counts as failed (gates.unresolved).",
    };
    let value = if gate.is_difference {
        "difference"
    } else {
        "rate"
    };
    format!(
        "the {value} is {seen} {unit} in {} trials ({least} to {most} {unit} at {} confidence), and {asked} {unit} are \
         required.{}{}{fails}",
        judged.trials,
        level(judged.confidence),
        differ.unwrap_or_default(),
        more.unwrap_or_default()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::summary;
    use standfast_sim::episode::Outcome::{self, Fell, Recovered};

    /// Controller "a" recovers from every push, "b" from half of them.
    fn halves(trials: usize) -> Vec<[Outcome; 2]> {
        (0..trials)
            .map(|i| [Recovered, if i < trials / 2 { Recovered } else { Fell }])
            .collect()
    }

    /// A summary with this number of controllers, of which these pairs were compared.
    fn with_pairs(controllers: usize, pairs: &[(usize, usize)]) -> Summary {
        let mut summary = summary(&halves(10), &[], &[]);
        let (controller, pair) = (summary.controllers[0].clone(), summary.pairs[0].clone());
        let name = |i: usize| format!("set{i}");
        summary.controllers = (0..controllers)
            .map(
                |i| standfast_study::verdict::controller_summary::ControllerSummary {
                    name: name(i),
                    ..controller.clone()
                },
            )
            .collect();
        // The last controller recovers most often.
        summary.pairs = pairs
            .iter()
            .map(|&(a, b)| PairSummary {
                a: name(b),
                b: name(a),
                ..pair.clone()
            })
            .collect();
        summary
    }

    #[test]
    fn many_pairs_are_cut_down_to_those_of_the_best_controller_unless_controllers_have_partners() {
        let every = standfast_study::verdict::pairs::every_pair(7);
        let summary = with_pairs(7, &every);
        assert!(shown(&summary).iter().all(|pair| pair.a == "set6"));
        let text = verdicts(&summary);
        assert_eq!(
            text.matches("\n - ").count() + usize::from(text.starts_with(" - ")),
            6,
            "{text}"
        );
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            words.contains("15 more pairs, those without set6, are in summary.json."),
            "{text}"
        );
        let partners: Vec<_> = (0..7).map(|i| (i, i + 7)).collect();
        let summary = with_pairs(14, &partners);
        assert_eq!(shown(&summary).len(), 7);
        assert!(!verdicts(&summary).contains("more pairs"));
    }

    #[test]
    fn a_failed_difference_says_how_often_each_side_alone_recovered() {
        let told = failed_gates(
            &summary(&halves(100), &[], &["a >= 0.8", "b >= a + 0.1"]),
            Path::new("out"),
        );
        let words = told
            .concat()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        let alone = "It alone recovered from 0 of them, and the other side alone from 50. to replay a trial";
        assert!(
            told.len() == 1
                && words.starts_with("gate failed: b >= a + 0.1: ")
                && words.contains(alone),
            "{words}"
        );
    }

    #[test]
    fn a_pair_and_its_gate_need_as_many_trials() {
        // Of 40 trials, a alone recovers from six, and b alone from one.
        let outcomes = (0..40).map(|i| match i {
            0..6 => [Recovered, Fell],
            6 => [Fell, Recovered],
            _ => [Recovered; 2],
        });
        let summary = summary(&outcomes.collect::<Vec<_>>(), &[], &["a >= b"]);
        let (pair, gate) = (&summary.pairs[0], &summary.gates[0]);
        assert_eq!(gate.judged.status, Status::Unresolved);
        assert_eq!(
            (pair.more_trials, gate.judged.more_trials),
            (Some(86), Some(86))
        );
        let about = "a new campaign with another seed and about 86 trials would";
        assert!(
            pair.words.contains(about) && gate_words(gate).contains(about),
            "{} {}",
            pair.words,
            gate_words(gate)
        );
    }

    #[test]
    fn what_would_resolve_a_gate_has_two_digits_and_the_baseline_is_named() {
        let mut summary = summary(&halves(100), &[], &["b >= 0.45"]);
        summary.gates[0].judged.more_trials = Some(1234);
        summary.baseline = Some(BaselineId {
            name: "old".into(),
            standfast: "0".into(),
            config_hash: "00".into(),
            trials: 9,
        });
        assert!(
            about_gates(&summary).contains(" The baseline is old, with 9 trials"),
            "{}",
            about_gates(&summary)
        );
        let about = [
            " a new campaign with another seed and about 1300 trials",
            " about 1300 more trials",
        ];
        for (sequential, about) in [false, true].into_iter().zip(about) {
            summary.gates[0].judged.sequential = sequential;
            assert!(gate_words(&summary.gates[0]).ends_with(&format!("{about} would resolve it.")));
        }
    }
}
