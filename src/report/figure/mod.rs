//! Pictures of results (SVG). Each module makes one kind of picture from panels, with `panel`, `axes` and `polar` as
//! the common tools; colours and strokes are classes of `figure.css`. A panel stands in a page or, with others, in a
//! file.

pub mod axes;
pub mod cpi;
pub mod limit;
pub mod limit_map;
pub mod motion;
pub mod panel;
pub mod polar;
pub mod skeleton;
pub mod success;

use panel::{Panel, escape};
use standfast_core::error::Result;
use standfast_files::write_atomic;
use standfast_scene::palette::{self, Overlay};
use std::path::Path;

const STYLE: &str = include_str!("figure.css");
/// What only pages need: colours of controllers beside figures, and lighter colours for readers who prefer dark pages.
const PAGE: &str = include_str!("page.css");
/// Colours of figures: controllers, feet, ground.
const LIGHT: [(&str, &str); 10] = [
    ("s0", "#0072b2"),
    ("s1", "#d55e00"),
    ("s2", "#009e73"),
    ("s3", "#cc79a7"),
    ("s4", "#56b4e9"),
    ("s5", "#e69f00"),
    ("s6", "#5a5a5a"),
    ("left", "#5a5a5a"),
    ("right", "#b3568c"),
    ("ground", "#eceff2"),
];
/// Further colours of a file, which stays white on any page. Pages define their own.
const PAPER: [(&str, &str); 4] = [
    ("page", "#fff"),
    ("ink", "#1f2328"),
    ("soft", "#5c6570"),
    ("line", "#e3e6ea"),
];
/// Space between the panels of a file, and around them (px).
const GAP: f64 = 16.0;
/// Height of the heading of a file, and approximate width of its letters (px).
const HEADING: f64 = 26.0;
const LETTER: f64 = 8.6;
/// Number of colours of controllers. Further controllers have the same colours again, dashed.
pub const COLORS: usize = 7;

/// The style sheet of panels that stand in a page.
pub fn page_style() -> String {
    let colors = LIGHT.map(|(name, color)| format!("--{name}:{color}"));
    format!(
        "{}:root{{{}}}\n{STYLE}{PAGE}",
        palette::css(),
        colors.join(";")
    )
}

/// The style sheet of a file. Only browsers know variables, so each is replaced by its colour, and `figure.css` has no
/// selectors but classes and names of elements: so Inkscape, rsvg-convert, CairoSVG and LaTeX draw the same colours.
fn file_style() -> String {
    let named = LIGHT.into_iter().chain(PAPER);
    let mut style = named.fold(STYLE.to_string(), |style, (name, color)| {
        style.replace(&format!("var(--{name})"), color)
    });
    for overlay in Overlay::ALL {
        let name = format!("var(--{})", overlay.look().id);
        style = style.replace(&name, &overlay.color().css());
    }
    style
}

/// A panel as a file of its own, without a heading.
fn alone(panel: &Panel) -> String {
    let (style, width, height) = (file_style(), panel.width, panel.height);
    panel
        .svg(&format!(
            "xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\""
        ))
        .replacen(">\n", &format!(">\n<style>\n{style}</style>\n"), 1)
}

/// Classes of all elements that are drawn for a controller.
pub fn class_of_controller(controller: usize) -> String {
    format!(
        "s{}{}",
        controller % COLORS,
        if controller >= COLORS { " again" } else { "" }
    )
}

/// Writes panels as one SVG file, in rows of `columns`. Fails if the file cannot be written.
pub fn write(path: &Path, heading: &str, panels: &[Panel], columns: usize) -> Result<()> {
    write_atomic(path, document(heading, panels, columns).as_bytes())
}

/// The text of one SVG file with a heading, its own style, and panels in rows of `columns`.
pub fn document(heading: &str, panels: &[Panel], columns: usize) -> String {
    let rows: Vec<&[Panel]> = panels.chunks(columns).collect();
    let row_height = |row: &[Panel]| row.iter().map(|panel| panel.height).fold(0.0, f64::max);
    let mut width = 2.0 * GAP + LETTER * heading.chars().count() as f64;
    for row in &rows {
        width = width.max(row.iter().map(|panel| panel.width + GAP).sum::<f64>() + GAP);
    }
    let width = width.ceil();
    let height = rows.iter().map(|row| row_height(row) + GAP).sum::<f64>() + GAP + HEADING;
    let (heading, style) = (escape(heading), file_style());
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"fig\" role=\"img\" width=\"{width}\" height=\"{height:.0}\" \
         viewBox=\"0 0 {width} {height:.0}\">\n<title>{heading}</title>\n<style>\n{style}</style>\n\
         <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n\
         <text class=\"heading\" x=\"{GAP}\" y=\"28\">{heading}</text>\n"
    );
    let mut top = GAP + HEADING;
    for row in rows {
        let mut left = GAP;
        for panel in row {
            let (w, h) = (panel.width, panel.height);
            svg += &panel.svg(&format!(
                "x=\"{left:.0}\" y=\"{top:.0}\" width=\"{w:.0}\" height=\"{h:.0}\""
            ));
            svg.push('\n');
            left += w + GAP;
        }
        top += row_height(row) + GAP;
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// A file looks the same everywhere, since it is one document with a title, a white ground and its own style.
    #[test]
    fn a_file_has_its_own_title_ground_and_style() {
        let mut panel = Panel::new(100.0, 50.0);
        panel.line("s6", [0.0, 0.0], [9.0, 9.0]);
        let heading = "a name < that is longer than its panel is wide";
        let svg = document(heading, &[panel.clone(), panel], 2);
        let file = roxmltree::Document::parse(&svg).unwrap();
        let root = file.root_element();
        let title = root
            .children()
            .find(|node| node.tag_name().name() == "title");
        assert_eq!(title.and_then(|title| title.text()), Some(heading));
        assert!(
            root.attribute("width").unwrap().parse::<f64>().unwrap()
                > LETTER * heading.len() as f64
        );
        assert!(!svg.contains("prefers-color-scheme"), "{svg}");
        assert!(page_style().contains("prefers-color-scheme"));
    }

    /// The colours of fills and of strokes in which rsvg-convert draws a file. It is None, on a machine that need not have
    /// the program, if it is not there.
    fn drawn(svg: &str) -> Option<[BTreeSet<String>; 2]> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.svg");
        std::fs::write(&file, svg).unwrap();
        // It writes what it has drawn as an SVG without classes.
        let run = std::process::Command::new("rsvg-convert")
            .args(["-f", "svg"])
            .arg(&file)
            .output();
        let output = match run {
            Err(_) if std::env::var_os("STANDFAST_NEED_CHROMIUM").is_none() => return None,
            output => output.expect("rsvg-convert"),
        };
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8(output.stdout).unwrap();
        Some(["fill", "stroke"].map(|kind| {
            let mut colors = BTreeSet::new();
            for place in text.split(kind).skip(1) {
                let value = place.trim_start_matches([':', '=', '"']);
                if let Some((shares, _)) =
                    value.strip_prefix("rgb(").and_then(|v| v.split_once(')'))
                {
                    let level = |share: &str| {
                        share.trim().trim_end_matches('%').parse::<f64>().unwrap() * 2.55
                    };
                    let hex = |share| format!("{:02x}", level(share).round() as u8);
                    colors.insert(format!(
                        "#{}",
                        shares.split(',').map(hex).collect::<String>()
                    ));
                }
            }
            colors
        }))
    }

    /// Programs that are no browser draw a file in the colours that a browser shows.
    #[test]
    fn a_file_has_its_colours_in_a_program_that_is_no_browser() {
        let mut panel = Panel::new(400.0, 60.0);
        let controllers: Vec<String> = (0..COLORS).map(class_of_controller).collect();
        let marks = ["com", "zmp", "dcm", "slice", "wanted", "plan", "push"];
        let all = controllers.iter().map(String::as_str).chain(marks);
        for (i, class) in all.clone().enumerate() {
            let at = [15.0 + 20.0 * i as f64, 20.0];
            panel.group(&format!("class=\"{class}\""), |panel| {
                panel.circle("dot", at, 8.0);
                panel.line("", [at[0] - 8.0, 50.0], [at[0] + 8.0, 50.0]);
            });
        }
        let colors = LIGHT[..COLORS].iter().map(|(_, color)| color.to_string());
        let of_marks = ["com", "zmp", "dcm", "sets", "zmpRef", "footstep", "push"].map(|id| {
            let mark = Overlay::ALL.into_iter().find(|mark| mark.look().id == id);
            mark.unwrap().color().css()
        });
        let expected: Vec<String> = colors.chain(of_marks).collect();
        let svg = document("", &[panel], 1);
        let Some([fills, strokes]) = drawn(&svg) else {
            return;
        };
        for (class, color) in all.zip(expected) {
            assert!(
                fills.contains(&color) && strokes.contains(&color),
                "{class} {color}: {fills:?}, {strokes:?}"
            );
        }
        assert!(fills.contains("#ffffff"), "the paper is white: {fills:?}");
        assert!(!svg.contains("var(") && !svg.contains(":is("), "{svg}");
    }
}
