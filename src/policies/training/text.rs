//! The file of a policy as commented TOML.

use super::known::{Figure, Training};
use crate::terms::Stack;
use serde::Serialize;
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
        observed,
        network,
        frames,
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
        let clip =
            toml::Value::try_from(value).map_or_else(|e| e.to_string(), |clip| clip.to_string());
        let _ = writeln!(text, "\naction_clip = {clip}  # {}", one_line(origin));
    }
    if *frames != Stack::default() {
        let count =
            toml::Value::try_from(frames).map_or_else(|e| e.to_string(), |count| count.to_string());
        let about = "The network sees several frames of all terms below";
        let _ = writeln!(
            text,
            "\n# {about}; {}\nframes = {count}",
            one_line(&observation.origin)
        );
    }
    let motors = training.motors();
    if !motors.is_empty() {
        text += "\n# The motors of the training. The robot has its own, which are the same for every controller: the table is told\n\
                 # where they differ, and `--motors` with this file gives the robot these.\n[training]\n";
    }
    for (key, about, Figure { value, origin }) in motors {
        text += list(key, about, &decimals(value), origin).trim_start();
    }
    if let Some(Figure { value, origin }) = observed {
        let names: Vec<String> = value.joints.iter().map(|joint| quoted(joint)).collect();
        let about =
            "The joints that the network sees, and the angles from which it sees theirs [rad]";
        let _ = writeln!(text, "\n# {about}; {}\n[observed]", one_line(origin));
        let _ = write!(text, "joints = [\n{}]\n", listed(&names));
        let _ = write!(
            text,
            "default_rad = [\n{}]\n",
            listed(&decimals(&value.default_rad))
        );
    }
    if let Some(Figure { value, origin }) = network {
        let about = "The outputs of the network, and those that are fed back to its inputs (input = output)";
        let _ = writeln!(text, "\n# {about}; {}\n[network]", one_line(origin));
        text += &keys(value, "");
    }
    if let Some(Figure { value, origin }) = gait {
        let about = "The phases of the left and the right foot";
        let _ = writeln!(text, "\n# {about}; {}\n[gait]", one_line(origin));
        text += &keys(value, "hz");
    }
    let _ = writeln!(
        text,
        "\n# What the network sees, in this order; {}",
        one_line(&observation.origin)
    );
    for term in &observation.value {
        text += "[[observation]]\n";
        text += &keys(term, "term");
    }
    text
}

/// The keys of a value, a line each, `first` before the others.
fn keys(value: &impl Serialize, first: &str) -> String {
    let table = toml::Table::try_from(value).unwrap_or_default();
    let (before, after): (Vec<_>, Vec<_>) = table.iter().partition(|(key, _)| *key == first);
    let lines = before.into_iter().chain(after);
    lines
        .map(|(key, value)| format!("{key} = {value}\n"))
        .collect()
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
