//! Success over impulse: each gain set's rates by bin with their intervals, and the impulses of 50 % and 90 %.

use super::svg::{Scale, colors, escape, px, short};
use super::value::list;
use serde_json::Value;
use std::fmt::Write;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 380.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 62.0;
/// More sets than this have bars in place of bands, which would hide each other.
const MOST_BANDS: usize = 4;

/// The picture of all sets. None: there are no bins of impulse.
pub(super) fn draw(summary: &Value) -> Option<String> {
    let sets = list(&summary["sets"]);
    let bins = || sets.iter().flat_map(|set| list(&set["by_impulse"]));
    let edge = |key: &'static str| bins().filter_map(move |bin| bin[key].as_f64());
    let (from, to) = (edge("from_n_s").reduce(f64::min)?, edge("to_n_s").reduce(f64::max)?);
    // A fitted curve runs over the range of the impulses, which the outer bins may exceed.
    let fitted_at = || sets.iter().flat_map(fitted).map(|(x, ..)| x);
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
    Some(svg + "</svg>")
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

    fn set(&self, svg: &mut String, set: &Value, as_band: bool) {
        let bins: Vec<(f64, f64, [f64; 2], String)> =
            list(&set["by_impulse"]).iter().filter_map(|of| bin(of, self.pushes)).collect();
        if bins.is_empty() {
            return;
        }
        let place = |(x, y): (f64, f64)| format!("{} {}", self.x(x), self.y(y));
        let joined = |points: Vec<(f64, f64)>| points.into_iter().map(place).collect::<Vec<_>>().join("L");
        // Without a fitted curve, straight lines join the rates.
        let mut curve = fitted(set);
        let is_fitted = !curve.is_empty();
        if !is_fitted {
            curve = bins.iter().map(|(x, rate, ci, _)| (*x, *rate, *ci)).collect();
        }
        if as_band {
            let low = curve.iter().map(|(x, _, ci)| (*x, ci[0]));
            let high = curve.iter().rev().map(|(x, _, ci)| (*x, ci[1]));
            _ = write!(svg, "<path class=\"band\" d=\"M{}z\"/>", joined(low.chain(high).collect()));
        }
        _ = write!(svg, "<path class=\"line\" d=\"M{}\"/>", joined(curve.iter().map(|(x, y, _)| (*x, *y)).collect()));
        for (x, rate, ci, words) in &bins {
            if !as_band && !is_fitted {
                _ = write!(svg, "<path class=\"ci\" d=\"M{}V{}\"/>", place((*x, ci[0])), self.y(ci[1]));
            }
            let (x, y) = (self.x(*x), self.y(*rate));
            _ = write!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"4\"><title>{}</title></circle>", escape(words));
        }
        for (share, key) in [(0.5, "impulse50"), (0.9, "impulse90")] {
            self.limit(svg, set, share, key);
        }
    }

    /// The impulse at which a share of the trials recovers, with its interval.
    fn limit(&self, svg: &mut String, set: &Value, share: f64, key: &str) {
        let limit = &set["curve"][key];
        let Some(at) = limit["at"].as_f64() else { return };
        let (x, y) = (self.x(at), self.y(share));
        // An end may be beyond the pushes: then the line runs to the edge.
        let ends = (limit["ci95"][0].as_f64(), limit["ci95"][1].as_f64());
        if limit["ci95"].is_array() {
            let (low, high) = (self.x(ends.0.unwrap_or(self.from)), self.x(ends.1.unwrap_or(self.to)));
            _ = write!(svg, "<path class=\"limit\" d=\"M{low} {y}H{high}\"/>");
        }
        let name = set["name"].as_str().unwrap_or_default();
        let interval = match ends {
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

/// Middle (N s) of the part of a bin that has pushes, rate and interval, and what it says.
fn bin(bin: &Value, [least, most]: [f64; 2]) -> Option<(f64, f64, [f64; 2], String)> {
    let (from, to) = (bin["from_n_s"].as_f64()?, bin["to_n_s"].as_f64()?);
    let (rate, ci) = (bin["success_rate"].as_f64()?, [bin["ci95"][0].as_f64()?, bin["ci95"][1].as_f64()?]);
    let words = format!(
        "{} to {} N s: {} of {} recovered, {:.1} % ({:.1} to {:.1} %)",
        short(from, 3),
        short(to, 3),
        bin["recovered"],
        bin["trials"],
        100.0 * rate,
        100.0 * ci[0],
        100.0 * ci[1]
    );
    Some(((from.max(least) + to.min(most)) / 2.0, rate, ci, words))
}

/// Points of the fitted curve: impulse (N s), chance and its interval.
fn fitted(set: &Value) -> Vec<(f64, f64, [f64; 2])> {
    let number = |value: &Value| value.as_f64();
    let point =
        |p: &Value| Some((number(&p["x"])?, number(&p["chance"])?, [number(&p["ci95"][0])?, number(&p["ci95"][1])?]));
    list(&set["curve"]["points"]).iter().filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_rate_stands_where_its_pushes_are() {
        let of = json!({ "from_n_s": 5.0, "to_n_s": 6.0, "success_rate": 0.5, "ci95": [0.4, 0.6] });
        assert_eq!(bin(&of, [0.5, 5.5]).unwrap().0, 5.25);
        assert_eq!(bin(&of, [0.5, 7.0]).unwrap().0, 5.5);
    }
}
