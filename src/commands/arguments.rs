//! Arguments that several commands take, and checks of their values.

use super::terminal::note;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::de::value::{Error as NoSuchName, StringDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};
use standfast_core::error::{Error, Result};
use standfast_files::{folder_of, is_no_file, shell_word};
use standfast_sim::Engine;
use standfast_study::{Folder, Overrides};
use std::ffi::OsStr;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Names of the engines for `--engine`.
pub const ENGINES: [&str; 2] = ["rapier", "mujoco"];
/// The word for all of them, where several can be compared.
pub const BOTH: &str = "both";

/// The campaign, with or without the name of the option.
#[derive(Debug, Default, Args)]
#[group(id = "of_campaign", multiple = false)]
pub struct CampaignArgs {
    /// Campaign: smoke, nominal, standard, harsh, robocup, dysturbance, or a TOML file
    #[arg(value_name = "CAMPAIGN")]
    first: Option<String>,
    /// The same as CAMPAIGN
    #[arg(long, value_name = "NAME|FILE")]
    campaign: Option<String>,
}

impl CampaignArgs {
    pub fn name(&self) -> Option<&str> {
        // If the first argument has a default, it is present beside the option, too, so the option comes first.
        self.campaign.as_deref().or(self.first.as_deref())
    }

    pub fn or_standard(&self) -> &str {
        self.name().unwrap_or("standard")
    }
}

/// The one controller of a command, with or without the name of the option. The command says whether it has a default.
#[derive(Debug, Default, Args)]
#[group(id = "of_controller", multiple = false)]
pub struct ControllerArgs {
    /// Controller by name or file, or a variant NAME:KEY=VALUE
    #[arg(value_name = "CONTROLLER", id = "first_controller")]
    first: Option<String>,
    /// The same as CONTROLLER
    #[arg(long, alias = "gains", value_name = "NAME|FILE")]
    controller: Option<String>,
}

impl ControllerArgs {
    /// The controller; the command line has made sure that there is one.
    pub fn name(&self) -> &str {
        self.controller
            .as_deref()
            .or(self.first.as_deref())
            .unwrap_or_default()
    }
}

/// The motors of a robot, if they are not its own.
#[derive(Debug, Default, Args)]
pub struct MotorsArgs {
    /// Motors of other settings or an MJCF, or of a policy's training
    #[arg(long = "motors", id = "motors", value_name = "FILE")]
    pub file: Option<String>,
}

/// A pendulum that pushes.
#[derive(Debug, Default, Args)]
pub struct PendulumArgs {
    /// Push by a bob on a rope, such as 3kg,1.75m
    #[arg(long = "pendulum", id = "pendulum", value_name = "MASS,ROPE", value_parser = mass_and_rope)]
    stated: Option<[f64; 2]>,
}

impl PendulumArgs {
    /// The change of a campaign by this pendulum with a drawback (m), if it is stated.
    pub fn change(&self, draw_m: Option<f64>) -> Option<String> {
        let draw = |draw_m: f64| format!("push.pendulum.draw_m={draw_m:?}");
        let Some([mass_kg, rope_m]) = self.stated else {
            return draw_m.map(draw);
        };
        // A search finds the drawback.
        let draw_m = draw_m.unwrap_or(0.5 * rope_m);
        Some(format!(
            "push.pendulum={{mass_kg={mass_kg:?}, rope_m={rope_m:?}, draw_m={draw_m:?}}}"
        ))
    }

    /// The option as it is to be typed again, after a space; empty if it is not stated.
    pub fn option(&self) -> String {
        self.stated.map_or_else(String::new, |[mass_kg, rope_m]| {
            format!(" --pendulum {mass_kg}kg,{rope_m}m")
        })
    }
}

/// Reads mass (kg) and length of the rope (m) of a pendulum.
fn mass_and_rope(text: &str) -> Result<[f64; 2], String> {
    let read = |part: &str, unit: &str| part.trim().strip_suffix(unit)?.trim().parse().ok();
    text.split_once(',')
        .and_then(|(mass, rope)| Some([read(mass, "kg")?, read(rope, "m")?]))
        .ok_or_else(|| {
            "is no pendulum; accepted: mass and rope with their units, such as 3kg,1.75m".into()
        })
}

/// Options that change a campaign.
#[derive(Debug, Default, Args)]
pub struct ChangeArgs {
    /// Controller by name or file; may be repeated
    #[arg(long = "controller", alias = "gains", value_name = "NAME|FILE")]
    pub gains: Vec<String>,
    /// Compare a controller with variants, such as paper:stepping.alpha=2,5
    #[arg(long, value_name = "NAME:KEY=V1,V2")]
    pub vary: Vec<String>,
    /// Robot by name, or URDF or MJCF file
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    #[command(flatten)]
    pub settings: SettingArgs,
}

/// Those that are the same for several controllers and robots.
#[derive(Debug, Default, Args)]
pub struct SettingArgs {
    /// Physics engine: rapier, mujoco or both
    #[arg(long, value_parser = [ENGINES[0], ENGINES[1], BOTH], hide_possible_values = true)]
    pub engine: Option<String>,
    /// Seed of all random numbers
    #[arg(long, value_name = "S", value_parser = count::<u64>(0..=MOST_SEED))]
    pub seed: Option<u64>,
    #[command(flatten)]
    pub motors: MotorsArgs,
    /// Change a value, such as push.height_m=0.05
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl ChangeArgs {
    /// These changes in the form that [`Campaign::load`](standfast_study::Campaign::load) takes.
    pub fn overrides(&self) -> Overrides {
        Overrides {
            controllers: self.gains.clone(),
            vary: self.vary.clone(),
            robot: self.robot.clone(),
            ..self.settings.overrides()
        }
    }
}

impl SettingArgs {
    /// The options that change the campaign beside seed and engine, each after a space, as they are to be typed again.
    pub fn options(&self) -> String {
        let motors = self.motors.file.iter().map(|motors| ("motors", motors));
        let set = self.set.iter().map(|assignment| ("set", assignment));
        motors
            .chain(set)
            .map(|(option, value)| format!(" --{option} {}", shell_word(value)))
            .collect()
    }

    /// As those of [`ChangeArgs`].
    pub fn overrides(&self) -> Overrides {
        Overrides {
            motors: self.motors.file.clone(),
            set: self.set.clone(),
            seed: self.seed,
            engines: engines_of(self.engine.as_deref()),
            ..Overrides::default()
        }
    }
}

/// The engines that a value of `--engine` stands for.
pub fn engines_of(asked: Option<&str>) -> Vec<Engine> {
    let mut engines = Engine::ALL.to_vec();
    engines.retain(|engine| asked.is_some_and(|asked| asked == BOTH || asked == engine.name()));
    engines
}

#[derive(Debug, Default, Args)]
pub struct GateArgs {
    /// A requirement, such as 'catch >= hold + 0.10'
    #[arg(long, value_name = "EXPR")]
    pub gate: Vec<String>,
    /// Result of an earlier run, for gates with `baseline`; or a packed one, such as g1-public, to be compared with
    #[arg(long, value_name = "DIR|NAME")]
    pub baseline: Option<PathBuf>,
}

impl GateArgs {
    /// The baseline, if it is packed.
    pub fn packed_baseline(&self) -> Result<Option<Folder>> {
        let baseline = self.baseline.as_deref().map(Folder::existing).transpose()?;
        Ok(baseline.filter(Folder::is_packed))
    }
}

#[derive(Debug, Args)]
pub struct ReplaysArgs {
    /// Pages that show a trial in 3D, for each controller; the report links to them
    #[arg(long, value_name = "N", default_value_t = ReplaysArgs::default().replays, value_parser = count::<usize>(0..=MOST_EXTRAS))]
    pub replays: usize,
}

impl Default for ReplaysArgs {
    fn default() -> Self {
        Self { replays: 3 }
    }
}

#[derive(Debug, Default, Args)]
pub struct DryRunArgs {
    /// Only check the input, and say what would run
    #[arg(long)]
    pub dry_run: bool,
}

/// Ends a command with `--dry-run`, after all checks. `what` names what would have run.
pub fn fine(what: &str) -> Result<ExitCode> {
    note(&format!("fine: {what}; nothing was written"));
    Ok(ExitCode::SUCCESS)
}

/// Most threads that a command accepts, which are several on each core of the largest machines.
pub const MOST_THREADS: u64 = 1024;
/// Most files or simulations that a command accepts beside its main work, for each controller.
pub const MOST_EXTRAS: u64 = 1000;

/// Reads a number whose unit is fixed. An error that such a unit causes says so.
pub fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| {
        let before_unit = text
            .split_once(|c: char| c.is_alphabetic() || c.is_whitespace() || "°%".contains(c))
            .map(|(number, _)| number.parse::<f64>());
        match before_unit {
            Some(Ok(number)) => {
                format!("the unit is fixed, and only the number is accepted: {number}")
            }
            _ => "is no number; accepted: a number without its unit, such as 2.5".into(),
        }
    })
}

/// Checks the number of threads that the environment asks for, before Rayon starts them.
pub fn check_environment() -> Result<()> {
    const NAME: &str = "RAYON_NUM_THREADS";
    let Ok(text) = std::env::var(NAME) else {
        return Ok(());
    };
    if text
        .parse()
        .is_ok_and(|threads: u128| threads > MOST_THREADS.into())
    {
        return Err(Error::value(
            "environment",
            NAME,
            text,
            "too many threads",
            format!("up to {MOST_THREADS}"),
        ));
    }
    Ok(())
}

/// Largest seed, as a campaign's file can state it.
pub const MOST_SEED: u64 = i64::MAX as u64;

/// Reads a whole number of this range, also one that is written as 1e3.
pub fn count<T>(range: RangeInclusive<u64>) -> impl TypedValueParser<Value = T>
where
    T: TryFrom<u64> + Clone + Send + Sync + 'static,
{
    // All whole numbers up to here are numbers with a fraction, too.
    const EXACT: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
    move |text: &str| {
        let number = match (text.parse::<u64>(), text.parse::<f64>()) {
            (Ok(number), _) => Some(number),
            (_, Ok(number)) if (0.0..=EXACT).contains(&number) && number.fract() == 0.0 => {
                Some(number as u64)
            }
            _ => None,
        };
        let accepted = match *range.end() {
            MOST_TRIAL => format!("a whole number of {} or more", range.start()),
            most => format!("a whole number from {} to {most}", range.start()),
        };
        let number = number.ok_or_else(|| format!("is no count; accepted: {accepted}"))?;
        let in_range = Some(number).filter(|number| range.contains(number));
        in_range
            .and_then(|number| T::try_from(number).ok())
            .ok_or_else(|| format!("out of range; accepted: {accepted}"))
    }
}

/// Largest number of a trial: those of searches are larger than those of any campaign.
pub const MOST_TRIAL: u64 = u64::MAX >> 8;

/// Reads a value by its name, which is the same on the command line and in files.
pub fn one_of<T, const N: usize>(names: [&'static str; N]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| -> Result<T, NoSuchName> {
        let name: StringDeserializer<NoSuchName> = name.into_deserializer();
        T::deserialize(name)
    })
}

/// Whether a path ends as files of this kind do.
pub fn is_file_of(path: &str, extension: &str) -> bool {
    Path::new(path)
        .extension()
        .is_some_and(|own| own.eq_ignore_ascii_case(extension))
}

/// Checks before any work that a file can be written. Fails if its extension is none of `kinds`, if its folder does not
/// exist, or if `path` is a folder, pipe or device itself. Errors name `option`.
pub fn check_output(option: &str, path: &Path, kinds: &[&str]) -> Result<()> {
    let fail =
        |problem, accepted: &str| Err(Error::option(option, path.display(), problem, accepted));
    if !path
        .extension()
        .and_then(OsStr::to_str)
        .is_some_and(|extension| kinds.contains(&extension))
    {
        return fail(
            "unknown kind of file",
            &format!("a name that ends in .{}", kinds.join(" or .")),
        );
    }
    if !folder_of(path).is_dir() {
        return fail(
            "its folder does not exist",
            "a file in a folder that exists",
        );
    }
    if is_no_file(path) {
        return fail(
            "it is no file, but a folder, pipe or device",
            "the name of a file, which is made or replaced",
        );
    }
    Ok(())
}
