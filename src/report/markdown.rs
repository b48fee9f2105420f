//! `summary.md`: the result in Markdown, for the page on which a CI service shows a job.

use super::table::{MOST_ROWS, escaped, left_out};
use super::tables::{self, Detail};
use crate::replay_command;
use crate::text::{gate_words, settings};
use standfast_study::Summary;
use standfast_study::verdict::evidence::Status;
use standfast_study::verdict::gates::GateResult;
use std::fmt::Write;
use std::path::Path;

/// The whole text: failed gates first, then verdicts and the other gates, then the numbers behind them. All but the
/// most important tables are folded. The commands are for a shell in the result folder.
pub fn text(summary: &Summary) -> String {
    let mut text = format!("## standfast: {}\n\n", escaped(&summary.name));
    let failed: Vec<_> = summary.gates.iter().filter(|gate| !gate.passes).collect();
    if !failed.is_empty() {
        let (count, all) = (failed.len(), summary.gates.len());
        let names: Vec<_> = failed
            .iter()
            .take(MOST_ROWS)
            .map(|gate| escaped(&gate.judged.name))
            .collect();
        // Writing to a String cannot fail.
        _ = writeln!(
            text,
            "**{count} of {all} {} failed: {}.**{}\n",
            if all == 1 { "gate" } else { "gates" },
            names.join(", "),
            left_out(count, "`junit.xml`")
        );
        for gate in failed.into_iter().take(MOST_ROWS) {
            tell_gate(&mut text, summary, gate);
        }
    }
    _ = writeln!(text, "{}", escaped(&summary.headline));
    for warning in summary.warnings.iter().take(MOST_ROWS) {
        _ = writeln!(text, "\n> **Note** {}", escaped(warning));
    }
    text += "\n";
    for pair in summary.pairs.iter().take(MOST_ROWS) {
        _ = writeln!(text, "- {}", escaped(&pair.words));
    }
    _ = writeln!(text, "{}", left_out(summary.pairs.len(), "pairs"));
    let unresolved = summary
        .gates
        .iter()
        .filter(|gate| gate.passes && gate.judged.status != Status::Passed);
    for gate in unresolved.take(MOST_ROWS) {
        tell_gate(&mut text, summary, gate);
    }
    let (short, full): (Vec<_>, Vec<_>) = tables::of(summary)
        .into_iter()
        .filter(|table| table.detail <= Detail::Full)
        .partition(|table| table.detail == Detail::Short);
    for table in short {
        text += &(table.table.markdown() + "\n");
    }
    if let Some(stopped) = &summary.stopped {
        _ = writeln!(text, "{}\n", escaped(stopped));
    }
    for table in full {
        let (title, table) = (escaped(&table.table.title), table.table.markdown());
        _ = writeln!(
            text,
            "<details><summary>{title}</summary>\n\n{table}\n</details>\n"
        );
    }
    for (name, words) in settings(summary, true) {
        _ = writeln!(text, "- {} {}", name.trim(), escaped(&words));
    }
    _ = writeln!(
        text,
        "\n{} `report.html` has pictures, and trials to replay.",
        summary.interval
    );
    text
}

/// Writes a gate that did not pass, its observed value, and the command that replays a lost trial.
fn tell_gate(text: &mut String, summary: &Summary, gate: &GateResult) {
    _ = writeln!(text, "{}\n", escaped(&gate_words(gate)));
    if let Some(trial) = gate.lost_trial {
        let command = replay_command(summary, &gate.controller, trial, Path::new(""));
        _ = writeln!(
            text,
            "To replay a trial that it lost, run this in the result folder:\n\n```sh\n{command}\n```\n"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::summary;
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    #[test]
    fn failed_gates_come_first_then_verdicts_and_names_are_text() {
        let outcomes: Vec<_> = (0..100)
            .map(|i| [Recovered, if i < 50 { Recovered } else { Fell }])
            .collect();
        let mut summary = summary(&outcomes, &[], &["b >= 0.8", "a >= 0.9"]);
        summary.name = "<b>|x|`_".into();
        let text = text(&summary);
        let place = |part: &str| {
            text.find(part)
                .unwrap_or_else(|| panic!("{part} not in {text}"))
        };
        let begins = "## standfast: &lt;b&gt;\\|x\\|\\`\\_\n\n**1 of 2 gates failed: b &gt;= 0.8.**\n\nb &gt;= 0.8: the rate is 50.0 %";
        assert!(text.starts_with(begins), "{text}");
        assert!(place("--trial 50 --controller b") < place("a recovers most often: "));
        assert!(place("a recovers most often: ") < place("- a is better than b by 50.0 points"));
        assert!(place("- a is better than b by 50.0 points") < place("| b &gt;= 0.8 | FAILED |"));
        assert!(
            place("| b &gt;= 0.8 | FAILED |") < place("| a | b | 50 | 50 | 0 | 0.00 | +50.0 |")
        );
        assert!(
            text.contains(" The intervals hold at 95 %; p is that of the exact McNemar test.\n"),
            "{text}"
        );
    }

    #[test]
    fn the_text_stays_small_with_many_controllers() {
        let mut summary = summary(&[[Recovered, Fell]], &[], &["b >= 0.8"]);
        summary.pairs = vec![summary.pairs[0].clone(); 10_000];
        summary.controllers = vec![summary.controllers[0].clone(); 200];
        summary.gates = vec![
            GateResult {
                passes: false,
                ..summary.gates[0].clone()
            };
            10_000
        ];
        summary.warnings = vec!["a design that does not support a claim".repeat(5); 10_000];
        let text = text(&summary);
        assert!(text.len() < 200_000, "{} bytes", text.len());
        assert_eq!(text.matches(" 9900 more ").count(), 4);
    }
}
