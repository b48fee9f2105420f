//! Arguments that several commands take, and checks of their values.

use super::terminal::note;
use crate::campaign::Overrides;
use crate::campaign::ask::gate::OnUnresolved;
use crate::error::{Error, Result};
use crate::files::folder_of;
use crate::sim::Engine;
use clap::Args;
use clap::builder::{PossibleValuesParser, RangedU64ValueParser, TypedValueParser};
use serde::Deserialize;
use serde::de::value::{Error as NoSuchName, StringDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The physics engines that `--engine` asks for where several can be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineChoice {
    Rapier,
    Mujoco,
    Both,
}

impl EngineChoice {
    /// The engine that is asked for; None for both.
    pub fn one(self) -> Option<Engine> {
        match self {
            EngineChoice::Rapier => Some(Engine::Rapier),
            EngineChoice::Mujoco => Some(Engine::Mujoco),
            EngineChoice::Both => None,
        }
    }
}

/// Names of the engines for `--engine`, and of [`EngineChoice`].
pub const ENGINES: [&str; 2] = ["rapier", "mujoco"];
pub const ENGINE_CHOICES: [&str; 3] = ["rapier", "mujoco", "both"];

/// Options that change a campaign.
#[derive(Debug, Default, Args)]
pub struct ChangeArgs {
    /// Controller by name or file, instead of those of the campaign; may be given several times
    #[arg(long = "controller", visible_alias = "gains", value_name = "NAME|FILE")]
    pub gains: Vec<String>,
    /// Compare variants of a controller: one for each value of a key, such as paper:stepping.alpha=2,5.
    ///
    /// The key names the table and the value in it, and counts in an array from 0: `gains.0.x`. The values are TOML.
    /// The variants replace the campaign's controllers, or come after those of --controller. If the option is given
    /// several times, each adds its variants; keys are not combined. --controller takes a single variant, SET:KEY=VALUE.
    #[arg(long, value_name = "SET:KEY=V1,V2,...")]
    pub vary: Vec<String>,
    /// Robot by name or URDF file; its settings are in a .toml file of the same name beside it, or are inferred
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// Physics engine that simulates the robot, or both [default: that of the campaign, or rapier]
    #[arg(long, value_name = "ENGINE", value_parser = one_of::<EngineChoice, 3>(ENGINE_CHOICES))]
    pub engine: Option<EngineChoice>,
    /// Seed of all random numbers
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Change one value of the campaign, e.g. push.height_m=0.05; the value is TOML
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl ChangeArgs {
    /// The engines that are asked for, one or two. None stands for that of the campaign.
    pub fn engines(&self) -> Vec<Option<Engine>> {
        match self.engine {
            Some(EngineChoice::Both) => Engine::ALL.map(Some).into(),
            one => vec![one.and_then(EngineChoice::one)],
        }
    }

    /// These changes in the form that [`Campaign::load`](crate::campaign::Campaign::load) takes, with the first of
    /// [`engines`](Self::engines).
    pub fn overrides(&self) -> Overrides {
        Overrides {
            set: self.set.clone(),
            seed: self.seed,
            gains: self.gains.clone(),
            vary: self.vary.clone(),
            robot: self.robot.clone(),
            engine: self.engines()[0],
            ..Overrides::default()
        }
    }
}

#[derive(Debug, Default, Args)]
pub struct GateArgs {
    /// What the result must show: 'A >= 0.80', 'A >= B + 0.10' or 'A >= baseline - 0.01', with controllers A and B.
    ///
    /// A and B are names of controllers as in the results. The option may be given several times, and adds to the gates
    /// of the campaign. A gate passes if its whole 95 % interval reaches what is asked, and fails (exit code 100) if
    /// the whole interval lies below. Otherwise it is unresolved, which is no failure unless --unresolved says so.
    /// `gates.confidence` of the campaign replaces the 95 %.
    #[arg(long, value_name = "EXPR")]
    pub gate: Vec<String>,
    /// How a gate counts that has too few trials to pass or to fail [default: as the campaign says, or else pass]
    #[arg(long, value_name = "pass|fail", value_parser = one_of::<OnUnresolved, 2>(["pass", "fail"]))]
    pub unresolved: Option<OnUnresolved>,
    /// Result folder of an earlier run with the same pushes, for gates that compare with a baseline
    #[arg(long, value_name = "DIR")]
    pub baseline: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ReplaysArgs {
    /// Write this many replays for each controller: pages that show a trial in 3D, to which report.html links.
    ///
    /// The first three show the easiest push that the set lost, the lost push nearest to the impulse that it survives
    /// in 50 % of trials, and the hardest push that it survived. A push is the harder, the larger its impulse is in
    /// relation to m omega d, where d is the distance from the COM to the edge of the support. With 0 no new ones are
    /// written.
    #[arg(long, value_name = "N", default_value_t = ReplaysArgs::default().replays, value_parser = up_to(MOST_EXTRAS))]
    pub replays: usize,
}

impl Default for ReplaysArgs {
    fn default() -> Self {
        Self { replays: 3 }
    }
}

#[derive(Debug, Default, Args)]
pub struct CheckArgs {
    /// Only check files, values, controllers, gates and outputs; run nothing and write nothing
    #[arg(long)]
    pub check: bool,
}

/// Ends a command with `--check`, after all checks. `what` names what would have run.
pub fn fine(what: &str) -> Result<ExitCode> {
    note(&format!("fine: {what}; nothing was run"));
    Ok(ExitCode::SUCCESS)
}

/// Most threads that a command accepts, which are several on each core of the largest machines.
pub const MOST_THREADS: u64 = 1024;
/// Most files or simulations that a command accepts beside its main work, for each controller.
pub const MOST_EXTRAS: u64 = 1000;

/// Checks the number of threads that the environment asks for, before Rayon starts them.
pub fn check_environment() -> Result<()> {
    const NAME: &str = "RAYON_NUM_THREADS";
    let Ok(text) = std::env::var(NAME) else { return Ok(()) };
    if text.parse().is_ok_and(|threads: u128| threads > MOST_THREADS.into()) {
        return Err(Error::value("environment", NAME, text, "too many threads", format!("up to {MOST_THREADS}")));
    }
    Ok(())
}

/// Reads a number from 0 to `most`.
pub fn up_to(most: u64) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(0..=most)
}

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

/// Checks before any work that a file can be written. Fails if its extension is none of `kinds`, if its folder does not
/// exist, or if `path` is a folder itself. Errors name `option`.
pub fn check_output(option: &str, path: &Path, kinds: &[&str]) -> Result<()> {
    let fail = |problem, accepted: &str| Err(Error::option(option, path.display(), problem, accepted));
    if !path.extension().and_then(OsStr::to_str).is_some_and(|extension| kinds.contains(&extension)) {
        return fail("unknown kind of file", &format!("a name that ends in .{}", kinds.join(" or .")));
    }
    if !folder_of(path).is_dir() {
        return fail("its folder does not exist", "a file in a folder that exists");
    }
    if path.is_dir() {
        return fail("it is a folder", "the name of a file");
    }
    Ok(())
}
