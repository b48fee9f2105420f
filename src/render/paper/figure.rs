//! A figure of the page: its panels, what it claims against the paper, and the numbers behind.

use super::super::html::svg::short;
use super::panel::Panel;
use serde::Serialize;
use serde_json::Value;

const STYLE: &str = include_str!("figure.css");
/// Between panels of a file (px).
const GAP: f64 = 16.0;

/// How a statement of the paper compares with what was computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    Agrees,
    Differs,
    /// The paper does not say, or its print does not let one read it.
    Open,
}

/// How many claims have a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Count {
    pub verdict: Verdict,
    pub claims: usize,
}

impl Count {
    /// In words: "2 agree", "1 differs".
    pub fn told(&self) -> String {
        let words = match (self.verdict, self.claims) {
            (Verdict::Agrees, 1) => "agrees",
            (Verdict::Agrees, _) => "agree",
            (Verdict::Differs, 1) => "differs",
            (Verdict::Differs, _) => "differ",
            (Verdict::Open, _) => "open",
        };
        format!("{} {words}", self.claims)
    }
}

/// Of each verdict that some claim has.
pub fn counts(claims: &[Claim]) -> Vec<Count> {
    let count = |verdict| Count { verdict, claims: claims.iter().filter(|claim| claim.verdict == verdict).count() };
    let all = [Verdict::Agrees, Verdict::Differs, Verdict::Open].map(count);
    all.into_iter().filter(|count| count.claims > 0).collect()
}

/// What a claim is about.
#[derive(Debug, Clone, Copy)]
pub enum Said {
    /// The paper's own words, and where they stand. What is left out is an ellipsis.
    Quote(&'static str, &'static str),
    /// A remark on the paper, in words of this page.
    Remark(&'static str),
}

/// A statement of the paper and what this run has to say to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    pub verdict: Verdict,
    /// The paper's own words if they have a `place`, else a remark on it.
    pub paper: String,
    pub place: Option<&'static str>,
    pub here: String,
}

impl Claim {
    /// One that a number decides: what is said if it `holds`, and if not.
    pub fn judged(paper: Said, holds: bool, if_so: String, if_not: String) -> Self {
        let (verdict, here) = if holds { (Verdict::Agrees, if_so) } else { (Verdict::Differs, if_not) };
        Self::new(verdict, paper, here)
    }

    /// One that no number decides.
    pub fn open(paper: Said, here: String) -> Self {
        Self::new(Verdict::Open, paper, here)
    }

    fn new(verdict: Verdict, paper: Said, here: String) -> Self {
        let (paper, place) = match paper {
            Said::Quote(words, place) => (words, Some(place)),
            Said::Remark(words) => (words, None),
        };
        Self { verdict, paper: paper.into(), place, here }
    }
}

/// Cells of text, below a head.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Table {
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// A figure.
#[derive(Debug, Clone)]
pub struct Figure {
    /// As in the paper, e.g. "3".
    pub number: &'static str,
    pub file: &'static str,
    pub title: &'static str,
    /// What is seen.
    pub reading: String,
    pub panels: Vec<Panel>,
    /// Panels side by side.
    pub columns: usize,
    pub table: Option<Table>,
    pub claims: Vec<Claim>,
    /// What the claims rest on.
    pub numbers: Value,
}

impl Figure {
    /// All panels as one SVG file.
    pub fn svg(&self) -> String {
        let rows: Vec<&[Panel]> = self.panels.chunks(self.columns).collect();
        let row_width = |row: &&[Panel]| row.iter().map(|p| p.width + GAP).sum::<f64>() + GAP;
        let row_height = |row: &[Panel]| row.iter().map(|p| p.height).fold(0.0, f64::max);
        let width = rows.iter().map(row_width).fold(0.0, f64::max);
        let height = rows.iter().map(|row| row_height(row) + GAP).sum::<f64>() + GAP;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 \
             {width:.0} {height:.0}\">\n<title>Fig. {}: {}</title>\n<style>\n{STYLE}</style>\n\
             <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n",
            self.number, self.title
        );
        let mut top = GAP;
        for row in rows {
            let mut left = GAP;
            for panel in row {
                let (w, h) = (panel.width, panel.height);
                svg += &panel.svg(&format!("x=\"{left:.0}\" y=\"{top:.0}\" width=\"{w:.0}\" height=\"{h:.0}\""));
                svg.push('\n');
                left += w + GAP;
            }
            top += row_height(row) + GAP;
        }
        svg + "</svg>\n"
    }
}

/// How far something went (m; x forward, y left), in words.
pub fn walked(way: [f64; 2]) -> String {
    let part = |m: f64, ways: [&str; 2]| format!("{} mm {}", short(1e3 * m.abs(), 0), ways[usize::from(m < 0.0)]);
    let [along, across] = [part(way[0], ["forward", "backward"]), part(way[1], ["to the left", "to the right"])];
    if way[1].abs() < 5e-4 { along } else { format!("{along} and {across}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_counted_and_panels_are_put_in_rows() {
        let claim = |holds| Claim::judged(Said::Quote("p", "Sect. I"), holds, "yes".into(), "no".into());
        let figure = |claims| Figure {
            number: "0",
            file: "f.svg",
            title: "t",
            reading: String::new(),
            panels: vec![Panel::new(100.0, 50.0); 3],
            columns: 2,
            table: None,
            claims,
            numbers: Value::Null,
        };
        assert_eq!((claim(true).here, claim(false).here), ("yes".into(), "no".into()));
        let told = |claims: &[Claim]| counts(claims).iter().map(Count::told).collect::<Vec<_>>().join(", ");
        assert_eq!(told(&[claim(true), claim(false), claim(true)]), "2 agree, 1 differs");
        assert_eq!(told(&[claim(true), Claim::open(Said::Remark("p"), String::new())]), "1 agrees, 1 open");
        assert_eq!(told(&[]), "");
        // Two rows, of two panels and of one.
        assert!(figure(vec![]).svg().contains("viewBox=\"0 0 248 148\""), "{}", figure(vec![]).svg());
    }
}
