//! Figures that README and guide state more than once are those that `.ci/figures` has measured, and the pictures are
//! of the same build.

use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::HashSet;
use std::fs;
use std::path::PathBuf;

const CONTROLLERS: [&str; 4] = ["hold", "switching", "paper", "catch"];

fn root() -> PathBuf {
    env!("CARGO_MANIFEST_DIR").into()
}

fn text(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn figures() -> Value {
    serde_json::from_str(&text("assets/figures.json")).unwrap()
}

/// The rows of the table after the sentence or heading that contains `before`.
fn rows(text: &str, before: &str) -> Vec<String> {
    let (_, after) = text
        .split_once(before)
        .unwrap_or_else(|| panic!("no {before:?}"));
    let table = after
        .lines()
        .skip_while(|line| !line.starts_with("|---"))
        .skip(1);
    table
        .take_while(|line| line.starts_with('|'))
        .map(String::from)
        .collect()
}

#[test]
fn the_tables_of_what_holds_now_are_those_that_were_measured() {
    let (figures, text) = (figures(), text("src/guide/measured.md"));
    let standard = &figures["standard"];
    let row = |name: &str| {
        let alike = 100.0 * standard["alike"][name].as_f64().unwrap();
        format!(
            "| `{name}` | {} | {} | {alike:.1} % |",
            standard["rapier"][name], standard["mujoco"][name]
        )
    };
    assert_eq!(
        rows(&text, "## Which controller recovers"),
        CONTROLLERS.map(row)
    );

    let nominal = &figures["nominal"];
    let of = |engine: &str, at: usize| nominal[engine][at].clone();
    let row = |at: usize| {
        let (here, there) = (of("rapier", at), of("mujoco", at));
        let n_s = |value: &Value, digits: usize| format!("{:.digits$}", value.as_f64().unwrap());
        let mut cells = vec![
            here["heading_deg"]
                .to_string()
                .trim_end_matches(".0")
                .to_string(),
        ];
        cells.extend(["none", "one", "any", "early"].map(|bound| n_s(&here[bound], 2)));
        cells.extend(CONTROLLERS.map(|name| n_s(&here["controllers"][name]["impulse50_n_s"], 2)));
        cells.push(n_s(&here["controllers"]["catch"]["safe_n_s"], 1));
        cells.push(n_s(&there["controllers"]["catch"]["impulse50_n_s"], 2));
        cells.push(n_s(&there["controllers"]["catch"]["safe_n_s"], 1));
        format!("| {} |", cells.join(" | "))
    };
    assert_eq!(
        rows(&text, "## The hardest push"),
        (0..9).map(row).collect::<Vec<_>>()
    );

    // The guide says that `early` is above all of them.
    for heading in ["rapier", "mujoco"]
        .map(|engine| nominal[engine].as_array().unwrap())
        .into_iter()
        .flatten()
    {
        for name in CONTROLLERS {
            let limit_n_s = heading["controllers"][name]["impulse50_n_s"].as_f64();
            assert!(limit_n_s < heading["early"].as_f64(), "{name}: {heading}");
        }
    }

    // The bins are those from the margin `from` on, up to `to`.
    let foretold = |from: f64, to: f64| {
        let bins = standard["foretold"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|bin| {
                bin["from"].as_f64().unwrap_or(f64::NEG_INFINITY) >= from
                    && bin["to"].as_f64().unwrap_or(f64::INFINITY) <= to
            });
        let sum = |of: &str| {
            bins.clone()
                .map(|bin| bin[of].as_u64().unwrap())
                .sum::<u64>()
        };
        format!("{} of {}", sum("recovered"), sum("trials"))
    };
    let (inf, rows) = (f64::INFINITY, rows(&text, "## Standing"));
    for (row, told) in rows.iter().zip([
        foretold(0.0, inf),
        foretold(-0.25, 0.0),
        foretold(-inf, -0.25),
    ]) {
        assert!(row.ends_with(&format!("| {told} |")), "{row}: {told}");
    }
    assert_eq!(rows.len(), 3);
}

#[test]
fn readme_and_guide_state_the_same_figures() {
    let (figures, readme) = (figures(), text("README.md"));
    let (standard, forward) = (&figures["standard"], &figures["nominal"]["rapier"][0]);
    for name in CONTROLLERS {
        let recovered = standard["rapier"][name].as_u64().unwrap();
        let row = format!(" {name:<11} {recovered:>4}/{}", standard["trials"]);
        assert!(readme.contains(&row), "README: {row}");
        let alike = format!("{:.1} %", 100.0 * standard["alike"][name].as_f64().unwrap());
        for file in ["README.md", "src/guide/engines.md"] {
            assert!(
                text(file).contains(&alike),
                "{file}: {alike} alike with {name}"
            );
        }
    }
    let n_s = |value: &Value| format!("{:.2}", value.as_f64().unwrap());
    let hardest = n_s(&forward["controllers"]["catch"]["impulse50_n_s"]);
    for (file, figure) in [
        (
            "README.md",
            format!(
                "takes at most {} N s with one footstep and {} N s with any number",
                n_s(&forward["one"]),
                n_s(&forward["any"])
            ),
        ),
        ("README.md", format!("to {hardest} N s with several")),
        ("src/guide/limits.md", format!("catch        {hardest} (")),
    ] {
        // A sentence may continue in the next line.
        assert!(
            text(file).replace('\n', " ").contains(&figure),
            "{file}: {figure}"
        );
    }
    // No other number of the standard campaign is stated as if it held now.
    let known: Vec<String> = CONTROLLERS
        .iter()
        .map(|name| standard["rapier"][name].to_string())
        .collect();
    for file in [
        "README.md",
        "src/guide/campaigns.md",
        "src/guide/measured.md",
    ] {
        let text = text(file);
        let told = text
            .split("/1000")
            .filter_map(|before| before.rsplit(|c: char| !c.is_ascii_digit()).next());
        let told: Vec<&str> = told.take(text.matches("/1000").count()).collect();
        assert!(
            told.iter().all(|told| known.contains(&told.to_string())),
            "{file}: {told:?}, measured {known:?}"
        );
    }
}

/// A rate is not lucky by choice if no choice was made by the pushes from which it comes.
#[test]
fn the_standard_campaign_has_the_last_seed_of_the_list_and_the_figures_are_of_it() {
    let table = |file: &str| {
        text(file)
            .parse::<toml::Table>()
            .unwrap_or_else(|e| panic!("{file}: {e}"))
    };
    let seeds = table("assets/seeds.toml");
    let used: Vec<(i64, &str)> = seeds["used"]
        .as_array()
        .unwrap()
        .iter()
        .map(|used| {
            (
                used["seed"].as_integer().unwrap(),
                used["for"].as_str().unwrap(),
            )
        })
        .collect();
    let different: HashSet<i64> = used.iter().map(|(seed, _)| *seed).collect();
    assert_eq!(different.len(), used.len(), "a seed is there twice");
    let &(last, what) = used.last().unwrap();
    assert!(
        what.starts_with("`standard` since ") && what.ends_with("and no choice."),
        "{what}"
    );
    assert_eq!(
        table("assets/campaigns/standard.toml")["seed"].as_integer(),
        Some(last)
    );
    for file in ["README.md", "src/guide/measured.md"] {
        let words = text(file).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            words.contains(&format!("seed {last}")),
            "{file} does not name seed {last}"
        );
    }
    assert_eq!(
        figures()["standard"]["seed"].as_i64(),
        Some(last),
        "figures.json: .ci/figures --keep-seed measures it"
    );
}

#[test]
fn pictures_are_of_the_build_that_was_measured() {
    let figures = figures();
    let pictures = figures["pictures"].as_object().unwrap();
    assert!(pictures.len() >= 8, "{pictures:?}");
    for (name, sum) in pictures {
        let picture = fs::read(root().join("assets/pictures").join(name)).unwrap();
        let found: String = Sha256::digest(&picture)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        assert_eq!(found, *sum, "{name}: made by another run of .ci/figures");
    }
}
