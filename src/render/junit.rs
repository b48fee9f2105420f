//! `junit.xml`: the gates as test cases, for the test view of a CI service. Trials are no test cases, since a lost
//! trial is not a failed test.

use crate::campaign::Summary;
use crate::campaign::verdict::evidence::Status;
use crate::error::{Error, Result};
use crate::render::replay_command;
use crate::render::text::gate_words;
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};
use std::path::Path;

/// One suite with a case for each gate, empty without gates. An unresolved gate is a skipped case, unless the campaign
/// counts it as failed. Fails if the report cannot be written as XML.
pub fn xml(summary: &Summary) -> Result<String> {
    let mut suite = TestSuite::new(summary.name.clone());
    for gate in &summary.gates {
        let words = gate_words(gate);
        let status = if !gate.passes {
            let mut failed = TestCaseStatus::non_success(NonSuccessKind::Failure);
            failed.set_message(words.clone());
            failed.set_type(if gate.judged.status == Status::Failed { "failed" } else { "unresolved" });
            failed
        } else if gate.judged.status == Status::Unresolved {
            let mut skipped = TestCaseStatus::skipped();
            skipped.set_message(format!("unresolved: {words}"));
            skipped
        } else {
            TestCaseStatus::success()
        };
        let mut case = TestCase::new(gate.judged.name.clone(), status);
        case.set_classname(format!("standfast.{}", summary.name));
        // A CI service keeps the result folder, where the campaign file lies.
        let replay = gate.lost_trial.filter(|_| gate.judged.status != Status::Passed).map(|trial| {
            let command = replay_command(summary, &gate.set, trial, Path::new(""));
            format!("\nto replay a trial that it lost, in the result folder: {command}")
        });
        case.set_system_out(words + replay.as_deref().unwrap_or_default());
        suite.add_test_case(case);
    }
    let mut report = Report::new("standfast");
    report.add_test_suite(suite);
    report.to_string().map_err(|e| Error::Write { path: "junit.xml".into(), source: std::io::Error::other(e) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::verdict::summary::tests::summary;
    use crate::episode::Outcome::{Fell, Recovered};

    #[test]
    fn each_gate_is_a_case_and_unresolved_is_skipped_unless_it_must_pass() {
        let outcomes: Vec<_> = (0..100).map(|i| [Recovered, if i < 50 { Recovered } else { Fell }]).collect();
        let gates = ["a >= 0.8", "b >= 0.8", "b >= 0.5"];
        let counts = |set: &[&str]| {
            let xml = xml(&summary(&outcomes, set, &gates)).unwrap();
            let suite = xml.lines().find(|line| line.contains("<testsuite ")).unwrap().trim().to_string();
            (suite, xml)
        };
        let (suite, xml) = counts(&[]);
        assert!(suite.contains(r#"tests="3" skipped="1" errors="0" failures="1""#), "{suite}");
        assert!(xml.contains("--trial 50 --gains b") && xml.contains("b &gt;= 0.8"), "{xml}");
        let (suite, _) = counts(&["gates.unresolved=fail"]);
        assert!(suite.contains(r#"skipped="0" errors="0" failures="2""#), "{suite}");
    }
}
