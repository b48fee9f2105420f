//! A chart of success over impulse: each controller's rates by bin, the curve that was fitted to its trials, and the
//! impulses of 50 % and 90 % on it. `success.svg` and the report show the same chart.

use super::axes::Axis;
use super::panel::{LegendRow, LegendSample, Panel, short};
use super::{COLORS, class_of_controller};
use standfast_core::error::Result;
use standfast_stats::curve::Level;
use standfast_study::Summary;
use standfast_study::verdict::controller_summary::{ControllerSummary, ImpulseBin};
use std::path::Path;

/// Largest number of controllers with bands. More bands would hide each other.
const MOST_BANDS: usize = 4;
/// Distance between the error bars of two controllers (px), and the largest share of a bin that all error bars take
/// together.
const BAR_SPACING_PX: f64 = 6.0;
const OF_BIN: f64 = 0.6;
/// Largest number of letters of a name in the legend.
const LETTERS: usize = 40;
/// Left and right edge of the chart (px).
const LEFT: f64 = 64.0;
const RIGHT: f64 = 736.0;

/// Writes the chart with a legend. Fails if the file cannot be written.
pub fn write(path: &Path, summary: &Summary) -> Result<()> {
    let most = if are_of_different_trials(&summary.controllers) {
        "up to "
    } else {
        ""
    };
    let heading = format!(
        "Recovered over impulse: {most}{} trials of campaign {}",
        summary.trials, summary.name
    );
    super::write(
        path,
        &heading,
        &[
            chart(&summary.controllers),
            Panel::of_legend(&legend(&summary.controllers)),
        ],
        2,
    )
}

/// The chart alone. The elements of a controller are a group with the number of the controller as `data-set`.
pub fn chart(controllers: &[ControllerSummary]) -> Panel {
    let edges = impulse_edges_n_s(controllers);
    let ends = [
        edges.first().map_or(0.0, |edge| *edge),
        edges.last().map_or(1.0, |edge| *edge),
    ];
    // A fitted curve runs over the range of the impulses, which the outer bins may exceed.
    let fitted_at = || {
        controllers
            .iter()
            .flat_map(|controller| &controller.curve.points)
            .map(|point| point.x)
    };
    let pushes = [
        fitted_at().reduce(f64::min).unwrap_or(ends[0]),
        fitted_at().reduce(f64::max).unwrap_or(ends[1]),
    ];
    let mut panel = Panel::new(760.0, 380.0);
    panel.class = "fig curve";
    let ticks = [0.0, 25.0, 50.0, 75.0, 100.0]
        .map(|percent| (percent / 100.0, format!("{percent} %")))
        .into();
    let rates = Axis {
        name: "recovered".into(),
        ends: [0.0, 1.0],
        ticks,
    };
    panel.axes(
        [LEFT, 14.0, RIGHT, 326.0],
        &Axis::new("impulse of the push [N s]", ends),
        &rates,
    );
    let n_s_per_px = (ends[1] - ends[0]) / (RIGHT - LEFT);
    let bins = edges.len().saturating_sub(1).max(1) as f64;
    let apart = BAR_SPACING_PX
        .min(OF_BIN * (RIGHT - LEFT) / bins / controllers.len().max(1) as f64)
        * n_s_per_px;
    for (i, controller) in controllers.iter().enumerate() {
        let beside = apart * (i as f64 - 0.5 * (controllers.len() - 1) as f64);
        let series = Series {
            controller,
            pushes,
            ends,
            beside,
            dot: dot(i),
            has_band: controllers.len() <= MOST_BANDS,
        };
        panel.group(
            &format!("class=\"{}\" data-set=\"{i}\"", class_of_controller(i)),
            |panel| series.draw(panel),
        );
    }
    panel
}

/// The elements of a controller.
struct Series<'a> {
    controller: &'a ControllerSummary,
    /// Smallest and largest impulse of the pushes, as far as they are known, and ends of the axis (N s).
    pushes: [f64; 2],
    ends: [f64; 2],
    /// Offset of error bars from the middle of their bin (N s).
    beside: f64,
    dot: &'static str,
    has_band: bool,
}

impl Series<'_> {
    fn draw(&self, panel: &mut Panel) {
        let curve = &self.controller.curve.points;
        let bins: Vec<&ImpulseBin> = self
            .controller
            .by_impulse
            .iter()
            .filter(|bin| bin.count.trials > 0)
            .collect();
        let beside = if curve.is_empty() { self.beside } else { 0.0 };
        let at = |bin: &ImpulseBin| {
            [
                middle_n_s(bin, self.pushes) + beside,
                bin.count.success_rate,
            ]
        };
        if curve.is_empty() {
            // Straight lines join the rates.
            panel.polyline("", bins.iter().copied().map(at));
            for bin in &bins {
                panel.error_bar("interval", at(bin)[0], bin.count.ci95);
            }
        } else {
            let (low, high) = (
                curve.iter().map(|p| [p.x, p.ci95[0]]),
                curve.iter().rev().map(|p| [p.x, p.ci95[1]]),
            );
            if self.has_band {
                panel.polygon("range", low.chain(high));
            }
            panel.polyline("", curve.iter().map(|p| [p.x, p.chance]));
        }
        for bin in bins {
            panel.told(&words(bin), |panel| panel.circle(self.dot, at(bin), 4.0));
        }
        let fit = self.controller.curve.fit.as_ref();
        self.level(panel, 0.5, fit.and_then(|fit| fit.impulse50));
        self.level(panel, 0.9, fit.and_then(|fit| fit.impulse90));
    }

    /// The impulse at which a share of the trials recovers, with its interval.
    fn level(&self, panel: &mut Panel, share: f64, level: Option<Level>) {
        let Some(Level {
            at,
            ci95: [low, high],
        }) = level
        else {
            return;
        };
        // An end that is not known lies beyond the pushes, so the line runs to the edge.
        let [from, to] = self.ends;
        panel.line(
            "level",
            [low.unwrap_or(from).max(from), share],
            [high.unwrap_or(to).min(to), share],
        );
        let interval = match (low, high) {
            (Some(low), Some(high)) => format!(" (95 %: {low:.2} to {high:.2})"),
            _ => String::new(),
        };
        let words = format!(
            "{}: {} % recover at {at:.2} N s{interval}",
            self.controller.name,
            short(100.0 * share, 0)
        );
        panel.told(&words, |panel| {
            panel.diamond("hollow", [at.clamp(from, to), share], 6.0)
        });
    }
}

/// Class of the dots of a controller. They are hollow if an earlier controller has the same colour.
fn dot(controller: usize) -> &'static str {
    if controller < COLORS { "dot" } else { "hollow" }
}

/// The legend: the colour of each controller with its rate over all impulses, and the meaning of the marks.
fn legend(controllers: &[ControllerSummary]) -> Vec<LegendRow> {
    let mut rows = Vec::new();
    for (i, controller) in controllers.iter().enumerate() {
        let name = match controller.name.char_indices().nth(LETTERS) {
            Some((end, _)) => format!("{}...", &controller.name[..end]),
            None => controller.name.clone(),
        };
        let of_trials = if are_of_different_trials(controllers) {
            format!(" of {}", controller.count.trials)
        } else {
            String::new()
        };
        rows.push((
            class_of_controller(i),
            LegendSample::DottedLine(dot(i)),
            format!(
                "{name}: {:.1} %{of_trials}",
                100.0 * controller.count.success_rate
            ),
        ));
    }
    let is_fitted = |controller: &ControllerSummary| !controller.curve.points.is_empty();
    let (some, all) = (
        controllers.iter().any(is_fitted),
        controllers.iter().all(is_fitted),
    );
    let notes = [
        (true, "dots: share by bin of impulse"),
        (
            some && controllers.len() <= MOST_BANDS,
            "bands: 95 % of the curves",
        ),
        (some, "diamonds: where 50 %, 90 % recover"),
        (!all, "bars: 95 % of the dots"),
    ];
    for (is_seen, words) in notes {
        if is_seen {
            rows.push((String::new(), LegendSample::Nothing, words.into()));
        }
    }
    rows
}

/// Whether some of the controllers have fewer trials than others.
fn are_of_different_trials(controllers: &[ControllerSummary]) -> bool {
    controllers
        .iter()
        .any(|controller| controller.count.trials != controllers[0].count.trials)
}

/// Middle (N s) of the part of a bin that has pushes.
fn middle_n_s(bin: &ImpulseBin, [least, most]: [f64; 2]) -> f64 {
    (bin.from_n_s.max(least) + bin.to_n_s.min(most)) / 2.0
}

fn words(bin: &ImpulseBin) -> String {
    let [rate, low, high] =
        [bin.count.success_rate, bin.count.ci95[0], bin.count.ci95[1]].map(|share| 100.0 * share);
    let ([from, to], count) = (
        [bin.from_n_s, bin.to_n_s].map(|edge| short(edge, 3)),
        bin.count,
    );
    format!(
        "{from} to {to} N s: {} of {} recovered, {rate:.1} % ({low:.1} to {high:.1} %)",
        count.recovered, count.trials
    )
}

/// Edges of the bins of impulse (N s), in ascending order.
pub fn impulse_edges_n_s(controllers: &[ControllerSummary]) -> Vec<f64> {
    let bins = controllers
        .iter()
        .flat_map(|controller| &controller.by_impulse);
    let mut edges_n_s: Vec<f64> = bins.flat_map(|bin| [bin.from_n_s, bin.to_n_s]).collect();
    edges_n_s.sort_by(f64::total_cmp);
    edges_n_s.dedup();
    edges_n_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{ragged, summary};
    use standfast_sim::episode::Outcome::{Fell, Recovered};
    use standfast_stats::rate::SuccessCount;
    use standfast_study::verdict::controller_summary::FittedCurve;

    #[test]
    fn a_rate_stands_where_its_pushes_are() {
        let bin = ImpulseBin {
            from_n_s: 5.0,
            to_n_s: 6.0,
            count: SuccessCount::new(1, 2),
        };
        assert_eq!(middle_n_s(&bin, [0.5, 5.5]), 5.25);
        assert_eq!(middle_n_s(&bin, [0.5, 7.0]), 5.5);
    }

    #[test]
    fn a_controller_that_was_stopped_has_no_dots_where_it_has_no_trials() {
        let controllers = ragged(&[]).0.controllers;
        let told = |svg: &str, controller: &ControllerSummary| {
            controller
                .by_impulse
                .iter()
                .filter(|bin| svg.contains(&words(bin)))
                .count()
        };
        let svg = chart(&controllers[1..2]).svg("");
        assert_eq!(
            (controllers[1].by_impulse.len(), told(&svg, &controllers[1])),
            (controllers[0].by_impulse.len(), 2)
        );
        assert!(
            legend(&controllers)
                .iter()
                .any(|(_, _, words)| words == "b: 20.0 % of 25")
        );
    }

    /// Only a fitted curve has a band. Without one, each bin has an error bar.
    #[test]
    fn only_fitted_curves_have_bands() {
        let mut controllers = summary(
            &[
                [Recovered, Recovered],
                [Recovered, Fell],
                [Fell, Recovered],
                [Fell, Fell],
            ],
            &[],
            &[],
        )
        .controllers;
        let found = |controllers: &[ControllerSummary]| {
            let svg = chart(controllers).svg("");
            ["class=\"range\"", "class=\"interval\""].map(|class| svg.matches(class).count())
        };
        assert_eq!(found(&controllers), [2, 0]);
        controllers[1].curve = FittedCurve {
            fit: None,
            none_because: None,
            points: Vec::new(),
        };
        assert_eq!(found(&controllers), [1, controllers[1].by_impulse.len()]);
    }
}
