//! Small pictures in the cells of tables. Their lengths are in percent of the cell, so that they fit any screen.

use crate::render::figure::axes::Scale;
use crate::render::figure::panel::{escape, px, short};
use std::fmt::Write;

/// Distance of a value from the left edge (%), from 0 to 100.
fn at(Scale { from, to }: Scale, x: f64) -> f64 {
    let width = (to - from).max(f64::MIN_POSITIVE);
    (100.0 * (x - from) / width).clamp(0.0, 100.0)
}

/// A dot for a value, with a bar for its interval.
pub(super) fn whisker(scale: Scale, value: Option<f64>, ci: Option<[f64; 2]>, class: &str) -> String {
    let mut svg = format!("<svg class=\"whisker {}\" aria-hidden=\"true\">", escape(class));
    // Writing to a String cannot fail.
    for tick in scale.ticks() {
        let zero = if tick.abs() < 1e-9 && scale.from < 0.0 { " class=\"zero\"" } else { "" };
        let x = px(at(scale, tick));
        _ = write!(svg, "<line{zero} x1=\"{x}%\" x2=\"{x}%\" y1=\"0\" y2=\"100%\"/>");
    }
    if let Some([low, high]) = ci {
        let (low, high) = (px(at(scale, low)), px(at(scale, high)));
        _ = write!(svg, "<line class=\"ci\" x1=\"{low}%\" x2=\"{high}%\" y1=\"50%\" y2=\"50%\"/>");
    }
    if let Some(value) = value {
        _ = write!(svg, "<circle cx=\"{}%\" cy=\"50%\" r=\"4\"/>", px(at(scale, value)));
    }
    svg + "</svg>"
}

/// The numbers of an axis, which stand above whiskers of the same scale. With the unit "%", shares are written in
/// percent.
pub(super) fn axis(scale: Scale, unit: &str) -> String {
    let mut svg = String::from("<svg class=\"axis\" aria-hidden=\"true\">");
    let ticks = scale.ticks();
    let last = ticks.len().saturating_sub(1);
    for (i, tick) in ticks.into_iter().enumerate() {
        let text = if unit == "%" { short(100.0 * tick, 1) } else { short(tick, 3) };
        let unit = if i == last { format!(" {}", escape(unit)) } else { String::new() };
        _ = write!(svg, "<text x=\"{}%\" y=\"12\">{text}{unit}</text>", px(at(scale, tick)));
    }
    svg + "</svg>"
}

/// A bar of parts side by side. Each part has a class, a share and the text of its tooltip. `to` is the share at the
/// right edge.
pub(super) fn share_bar(parts: &[(String, f64, String)], to: f64) -> String {
    let mut svg = String::from("<svg class=\"bar\" aria-hidden=\"true\">");
    let scale = Scale { from: 0.0, to };
    let mut from = 0.0;
    for (class, share, words) in parts.iter().filter(|(_, share, _)| *share > 0.0) {
        let (x, width) = (at(scale, from), at(scale, from + share) - at(scale, from));
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
