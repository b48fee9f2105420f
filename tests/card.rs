//! `standfast card` makes a page and a sheet, and `compare --observed` says whether hardware agrees with them.

use crate::common::program::{Run, files, folder, standfast, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A card with little to simulate.
const CARD: [&str; 11] = [
    "card",
    "--controller=hold",
    "--headings=1",
    "--precision=1",
    "--trials=2",
    "--replicas=2",
    "--tries=2",
    "--set=episode.horizon_s=1.8",
    "--set=episode.judge.standing_time_s=0.1",
    "--threads=2",
    "--out=lab",
];

fn card(dir: &Path, more: &[&str]) -> Run {
    standfast(dir, &[&CARD, more].concat())
}

/// The sheet with these outcomes in its last column.
fn fill(dir: &Path, outcomes: &[&str]) -> String {
    let sheet = fs::read_to_string(dir.join("lab/observed.csv")).unwrap();
    let mut lines = sheet.lines();
    let mut filled = lines.next().unwrap().to_string();
    for (line, outcome) in lines.zip(outcomes) {
        let (push, _) = line.rsplit_once(',').unwrap();
        filled += &format!("\n{push},{outcome}");
    }
    fs::write(dir.join("filled.csv"), &filled).unwrap();
    filled
}

fn compare(dir: &Path, more: &[&str]) -> Run {
    standfast(
        dir,
        &[&["compare", "--observed=filled.csv", "lab"], more].concat(),
    )
}

#[test]
fn a_card_is_made_kept_and_compared_with_what_was_observed() {
    let dir = folder();
    let (dir, lab) = (dir.path(), dir.path().join("lab"));
    let json = stdout(&card(dir, &["--json"]).success());
    let found: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(fs::read_to_string(lab.join("card.json")).unwrap(), json);
    let pushes = found["pushes"].as_array().unwrap();
    assert_eq!(pushes.len(), 2);
    let chance = |push: &Value| push["predicted"].as_f64().unwrap();
    for push in pushes {
        let heading = usize::from(push["heading_deg"] == 180.0);
        let limit = &found["limits"]["headings"][heading]["controllers"][0]["impulse50_n_s"];
        let of_limit = push["impulse_n_s"].as_f64().unwrap() / limit.as_f64().unwrap();
        // Impulses have two digits.
        assert!((0.48..1.35).contains(&of_limit), "{push} at {limit}");
        // Of 2 replicas, (k + 1/2) / 3.
        let k = 3.0 * chance(push) - 0.5;
        assert!(
            (k - k.round()).abs() < 1e-3 && (0.0..2.01).contains(&k.round()),
            "{push}"
        );
        assert!(
            [0.0, 180.0].contains(&push["heading_deg"].as_f64().unwrap()),
            "{push}"
        );
    }
    assert_eq!(found["factors"].as_array().unwrap().len(), 8);
    assert_eq!(found["designed"]["trials"], 2);
    let page = fs::read_to_string(lab.join("card.html")).unwrap();
    assert_eq!(
        page.matches("class=\"box\"").count(),
        4,
        "two boxes for each push"
    );
    assert!(!page.contains("http"), "the page loads nothing");

    // The same command runs nothing again, and keeps what was filled in.
    fill(dir, &["1", "0"]);
    fs::copy(dir.join("filled.csv"), lab.join("observed.csv")).unwrap();
    let kept = files(&lab);
    let again = card(dir, &["--json"]).success();
    assert_eq!((stdout(&again), files(&lab)), (json, kept.clone()));
    assert!(
        stderr(&again).contains("all 1 searches are there"),
        "{}",
        stderr(&again)
    );
    // With parts lost, they are run again to the same bits.
    fs::remove_file(lab.join("parts/push-2-of-2.json")).unwrap();
    fs::remove_file(lab.join("parts/trial-2-of-2.json")).unwrap();
    let text = stdout(&card(dir, &[]).success());
    assert_eq!(files(&lab), kept);
    assert!(text.contains("To try on hardware first"), "{text}");

    // What was observed, beside the sheet and elsewhere.
    let beside = standfast(dir, &["compare", "--observed=lab/observed.csv"]).success();
    assert_eq!(stdout(&beside), stdout(&compare(dir, &[]).success()));
    assert!(
        stdout(&beside).contains("survived: 1 of 2"),
        "{}",
        stdout(&beside)
    );
    let told = |outcomes: &[&str]| -> Value {
        fill(dir, outcomes);
        serde_json::from_str(&stdout(&compare(dir, &["--json"]).success())).unwrap()
    };
    let all = told(&["1", "1"]);
    let product: f64 = pushes.iter().map(chance).product();
    assert!(
        (all["so_many_p"].as_f64().unwrap() - product).abs() < 1e-12,
        "{all}"
    );
    assert!(
        (all["log_likelihood"].as_f64().unwrap() - product.ln()).abs() < 1e-9,
        "{all}"
    );
    let sum: f64 = pushes.iter().map(chance).sum();
    assert!(
        (all["expected"].as_f64().unwrap() - sum).abs() < 1e-12,
        "{all}"
    );
    let none = told(&["0", "0"]);
    let product: f64 = pushes.iter().map(|push| 1.0 - chance(push)).product();
    assert!(
        (none["so_few_p"].as_f64().unwrap() - product).abs() < 1e-12,
        "{none}"
    );
    assert_eq!(none["verdict"], "cannot-be-told", "{none}");
    assert_eq!(
        told(&["1"])["pushes"],
        1,
        "pushes that were not made have no line"
    );
}

/// A card as `standfast card` writes it, with what is compared.
const WRITTEN: &str = r#"{
  "controller": "catch", "limits": { "robot": "ut-mu2" }, "pushes": [
  { "push": 1, "impulse_n_s": 4.5, "heading_deg": 0.0, "height_m": 0.0, "duration_s": 0.05, "predicted": 0.9,
    "predicted_ci95": [0.8, 1.0], "lapse": 0.01, "slope": 20.0, "limit_n_s": 5.0 },
  { "push": 2, "impulse_n_s": 6.0, "heading_deg": 90.0, "height_m": 0.0, "duration_s": 0.05, "predicted": 0.5,
    "predicted_ci95": [0.3, 0.7], "lapse": 0.01, "slope": 20.0, "limit_n_s": 6.0 } ] }"#;
const HEAD: &str = "push,impulse_n_s,heading_deg,height_m,duration_s,predicted,observed\n";

#[test]
fn a_sheet_that_is_not_of_the_card_is_refused_with_line_field_and_value() {
    let dir = folder();
    let dir = dir.path();
    fs::create_dir(dir.join("lab")).unwrap();
    fs::write(dir.join("lab/card.json"), WRITTEN).unwrap();
    let (first, second) = ("1,4.5,0,0,0.05,0.9,", "2,6.0,90,0,0.05,0.5,");
    let told = |lines: &str, code: i32| {
        fs::write(dir.join("filled.csv"), lines).unwrap();
        stderr(&compare(dir, &[]).code(code))
    };
    for (lines, message) in [
        (
            format!("{first}\n"),
            "line 2, observed = : is missing; accepted: 1 if",
        ),
        (
            format!("{first}yes\n"),
            "line 2, observed = yes: is no outcome; accepted: 1 if",
        ),
        (
            format!("{first}1\n3,6.0,90,0,0.05,0.5,0\n"),
            "line 3, push = 3: the card has no such push; accepted: 1 to 2",
        ),
        (
            format!("{first}1\n{first}0\n"),
            "line 3, push = 1: is there twice",
        ),
        (
            format!("{first}1\n2,6.0,90,0,0.05,0.7,0\n"),
            "line 3, predicted = 0.7: is not as on the card; accepted: 0.5",
        ),
        (
            format!("{first}1\n2,6.0,,0,0.05,0.5,0\n"),
            "line 3, heading_deg = : is not as on the card; accepted: 90",
        ),
        (format!("{first}1\n2,6.0\n"), "found record with 2 fields"),
        (String::new(), "no push was observed"),
    ] {
        let error = told(&format!("{HEAD}{lines}"), 2);
        assert!(
            error.contains("filled.csv: ") && error.contains(message),
            "{error}"
        );
    }
    assert!(
        told("push,observed\n1,1\n", 2)
            .contains("line 1 = push,observed: has no column impulse_n_s")
    );
    let both = told(&format!("{HEAD}{first}\n{second}2\n"), 2);
    assert!(
        both.contains("2 problems") && both.contains("line 3, observed = 2"),
        "{both}"
    );
    // As an office program in a country with decimal commas writes it.
    let commas = |line: &str| line.replace(',', ";").replace('.', ",");
    told(
        &format!(
            "{}{}1\r\n{}0\r\n",
            commas(HEAD),
            commas(first),
            commas(second)
        ),
        0,
    );

    fs::remove_file(dir.join("lab/card.json")).unwrap();
    assert!(told(&format!("{HEAD}{first}1\n"), 3).contains("lab: holds no card.json"));
    let neither = stderr(&standfast(dir, &["compare"]).code(2));
    assert!(neither.contains("required"), "{neither}");
    let full = standfast(dir, &["compare", "--observed=filled.csv", "lab", "other"]);
    assert!(stderr(&full.code(2)).contains("cannot be used with"));
}

#[test]
fn a_card_is_of_one_entrant_and_of_a_robot_that_takes_pushes() {
    let dir = folder();
    let refused = |more: &[&str], message: &str| {
        let error = stderr(&card(dir.path(), more).code(2));
        assert!(error.contains(message), "{error}");
    };
    refused(&["--engine=both"], "a card is of one engine");
    let none = standfast(dir.path(), &["card", "--replicas=0"]).code(2);
    assert!(stderr(&none).contains("accepted: a whole number from 1 to"));
    refused(&["--set=push.hight_m=0.1"], "push.hight_m");
    let dry = card(dir.path(), &["--dry-run"]).success();
    assert!(
        stderr(&dry).contains("limits at 1 headings"),
        "{}",
        stderr(&dry)
    );
    assert!(!dir.path().join("lab").exists());
}
