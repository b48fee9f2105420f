//! The specification of a campaign: robot, controllers, number of trials, and all distributions.

use crate::ask::bounds::{PushBounds, accept, check_episode, digits, in_range};
use crate::ask::distribution::FORMS;
use crate::ask::entrant::Entrant;
use crate::ask::gate::GateSpec;
use crate::ask::measures::{Measures, keys_in_file, with_relative_keys};
use crate::ask::pendulum::{OF_PENDULUM, of_size_class_kg};
use crate::ask::push::{PushSpec, SecondPushSpec};
use crate::ask::variations::{self, VariationSpec};
use serde::{Deserialize, Serialize};
use standfast_controllers::variant::{self, ControllerName};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Robot, Units};
use standfast_files::assets::{self, InputKind, Source};
use standfast_robots::urdf::Files;
use standfast_sim::Engine;
use standfast_sim::episode::EpisodeConfig;
use standfast_stats::sequential::look_from;
use std::path::Path;
use toml::Table;

/// A campaign as its TOML file states it, with all defaults filled in, and in SI units: it belongs to its robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// Name, also of the default result folder: letters, digits, `-`, `_`, `.`.
    pub name: String,
    /// Name of a built-in robot, or path of a URDF (in a file: relative to that file).
    #[serde(default = "default_robot")]
    pub robot: String,
    /// Motors of the robot, for all controllers, in place of those of its settings: path of a file (in a file: relative to
    /// that file). The campaign of a result has none, since the settings that it keeps have them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motors: Option<String>,
    /// The [entrants](Entrant): names of built-in controllers, paths as for the robot, or variants
    /// ([`NAME:KEY=VALUE`](standfast_controllers::variant)), each with `@ENGINE` behind it or in the engine of
    /// `episode`. All go through the same trials.
    #[serde(default = "default_controllers")]
    pub controllers: Vec<String>,
    /// Number of trials, which are the same for each controller.
    pub trials: u64,
    /// Seed of all random numbers (at most 2^63 - 1, as in TOML).
    pub seed: u64,
    /// The units of the robot, in which the file may state quantities; not in the file itself.
    pub units: Units,
    pub episode: EpisodeConfig,
    /// Whether outcomes are made up from the drawn quantities, without a simulation, to test campaigns of any size.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub synthetic: bool,
    pub push: PushSpec,
    #[serde(default)]
    pub sensors: SensorSpec,
    pub second_push: SecondPushSpec,
    #[serde(default)]
    pub variations: VariationSpec,
    #[serde(default)]
    pub stopping: Stopping,
    /// Requirements that the result must meet. The configuration hash leaves them out, since no trial depends on them.
    #[serde(default)]
    pub gates: GateSpec,
}

/// Most trials of a campaign: a year of simulation on some cores.
pub const MOST_TRIALS: u64 = 10_000_000;
/// Most controllers of a campaign, each of which takes a part of a second to prepare.
const MOST_SETS: usize = 200;
/// Longest name, because a folder is named after it.
const MOST_LETTERS: usize = 100;

/// When a campaign may end before all its trials are run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Stopping {
    /// End as soon as every gate is decided or, without gates, every pair of controllers. `trials` is then the maximum.
    pub until_resolved: bool,
    /// If the rates of a pair certainly differ by less than this share, the pair counts as decided, namely as equal.
    pub margin: f64,
}

impl Default for Stopping {
    fn default() -> Self {
        Self {
            until_resolved: false,
            margin: 0.02,
        }
    }
}

/// Sensor errors relative to the robot's own noise. With both at 0 the sensors are ideal.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorSpec {
    /// Scale of the white noise, with one sample per control tick.
    pub noise_scale: f64,
    /// Standard deviation of the bias, which is constant over an episode.
    pub bias_scale: f64,
}

pub(super) fn default_robot() -> String {
    assets::DEFAULT_ROBOT.into()
}

fn default_controllers() -> Vec<String> {
    ["hold", "switching", "paper", "catch"]
        .map(String::from)
        .into()
}

/// Changes to a campaign by the caller, in the order in which they are applied.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// Assignments `dotted.key=value` with the value in TOML (a bare word is a string).
    pub set: Vec<String>,
    pub trials: Option<u64>,
    pub seed: Option<u64>,
    /// Replaces the list of controllers unless empty. Paths are relative to the working folder.
    pub controllers: Vec<String>,
    /// Sweeps `SET:KEY=V1,V2,...`. The unchanged controller and its variants follow `gains`, and the campaign's own
    /// list is dropped.
    pub vary: Vec<String>,
    pub robot: Option<String>,
    /// As [`Campaign::motors`].
    pub motors: Option<String>,
    /// The engine of the entrants that name none. With several, each such entrant becomes one in each of them.
    pub engines: Vec<Engine>,
    /// See [`Campaign::synthetic`].
    pub synthetic: bool,
    /// Gates in addition to the campaign's own.
    pub gates: Vec<String>,
    /// Ends the campaign when it is decided; see [`Stopping`].
    pub until_resolved: bool,
    /// The file of the campaign, in place of the one that its name stands for.
    pub file: Option<Source>,
}

impl Overrides {
    /// The file of the campaign of this name or path.
    fn file_of(&self, name_or_path: &str) -> Result<Source> {
        match &self.file {
            Some(file) => Ok(file.clone()),
            None => assets::open(InputKind::Campaign, name_or_path),
        }
    }

    /// The robot of the campaign whose file states `asked`, after these changes.
    fn robot_of(&self, asked: &Table) -> String {
        if let Some(robot) = &self.robot {
            return robot.clone();
        }
        for assignment in self.set.iter().rev() {
            if let Some((key, text)) = assignment.split_once('=')
                && key.trim() == "robot"
                && let toml::Value::String(robot) = assets::toml_value(text.trim())
            {
                return robot;
            }
        }
        match asked.get("robot") {
            Some(toml::Value::String(robot)) => robot.clone(),
            _ => default_robot(),
        }
    }
}

/// Keys that have no default, beside the impulse of a push.
const NEEDED: [&str; 3] = ["name", "trials", "seed"];

/// The keys and values in the file of a campaign. The path of its robot is made relative to the working folder.
fn asked(source: &Source) -> Result<Table> {
    let mut asked: Table = assets::parse_toml(source)?;
    // The name of this key in files of former versions.
    if let Some(gains) = asked.remove("gains") {
        asked.entry("controllers").or_insert(gains);
    }
    for key in ["robot", "motors"] {
        if let Some(toml::Value::String(path)) = asked.get_mut(key) {
            *path = moved(path, source);
        }
    }
    Ok(asked)
}

/// An input that the file of a campaign names, as seen from the working folder.
fn moved(name: &str, source: &Source) -> String {
    let folder = Path::new(&source.file)
        .parent()
        .filter(|_| !source.is_builtin());
    match folder {
        Some(folder) if assets::is_path(name) => folder.join(name).to_string_lossy().into_owned(),
        _ => name.into(),
    }
}

impl Campaign {
    /// Opens a campaign by name or path, applies the changes, converts it to the units of its robot, and checks all
    /// values.
    pub fn load(name_or_path: &str, overrides: &Overrides) -> Result<Campaign> {
        Self::load_for(
            &Self::robot_files(name_or_path, overrides)?.robot()?,
            name_or_path,
            overrides,
        )
    }

    /// The files of the robot that a campaign, opened with these changes, names. Fails if a file cannot be read.
    pub fn robot_files(name_or_path: &str, overrides: &Overrides) -> Result<Files> {
        let asked = asked(&overrides.file_of(name_or_path)?)?;
        let stated = asked.get("motors").and_then(toml::Value::as_str);
        let motors = overrides.motors.as_deref().or(stated);
        Files::open(&overrides.robot_of(&asked))?.with_motors(motors)
    }

    /// As [`load`](Self::load), in the units of this robot, which need not be the one that the campaign names.
    pub fn load_for(robot: &Robot, name_or_path: &str, overrides: &Overrides) -> Result<Campaign> {
        let source = overrides.file_of(name_or_path)?;
        let measures = Measures::of(robot);
        let mut campaign = Self::of(&source, &measures)?;
        campaign
            .check(&source.file)
            .map_err(|e| measures.explain(e))?;
        campaign.move_gains(&source);
        for assignment in &overrides.set {
            campaign = campaign.with(assignment, &measures)?;
        }
        campaign.trials = overrides.trials.unwrap_or(campaign.trials);
        campaign.seed = overrides.seed.unwrap_or(campaign.seed);
        if !(overrides.controllers.is_empty() && overrides.vary.is_empty()) {
            campaign.controllers.clone_from(&overrides.controllers);
        }
        for sweep in &overrides.vary {
            // The unchanged controller goes first, because each variant is compared with it.
            let sweep = Entrant::split(sweep);
            let unchanged = sweep.of(sweep.controller_name().base);
            if !campaign.controllers.contains(&unchanged) {
                campaign.controllers.push(unchanged);
            }
            let variants = variant::expand(sweep.controller)?;
            campaign
                .controllers
                .extend(variants.iter().map(|variant| sweep.of(variant)));
        }
        if let Some(robot) = &overrides.robot {
            campaign.robot.clone_from(robot);
        }
        campaign.motors = overrides.motors.clone().or(campaign.motors);
        campaign.settle_engines(&overrides.engines);
        campaign.synthetic |= overrides.synthetic;
        campaign.gates.add(&overrides.gates);
        campaign.stopping.until_resolved |= overrides.until_resolved;
        campaign
            .check("command line")
            .map_err(|e| measures.explain(e))?;
        if campaign.stopping.until_resolved {
            // The last look is then also a look of a longer campaign, so that the campaign can be continued.
            campaign.trials = look_from(campaign.trials);
        }
        Ok(campaign)
    }

    /// Makes one engine that of all entrants that name none; of several, each such entrant becomes one in each.
    fn settle_engines(&mut self, engines: &[Engine]) {
        if let [engine] = engines {
            self.episode.engine = *engine;
        } else if !engines.is_empty() {
            let mut settled = Vec::new();
            for listed in &self.controllers {
                let entrant = Entrant::split(listed);
                match entrant.engine {
                    Some(_) => settled.push(listed.clone()),
                    None => settled.extend(engines.iter().map(|&engine| {
                        let engine = Some(engine);
                        Entrant { engine, ..entrant }.of(listed)
                    })),
                }
            }
            self.controllers = settled;
        }
    }

    /// The engine of each entrant, in the order of `controllers`.
    pub fn engines(&self) -> Vec<Engine> {
        let stated = self
            .controllers
            .iter()
            .map(|listed| Entrant::split(listed).engine);
        stated
            .map(|engine| engine.unwrap_or(self.episode.engine))
            .collect()
    }

    /// Each engine that an entrant has, once, in the order of their first appearance.
    pub fn different_engines(&self) -> Vec<Engine> {
        let mut different = Vec::new();
        for engine in self.engines() {
            if !different.contains(&engine) {
                different.push(engine);
            }
        }
        different
    }

    /// A campaign for each entrant, whose engine is that of the campaign then.
    pub fn of_each_entrant(&self) -> Vec<Campaign> {
        let mut campaigns = Vec::new();
        for (listed, engine) in self.controllers.iter().zip(self.engines()) {
            let mut campaign = self.clone();
            campaign.controllers = vec![Entrant::split(listed).controller.into()];
            campaign.episode.engine = engine;
            campaigns.push(campaign);
        }
        campaigns
    }

    /// The campaign that a file asks for.
    fn of(source: &Source, measures: &Measures) -> Result<Campaign> {
        let (mut asked, file) = (asked(source)?, source.file.as_str());
        measures.to_si("", file, &mut asked)?;
        let mut campaign = Self::usual(&measures.units)?;
        if asked.contains_key("units") {
            let accepted = "no such table: the units follow from the robot";
            return Err(Error::value(
                file,
                "units",
                "(a table)",
                "unknown key",
                accepted,
            ));
        }
        check_pendulum(&asked, file)?;
        merge(&mut campaign, asked);
        let mut missing: Vec<&str> = NEEDED
            .into_iter()
            .filter(|key| !campaign.contains_key(*key))
            .collect();
        let is_pushed = campaign["push"]
            .as_table()
            .is_none_or(|push| push.contains_key("impulse_n_s") || push.contains_key("pendulum"));
        missing.extend((!is_pushed).then_some("push.impulse"));
        Self::complete(campaign, &measures.units).map_err(|e| {
            let mut message = with_relative_keys(e.to_string().trim_end()).replace('\n', "\n  ");
            if missing.len() > 1 && message.starts_with("missing field") {
                message = format!("missing fields: {}", missing.join(", "));
            }
            if let Some((line, column)) = place_of(&e, source) {
                message = format!("line {line}, column {column}: {message}");
            }
            Error::Syntax {
                file: file.into(),
                message,
            }
        })
    }

    /// The campaign with all keys of this table. Impulse, duration and course of a push by a pendulum follow from the others,
    /// and the mass of a bob that has none from the size of the robot.
    fn complete(mut table: Table, units: &Units) -> Result<Campaign, toml::de::Error> {
        if let Some(push) = table.get_mut("push").and_then(toml::Value::as_table_mut)
            && let Some(pendulum) = push.get_mut("pendulum")
        {
            if let Some(pendulum) = pendulum.as_table_mut() {
                let mass_kg = pendulum.entry("mass_kg");
                mass_kg.or_insert(of_size_class_kg(units).into());
            }
            push.insert("impulse_n_s".into(), 0.0.into());
        }
        let mut campaign: Campaign = table.try_into()?;
        campaign.push.settle(units);
        Ok(campaign)
    }

    /// The defaults of a campaign for a robot with these units. Some keys have no default: they must be in the file.
    fn usual(units: &Units) -> Result<Table> {
        let usual = Campaign {
            name: String::new(),
            robot: default_robot(),
            motors: None,
            controllers: default_controllers(),
            trials: 0,
            seed: 0,
            units: *units,
            episode: EpisodeConfig::of(units),
            synthetic: false,
            push: PushSpec::usual(units),
            sensors: SensorSpec::default(),
            second_push: SecondPushSpec::none(units),
            variations: VariationSpec::default(),
            stopping: Stopping::default(),
            gates: GateSpec::default(),
        };
        let mut usual = Table::try_from(usual).map_err(not_toml)?;
        for key in NEEDED {
            usual.remove(key);
        }
        if let Some(push) = usual["push"].as_table_mut() {
            push.remove("impulse_n_s");
        }
        Ok(usual)
    }

    /// The campaign of a result folder, which names the inputs there, as seen from the working folder.
    pub fn seen_from(mut self, folder: &Path) -> Self {
        let source = Source {
            file: folder.join("campaign.toml").to_string_lossy().into_owned(),
            text: String::new(),
        };
        self.robot = moved(&self.robot, &source);
        self.move_gains(&source);
        self
    }

    /// Makes the paths of the controllers that `source` names relative to the working folder.
    fn move_gains(&mut self, source: &Source) {
        for gains in &mut self.controllers {
            let entrant = Entrant::split(gains);
            let name = entrant.controller_name();
            *gains = entrant.of(&name.with_base(&moved(name.base, source)));
        }
    }

    /// Fails if the campaign has no trial with this index.
    pub fn check_trial(&self, trial: u64) -> Result<()> {
        if trial < self.trials {
            return Ok(());
        }
        let accepted = format!("0 to {}", self.trials.saturating_sub(1));
        Err(Error::option(
            "--trial",
            trial,
            "the campaign has no such trial",
            accepted,
        ))
    }

    /// The campaign with `dotted.key=value` applied, which may be in units of its robot. It fails for an unknown key or
    /// a value of the wrong type.
    pub(super) fn with(&self, assignment: &str, measures: &Measures) -> Result<Campaign> {
        let split = assignment
            .split_once('=')
            .map(|(key, text)| (key.trim(), text.trim()));
        let Some((key, text)) = split.filter(|(key, _)| !key.is_empty()) else {
            let problem = if split.is_some() {
                "has no key"
            } else {
                "has no `=`"
            };
            return Err(Error::option(
                "--set",
                assignment,
                problem,
                "KEY=VALUE, for example push.height_m=0.1",
            ));
        };
        let (si_key, value) = measures.assigned(key, assets::toml_value(text))?;
        let mut root: toml::Value = self.table()?.into();
        // A campaign may lack a pendulum, and a limit.
        if let (PENDULUM, Some(push)) = (
            key,
            root.get_mut("push").and_then(toml::Value::as_table_mut),
        ) {
            push.insert("pendulum".into(), Table::new().into());
        }
        if key == "episode.judge.max_sole_force_weights"
            && let Some(judge) = root["episode"]["judge"].as_table_mut()
        {
            judge
                .entry("max_sole_force_weights")
                .or_insert(f64::INFINITY.into());
        }
        let at = assets::place(&mut root, &si_key).map_err(|missing| {
            Error::value(
                "--set",
                key,
                text,
                "unknown key",
                with_relative_keys(&missing.accepted),
            )
        })?;
        let kind = match &*at {
            quantity
                if ["uniform", "normal", "each"]
                    .iter()
                    .any(|key| quantity.get(*key).is_some()) =>
            {
                FORMS
            }
            toml::Value::Table(_) => "a table",
            other => other.type_str(),
        };
        let accepted = format!(
            "{kind}, like the present value: {}",
            at.to_string().trim().replace('\n', "; ")
        );
        *at = value;
        // A table that is set has the defaults for the keys that it leaves out, not the present values.
        let mut usual = Self::usual(&self.units)?;
        let Ok(changed) = root.try_into::<Table>() else {
            unreachable!("a table")
        };
        merge(&mut usual, changed);
        Self::complete(usual, &self.units).map_err(|e| {
            let message = with_relative_keys(e.message().trim_end());
            let message = message.as_str();
            // The error of a quantity lists the accepted forms, whatever the present value is.
            let of_quantity = message
                .split_once(", expected ")
                .filter(|(_, expected)| expected.starts_with(FORMS));
            let (problem, accepted) = of_quantity.unwrap_or((message, &accepted));
            Error::value("--set", key, text, problem, accepted)
        })
    }

    /// Finds the entry to load for a controller, given its name in the results, the name of its file (also as the base
    /// of an unlisted variant), or its entry in the list. Any other name is returned unchanged. Engines are left out.
    pub fn gains_named(&self, name: &str) -> String {
        let listed = || self.controllers.iter().map(|listed| Entrant::split(listed));
        let found = listed().find(|entrant| {
            entrant.controller == name
                || entrant.controller_name().change.is_some()
                    && standfast_controllers::load(entrant.controller)
                        .is_ok_and(|set| set.name() == name)
        });
        if let Some(entrant) = found {
            return entrant.controller.into();
        }
        let wanted = ControllerName::split(name);
        let base = listed()
            .map(|entrant| entrant.controller_name().base)
            .find(|base| Path::new(base).file_stem() == Some(wanted.base.as_ref()));
        wanted.with_base(base.unwrap_or(wanted.base))
    }

    /// The campaign as TOML, in SI units, which reads back to the same campaign, to the bit.
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string(&self.table()?).map_err(not_toml)
    }

    /// The campaign as it could stand in a file.
    fn table(&self) -> Result<Table> {
        let mut table = Table::try_from(self).map_err(not_toml)?;
        table.remove("units");
        if let (Some(_), Some(push)) = (&self.push.pendulum, table["push"].as_table_mut()) {
            for key in OF_PENDULUM {
                push.remove(key);
            }
        }
        Ok(table)
    }

    /// Accepted values of the first push.
    pub fn push_bounds(&self) -> PushBounds {
        let bounds = PushBounds::new(self.episode.horizon_s);
        let start_s = [
            variations::earliest_push_s(&self.variations, &self.units),
            bounds.start_s[1],
        ];
        PushBounds { start_s, ..bounds }
    }

    /// Checks that no push starts while the ground still tilts to its slope.
    fn check_start(&self, file: &str) -> Result<()> {
        let (start_s, [earliest, latest]) = (self.push.start_s, self.push_bounds().start_s);
        start_s
            .check(file, "push.start_s", [earliest, latest])
            .map_err(|_| {
                let problem = "the ground is still tilting to its slope (variations.slope_deg)";
                let longer = format!(", episode.horizon_s at least {}", digits(2.0 * earliest));
                let longer = if latest < earliest {
                    longer.as_str()
                } else {
                    ""
                };
                let accepted = format!(
                    "{} to {}{longer}",
                    digits(earliest),
                    digits(latest.max(earliest))
                );
                Error::value(file, "push.start_s", start_s, problem, accepted)
            })
    }

    /// Checks every value. Errors name `file` as the origin of the values.
    pub fn check(&self, file: &str) -> Result<()> {
        if self.name.is_empty()
            || self.name.starts_with('.')
            || self
                .name
                .contains(|c: char| !c.is_ascii_alphanumeric() && !"-_.".contains(c))
        {
            return Err(Error::value(
                file,
                "name",
                format!("{:?}", self.name),
                "is not usable as a folder name",
                "letters, digits, `-`, `_` and `.`, but no `.` at the beginning",
            ));
        }
        if self.name.len() > MOST_LETTERS {
            return Err(Error::value(
                file,
                "name",
                &self.name,
                "is too long",
                format!("up to {MOST_LETTERS} letters"),
            ));
        }
        if self.controllers.is_empty() {
            return Err(Error::value(
                file,
                "controllers",
                "[]",
                "there is no controller",
                "one or more names or paths",
            ));
        }
        if self.controllers.len() > MOST_SETS {
            return Err(Error::value(
                file,
                "controllers",
                format!("{} entries", self.controllers.len()),
                "too many",
                format!("up to {MOST_SETS}"),
            ));
        }
        accept(
            (1..=MOST_TRIALS).contains(&self.trials),
            file,
            "trials",
            self.trials as f64,
            "1 to 1e7",
        )?;
        if self.seed > i64::MAX as u64 {
            return Err(Error::value(
                file,
                "seed",
                self.seed,
                "is too large",
                "0 to 2^63 - 1",
            ));
        }
        for listed in &self.controllers {
            Entrant::check(listed, file)?;
        }
        check_episode(file, &self.episode)?;
        let horizon_s = self.episode.horizon_s;
        self.push.check(file, horizon_s)?;
        self.second_push.check(file, &self.push, horizon_s)?;
        variations::check(&self.variations, &self.units, file)?;
        self.check_start(file)?;
        in_range(
            file,
            "sensors.noise_scale",
            self.sensors.noise_scale,
            [0.0, 1e3],
        )?;
        in_range(
            file,
            "sensors.bias_scale",
            self.sensors.bias_scale,
            [0.0, 1e3],
        )?;
        let margin = self.stopping.margin;
        accept(
            (0.0..=1.0).contains(&margin),
            file,
            "stopping.margin",
            margin,
            "0 to 1: a share, not percent",
        )?;
        self.gates.check(file)
    }
}

/// The dotted key of a pendulum.
const PENDULUM: &str = "push.pendulum";

/// Fails if a file states, beside a pendulum, what follows from it.
fn check_pendulum(asked: &Table, file: &str) -> Result<()> {
    let Some(push) = asked.get("push").and_then(toml::Value::as_table) else {
        return Ok(());
    };
    let stated = OF_PENDULUM
        .into_iter()
        .find_map(|key| Some((key, push.get(key)?)));
    match stated.filter(|_| push.contains_key("pendulum")) {
        Some((key, value)) => {
            let problem = "follows from push.pendulum";
            let accepted = "one of the two";
            Err(Error::value(
                file,
                format!("push.{key}"),
                value,
                problem,
                accepted,
            ))
        }
        None => Ok(()),
    }
}

/// Line and column, in the file of a campaign, of an error that was found after the quantities had been converted to SI
/// units. It is None if the error is about a missing key.
fn place_of(error: &toml::de::Error, source: &Source) -> Option<(usize, usize)> {
    let (message, whole) = (error.message(), error.to_string());
    let between =
        |text: &str, before: &str| Some(text.split_once(before)?.1.split_once('`')?.0.to_string());
    let path = between(&whole, "\nin `");
    let unknown = between(message, "unknown field `");
    let key = [path, unknown]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>()
        .join(".");
    keys_in_file(&key)
        .into_iter()
        .find_map(|key| assets::position(&source.text, &key))
}

/// Replaces values of `base` by the values of `asked`.
fn merge(base: &mut Table, asked: Table) {
    for (key, value) in asked {
        match (base.get_mut(&key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(asked)) => merge(inner, asked),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

fn not_toml(e: toml::ser::Error) -> Error {
    Error::Syntax {
        file: "campaign".into(),
        message: e.to_string(),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fixtures::campaign;

    #[test]
    fn builtin_campaigns_load_and_survive_a_round_trip() {
        let dir = tempfile::tempdir().unwrap();
        for name in InputKind::Campaign.names() {
            let campaign = campaign(name, &["push.height_m={normal=[0.01, 0.003]}"]);
            let path = dir.path().join(name);
            assert_eq!(campaign.name, name);
            std::fs::write(&path, campaign.to_toml().unwrap()).unwrap();
            assert_eq!(
                Campaign::load(path.to_str().unwrap(), &Overrides::default()).unwrap(),
                campaign
            );
        }
    }

    #[test]
    fn a_pendulum_takes_the_place_of_the_impulse() {
        let set = "push.pendulum={mass_kg=3, rope_m=1.75, draw_m={uniform=[0.2, 1]}}";
        let swung = campaign("nominal", &[set]);
        for trial in 0..20 {
            let push = crate::ask::trial::push(&swung, trial);
            let draw_m = push.bob.unwrap().draw_m(push.impulse_n_s);
            assert!((0.2..=1.0).contains(&draw_m), "{draw_m}");
        }
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("c.toml");
        let load = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Campaign::load(path.to_str().unwrap(), &Overrides::default())
        };
        let text = swung.to_toml().unwrap();
        assert_eq!(load(&text).unwrap(), swung);
        for (from, to, words) in [
            ("[push]\n", "[push]\nimpulse = 1\n", "push.impulse_n_s = "),
            ("mass_kg = 3", "mass_kg = 0", "push.pendulum.mass_kg = 0"),
            ("1.0]", "2.0]", "push.pendulum.draw_m.uniform = 2"),
            ("impulse_n_s = 0.0", "impulse_n_s = 1.0", "strikes once"),
        ] {
            assert!(text.contains(from), "{from} in {text}");
            let error = load(&text.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    /// It is the file from which people begin, and shows what a campaign that states nothing has.
    #[test]
    fn the_standard_campaign_states_the_default_settings_of_an_episode() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("c.toml");
        let text = "name = 'c'\ntrials = 1\nseed = 1\n[push]\nimpulse = 1\n";
        std::fs::write(&path, text).unwrap();
        let short = Campaign::load(path.to_str().unwrap(), &Overrides::default()).unwrap();
        assert_eq!(campaign("standard", &[]).episode, short.episode);
    }

    #[test]
    fn files_of_former_versions_call_the_controllers_gains() {
        let dir = tempfile::tempdir().unwrap();
        let read = |key: &str| {
            let path = dir.path().join("c.toml");
            let text = format!(
                "name = 'c'\n{key} = ['slow', 'hold']\ntrials = 1\nseed = 1\n[push]\nimpulse = 1\n"
            );
            std::fs::write(&path, text).unwrap();
            Campaign::load(path.to_str().unwrap(), &Overrides::default()).unwrap()
        };
        assert_eq!(read("gains"), read("controllers"));
        assert_eq!(read("gains").controllers, ["slow", "hold"]);
    }

    #[test]
    fn errors_of_an_assignment_name_the_key_and_what_is_accepted() {
        let forms = "string \"hard\"; accepted: a number, { uniform = [a, b] }, { normal = [mean, sd] } or { each = [a, b, ...] }";
        for (bad, expected) in [
            ("push.impulse_n_s=nan", &["push.impulse_n_s = NaN"][..]),
            (
                "push.impulse_n_s={uniform=[2, 1]}",
                &["push.impulse_n_s.uniform = 1", "smaller number first"],
            ),
            ("push.impulse_n_s=hard", &["--set", forms]),
            (
                "push.impulse_n_s={unifrom=[1, 2]}",
                &["unifrom", "one of `uniform`, `normal`, `each`"],
            ),
            (
                "push.impulse_n_s={uniform=[1, 2], normal=[1, 2]}",
                &["invalid length 2", "a number, {"],
            ),
            // With what 1 of the robot's own unit is.
            (
                "push.impulse=-1",
                &["push.impulse_n_s = -2.16", "(1 of push.impulse is 2.16"],
            ),
            ("push.impulse=hard", &[forms]),
            (
                "push.impuls=1",
                &["--set", "push.impulse, push.impulse_n_s"],
            ),
            (
                "push.duration_s=0",
                &["push.duration_s = 0", "0.001 to 1.5"],
            ),
            ("pushes.impulse_n_s=1", &["--set", "sensors"]),
            ("trials=many", &["--set", "integer"]),
            ("trials.x=1", &["--set", "accepted: trials"]),
            ("trials", &["--set", "KEY=VALUE"]),
            ("units.mass_kg=1", &["unknown key"]),
            (
                "episode.physics_step_s=0.0015",
                &["episode.physics_step_s = 0.0015"],
            ),
            (
                "variations.mass_scale=0",
                &["variations.mass_scale = 0", "0.5 to 2"],
            ),
            (
                "variations.friction=0",
                &["variations.friction = 0", "0.01 to 10"],
            ),
            (
                "variations.joint_friction_share=2",
                &["variations.joint_friction_share = 2", "0 to 1"],
            ),
            (
                "variations.joint_damping_share=-1",
                &["variations.joint_damping_share = -1", "0 to 1"],
            ),
            (
                "variations.trunk_com_x_m={uniform=[0, 0.1]}",
                &["variations.trunk_com_x_m.uniform = 0.1", "to 0.04959"],
            ),
            (
                "variations.slope_deg={normal=[20, 1]}",
                &["variations.slope_deg.normal = 20", "-15 to 15"],
            ),
            (
                "variations.slope_deg=-2",
                &[
                    "push.start_s = 0.5: the ground is still tilting",
                    "accepted: 0.5972 to 3",
                ],
            ),
            (
                "variations.delay_s=1",
                &["variations.delay_s = 1", "0 to 0.1"],
            ),
            (
                "variations.ground_step_m=1",
                &["variations.ground_step_m = 1", "-0.04959 to 0.04959"],
            ),
            (
                "variations.kp_scale=nominl",
                &["variations.kp_scale", "{ uniform = [a, b] }", "nominal"],
            ),
            (
                "variations.mass_kg=1",
                &["variations.mass_kg", "variations.mass_scale"],
            ),
            (
                "second_push.impuls=1",
                &["second_push.impulse, second_push.impulse_n_s"],
            ),
            (
                "second_push={impulse_n_s=-1}",
                &["second_push.impulse_n_s = -1", "0 to 10000"],
            ),
            (
                "second_push={impulse_n_s=1, after_s=4}",
                &["second_push.after_s = 4", "0 to 3.9"],
            ),
            (
                "second_push={impulse=1, impulse_n_s=2}",
                &[
                    "second_push.impulse, second_push.impulse_n_s = 1, 2",
                    "twice",
                ],
            ),
        ] {
            let overrides = Overrides {
                set: vec![bad.into()],
                ..Overrides::default()
            };
            let message = Campaign::load("nominal", &overrides)
                .unwrap_err()
                .to_string();
            for part in expected {
                assert!(message.contains(part), "{bad}: {part:?} not in {message:?}");
            }
        }
    }
}
