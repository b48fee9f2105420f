//! `summary.md`: the result in Markdown, for the page on which a CI service shows a job.

use crate::campaign::Summary;
use crate::campaign::verdict::agreement::Agreement;
use crate::campaign::verdict::evidence::Status;
use crate::render::replay_command;
use crate::render::text::layout::{percent, seconds, signed, unit_of_impulses};
use crate::render::text::{
    ABOUT_AGREEMENT, about_pairs, adjusted_p, agreement_cells, baseline, gate_cells, gate_words, impulse_at,
    pair_cells, status, unit,
};
use std::fmt::Write;
use std::path::Path;

/// Most rows of a table, since GitHub takes 1 MiB at most, and nobody reads more rows than these.
const MOST_ROWS: usize = 100;

/// The whole text: verdicts and gates first, then the numbers behind them. Its commands are for a shell in the result
/// folder.
pub fn text(summary: &Summary) -> String {
    let mut text = format!("## standfast: {}\n\n", escaped(&summary.name));
    let _ = writeln!(text, "{}\n", escaped(&summary.headline));
    for warning in summary.warnings.iter().take(MOST_ROWS) {
        let _ = writeln!(text, "> **Note** {}\n", escaped(warning));
    }
    text += &left_out(summary.warnings.len(), "notes");
    for pair in summary.pairs.iter().take(MOST_ROWS) {
        let _ = writeln!(text, "- {}", escaped(&pair.words));
    }
    text += &gates(summary);
    text += "\n| gain set | recovered | rate | 95 % | 50 % impulse | settles (median) |\n|---|--:|--:|--:|--:|--:|\n";
    for set in summary.sets.iter().take(MOST_ROWS) {
        let [low, high] = set.count.ci95.map(|share| 100.0 * share);
        text += &row([
            escaped(&set.name),
            format!("{}/{}", set.count.recovered, set.count.trials),
            percent(set.count.success_rate),
            format!("{low:.1} to {high:.1} %"),
            impulse_at(&set.curve, true),
            seconds(set.times.median_settling_s),
        ]);
    }
    text += &left_out(summary.sets.len(), "gain sets");
    if let Some(stopped) = &summary.stopped {
        let _ = writeln!(text, "\n{}", escaped(stopped));
    }
    text += &summary.agreement.as_ref().map_or(String::new(), agreement);
    text += &pairs(summary);
    let push = &summary.push;
    let (pushes, same) = match summary.stopped {
        None => (format!("{} pushes", summary.trials), "the same for each gain set"),
        Some(_) => (format!("Up to {} pushes", summary.trials), "for each gain set its first ones"),
    };
    let _ = writeln!(
        text,
        "\n{pushes} of {} N s ({}), heading {} deg, {same}; robot {} in {}, seed {}, standfast {}, \
         configuration `{}`. Intervals, {}. `report.html` has pictures, strata and trials to replay.",
        push.impulse_n_s,
        unit_of_impulses(summary.units.impulse_n_s()),
        push.heading_deg,
        escaped(&summary.robot),
        summary.engine,
        summary.seed,
        summary.standfast,
        &summary.config_hash[..summary.config_hash.len().min(12)],
        summary.interval,
    );
    text
}

fn gates(summary: &Summary) -> String {
    if summary.gates.is_empty() {
        return String::new();
    }
    let mut text = String::from("\n| gate | | seen | interval | trials |\n|---|---|--:|--:|--:|\n");
    for gate in summary.gates.iter().take(MOST_ROWS) {
        let ([seen, interval, trials], judged) = (gate_cells(gate), &gate.judged);
        let status = if gate.passes { status(judged.status).to_string() } else { failing_status(judged.status) };
        text += &row([code(&judged.name), format!("**{status}**"), seen, format!("{interval} {}", unit(gate)), trials]);
    }
    text += &left_out(summary.gates.len(), "gates");
    if let Some(baseline) = baseline(summary) {
        let _ = writeln!(text, "\n{}", escaped(&baseline));
    }
    let not_passed = summary.gates.iter().filter(|gate| gate.judged.status != Status::Passed);
    for gate in not_passed.take(MOST_ROWS) {
        let _ = writeln!(text, "\n{}", escaped(&gate_words(gate)));
        if let Some(trial) = gate.lost_trial {
            let command = replay_command(summary, &gate.set, trial, Path::new(""));
            let _ = writeln!(
                text,
                "\nTo replay a trial that it lost, run this in the result folder:\n\n```sh\n{command}\n```"
            );
        }
    }
    text
}

fn row(cells: impl IntoIterator<Item = String>) -> String {
    format!("| {} |\n", cells.into_iter().collect::<Vec<_>>().join(" | "))
}

/// The status of a gate that does not pass.
fn failing_status(found: Status) -> String {
    match found {
        Status::Unresolved => "unresolved, counts as FAILED".into(),
        other => status(other).into(),
    }
}

fn pairs(summary: &Summary) -> String {
    let pairs = &summary.pairs;
    if pairs.is_empty() {
        return String::new();
    }
    let mut text = String::from(
        "\n| a | b | both | only a | only b | neither | a - b (points) | 95 % | p |\n\
         |---|---|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for pair in pairs.iter().take(MOST_ROWS) {
        let [least, most] = pair.adjusted_ci95.map(|share| signed(100.0 * share, 1));
        let [a, b, counts @ ..] = pair_cells(pair);
        let names = [escaped(&a), escaped(&b)];
        text += &row(names.into_iter().chain(counts).chain([format!("{least} to {most}"), adjusted_p(pair)]));
    }
    text += &left_out(pairs.len(), "pairs");
    let _ = writeln!(text, "\n{}", escaped(&about_pairs(summary)));
    text
}

fn agreement(agreement: &Agreement) -> String {
    let [a, b] = agreement.engines.map(|engine| engine.title());
    let mut text = format!(
        "\n{}, trial by trial:\n\n| gain set | both | only {a} | only {b} | neither | agree | kappa | 95 % |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|\n",
        agreement.versions.join(" and ")
    );
    for set in agreement.sets.iter().take(MOST_ROWS) {
        text += &row([escaped(&set.set)].into_iter().chain(agreement_cells(&set.counts, &set.agreed)));
    }
    text += &left_out(agreement.sets.len(), "gain sets");
    let _ = writeln!(text, "\n{ABOUT_AGREEMENT}");
    text
}

/// A sentence on the rows that are left out, or nothing if all are written.
fn left_out(count: usize, what: &str) -> String {
    match count.saturating_sub(MOST_ROWS) {
        0 => String::new(),
        more => format!("\n{more} more {what} are in `summary.json`.\n"),
    }
}

/// The text as code in a cell of a table, whatever characters it contains.
fn code(text: &str) -> String {
    let text = text.replace('|', "\\|").replace(['\n', '\r'], " ");
    // The fence is longer than every run of backticks in the text, and a space separates it from a backtick at an end.
    let runs = text.split(|c| c != '`').map(str::len);
    let fence = "`".repeat(runs.max().unwrap_or(0) + 1);
    let space = if text.starts_with('`') || text.ends_with('`') { " " } else { "" };
    format!("{fence}{space}{text}{space}{fence}")
}

/// The text with all characters escaped that mean something in Markdown or HTML.
fn escaped(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, c| {
        match c {
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '&' => out += "&amp;",
            '\\' | '`' | '*' | '_' | '[' | ']' | '|' | '#' | '~' => out.extend(['\\', c]),
            '\n' | '\r' => out.push(' '),
            _ => out.push(c),
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::verdict::summary::tests::{ragged, summary};
    use crate::episode::Outcome::{Fell, Recovered};

    #[test]
    fn verdicts_and_gates_come_first_and_names_are_text() {
        let outcomes: Vec<_> = (0..100).map(|i| [Recovered, if i < 50 { Recovered } else { Fell }]).collect();
        let mut summary = summary(&outcomes, &[], &["b >= 0.8"]);
        summary.name = "<b>|x|`_".into();
        let text = text(&summary);
        let place = |part: &str| text.find(part).unwrap_or_else(|| panic!("{part} not in {text}"));
        assert!(place("- a is better than b by 50.0 points") < place("| `b >= 0.8` | **FAILED** |"));
        assert!(place("--trial 50 --gains b") < place("| a | b | 50 | 50 | 0 | 0 | +50.0 |"));
        assert!(text.starts_with("## standfast: &lt;b&gt;\\|x\\|\\`\\_"), "{text}");
        assert!(text.contains("\nThe intervals hold at 95 %; p is that of the exact McNemar test.\n"), "{text}");
    }

    #[test]
    fn a_set_that_was_stopped_has_its_own_trials() {
        let text = text(&ragged(&[]).0);
        assert!(text.contains("| b | 5/25 |") && text.contains(": b after 25 trials. Each rate "), "{text}");
        assert!(text.contains("\nUp to 100 pushes of "), "{text}");
    }

    #[test]
    fn p_is_named_after_its_test() {
        let text = |set: &[&str]| {
            let mut summary = summary(&[[Recovered, Fell]; 9], set, &[]);
            summary.pairs = vec![summary.pairs[0].clone(); 3];
            text(&summary)
        };
        let (fixed, sequential) = (text(&[]), text(&["stopping.until_resolved=true"]));
        assert!(fixed.contains("for all 3 pairs together; p is that of the exact McNemar test times 3.\n"), "{fixed}");
        assert!(sequential.contains("for all 3 pairs together, however often one looks; which set"), "{sequential}");
        assert!(sequential.contains(" | - |\n"), "no p: {sequential}");
    }

    #[test]
    fn code_is_code_whatever_is_in_it() {
        for (name, expected) in [("a >= b", "`a >= b`"), ("a`|b", "``a`\\|b``"), ("``", "``` `` ```")] {
            assert_eq!(code(name), expected);
        }
    }

    #[test]
    fn the_text_stays_small_with_many_sets() {
        let mut summary = summary(&[[Recovered, Fell]], &[], &["b >= 0.8"]);
        summary.pairs = vec![summary.pairs[0].clone(); 10_000];
        summary.sets = vec![summary.sets[0].clone(); 10_000];
        summary.gates = vec![summary.gates[0].clone(); 10_000];
        summary.warnings = vec!["a design that does not support a claim".repeat(5); 10_000];
        let text = text(&summary);
        assert!(text.len() < 200_000, "{} bytes", text.len());
        assert_eq!(text.matches("9900 ").count(), 4);
    }
}
