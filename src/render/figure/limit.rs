//! The picture of `standfast limit`: the largest recoverable impulses by heading, over the bounds of a pendulum.

use super::axes::Scale;
use super::class_of_set;
use super::panel::{Panel, Row, Sample};
use super::polar::{Polar, towards};
use crate::campaign::limit::{Heading, Limits, SetLimit};
use crate::error::Result;
use std::path::Path;

/// Radius of the outermost ring (px).
const RADIUS: f64 = 265.0;
/// Angle between the points of the curves of the bounds (degrees).
const BOUND_EVERY_DEG: usize = 3;
/// A bound: class in `figure.css`, name in the legend, and impulse (N s).
type Bound = (&'static str, &'static str, fn(&Heading) -> f64);
/// The bounds in the order in which they are drawn, one over the other.
const BOUNDS: [Bound; 3] = [
    ("bound many", "any number of footsteps, or none", |heading| heading.bound_n_step_n_s),
    ("bound one", "at most one footstep", |heading| heading.bound_one_step_n_s),
    ("bound none", "no footstep", |heading| heading.bound_no_step_n_s),
];
/// Points of fewer headings than this are not joined, since a line would say too much about the headings between.
const JOINED: usize = 8;

/// Draws bounds and gain sets. Fails if the solver gives up on a bound, or if the file cannot be written.
pub fn write(path: &Path, limits: &Limits) -> Result<()> {
    let headings = (0..360).step_by(BOUND_EVERY_DEG).map(|deg| limits.yardstick.heading(deg as f64));
    let bounds = headings.collect::<Result<Vec<Heading>>>()?;
    let heading = format!("Largest recoverable impulse by heading: {}, campaign {}", limits.robot, limits.campaign);
    super::write(path, &heading, &[map(limits, &bounds), Panel::of_legend(&legend(limits))], 2)
}

fn map(limits: &Limits, bounds: &[Heading]) -> Panel {
    let found = limits.headings.iter().flat_map(|heading| &heading.sets).map(|set| set.ci95[1]);
    let allowed = bounds.iter().flat_map(|heading| BOUNDS.map(|(.., of)| of(heading)));
    let ticks = Scale { from: 0.0, to: found.chain(allowed).fold(0.1, f64::max) }.ticks();
    // The last ring lies beyond all values.
    let step = ticks[1] - ticks[0];
    let rings: Vec<f64> = (1..=ticks.len()).map(|i| step * i as f64).collect();
    let mut polar = Polar::new(RADIUS, rings[rings.len() - 1]);
    for (class, _, of) in BOUNDS {
        polar.panel.polygon(class, bounds.iter().map(|heading| towards(heading.heading_deg, of(heading))));
    }
    polar.rings(&rings);
    for set in 0..limits.headings.first().map_or(0, |heading| heading.sets.len()) {
        polar.panel.group(&format!("class=\"{}\"", class_of_set(set)), |panel| draw_set(panel, &limits.headings, set));
    }
    polar.names(&rings);
    polar.panel
}

fn draw_set(panel: &mut Panel, headings: &[Heading], set: usize) {
    let at = |of: fn(&SetLimit) -> f64| move |heading: &Heading| towards(heading.heading_deg, of(&heading.sets[set]));
    let middle = at(|limit| limit.impulse50_n_s);
    if headings.len() >= JOINED {
        panel.polygon("outline", headings.iter().map(middle));
    }
    for heading in headings {
        panel.line("interval", at(|limit| limit.ci95[0])(heading), at(|limit| limit.ci95[1])(heading));
    }
    for heading in headings {
        let SetLimit { name, impulse50_n_s: most, ci95: [low, high], resolved, .. } = &heading.sets[set];
        let words = format!("{name}, {}\u{b0}: {most:.2} N s ({low:.2} to {high:.2})", heading.heading_deg);
        panel.told(&words, |panel| panel.circle(if *resolved { "" } else { "hollow" }, middle(heading), 4.0));
    }
}

fn legend(limits: &Limits) -> Vec<Row> {
    let sets = || limits.headings.iter().flat_map(|heading| &heading.sets);
    let names =
        limits.headings.iter().take(1).flat_map(|heading| &heading.sets).map(|set| set.name.clone()).enumerate();
    let mut rows: Vec<Row> = names.map(|(i, name)| (class_of_set(i), Sample::DottedLine(""), name)).collect();
    let mut note = |words: &str| rows.push((String::new(), Sample::Nothing, words.into()));
    note("dot: 50 % recover; bar: 95 %");
    if sets().any(|set| !set.resolved) {
        note("hollow: not precise enough");
    }
    note("A pendulum stays up with");
    rows.extend(BOUNDS.map(|(class, words, _)| (class.into(), Sample::Area, words.into())));
    rows.push((String::new(), Sample::Nothing, "read from the middle along a heading".into()));
    rows
}
