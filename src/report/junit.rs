//! `junit.xml`: the gates as test cases, for the test view of a CI service. Trials are no test cases, since a lost
//! trial is not a failed test.

use super::html_page;
use crate::replay_command;
use crate::text::gate_words;
use minijinja::UndefinedBehavior;
use serde_json::json;
use standfast_core::error::Result;
use standfast_study::Summary;
use standfast_study::verdict::evidence::Status;
use standfast_study::verdict::gates::GateResult;
use std::path::Path;

const TEMPLATE: &str = include_str!("junit.xml.jinja");

/// One suite with a case for each gate, and the physics engine as its property. An unresolved gate is a skipped case,
/// unless the campaign counts it as failed. Fails only if the template is wrong.
pub fn xml(summary: &Summary) -> Result<String> {
    let case = |gate: &GateResult| {
        // A CI service keeps the result folder, which contains the campaign file.
        let command = |trial| replay_command(summary, &gate.set, trial, Path::new(""));
        json!({
            "name": gate.judged.name,
            "words": gate_words(gate),
            "status": gate.judged.status,
            "passes": gate.passes,
            "replay": gate.lost_trial.filter(|_| gate.judged.status != Status::Passed).map(command),
        })
    };
    let failures = summary.gates.iter().filter(|gate| !gate.passes).count();
    let unresolved = summary
        .gates
        .iter()
        .filter(|gate| gate.passes && gate.judged.status == Status::Unresolved);
    let counts = [summary.gates.len(), unresolved.count(), failures];
    let cases: Vec<_> = summary.gates.iter().map(case).collect();
    let context =
        json!({ "name": summary.name, "engine": summary.engine, "counts": counts, "gates": cases });
    html_page::render(
        "junit.xml",
        TEMPLATE,
        UndefinedBehavior::Strict,
        |_| (),
        &context,
    )
    .map(|xml| xml + "\n")
}
