//! Success over impulse: each gain set's rates by bin with their intervals, and the impulses of 50 % and 90 %.

use super::svg::{Scale, colors, escape, px, short};
use crate::campaign::verdict::set_summary::{ImpulseBin, SetSummary};
use crate::stats::curve::{Level, SuccessCurve};
use crate::stats::rate::SuccessCount;
use std::fmt::Write;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 380.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 62.0;
/// More sets than this have bars in place of bands, which would hide each other.
const MOST_BANDS: usize = 4;

/// The picture of all sets.
pub(super) fn draw(sets: &[SetSummary]) -> String {
    let edges = impulse_edges_n_s(sets);
    let (from, to) = (edges.first().map_or(0.0, |edge| *edge), edges.last().map_or(1.0, |edge| *edge));
    // A fitted curve runs over the range of the impulses, which the outer bins may exceed.
    let fitted_at = || sets.iter().flat_map(|set| &set.curve.points).map(|point| point.x);
    let pushes = [fitted_at().reduce(f64::min).unwrap_or(from), fitted_at().reduce(f64::max).unwrap_or(to)];
    let area = Area { from, to, pushes };
    let mut svg = format!(
        "<svg class=\"curve\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Success rate over impulse\">"
    );
    area.frame(&mut svg);
    for (i, set) in sets.iter().enumerate() {
        let again = if i >= colors() { " again" } else { "" };
        _ = write!(svg, "<g class=\"s{}{again}\" data-set=\"{i}\">", i % colors());
        area.set(&mut svg, set, sets.len() <= MOST_BANDS);
        svg += "</g>";
    }
    svg + "</svg>"
}

/// The rectangle in which curves are: impulses (N s) by shares.
struct Area {
    from: f64,
    to: f64,
    /// Least and greatest impulse, as far as they are known.
    pushes: [f64; 2],
}

impl Area {
    fn x(&self, impulse_n_s: f64) -> String {
        let share = ((impulse_n_s - self.from) / (self.to - self.from).max(1e-9)).clamp(0.0, 1.0);
        px(LEFT + share * (WIDTH - LEFT - RIGHT))
    }

    fn y(&self, share: f64) -> String {
        px(HEIGHT - BOTTOM - share.clamp(0.0, 1.0) * (HEIGHT - TOP - BOTTOM))
    }

    fn frame(&self, svg: &mut String) {
        *svg += "<g class=\"frame\">";
        let (left, right) = (self.x(self.from), self.x(self.to));
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let y = self.y(share);
            // Writing to a String cannot fail.
            _ = write!(svg, "<path d=\"M{left} {y}H{right}\"/>");
        }
        *svg += "</g><g class=\"names\">";
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            _ = write!(
                svg,
                "<text class=\"end\" x=\"{}\" y=\"{}\" dy=\".35em\">{} %</text>",
                LEFT - 8.0,
                self.y(share),
                short(100.0 * share, 0)
            );
        }
        for tick in (Scale { from: self.from, to: self.to }).ticks() {
            _ = write!(svg, "<text x=\"{}\" y=\"{}\">{}</text>", self.x(tick), HEIGHT - BOTTOM + 22.0, short(tick, 3));
        }
        let middle = (LEFT + WIDTH - RIGHT) / 2.0;
        _ = write!(svg, "<text x=\"{middle}\" y=\"{}\">impulse of the push [N s]</text></g>", HEIGHT - 8.0);
    }

    fn set(&self, svg: &mut String, set: &SetSummary, as_band: bool) {
        let at = |bin: &ImpulseBin| middle_n_s(bin, self.pushes);
        let place = |(x, y): (f64, f64)| format!("{} {}", self.x(x), self.y(y));
        let joined = |points: Vec<(f64, f64)>| points.into_iter().map(place).collect::<Vec<_>>().join("L");
        // Without a fitted curve, straight lines join the rates.
        let is_fitted = !set.curve.points.is_empty();
        let curve: Vec<(f64, f64, [f64; 2])> = if is_fitted {
            set.curve.points.iter().map(|point| (point.x, point.chance, point.ci95)).collect()
        } else {
            set.by_impulse.iter().map(|bin| (at(bin), bin.count.success_rate, bin.count.ci95)).collect()
        };
        if as_band {
            let low = curve.iter().map(|(x, _, ci)| (*x, ci[0]));
            let high = curve.iter().rev().map(|(x, _, ci)| (*x, ci[1]));
            _ = write!(svg, "<path class=\"band\" d=\"M{}z\"/>", joined(low.chain(high).collect()));
        }
        _ = write!(svg, "<path class=\"line\" d=\"M{}\"/>", joined(curve.iter().map(|(x, y, _)| (*x, *y)).collect()));
        for bin in &set.by_impulse {
            let (x, SuccessCount { success_rate, ci95, .. }) = (at(bin), bin.count);
            if !as_band && !is_fitted {
                _ = write!(svg, "<path class=\"ci\" d=\"M{}V{}\"/>", place((x, ci95[0])), self.y(ci95[1]));
            }
            let (x, y, words) = (self.x(x), self.y(success_rate), words(bin));
            _ = write!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"4\"><title>{}</title></circle>", escape(&words));
        }
        let level = |of: fn(&SuccessCurve) -> Option<Level>| set.curve.fit.as_ref().and_then(of);
        for (share, level) in [(0.5, level(|fit| fit.impulse50)), (0.9, level(|fit| fit.impulse90))] {
            if let Some(level) = level {
                self.limit(svg, &set.name, share, level);
            }
        }
    }

    /// The impulse at which a share of the trials recovers, with its interval.
    fn limit(&self, svg: &mut String, name: &str, share: f64, Level { at, ci95: [low, high] }: Level) {
        let (x, y) = (self.x(at), self.y(share));
        // An end may be beyond the pushes: then the line runs to the edge.
        let ends = [self.x(low.unwrap_or(self.from)), self.x(high.unwrap_or(self.to))];
        _ = write!(svg, "<path class=\"limit\" d=\"M{} {y}H{}\"/>", ends[0], ends[1]);
        let interval = match (low, high) {
            (Some(low), Some(high)) => format!(" (95 %: {low:.2} to {high:.2})"),
            _ => String::new(),
        };
        let words = format!("{name}: {} % recover at {at:.2} N s{interval}", short(100.0 * share, 0));
        _ = write!(
            svg,
            "<path class=\"diamond\" transform=\"translate({x} {y})\" d=\"M0-6L6 0 0 6-6 0z\"><title>{}</title></path>",
            escape(&words)
        );
    }
}

/// Middle (N s) of the part of a bin that has pushes.
fn middle_n_s(bin: &ImpulseBin, [least, most]: [f64; 2]) -> f64 {
    (bin.from_n_s.max(least) + bin.to_n_s.min(most)) / 2.0
}

/// What a bin says.
fn words(bin: &ImpulseBin) -> String {
    let [rate, low, high] = [bin.count.success_rate, bin.count.ci95[0], bin.count.ci95[1]].map(|share| 100.0 * share);
    let ([from, to], count) = ([bin.from_n_s, bin.to_n_s].map(|edge| short(edge, 3)), bin.count);
    format!(
        "{from} to {to} N s: {} of {} recovered, {rate:.1} % ({low:.1} to {high:.1} %)",
        count.recovered, count.trials
    )
}

/// Where bins of impulse begin and end (N s), ascending.
pub fn impulse_edges_n_s(sets: &[SetSummary]) -> Vec<f64> {
    let bins = sets.iter().flat_map(|set| &set.by_impulse);
    let mut edges_n_s: Vec<f64> = bins.flat_map(|bin| [bin.from_n_s, bin.to_n_s]).collect();
    edges_n_s.sort_by(f64::total_cmp);
    edges_n_s.dedup();
    edges_n_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_stands_where_its_pushes_are() {
        let bin = ImpulseBin { from_n_s: 5.0, to_n_s: 6.0, count: SuccessCount::new(1, 2) };
        assert_eq!(middle_n_s(&bin, [0.5, 5.5]), 5.25);
        assert_eq!(middle_n_s(&bin, [0.5, 7.0]), 5.5);
    }
}
