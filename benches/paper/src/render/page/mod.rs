//! The page of `standfast-paper page`: its figures, with the paper's statements on each figure and a verdict on each
//! statement.
//!
//! The runs are given as a [`Study`], and the numbers of each figure as JSON, from which `words.toml` makes all
//! captions and claims. `sets`, `feet`, `robot` and `time` draw the panels.

mod feet;
pub mod footwork;
mod ground;
pub mod robot;
mod sets;
pub mod study;
mod time;
pub mod words;

use minijinja::UndefinedBehavior;
use serde_json::{Value, json};
use standfast::core::error::Result;
use standfast::report::figure::{self, panel::Panel};
use standfast::report::html_page;
use study::Study;
use words::{Claim, FigureWords, NotMade, Teller, Words, counts};

pub struct Page {
    /// Sentences that sum up what was found.
    pub found: Vec<String>,
    pub figures: Vec<Figure>,
    pub not_made: Vec<NotMade>,
    /// Claims on the update time of the CPI sets; empty if the update time was not measured.
    pub update_claims: Vec<Claim>,
    /// Number of updates that were timed.
    repetitions: Value,
}

pub struct Figure {
    pub words: FigureWords,
    /// What the figure shows, in words.
    pub reading: String,
    pub panels: Vec<Panel>,
    pub table: Option<Value>,
    pub claims: Vec<Claim>,
}

impl Page {
    /// The page from its words, the runs, and `numbers`, an object that has the numbers of each figure under the
    /// figure's number, and the numbers of the update time (or null) under "update_time". Fails only if the words name
    /// a number that is not there.
    pub fn new(words: Words, study: &Study, numbers: &Value) -> Result<Self> {
        let family = &study.design.family;
        let design = json!({
            "stepping": study.rules, "omega_rad_s": family.pendulum.omega, "zmp_margin_m": family.zmp_margin,
            "period_s": family.pendulum.dt,
        });
        let teller = Teller::new(words, numbers, &design);
        let found = teller.found()?;
        let mut figures = Vec::new();
        for words in &teller.words.figure {
            let numbers = &numbers[&words.number];
            figures.push(Figure {
                words: words.clone(),
                reading: teller.reading(words, numbers)?,
                panels: panels(&words.number, study, numbers),
                table: words
                    .table
                    .as_ref()
                    .map(|table| teller.table(table, numbers))
                    .transpose()?,
                claims: teller.claims(&words.claims, numbers)?,
            });
        }
        let update = &numbers["update_time"];
        let on_update: &[String] = if update.is_null() {
            &[]
        } else {
            &teller.words.update_time
        };
        Ok(Self {
            found,
            figures,
            update_claims: teller.claims(on_update, update)?,
            repetitions: update["repetitions"].clone(),
            not_made: teller.words.not_made,
        })
    }

    /// All claims, in their order.
    pub fn claims(&self) -> impl Iterator<Item = &Claim> {
        self.figures
            .iter()
            .flat_map(|figure| &figure.claims)
            .chain(&self.update_claims)
    }

    /// `index.html`: all figures as one page that loads nothing else. Fails only if the template is wrong.
    pub fn html(&self, study: &Study) -> Result<String> {
        let context = json!({
            "style": include_str!("page.css"),
            "figure_style": figure::page_style(),
            "total": { "claims": self.claims().count(), "counts": told(self.claims()) },
            "found": self.found,
            "figures": self.figures.iter().map(Figure::shown).collect::<Vec<_>>(),
            "not_made": self.not_made,
            "timing": {
                "claims": self.update_claims, "counts": told(&self.update_claims), "repetitions": self.repetitions,
            },
            "facts": { "robot": study.robot.name, "gains": study.design.family.name, "judge": study.judge },
        });
        let template = include_str!("index.html.jinja");
        html_page::render(
            "index.html",
            template,
            UndefinedBehavior::Strict,
            |_| (),
            &context,
        )
    }
}

fn panels(number: &str, study: &Study, numbers: &Value) -> Vec<Panel> {
    match number {
        "3" => sets::inclusion(study),
        "4" => sets::regions(study),
        "5" => time::sequence(study, numbers),
        "6" => feet::decision(study),
        "7" => robot::machine(study),
        "8" => robot::imposed(study),
        "9" => time::imposed(study),
        "10" => time::strikes(numbers),
        "12" => robot::pushed(study, &study.pushes[0]),
        "13" => robot::pushed(study, &study.pushes[1]),
        "14" => time::pushed(study),
        _ => Vec::new(),
    }
}

/// The number of claims with each verdict, in words.
fn told<'a>(claims: impl IntoIterator<Item = &'a Claim>) -> Vec<Value> {
    counts(claims)
        .iter()
        .map(|count| json!({ "verdict": count.verdict, "told": count.in_words() }))
        .collect()
}

impl Figure {
    /// The values that the template reads.
    fn shown(&self) -> Value {
        let layout = match self
            .panels
            .iter()
            .map(|panel| panel.width)
            .fold(0.0, f64::max)
        {
            w if w < 300.0 => "strip",
            w if w < 420.0 => "thirds",
            w if w < 600.0 => "halves",
            _ => "wide",
        };
        let number = &self.words.number;
        let panels: Vec<String> = (1..)
            .zip(&self.panels)
            .map(|(part, panel)| {
                panel.svg(&format!(
                    "role=\"img\" aria-label=\"Fig. {number}, part {part}\""
                ))
            })
            .collect();
        json!({
            "number": number, "title": self.words.title, "reading": self.reading, "layout": layout,
            "panels": panels, "table": self.table, "claims": self.claims, "counts": told(&self.claims),
        })
    }

    /// All panels as one SVG file.
    pub fn svg(&self) -> String {
        let heading = format!("Fig. {}: {}", self.words.number, self.words.title);
        figure::document(&heading, &self.panels, self.words.columns)
    }
}
