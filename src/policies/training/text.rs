//! The file of a policy as commented TOML.

use super::known::{Figure, Training};
use crate::observation::{Gait, Scale, Term};
use standfast_files::assets::{decimal, one_line, quoted};
use std::fmt::Write;
use std::path::Path;

/// Width of the lines of a list (characters).
const WIDTH: usize = 110;

/// The text of the file, which lies beside `model`.
pub fn toml(model: &Path, training: &Training) -> String {
    let name = |part: Option<&std::ffi::OsStr>| {
        part.map(|part| part.to_string_lossy().into_owned())
            .unwrap_or_default()
    };
    let (file, stem) = (name(model.file_name()), name(model.file_stem()));
    let Training {
        by,
        period_s,
        joints,
        action_clip,
        gait,
        observation,
        ..
    } = training;
    let mut text = format!(
        "# What {} was trained with, written by `standfast init` from what is known of {}.\n\
         # \"read\" is stated there, \"inferred\" follows from it, and \"assumed\" is what this trainer usually does: check it.\n\n\
         kind = \"onnx\"\nname = {}\nmodel = {}\n",
        one_line(&file),
        one_line(by),
        quoted(&stem),
        quoted(&file)
    );
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "period_s = {}  # between two actions [s]; {}",
        decimal(period_s.value),
        period_s.origin
    );
    let _ = writeln!(
        text,
        "command = [0.0, 0.0, 0.0]  # the velocity asked for: it is to stand; assumed"
    );
    let names: Vec<String> = joints.value.iter().map(|joint| quoted(joint)).collect();
    text += &list(
        "joints",
        "In the order of the policy",
        &names,
        &joints.origin,
    );
    for (key, about, Figure { value, origin }) in training.lists() {
        text += &list(key, about, &decimals(value), origin);
    }
    if let Some(Figure { value, origin }) = action_clip {
        let _ = writeln!(text, "\naction_clip = {}  # {origin}", decimal(*value));
    }
    let motors = training.motors();
    if !motors.is_empty() {
        text += "\n# The motors of the training. The robot has its own, which are the same for every controller: the table is told\n\
                 # where they differ, and `--motors` with this file gives the robot these.\n[training]\n";
    }
    for (key, about, Figure { value, origin }) in motors {
        text += list(key, about, &decimals(value), origin).trim_start();
    }
    if let Some(Figure {
        value: Gait {
            hz,
            start_rad,
            standing_rad,
        },
        origin,
    }) = gait
    {
        let pair = |[a, b]: [f64; 2]| format!("[{}, {}]", decimal(a), decimal(b));
        let _ = writeln!(
            text,
            "\n# The phases of the left and the right foot; {origin}\n[gait]\nhz = {}",
            decimal(*hz)
        );
        let _ = writeln!(text, "start_rad = {}", pair(*start_rad));
        let _ = standing_rad
            .map(|standing_rad| writeln!(text, "standing_rad = {}", pair(standing_rad)));
    }
    let _ = writeln!(
        text,
        "\n# What the network sees, in this order; {}",
        one_line(&observation.origin)
    );
    for of_term in &observation.value {
        let Term {
            scale,
            clip,
            history,
            ..
        } = of_term;
        let _ = writeln!(text, "[[observation]]\nterm = {}", quoted(&of_term.name()));
        match scale {
            Scale::All(1.0) => {}
            Scale::All(scale) => _ = writeln!(text, "scale = {}", decimal(*scale)),
            Scale::Each(each) => {
                let items: Vec<String> = each.iter().map(|scale| decimal(*scale)).collect();
                _ = writeln!(text, "scale = [{}]", items.join(", "));
            }
        }
        if let Some(clip) = clip {
            _ = writeln!(text, "clip = {}", decimal(*clip));
        }
        if *history > 1 {
            let _ = writeln!(text, "history = {history}");
        }
    }
    text
}

fn decimals(list: &[f64]) -> Vec<String> {
    list.iter().map(|number| decimal(*number)).collect()
}

/// A key with a list, and a comment with its origin.
fn list(key: &str, about: &str, items: &[String], origin: &str) -> String {
    let items = listed(items);
    format!("\n# {about}; {}\n{key} = [\n{items}]\n", one_line(origin))
}

/// Items in lines of some width.
fn listed(items: &[String]) -> String {
    let (mut lines, mut line) = (String::new(), String::from("   "));
    for item in items {
        if line.len() + item.len() > WIDTH {
            lines += &line;
            lines += "\n";
            line = "   ".into();
        }
        let _ = write!(line, " {item},");
    }
    lines + &line + "\n"
}
