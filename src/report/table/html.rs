//! Tables in HTML: with a caption, headings that name the columns and rows that they head, and the marks of the cells
//! as pictures. Lengths in these pictures are in percent of their cell, so that they fit any screen.

use super::{CellMark, Table};
use crate::figure::axes::AxisScale;
use crate::figure::class_of_controller;
use crate::figure::panel::{escape, px, short};
use crate::text::layout::together;
use std::fmt::Write;

impl Table {
    /// The table as a figure, with its note below. The marks of a row are in a cell of their own, after its names.
    pub fn html(&self) -> String {
        let scale = self.scale();
        let names = self
            .columns
            .iter()
            .take_while(|column| column.is_words)
            .count();
        let title = signs(&self.title);
        let mut html = format!(
            "<figure>\n<div class=\"scroll\">\n<table class=\"rows\">\n<caption>{title}</caption>\n<thead><tr>"
        );
        // Writing to a String cannot fail.
        for (i, column) in self.columns.iter().enumerate() {
            let class = if column.is_words {
                ""
            } else {
                " class=\"number\""
            };
            let heading = signs(&column.text());
            _ = write!(
                html,
                "<th scope=\"col\"{class}>{}{heading}</th>",
                key(column.controller)
            );
            if let Some(scale) = scale.filter(|_| i + 1 == names) {
                _ = write!(
                    html,
                    "<th scope=\"col\" class=\"picture\">{}</th>",
                    axis(scale, self.about_zero)
                );
            }
        }
        html += "</tr></thead>\n<tbody>\n";
        for row in &self.rows {
            html += "<tr>";
            for (i, (cell, column)) in row.iter().zip(&self.columns).enumerate() {
                let text = signs(&cell.text);
                _ = match (i, column.is_words) {
                    (0, _) => write!(
                        html,
                        "<th scope=\"row\">{}{text}</th>",
                        key(cell.controller)
                    ),
                    (_, true) => write!(html, "<td>{}{text}</td>", key(cell.controller)),
                    (_, false) => write!(html, "<td class=\"number\">{text}</td>"),
                };
                if let Some(scale) = scale.filter(|_| i + 1 == names) {
                    let marks: Vec<CellMark> = row.iter().filter_map(|cell| cell.mark).collect();
                    let size = if marks.len() > 1 { "small " } else { "" };
                    let drawn: String = marks
                        .into_iter()
                        .map(|mark| whisker(scale, mark, size))
                        .collect();
                    _ = write!(html, "<td class=\"picture\">{drawn}</td>");
                }
            }
            html += "</tr>\n";
        }
        html += "</tbody>\n</table>\n</div>\n";
        if !self.note.is_empty() {
            _ = writeln!(html, "<figcaption>{}</figcaption>", signs(&self.note));
        }
        html + "</figure>\n"
    }

    /// The scale of all marks. None if there are no marks.
    fn scale(&self) -> Option<AxisScale> {
        let marks: Vec<CellMark> = self
            .rows
            .iter()
            .flatten()
            .filter_map(|cell| cell.mark)
            .collect();
        let ends = marks
            .iter()
            .flat_map(|mark| mark.ci.unwrap_or([mark.at; 2]));
        let most = ends.map(f64::abs).fold(0.0, f64::max).max(1e-6);
        let scale = if self.about_zero {
            AxisScale {
                from: -most,
                to: most,
            }
        } else {
            AxisScale { from: 0.0, to: 1.0 }
        };
        (!marks.is_empty()).then_some(scale)
    }
}

/// The text, escaped, with minus signs before negative numbers, and numbers that stay with their units. Hyphens in
/// names stay.
pub fn signs(text: &str) -> String {
    let mut parts = text.split('-');
    let mut out = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let is_sign = part.starts_with(|c: char| c.is_ascii_digit())
            && (out.is_empty() || out.ends_with([' ', '(']));
        out.push(if is_sign { '\u{2212}' } else { '-' });
        out += part;
    }
    escape(&together(&out))
}

/// The colour of a controller, before its name.
fn key(controller: Option<usize>) -> String {
    controller.map_or(String::new(), |controller| {
        format!(
            "<span class=\"key {}\"></span>",
            class_of_controller(controller)
        )
    })
}

/// Distance of a value from the left edge (%), from 0 to 100.
fn at(AxisScale { from, to }: AxisScale, x: f64) -> f64 {
    (100.0 * (x - from) / (to - from)).clamp(0.0, 100.0)
}

/// A dot for a value, with a bar for its interval.
fn whisker(scale: AxisScale, mark: CellMark, size: &str) -> String {
    let class = mark.controller.map_or(String::new(), class_of_controller);
    let mut svg = format!("<svg class=\"whisker {size}{class}\" aria-hidden=\"true\">");
    for tick in scale.ticks() {
        let zero = if tick.abs() < 1e-9 && scale.from < 0.0 {
            " class=\"zero\""
        } else {
            ""
        };
        let x = px(at(scale, tick));
        _ = write!(
            svg,
            "<line{zero} x1=\"{x}%\" x2=\"{x}%\" y1=\"0\" y2=\"100%\"/>"
        );
    }
    if let Some(ends) = mark.ci {
        let [low, high] = ends.map(|end| px(at(scale, end)));
        _ = write!(
            svg,
            "<line class=\"ci\" x1=\"{low}%\" x2=\"{high}%\" y1=\"50%\" y2=\"50%\"/>"
        );
    }
    svg + &format!(
        "<circle cx=\"{}%\" cy=\"50%\" r=\"4\"/></svg>",
        px(at(scale, mark.at))
    )
}

/// The numbers of an axis, which is above whiskers of the same scale. Shares are written in percent.
fn axis(scale: AxisScale, about_zero: bool) -> String {
    let mut svg = String::from("<svg class=\"axis\" aria-hidden=\"true\">");
    let ticks = scale.ticks();
    let last = ticks.len().saturating_sub(1);
    for (i, tick) in ticks.into_iter().enumerate() {
        let text = if about_zero {
            short(tick, 3)
        } else {
            short(100.0 * tick, 1)
        };
        let unit = if i == last && !about_zero { " %" } else { "" };
        _ = write!(
            svg,
            "<text x=\"{}%\" y=\"12\">{text}{unit}</text>",
            px(at(scale, tick))
        );
    }
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::super::tests::{beside, rates};
    use super::*;

    #[test]
    fn names_are_escaped_and_marks_stand_after_them() {
        let html = rates().html();
        let table = html.split_once("<caption>").unwrap().1;
        assert!(
            table.starts_with("Rates</caption>")
                && html.ends_with("At 95\u{a0}%, \u{2212}1 to 1.</figcaption>\n</figure>\n")
        );
        let heads: Vec<_> = table.match_indices("<th scope=\"col\"").collect();
        assert_eq!(
            (heads.len(), table.matches("<th scope=\"row\">").count()),
            (4, 2),
            "{html}"
        );
        assert!(
            html.contains("&lt;b&gt;|x_</th><td class=\"picture\"><svg class=\"whisker s1\""),
            "{html}"
        );
        assert!(
            html.contains("cx=\"50%\"")
                && html.contains("x1=\"40%\" x2=\"60%\"")
                && !html.contains("<b>"),
            "{html}"
        );
        // Every row is one well-formed element.
        assert!(roxmltree::Document::parse(&html).is_ok(), "{html}");
        assert!(!beside(9).html().contains("picture"));
    }

    #[test]
    fn a_minus_is_no_hyphen() {
        let told = signs("a-1 and b: -2.0 points (-11.3 to 7.2)");
        assert_eq!(
            told,
            "a-1 and b: \u{2212}2.0\u{a0}points (\u{2212}11.3 to 7.2)"
        );
    }
}
