//! Small pictures that stand in a table, and what all pictures share. Lengths are percent of the cell, so that they fit
//! a phone as well as a page.

use super::super::plot::COLORS;
use minijinja::HtmlEscape;
use std::fmt::Write;

/// What is drawn from the left end of a picture to its right end.
#[derive(Debug, Clone, Copy)]
pub(in crate::render) struct Scale {
    pub from: f64,
    pub to: f64,
}

impl Scale {
    /// Place from the left (%), within the picture.
    fn at(self, x: f64) -> f64 {
        let width = (self.to - self.from).max(f64::MIN_POSITIVE);
        (100.0 * (x - self.from) / width).clamp(0.0, 100.0)
    }

    /// Three to eight round values.
    pub fn ticks(self) -> Vec<f64> {
        let span = self.to - self.from;
        if !(span.is_finite() && span > 0.0) {
            return vec![self.from];
        }
        let decade = 10f64.powf((span / 4.0).log10().floor());
        let step = [5.0, 2.0, 1.0].map(|m| m * decade).into_iter().find(|s| span / s >= 2.9).unwrap_or(decade);
        let (first, last) = ((self.from / step - 1e-9).ceil() as i64, (self.to / step + 1e-9).floor() as i64);
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

/// Text for the inside of an element or of an attribute in quotes.
pub(in crate::render) fn escape(text: &str) -> impl std::fmt::Display {
    HtmlEscape(text)
}

/// A number with at most `digits` behind the point and a real minus.
pub(in crate::render) fn short(x: f64, digits: usize) -> String {
    let text = format!("{x:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.replace('-', "\u{2212}") }
}

/// A place in a picture: one digit behind the point.
pub(in crate::render) fn px(x: f64) -> String {
    let text = format!("{x:.1}");
    text.strip_suffix(".0").unwrap_or(&text).into()
}

/// A dot with its interval; `mark`: a line across, at what is required, say.
pub(super) fn whisker(scale: Scale, at: Option<f64>, ci: Option<[f64; 2]>, mark: Option<f64>, class: &str) -> String {
    let mut svg = format!("<svg class=\"whisker {}\" aria-hidden=\"true\">", escape(class));
    // Writing to a String cannot fail.
    for tick in scale.ticks() {
        let zero = if tick.abs() < 1e-9 && scale.from < 0.0 { " class=\"zero\"" } else { "" };
        let x = px(scale.at(tick));
        _ = write!(svg, "<line{zero} x1=\"{x}%\" x2=\"{x}%\" y1=\"0\" y2=\"100%\"/>");
    }
    if let Some(mark) = mark {
        let x = px(scale.at(mark));
        _ = write!(svg, "<line class=\"mark\" x1=\"{x}%\" x2=\"{x}%\" y1=\"0\" y2=\"100%\"/>");
    }
    if let Some([low, high]) = ci {
        let (low, high) = (px(scale.at(low)), px(scale.at(high)));
        _ = write!(svg, "<line class=\"ci\" x1=\"{low}%\" x2=\"{high}%\" y1=\"50%\" y2=\"50%\"/>");
    }
    if let Some(at) = at {
        _ = write!(svg, "<circle cx=\"{}%\" cy=\"50%\" r=\"4\"/>", px(scale.at(at)));
    }
    svg + "</svg>"
}

/// Ticks and their numbers, to stand above whiskers of the same scale. `unit` "%" takes shares.
pub(super) fn axis(scale: Scale, unit: &str) -> String {
    let mut svg = String::from("<svg class=\"axis\" aria-hidden=\"true\">");
    let ticks = scale.ticks();
    let last = ticks.len().saturating_sub(1);
    for (i, tick) in ticks.into_iter().enumerate() {
        let text = if unit == "%" { short(100.0 * tick, 1) } else { short(tick, 3) };
        let unit = if i == last { format!(" {}", escape(unit)) } else { String::new() };
        _ = write!(svg, "<text x=\"{}%\" y=\"12\">{text}{unit}</text>", px(scale.at(tick)));
    }
    svg + "</svg>"
}

/// Parts of a whole side by side: (class, share, what it says); the bar is as wide as `to`.
pub(super) fn share_bar(parts: &[(String, f64, String)], to: f64) -> String {
    let mut svg = String::from("<svg class=\"bar\" aria-hidden=\"true\">");
    let scale = Scale { from: 0.0, to };
    let mut from = 0.0;
    for (class, share, words) in parts.iter().filter(|(_, share, _)| *share > 0.0) {
        let (x, width) = (scale.at(from), scale.at(from + share) - scale.at(from));
        _ = write!(
            svg,
            "<rect class=\"{}\" x=\"{x:.2}%\" width=\"{width:.2}%\" y=\"2\" height=\"16\"><title>{}</title></rect>",
            escape(class),
            escape(words)
        );
        from += share;
    }
    svg + "</svg>"
}

/// How many colours there are before they come again.
pub(super) fn colors() -> usize {
    COLORS.len()
}

/// The colours of gain sets as CSS, and lighter ones for a dark page.
pub(super) fn palette() -> String {
    let lit = |c: u8, light: f64| (f64::from(c) + light * (255.0 - f64::from(c))).round() as u8;
    let rules = |light: f64| -> String {
        let rule = |(i, c): (usize, &plotters::style::RGBColor)| {
            format!(".s{i}{{--c:#{:02x}{:02x}{:02x}}}", lit(c.0, light), lit(c.1, light), lit(c.2, light))
        };
        COLORS.iter().enumerate().map(rule).collect()
    };
    format!("{}@media screen and (prefers-color-scheme:dark){{{}}}", rules(0.0), rules(0.3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let ticks = |from, to| Scale { from, to }.ticks();
        assert_eq!(ticks(0.0, 1.0), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert_eq!(ticks(-0.5, 0.5), [-0.4, -0.2, 0.0, 0.2, 0.4]);
        assert_eq!(ticks(1.0, 1.0), [1.0]);
        for half in [0.05, 0.15, 0.3, 0.35, 2.5, 7.0] {
            let n = ticks(-half, half).len();
            assert!((3..=11).contains(&n), "{half}: {n} ticks");
        }
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            (short(-2.50, 2), short(-0.001, 2), short(100.0, 1)),
            ("\u{2212}2.5".into(), "0".into(), "100".into())
        );
        assert_eq!((px(12.04), px(-3.0)), ("12".into(), "-3".into()));
    }
}
