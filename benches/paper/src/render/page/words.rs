//! The words of `words.toml`: fills in the numbers of this run, and decides which statements of the paper it bears out.

use minijinja::value::{Serde, Value as Any};
use minijinja::{Environment, UndefinedBehavior, context};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use standfast::core::error::{Error, Result};
use standfast::report::figure::panel::short;
use std::collections::BTreeMap;

/// The contents of `words.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Words {
    /// Sentences that sum up what was found.
    found: Vec<String>,
    /// The figures, in the order of the page.
    pub figure: Vec<FigureWords>,
    claim: BTreeMap<String, ClaimWords>,
    pub not_made: Vec<NotMade>,
    /// Names of the claims on the update time.
    pub update_time: Vec<String>,
}

impl Words {
    /// Reads the compiled-in file. Fails only if the file is wrong.
    pub fn load() -> Result<Self> {
        toml::from_str(include_str!("words.toml")).map_err(wrong)
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FigureWords {
    /// Number in the paper, such as "3".
    pub number: String,
    pub file: String,
    pub title: String,
    /// Number of panels side by side in the SVG file.
    pub columns: usize,
    pub claims: Vec<String>,
    pub reading: String,
    pub table: Option<TableWords>,
}

/// A table with a row for each element of a list.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableWords {
    /// Name of the list among the numbers of the figure.
    rows: String,
    /// Head and cell of each column.
    columns: Vec<[String; 2]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ClaimWords {
    paper: String,
    holds: Option<String>,
    /// The verdict for which `here` is written. By default, a claim with `holds` agrees, and a claim without `holds` is
    /// open.
    verdict: Option<Verdict>,
    here: String,
}

/// A figure of the paper that nothing here can show.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NotMade {
    pub figure: String,
    pub why: String,
}

/// How a statement of the paper compares with what was computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    Agrees,
    Differs,
    /// The paper does not make the statement, or its print cannot be read.
    Open,
}

/// A statement of the paper, and the finding of this run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    pub verdict: Verdict,
    /// The paper's own words if there is a `place`, or else a remark on the paper.
    pub paper: String,
    pub place: Option<String>,
    pub here: String,
}

/// The number of claims with a verdict.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Count {
    pub verdict: Verdict,
    pub claims: usize,
}

impl Count {
    /// "2 agree", "1 differs", "3 open".
    pub fn in_words(&self) -> String {
        let words = match self.verdict {
            Verdict::Agrees => ["agrees", "agree"],
            Verdict::Differs => ["differs", "differ"],
            Verdict::Open => ["open", "open"],
        };
        format!("{} {}", self.claims, words[usize::from(self.claims != 1)])
    }
}

/// The number of claims with each verdict, without verdicts that no claim has.
pub fn counts<'a>(claims: impl IntoIterator<Item = &'a Claim>) -> Vec<Count> {
    let mut counts = [Verdict::Agrees, Verdict::Differs, Verdict::Open]
        .map(|verdict| Count { verdict, claims: 0 });
    for claim in claims {
        counts[claim.verdict as usize].claims += 1;
    }
    counts
        .into_iter()
        .filter(|count| count.claims > 0)
        .collect()
}

/// The text in place of words that were written for another verdict.
const OTHERWISE: &str = "What this run found differs from the words that were written for this place; its numbers are in \
                         the output of `standfast-paper page --json`.";

/// Fills the numbers of all figures into the words.
pub struct Teller {
    pub words: Words,
    environment: Environment<'static>,
}

impl Teller {
    /// `numbers` holds the numbers of each figure under the figure's number, and the numbers of the update time.
    /// `design` holds the numbers of the controller.
    pub fn new(words: Words, numbers: &Value, design: &Value) -> Self {
        let mut environment = Environment::new();
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        environment.add_global("fig", Any::from(Serde(numbers)));
        environment.add_global("design", Any::from(Serde(design)));
        environment.add_filter("n", |x: f64, digits: Option<usize>| {
            short(x, digits.unwrap_or(0))
        });
        environment.add_filter("mm", |m: f64, digits: Option<usize>| {
            short(1e3 * m, digits.unwrap_or(0))
        });
        environment.add_filter("s", |s: Option<f64>| {
            s.map_or("never".into(), |s| format!("{s:.2} s"))
        });
        environment.add_filter("phase", phase);
        environment.add_filter("length_of", |Serde([x, y]): Serde<[f64; 2]>| x.hypot(y));
        environment.add_filter("towards_deg", |Serde([x, y]): Serde<[f64; 2]>| {
            y.atan2(x).to_degrees()
        });
        environment.add_filter("walked", |Serde(way): Serde<[f64; 2]>| walked(way));
        environment.add_filter("way", |Serde(Ends { from_m, to_m }): Serde<Ends>| {
            vec![to_m[0] - from_m[0], to_m[1] - from_m[1]]
        });
        Self { words, environment }
    }

    /// The claims of a figure, from its numbers. Like the functions below, it fails only if the words are wrong.
    pub fn claims(&self, names: &[String], numbers: &Value) -> Result<Vec<Claim>> {
        names.iter().map(|name| self.claim(name, numbers)).collect()
    }

    fn claim(&self, name: &str, numbers: &Value) -> Result<Claim> {
        let words = self
            .words
            .claim
            .get(name)
            .ok_or_else(|| wrong(format!("there is no claim {name}")))?;
        let numbers = Any::from(Serde(numbers));
        let holds = match &words.holds {
            Some(holds) => self
                .environment
                .compile_expression(holds)
                .and_then(|it| it.eval(&numbers)),
            None => Ok(Any::from(())),
        };
        let holds = holds.map_err(|e| wrong(format!("claim {name}: {e:#}")))?;
        let verdict = match (holds.is_none(), holds.is_true()) {
            (true, _) => Verdict::Open,
            (_, true) => Verdict::Agrees,
            _ => Verdict::Differs,
        };
        let usual = if words.holds.is_some() {
            Verdict::Agrees
        } else {
            Verdict::Open
        };
        let is_as_written = verdict == words.verdict.unwrap_or(usual);
        let here = if is_as_written {
            self.fill(&words.here, numbers)?
        } else {
            OTHERWISE.into()
        };
        let paper = joined(&words.paper);
        let quoted = paper
            .strip_prefix('\u{201c}')
            .and_then(|quoted| quoted.strip_suffix(')')?.rsplit_once("\u{201d} ("));
        let (paper, place) = quoted.map_or((paper.as_str(), None), |(paper, place)| {
            (paper, Some(place.into()))
        });
        Ok(Claim {
            verdict,
            paper: paper.into(),
            place,
            here,
        })
    }

    /// The sentences that sum up what was found.
    pub fn found(&self) -> Result<Vec<String>> {
        self.words
            .found
            .iter()
            .map(|sentence| self.fill(sentence, context! {}))
            .collect()
    }

    /// The text on what a figure shows.
    pub fn reading(&self, figure: &FigureWords, numbers: &Value) -> Result<String> {
        self.fill(&figure.reading, Any::from(Serde(numbers)))
    }

    /// A table of text: its head and its rows.
    pub fn table(&self, words: &TableWords, numbers: &Value) -> Result<Value> {
        let list = numbers[&words.rows]
            .as_array()
            .ok_or_else(|| wrong(format!("there is no list {}", words.rows)))?;
        let mut rows = Vec::new();
        for row in list {
            let mut cells = Vec::new();
            for [_, cell] in &words.columns {
                cells.push(self.fill(cell, context! { row => Serde(row) })?);
            }
            rows.push(cells);
        }
        Ok(
            json!({ "head": words.columns.iter().map(|[head, _]| head).collect::<Vec<_>>(), "rows": rows }),
        )
    }

    /// Fills numbers into words, and joins their lines.
    fn fill(&self, words: &str, numbers: Any) -> Result<String> {
        let text = self.environment.render_str(words, numbers);
        Ok(joined(&text.map_err(|e| wrong(format!("{e:#}: {words}")))?))
    }
}

fn wrong(problem: impl std::fmt::Display) -> Error {
    Error::Numeric {
        what: "words.toml".into(),
        problem: problem.to_string(),
    }
}

/// The text on one line.
fn joined(lines: &str) -> String {
    lines.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Where a footstep lifts off and lands (m).
#[derive(Deserialize)]
struct Ends {
    from_m: [f64; 3],
    to_m: [f64; 3],
}

/// A phase of the controller, in the words of the figure.
fn phase(name: String) -> String {
    match name.as_str() {
        "out-of-sets" => "no set holds the state".into(),
        "swing-left" => "left foot in the air".into(),
        "swing-right" => "right foot in the air".into(),
        _ => name,
    }
}

/// A way (m; x forward, y left) in words.
fn walked(way: [f64; 2]) -> String {
    let part = |m: f64, ways: [&str; 2]| {
        format!(
            "{} mm {}",
            short(1e3 * m.abs(), 0),
            ways[usize::from(m < 0.0)]
        )
    };
    let [along, across] = [
        part(way[0], ["forward", "backward"]),
        part(way[1], ["to the left", "to the right"]),
    ];
    if way[1].abs() < 5e-4 {
        along
    } else {
        format!("{along} and {across}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_used_only_for_the_verdict_that_they_were_written_for() {
        let words = r#"
            found = []
            figure = []
            not_made = []
            update_time = []
            claim.more = { paper = "more", holds = "x > 1", here = "x is {{ x }}" }
            claim.less = { paper = "less", holds = "x < 1", verdict = "differs", here = "no, x is {{ x }}" }
            claim.open = { paper = "open", here = "x may be {{ x }}" }
        "#;
        let teller = Teller::new(toml::from_str(words).unwrap(), &json!({}), &json!({}));
        let told = |x: u32| {
            let names = ["more", "less", "open"].map(String::from);
            teller
                .claims(&names, &json!({ "x": x }))
                .unwrap()
                .into_iter()
                .map(|claim| (claim.verdict, claim.here))
        };
        let (agrees, differs, open) = (Verdict::Agrees, Verdict::Differs, Verdict::Open);
        let as_written = [
            (agrees, "x is 2".into()),
            (differs, "no, x is 2".into()),
            (open, "x may be 2".into()),
        ];
        assert!(told(2).eq(as_written));
        let otherwise = || OTHERWISE.to_string();
        assert!(told(0).eq([
            (differs, otherwise()),
            (agrees, otherwise()),
            (open, "x may be 0".into())
        ]));
    }
}
