//! `junit.xml`: the gates as test cases, for the test view of a CI service. Trials are no test cases, since a lost
//! trial is not a failed test.

use crate::campaign::Summary;
use crate::campaign::verdict::evidence::Status;
use crate::campaign::verdict::gates::GateResult;
use crate::error::{Error, Result};
use crate::render::replay_command;
use crate::render::text::gate_words;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};
use std::io;
use std::path::Path;

/// One suite with a case for each gate, and the physics engine as its property. An unresolved gate is a skipped case,
/// unless the campaign counts it as failed. Fails if the report cannot be written as XML.
pub fn xml(summary: &Summary) -> Result<String> {
    let mut out = Writer::new_with_indent(Vec::new(), b' ', 4);
    let written = write(&mut out, summary);
    let text = written.and_then(|()| String::from_utf8(out.into_inner()).map_err(io::Error::other));
    text.map(|text| text + "\n").map_err(|source| Error::Write { path: "junit.xml".into(), source })
}

fn write(out: &mut Writer<Vec<u8>>, summary: &Summary) -> io::Result<()> {
    let count = |counts: fn(&GateResult) -> bool| summary.gates.iter().filter(|gate| counts(gate)).count().to_string();
    let (tests, skipped, failures) = (count(|_| true), count(is_skipped), count(|gate| !gate.passes));
    let counts = [("tests", &*tests), ("skipped", &*skipped), ("errors", "0"), ("failures", &*failures)];
    out.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let suites = out.create_element("testsuites").with_attribute(("name", "standfast")).with_attributes(counts);
    suites.write_inner_content(|out| {
        let suite = out.create_element("testsuite").with_attribute(("name", &*summary.name)).with_attributes(counts);
        suite
            .write_inner_content(|out| {
                let engine = [("name", "engine"), ("value", &*summary.engine)];
                out.create_element("properties").write_inner_content(|out| {
                    out.create_element("property").with_attributes(engine).write_empty().map(drop)
                })?;
                summary.gates.iter().try_for_each(|gate| write_case(out, summary, gate))
            })
            .map(drop)
    })?;
    Ok(())
}

fn write_case(out: &mut Writer<Vec<u8>>, summary: &Summary, gate: &GateResult) -> io::Result<()> {
    let words = gate_words(gate);
    let class = format!("standfast.{}", summary.name);
    let case = out.create_element("testcase").with_attributes([("name", &*gate.judged.name), ("classname", &*class)]);
    case.write_inner_content(|out| {
        if !gate.passes {
            let kind = if gate.judged.status == Status::Failed { "failed" } else { "unresolved" };
            out.create_element("failure").with_attributes([("message", &*words), ("type", kind)]).write_empty()?;
        } else if is_skipped(gate) {
            let message = format!("unresolved: {words}");
            out.create_element("skipped").with_attribute(("message", &*message)).write_empty()?;
        }
        // A CI service keeps the result folder, where the campaign file lies.
        let replay = gate.lost_trial.filter(|_| gate.judged.status != Status::Passed).map(|trial| {
            let command = replay_command(summary, &gate.set, trial, Path::new(""));
            format!("\nto replay a trial that it lost, in the result folder: {command}")
        });
        let told = words + replay.as_deref().unwrap_or_default();
        out.create_element("system-out").write_text_content(BytesText::new(&told)).map(drop)
    })?;
    Ok(())
}

fn is_skipped(gate: &GateResult) -> bool {
    gate.passes && gate.judged.status == Status::Unresolved
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
