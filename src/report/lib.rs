//! Output for people and other programs: text, plots, pages and tables. These modules draw and write results,
//! and simulate nothing.

#![forbid(unsafe_code)]

pub mod baselines;
pub mod card_page;
pub mod figure;
#[cfg(test)]
#[path = "../study/fixtures.rs"]
mod fixtures;
pub mod foreign;
pub mod html;
pub mod html_page;
pub mod junit;
pub mod markdown;
pub mod mcap;
pub mod observer;
pub mod replay;
pub mod result;
pub mod table;
pub mod tables;
pub mod text;
pub mod trace;
pub mod trial_page;
pub mod tune_page;

use standfast_files::{json_pretty, shell_word};
use standfast_study::Summary;
use standfast_study::verdict::controller_summary::ControllerOrigin;
use std::path::Path;

/// A value as indented JSON, for the terminal or a file.
pub fn json(value: &impl serde::Serialize) -> String {
    // Only a map whose keys are not text can fail, and there is none.
    json_pretty(value).unwrap_or_default()
}

/// The command that simulates a trial of the result in `folder` again with a controller.
pub fn replay_command(summary: &Summary, controller: &str, trial: u64, folder: &Path) -> String {
    let origin = match summary
        .controllers
        .iter()
        .find(|own| own.name == controller)
    {
        Some(own) => own.origin.clone(),
        None => ControllerOrigin::own(controller),
    };
    replay_parts(&origin, folder).join(&trial.to_string())
}

/// The parts of the replay command before and after the number of the trial. Of a packed result they say that there is none.
fn replay_parts(origin: &ControllerOrigin, folder: &Path) -> [String; 2] {
    if origin.is_packed {
        let ControllerOrigin {
            campaign,
            controller,
            ..
        } = origin;
        return [
            format!("# {campaign} has no files of {controller} to replay trial "),
            String::new(),
        ];
    }
    let campaign = folder.join(&origin.campaign).display().to_string();
    let [campaign, gains] = [&campaign, &origin.controller].map(|word| shell_word(word));
    [
        format!("standfast push --campaign {campaign} --trial "),
        format!(" --controller {gains}"),
    ]
}

/// The JSON object with the fields of `record` added to its own.
pub fn with_fields_of(
    mut object: serde_json::Value,
    record: &impl serde::Serialize,
) -> serde_json::Value {
    use serde_json::Value::Object;
    if let (Object(all), Ok(Object(more))) = (&mut object, serde_json::to_value(record)) {
        all.extend(more);
    }
    object
}
