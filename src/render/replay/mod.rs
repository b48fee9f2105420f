//! A film as one page that people look at: the robot in 3D, what the controller knows and wants, and plots over time.
//!
//! One file that asks for nothing else and opens from a disk: its own small WebGL viewer (`scene.js` and what it stands
//! on), nothing of other hands. The robot's positions in it are right to 0.1 mm (`pack`: 16 bits for each number; the
//! page does the kinematics), as far as it shows them: it ends where the robot has flown off or its numbers run away
//! (`data`). The same bytes everywhere, as the film.

mod data;
mod pack;

use crate::episode::film::Film;
use crate::error::{Error, Result};
use crate::render::html_page;
use crate::render::scene::palette::{self, Overlay};
use minijinja::{UndefinedBehavior, context};

const TEMPLATE: &str = include_str!("replay.html.jinja");
const STYLE: &str = include_str!("replay.css");
/// In the order in which they build on each other; all in one scope of the page.
const SCRIPTS: [&str; 8] = [
    include_str!("math.js"),
    include_str!("film.js"),
    include_str!("meshes.js"),
    include_str!("scene.js"),
    include_str!("overlays.js"),
    include_str!("camera.js"),
    include_str!("plots.js"),
    include_str!("player.js"),
];

/// What stands beside the film.
#[derive(Debug, Clone, Default)]
pub struct Head {
    pub title: String,
    /// What a reader must know before anything else, a sentence: that this is not the trial as it was, say.
    pub warning: Option<String>,
    /// The story, plain text.
    pub lines: Vec<String>,
    /// The shell command that makes this page.
    pub command: String,
    /// The page lies among the replays of a result: it leads back to the report, and the command is to be run in that
    /// folder.
    pub of_result: bool,
}

/// The page of a film.
///
/// Errors: a film without a moment, or a template that is wrong.
pub fn page(film: &Film, head: &Head) -> Result<String> {
    if film.snapshots.is_empty() {
        return Err(Error::Numeric { what: "replay".into(), problem: "the film has no moment".into() });
    }
    // Nothing in it may end the element that holds it.
    let (data, notes) = data::packed(film);
    let data = data.to_string().replace('<', "\\u003c");
    let looks = palette::json();
    let context = context! {
        title => &head.title,
        lines => paragraphs(&head.lines),
        warning => &head.warning,
        command => &head.command,
        of_result => head.of_result,
        notes,
        robot => &film.robot.name,
        gain_set => &film.gain_set,
        outcome => film.record.outcome.name(),
        overlays => Overlay::ALL.map(Overlay::look).map(|look| vec![look.key.to_string(), look.name.to_string()]).to_vec(),
        style => palette::css() + STYLE,
        script => format!("const PALETTE = {looks};\n{}", SCRIPTS.concat()),
        data,
    };
    html_page::render("replay.html", TEMPLATE, UndefinedBehavior::Lenient, |_| (), &context)
}

/// Lines that go on with the one before, which begin with a space, are one with it: the page breaks them itself.
fn paragraphs(lines: &[String]) -> Vec<String> {
    let mut whole: Vec<String> = Vec::new();
    for line in lines {
        match whole.last_mut() {
            Some(last) if line.starts_with(' ') => *last += &format!(" {}", line.trim_start()),
            _ => whole.push(line.clone()),
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::paragraphs;

    #[test]
    fn a_line_that_goes_on_is_one_with_the_line_before() {
        let lines =
            ["push      5 N s", "torque    at most", "          25 %", "", "fell:      a link"].map(String::from);
        assert_eq!(paragraphs(&lines), ["push      5 N s", "torque    at most 25 %", "", "fell:      a link"]);
    }
}
