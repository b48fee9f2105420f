//! The picture of `standfast limit`: the largest recoverable impulses by heading, over the pendulum bounds.

use super::axes::AxisScale;
use super::class_of_controller;
use super::panel::{LegendRow, LegendSample, Panel};
use super::polar::{Polar, towards};
use standfast_core::error::Result;
use standfast_study::limit::{ControllerLimit, Heading, Limits};
use std::path::Path;

/// Radius of the outermost ring (px).
const RADIUS: f64 = 265.0;
/// Angle between the points of the curves of the bounds (degrees).
const BOUND_EVERY_DEG: usize = 3;
/// A bound: class in `figure.css`, name in the legend, and impulse (N s) if it is known.
type BoundCurve = (&'static str, &'static str, fn(&Heading) -> Option<f64>);
/// The bounds in the order in which they are drawn on top of each other.
const BOUNDS: [BoundCurve; 4] = [
    (
        "bound early",
        "any number, farther and earlier",
        |heading| heading.bound_early_n_s,
    ),
    (
        "bound many",
        "any number of footsteps, or none",
        |heading| heading.bound_n_step_n_s,
    ),
    ("bound one", "at most one footstep", |heading| {
        heading.bound_one_step_n_s
    }),
    ("bound none", "no footstep", |heading| {
        Some(heading.bound_no_step_n_s)
    }),
];
/// Half the width of the marks of the impulses up to which nothing was lost (degrees).
const SAFE_MARK_HALF_DEG: f64 = 2.5;
/// Least number of headings whose points are joined. With fewer, a line would claim too much about the headings in
/// between.
const JOINED: usize = 8;

/// Draws bounds and controllers. Fails if the solver gives up on a bound, or if the
/// file cannot be written.
pub fn write(path: &Path, limits: &Limits) -> Result<()> {
    let Limits {
        robot, campaign, ..
    } = limits;
    let heading = format!("Largest recoverable impulse by heading: {robot}, campaign {campaign}");
    super::write(
        path,
        &heading,
        &[panel(limits), Panel::of_legend(&legend(limits))],
        2,
    )
}

/// The limits of all controllers at all headings.
fn all(limits: &Limits) -> impl Iterator<Item = &ControllerLimit> {
    limits
        .headings
        .iter()
        .flat_map(|heading| &heading.controllers)
}

/// The picture without its legend.
pub fn panel(limits: &Limits) -> Panel {
    map(limits, &bounds(limits))
}

/// The pendulum bounds all around.
fn bounds(limits: &Limits) -> Vec<Heading> {
    let headings = (0..360).step_by(BOUND_EVERY_DEG);
    headings
        .map(|deg| limits.pendulum_bounds.heading(deg as f64))
        .collect()
}

fn map(limits: &Limits, bounds: &[Heading]) -> Panel {
    let limits_n_s = all(limits).map(|controller| controller.ci95[1]);
    let bounds_n_s = bounds
        .iter()
        .flat_map(|heading| BOUNDS.map(|(.., impulse_n_s)| impulse_n_s(heading)))
        .flatten();
    let ticks = AxisScale {
        from: 0.0,
        to: limits_n_s.chain(bounds_n_s).fold(0.1, f64::max),
    }
    .ticks();
    // The last ring lies beyond all values.
    let step = ticks[1] - ticks[0];
    let rings: Vec<f64> = (1..=ticks.len()).map(|i| step * i as f64).collect();
    let mut polar = Polar::new(RADIUS, rings[rings.len() - 1]);
    for (class, _, impulse_n_s) in BOUNDS {
        polar.panel.polygon(
            class,
            bounds
                .iter()
                .filter_map(|heading| Some(towards(heading.heading_deg, impulse_n_s(heading)?))),
        );
    }
    polar.rings(&rings);
    for controller in 0..limits
        .headings
        .first()
        .map_or(0, |heading| heading.controllers.len())
    {
        let class = format!("class=\"{}\"", class_of_controller(controller));
        polar.panel.group(&class, |panel| {
            draw_controller(panel, &limits.headings, controller)
        });
    }
    polar.names(&rings);
    polar.panel
}

/// Draws the limits of a controller: dots and a line.
fn draw_controller(panel: &mut Panel, headings: &[Heading], controller: usize) {
    let middle = |heading: &Heading| {
        towards(
            heading.heading_deg,
            heading.controllers[controller].impulse50_n_s,
        )
    };
    if headings.len() >= JOINED {
        panel.polygon("outline", headings.iter().map(middle));
    }
    for heading in headings {
        let [low, high] = heading.controllers[controller]
            .ci95
            .map(|impulse_n_s| towards(heading.heading_deg, impulse_n_s));
        panel.line("interval", low, high);
    }
    for heading in headings {
        let ControllerLimit {
            name,
            impulse50_n_s: most,
            ci95: [low, high],
            resolved,
            ..
        } = &heading.controllers[controller];
        let words = format!(
            "{name}, {}\u{b0}: {most:.2} N s ({low:.2} to {high:.2})",
            heading.heading_deg
        );
        if let Some(safe_n_s) = heading.controllers[controller].safe_n_s {
            let [from, to] = [-SAFE_MARK_HALF_DEG, SAFE_MARK_HALF_DEG]
                .map(|turn| towards(heading.heading_deg + turn, safe_n_s));
            let words = format!(
                "{name}, {}\u{b0}: nothing lost up to {safe_n_s:.2} N s",
                heading.heading_deg
            );
            panel.told(&words, |panel| panel.line("interval safe", from, to));
        }
        let class = if *resolved { "" } else { "hollow" };
        panel.told(&words, |panel| panel.circle(class, middle(heading), 4.0));
    }
}

fn legend(limits: &Limits) -> Vec<LegendRow> {
    let mut rows: Vec<LegendRow> = Vec::new();
    for heading in limits.headings.iter().take(1) {
        for (i, controller) in heading.controllers.iter().enumerate() {
            let sample = LegendSample::DottedLine("");
            rows.push((class_of_controller(i), sample, controller.name.clone()));
        }
    }
    let mut note = |words: &str| rows.push((String::new(), LegendSample::Nothing, words.into()));
    let engines: Vec<&str> = limits.engines.iter().map(|of| &of.engine[..]).collect();
    note(&format!("simulated by {}", engines.join(", ")));
    note("dot: 50 % recover; bar: 95 %");
    if all(limits).any(|controller| controller.safe_n_s.is_some()) {
        note("line across: nothing lost up to there");
    }
    if all(limits).any(|controller| !controller.resolved) {
        note("hollow: not precise enough");
    }
    note("Pendulum bounds: a pendulum stays up with");
    rows.extend(BOUNDS.map(|(class, words, _)| (class.into(), LegendSample::Area, words.into())));
    rows.push((
        String::new(),
        LegendSample::Nothing,
        "read from the middle along a heading".into(),
    ));
    rows
}
