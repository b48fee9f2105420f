//! A film as one HTML page: the robot in 3D, the controller's estimates and commands, and plots over time.
//!
//! The page is one file that loads nothing else and opens from a disk, with its own small WebGL viewer. Numbers are
//! packed to 16 bits each (`pack`), and the page computes the kinematics, so that positions are right to 0.1 mm. The
//! page ends when the robot has flown off or its numbers run away (`data`). The same film gives the same bytes.

mod data;
mod pack;

use crate::html_page;
use crate::text::ghost::{ended, parted};
use minijinja::{UndefinedBehavior, context};
use standfast_core::error::{Error, Result};
use standfast_scene::palette::{self, Overlay};
use standfast_sim::episode::Film;
use standfast_sim::episode::parting::Parting;

const TEMPLATE: &str = include_str!("replay.html.jinja");
const STYLE: &str = include_str!("replay.css");
/// The scripts of the page, which share one scope, in the order in which they use each other.
const SCRIPTS: [&str; 9] = [
    include_str!("math.js"),
    include_str!("film.js"),
    include_str!("meshes.js"),
    include_str!("scene.js"),
    include_str!("overlays.js"),
    include_str!("camera.js"),
    include_str!("plots.js"),
    include_str!("save.js"),
    include_str!("player.js"),
];

/// The text that the page shows beside the film.
#[derive(Debug, Clone, Default)]
pub struct Head {
    pub title: String,
    /// A sentence that a reader must know first, for example that the episode differs from the recorded trial.
    pub warning: Option<String>,
    /// The lines of the story, as plain text.
    pub lines: Vec<String>,
    /// The shell command that makes this page.
    pub command: String,
    /// Whether the page is in a result folder. If so, it links to the report, and its command is for a shell in the
    /// result folder.
    pub of_result: bool,
}

/// The page of a film. The robot of a second film of the same trial, of another entrant, is shown as a ghost. Fails if a film has no moment, or if the template is wrong.
pub fn page(film: &Film, ghost: Option<&Film>, head: &Head) -> Result<String> {
    if std::iter::once(film)
        .chain(ghost)
        .any(|film| film.snapshots.is_empty())
    {
        return Err(Error::Numeric {
            what: "replay".into(),
            problem: "the film has no moment".into(),
        });
    }
    // The data must not contain the end tag of the element that holds them.
    let (data, notes) = data::packed(film, ghost);
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
        controller => &film.controller,
        outcomes => outcomes(film, ghost),
        ghost => ghost.map(|ghost| context! {
            ended => ended([film, ghost]).to_vec(),
            parted => parted(film, ghost),
            parted_s => Parting::of_films(film, ghost).map(|parting| parting.at_s),
        }),
        overlays => Overlay::ALL.map(Overlay::look).map(|look| (look.key, look.name)),
        style => palette::css() + STYLE,
        script => format!("const PALETTE = {looks};\n{}", SCRIPTS.concat()),
        data,
    };
    html_page::render(
        "replay.html",
        TEMPLATE,
        UndefinedBehavior::Lenient,
        |_| (),
        &context,
    )
}

/// The outcome of a film, which is also the class of its badge, and the text of the badge. With a ghost, there are two.
fn outcomes(film: &Film, ghost: Option<&Film>) -> Vec<[String; 2]> {
    let outcome = |film: &Film| film.record.outcome.name().to_string();
    let Some(ghost) = ghost else {
        return vec![[outcome(film), outcome(film)]];
    };
    let badge = |film: &Film| {
        [
            outcome(film),
            format!("{}: {}", film.controller, outcome(film)),
        ]
    };
    [film, ghost].map(badge).to_vec()
}

/// Joins each line that begins with a space to the line before, since the page wraps lines itself.
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
    fn an_indented_line_is_joined_to_the_line_before() {
        let lines = [
            "push      5 N s",
            "torque    at most",
            "          25 %",
            "",
            "fell:      a link",
        ]
        .map(String::from);
        assert_eq!(
            paragraphs(&lines),
            [
                "push      5 N s",
                "torque    at most 25 %",
                "",
                "fell:      a link"
            ]
        );
    }
}
