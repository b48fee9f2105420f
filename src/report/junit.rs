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

use std::path::Path;

const TEMPLATE: &str = include_str!("junit.xml.jinja");

/// One suite with a case for each gate, and the physics engine as its property. An unresolved gate is a skipped case,
/// unless the campaign counts it as failed. Fails only if the template is wrong.
pub fn xml(summary: &Summary) -> Result<String> {
    let mut cases = Vec::new();
    for gate in &summary.gates {
        // A CI service keeps the result folder, which contains the campaign file.
        let replay = gate
            .lost_trial
            .filter(|_| gate.judged.status != Status::Passed)
            .map(|trial| replay_command(summary, &gate.controller, trial, Path::new("")));
        cases.push(json!({
            "name": gate.judged.name,
            "words": gate_words(gate),
            "status": gate.judged.status,
            "passes": gate.passes,
            "replay": replay,
        }));
    }
    let failures = summary.gates.iter().filter(|gate| !gate.passes).count();
    let unresolved = summary
        .gates
        .iter()
        .filter(|gate| gate.passes && gate.judged.status == Status::Unresolved);
    let counts = [summary.gates.len(), unresolved.count(), failures];

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
