//! `standfast list`: what can be named without a file: robots, controllers, campaigns and baselines that are compiled in; and which
//! engines and features this program has.

use super::mujoco;
use super::terminal::print;
use serde_json::{Value, json};
use standfast_core::error::Result;
use standfast_files::assets::InputKind;
use standfast_report::text::layout::wrapped;
use standfast_sim::Engine;
use standfast_study::ask::entrant::Entrant;
use standfast_study::store::compiled_in;
use standfast_study::store::manifest::{Manifest, each_once};
use standfast_study::{Campaign, Folder, Overrides};
use std::path::Path;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub struct ListArgs {
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

/// A feature of the build: its name, whether this program has it, and what it is for.
const FEATURES: [(&str, bool, &str); 3] = [
    (
        "onnx",
        cfg!(feature = "onnx"),
        "learned policies from ONNX files",
    ),
    ("view", cfg!(feature = "view"), "the window"),
    (
        "mujoco",
        cfg!(feature = "mujoco"),
        "the second physics engine",
    ),
];

pub fn run(args: &ListArgs) -> Result<ExitCode> {
    let tables = [
        ("robots", robots()),
        ("controllers", controllers()?),
        ("campaigns", campaigns()?),
        ("baselines", baselines()?),
        ("engines", engines()),
        ("features", features()),
    ];
    if args.json {
        let all: serde_json::Map<String, Value> = tables
            .into_iter()
            .map(|(kind, list)| (kind.into(), list.into()))
            .collect();
        return print(&standfast_report::json(&Value::Object(all)));
    }
    let mut text = String::new();
    for (kind, list) in &tables {
        text += &format!("{kind}\n");
        for item in list {
            let word = |key: &str| item[key].as_str().unwrap_or_default();
            let lacks = if item["is_there"] == false {
                "not in this program: "
            } else {
                ""
            };
            text += &wrapped(
                &format!("  {:<10} ", word("name")),
                &format!("{lacks}{}", word("what")),
            );
        }
    }
    let files = "A file has the same place as a name: a URDF or MJCF, or a TOML file, which `standfast new` writes.";
    print(&format!("{text}\n{}", wrapped("", files)))
}

fn robots() -> Vec<Value> {
    let what = "UT-mu2:magnum, the robot of the paper: 0.54 m, 8 kg, 20 joints";
    InputKind::Robot
        .names()
        .into_iter()
        .map(|name| json!({ "name": name, "what": what }))
        .collect()
}

fn controllers() -> Result<Vec<Value>> {
    let mut controllers = Vec::new();
    for name in InputKind::Controller.names() {
        let tree = standfast_controllers::load(name)?.tree();
        let what = tree.get("description").and_then(toml::Value::as_str);
        controllers.push(json!({ "name": name, "what": what }));
    }
    Ok(controllers)
}

fn campaigns() -> Result<Vec<Value>> {
    let mut campaigns = Vec::new();
    for name in InputKind::Campaign.names() {
        let Campaign {
            trials,
            robot,
            controllers: gains,
            ..
        } = Campaign::load(name, &Overrides::default())?;
        let what = format!(
            "{trials} trials, robot {robot}, controllers {}",
            gains.join(", ")
        );
        campaigns.push(
            json!({ "name": name, "what": what, "trials": trials, "robot": robot, "controllers": gains }),
        );
    }
    Ok(campaigns)
}

fn baselines() -> Result<Vec<Value>> {
    let mut baselines = Vec::new();
    for name in compiled_in::names() {
        let Manifest {
            campaign,
            controllers,
            ..
        } = Folder::existing(Path::new(name))?.manifest;
        let entrants = controllers.iter();
        let entered = entrants.map(|entrant| Entrant::split(entrant).controller.to_string());
        let entered = each_once(entered).join(", ");
        let what = format!("{} trials of {}: {entered}", campaign.trials, campaign.name);
        baselines.push(json!({ "name": name, "what": what, "controllers": controllers }));
    }
    Ok(baselines)
}

fn engines() -> Vec<Value> {
    let mut engines = Vec::new();
    for engine in Engine::ALL {
        let is_within = engine != Engine::Mujoco || cfg!(feature = "mujoco");
        let what = match (is_within, mujoco::is_beside()) {
            (true, _) => engine.with_version(),
            (false, true) => format!(
                "{}, in the program standfast-mujoco beside this one",
                engine.title()
            ),
            (false, false) => mujoco::HOW_TO_GET.into(),
        };
        let is_there = is_within || mujoco::is_beside();
        engines.push(json!({ "name": engine.name(), "what": what, "is_there": is_there }));
    }
    engines
}

fn features() -> Vec<Value> {
    FEATURES
        .map(|(name, is_there, what)| json!({ "name": name, "what": what, "is_there": is_there }))
        .to_vec()
}
