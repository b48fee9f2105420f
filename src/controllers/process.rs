//! Programs of any language: a controller that runs in a process of its own, and answers the readings of each tick with
//! a command, as lines of JSON. The guide's chapter `process.md` has the protocol.
//!
//! Each worker has a child, which serves one episode after another. A child that dies, hangs or answers nonsense is
//! replaced, and its episode ends as failed, with the cause.

use super::child::{Talker, Trouble, in_short, shortened};
use super::command::CommandFiles;
use super::companion_files;
use super::permission;
use super::spec::{ControllerSpec, about, check_name};
use super::tunable::Tunable;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{PerFoot, Robot};
use standfast_core::socket::{
    Command, Controller, PreparedController, Report, Sensed, TickError, Wrench,
};
use standfast_files::assets::{Source, number, parse_toml};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use toml::Table;

/// The version of the protocol.
const PROTOCOL: u64 = 1;
/// Limits of what traces, replays and results keep of an episode: characters of a phase or a name, numbers of a tick,
/// names of numbers, and phases. `MOST_NUMBERS` is the limit of the numbers of a tick and of the names.
const MOST_LETTERS: usize = 100;
const MOST_NUMBERS: usize = 100;
const MOST_PHASES: usize = 1000;
/// Longest timeout of an answer that a file may state (s), and the timeout of the first answer, before which a program
/// loads.
const MOST_TIMEOUT_S: f64 = 1000.0;
const START: Duration = Duration::from_secs(30);
/// Largest number of characters that are shown of a child's error, or of the reason why its answer cannot be read.
const MOST_WORDS: usize = 1000;

/// The content of the controller's file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Process {
    kind: String,
    name: String,
    #[serde(default)]
    description: String,
    /// The program and its arguments. It runs in the folder of the file.
    command: Vec<String>,
    /// Further files that the program reads, relative to the folder of the file.
    #[serde(default)]
    files: Vec<String>,
    /// Longest time for an answer (s).
    #[serde(default = "one_second")]
    timeout_s: f64,
    /// Settings of the program; `--vary` can change them.
    #[serde(default)]
    parameters: Table,
    /// Which numbers of `parameters` are worth tuning, each with the ends of its range.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    tunable: BTreeMap<String, [f64; 2]>,
    /// Path of the file itself. No file states this key.
    #[serde(default)]
    file: String,
}

fn one_second() -> f64 {
    1.0
}

impl Process {
    /// Reads a file, and keeps its path.
    pub fn read(source: &Source) -> Result<Box<dyn ControllerSpec>> {
        companion_files::refuse_file(
            source,
            "`command`, `files`, `timeout_s`, `parameters`, `tunable`",
        )?;
        Ok(Box::new(Self {
            file: source.file.clone(),
            ..parse_toml(source)?
        }))
    }

    fn bad(&self, field: &str, value: impl ToString, problem: &str, accepted: &str) -> Error {
        Error::value(&self.file, field, value, problem, accepted)
    }

    fn followed(&self) -> CommandFiles {
        CommandFiles::of(
            &companion_files::folder(&self.file),
            &self.command,
            &self.files,
        )
    }

    /// Starts a child and greets it.
    fn start(&self, hello: &str) -> Result<Talker, Trouble> {
        let (folder, [program, args @ ..]) =
            (companion_files::folder(&self.file), &self.command[..])
        else {
            return Err("there is no command".to_string().into());
        };
        // A path is relative to the folder of the file; a plain name is searched for as usual.
        let program = match Path::new(program).components().count() {
            1 => PathBuf::from(program),
            _ => folder
                .canonicalize()
                .unwrap_or(folder.clone())
                .join(program),
        };
        let mut command = process::Command::new(program);
        // Otherwise Python writes compiled scripts beside the scripts, even in the folder of a result.
        command
            .args(args)
            .current_dir(&folder)
            .env("PYTHONDONTWRITEBYTECODE", "1");
        let mut talker = Talker::start(&mut command)?;
        let answer = talker.ask(hello, START)?;
        let hello: Hello = serde_json::from_str(&answer).map_err(|e| {
            format!(
                "does not answer the greeting as it should ({e}): {}",
                in_short(&answer)
            )
        })?;
        match hello.protocol {
            PROTOCOL => Ok(talker),
            other => {
                Err(format!("speaks version {other} of the protocol; accepted: {PROTOCOL}").into())
            }
        }
    }
}

impl ControllerSpec for Process {
    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, file: &str) -> Result<()> {
        check_name(file, &self.name)?;
        if self.command.first().is_none_or(String::is_empty) {
            let accepted = "a program and its arguments, such as [\"python3\", \"mine.py\"]";
            return Err(Error::value(
                file,
                "command",
                "[]",
                "names no program",
                accepted,
            ));
        }
        for (name, [from, to]) in &self.tunable {
            let (field, value) = (format!("tunable.{name}"), format!("[{from}, {to}]"));
            if !self
                .parameters
                .get(name)
                .and_then(number)
                .is_some_and(f64::is_finite)
            {
                let numbers = self
                    .parameters
                    .iter()
                    .filter(|(_, value)| number(value).is_some_and(f64::is_finite));
                let numbers: Vec<&str> = numbers.map(|(name, _)| name.as_str()).collect();
                let problem = "is no number among the parameters";
                return Err(Error::value(
                    file,
                    field,
                    value,
                    problem,
                    format!("one of: {}", numbers.join(", ")),
                ));
            }
            if let Some(problem) = Tunable::problem([*from, *to]) {
                return Err(Error::value(
                    file,
                    field,
                    value,
                    problem,
                    "[FROM, TO], two finite numbers",
                ));
            }
        }
        let is_time = self.timeout_s > 0.0 && self.timeout_s <= MOST_TIMEOUT_S;
        if is_time {
            return Ok(());
        }
        Err(Error::value(
            file,
            "timeout_s",
            self.timeout_s,
            "out of range",
            format!("more than 0, at most {MOST_TIMEOUT_S}"),
        ))
    }

    fn tree(&self) -> Table {
        Table::try_from(self).expect("it was read from a table")
    }

    /// The files in the folder of the controller's file that the command refers to, and the files that the file lists.
    fn files(&self) -> Result<Vec<(String, Vec<u8>)>> {
        self.followed()
            .kept
            .iter()
            .map(|name| companion_files::read(&self.file, "files", name))
            .collect()
    }

    fn not_kept(&self) -> Vec<String> {
        self.followed().not_kept.into_iter().collect()
    }

    fn is_program(&self) -> bool {
        true
    }

    fn tunables(&self) -> Vec<Tunable> {
        let mut tunables = Vec::new();
        for (name, range) in &self.tunable {
            let now = self.parameters.get(name).and_then(number);
            let key = format!("parameters.{name}");
            tunables.push(Tunable::new(key, now.unwrap_or_default(), *range));
        }
        tunables
    }

    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<PreparedController> {
        permission::check(&self.file, &self.command)?;
        let hello = line(&hello(robot, period_s, &self.parameters));
        let first = self.start(&hello).map_err(|trouble| match trouble {
            Trouble::OfChild(problem) => {
                let accepted =
                    "a program that speaks the protocol of the guide's chapter process.md";
                self.bad("command", self.command.join(" "), &problem, accepted)
            }
            Trouble::OfMachine(problem) => Error::Machine(problem),
            Trouble::Stopped => Error::Interrupted,
        })?;
        let shared = Arc::new(SharedProcess {
            settings: self.clone(),
            hello,
            idle: Mutex::new(vec![first]),
        });
        let about = about(&self.description, &self.command.join(" "));
        Ok(PreparedController::new(&self.name, about, move |seed| {
            Remote {
                shared: Arc::clone(&shared),
                seed,
                talker: None,
                phase: "starting".into(),
                numbers: Vec::new(),
                phases: BTreeSet::new(),
                names: BTreeSet::new(),
            }
        }))
    }
}

/// The data that all episodes share.
struct SharedProcess {
    settings: Process,
    hello: String,
    /// Children that serve no episode now.
    idle: Mutex<Vec<Talker>>,
}

impl SharedProcess {
    fn idle(&self) -> std::sync::MutexGuard<'_, Vec<Talker>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The controller in one episode.
struct Remote {
    shared: Arc<SharedProcess>,
    seed: u64,
    /// The child of this episode; None before the first tick and after a failure.
    talker: Option<Talker>,
    phase: String,
    numbers: Vec<(String, f64)>,
    /// All phases and all names of numbers of this episode so far.
    phases: BTreeSet<String>,
    names: BTreeSet<String>,
}

impl Remote {
    /// A child that is ready for this episode: an idle one, or a new one.
    fn begin(&self, limit: Duration) -> Result<Talker, Trouble> {
        let idle = self.shared.idle().pop();
        let mut talker = idle.map_or_else(|| self.shared.settings.start(&self.shared.hello), Ok)?;
        // The seed is sent as text, because every bit of it counts, and many languages have numbers of 53 bits.
        let answer = talker.ask(
            &line(&json!({ "type": "reset", "seed": self.seed.to_string() })),
            limit,
        )?;
        let said: Value = serde_json::from_str(&answer).map_err(|e| nonsense(&answer, &e))?;
        if said["type"] == "ready" {
            Ok(talker)
        } else {
            Err(format!(
                "does not answer `reset` with `ready`: {}",
                in_short(&answer)
            )
            .into())
        }
    }

    /// Fails if the phase or the numbers of an answer exceed what traces, replays and results keep.
    fn check_told(&mut self, answer: &Answer) -> Result<(), String> {
        let count = answer.numbers.len();
        if count > MOST_NUMBERS {
            return Err(format!(
                "answered with {count} `numbers`; accepted: up to {MOST_NUMBERS}"
            ));
        }
        let kinds = [
            (
                "phase",
                "phases",
                &mut self.phases,
                MOST_PHASES,
                answer.phase.iter().collect::<Vec<_>>(),
            ),
            (
                "name in `numbers`",
                "names in `numbers`",
                &mut self.names,
                MOST_NUMBERS,
                answer.numbers.keys().collect(),
            ),
        ];
        for (one, many, told, most, new) in kinds {
            if let Some(long) = new.iter().find(|text| text.chars().count() > MOST_LETTERS) {
                let length = long.chars().count();
                return Err(format!(
                    "answered with a {one} of {length} characters; accepted: up to {MOST_LETTERS}"
                ));
            }
            for text in new {
                if !told.contains(text) {
                    told.insert(text.clone());
                }
            }
            if told.len() > most {
                return Err(format!(
                    "answered with more than {most} different {many} in an episode; accepted: up to {most}"
                ));
            }
        }
        Ok(())
    }

    fn ask(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), Trouble> {
        let limit = Duration::from_secs_f64(self.shared.settings.timeout_s);
        let mut talker = self.talker.take().map_or_else(|| self.begin(limit), Ok)?;
        let text = talker.ask(&line(&Reading::of(sensed)), limit)?;
        let answer: Answer = serde_json::from_str(&text).map_err(|e| nonsense(&text, &e))?;
        if let Some(error) = answer.error {
            return Err(format!("gives up: {}", shortened(&error, MOST_WORDS)).into());
        }
        self.check_told(&answer)?;
        command.q_ref = answer.q_ref;
        let zeros = || vec![0.0; command.q_ref.len()];
        (command.dq_ref, command.tau_ff) = (
            answer.dq_ref.unwrap_or_else(zeros),
            answer.tau_ff.unwrap_or_else(zeros),
        );
        command.gains = answer.gains;
        if let Some(phase) = answer.phase {
            self.phase = phase;
        }
        let numbers = answer.numbers.into_iter();
        self.numbers = numbers
            .filter_map(|(name, number)| Some((name, number.as_f64()?)))
            .collect();
        // Only a child that has answered is kept.
        self.talker = Some(talker);
        Ok(())
    }
}

impl Controller for Remote {
    fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
        self.ask(sensed, command).map_err(|trouble| match trouble {
            Trouble::OfChild(problem) => {
                TickError::Failed(format!("{} {problem}", self.shared.settings.name))
            }
            Trouble::OfMachine(problem) => TickError::Machine(problem),
            Trouble::Stopped => TickError::Interrupted,
        })
    }

    fn report(&self) -> Report<'_> {
        Report {
            others: &self.numbers,
            ..Report::of_phase(&self.phase)
        }
    }

    /// A process cannot be copied.
    fn fork(&self) -> Option<Box<dyn Controller>> {
        None
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        self.shared.idle().extend(self.talker.take());
    }
}

fn nonsense(answer: &str, error: &serde_json::Error) -> String {
    let error = shortened(&error.to_string(), MOST_WORDS);
    format!(
        "answered with something else than a command ({error}): {}",
        in_short(answer)
    )
}

/// A value as one line.
pub(super) fn line(value: &impl Serialize) -> String {
    // Numbers that are not finite become null, and nothing else can fail.
    serde_json::to_string(value).unwrap_or_default() + "\n"
}

/// The greeting: the robot as it is designed, and the control period (s).
pub(super) fn hello(robot: &Robot, period_s: f64, parameters: &Table) -> Value {
    let home = robot.home_command();
    let mut joints = Vec::new();
    for (joint, servo) in robot.joints.iter().zip(&robot.servos) {
        joints.push(json!({
            "name": joint.name,
            "lower_rad": joint.lower_rad,
            "upper_rad": joint.upper_rad,
            "torque_n_m": servo.torque_n_m,
            "kp": servo.kp,
            "kd": servo.kd,
            "rotor_inertia_kg_m2": servo.rotor_inertia_kg_m2,
            "friction_n_m": servo.friction_n_m,
            "damping_n_m_s_rad": servo.damping_n_m_s_rad,
        }));
    }
    let links = robot.links.iter();
    let links: Vec<Value> = links
        .map(|link| json!({ "name": link.name, "mass_kg": link.mass_kg }))
        .collect();
    json!({
        "type": "hello",
        "protocol": PROTOCOL,
        "period_s": period_s,
        "parameters": parameters,
        "robot": {
            "name": robot.name,
            "urdf": robot.urdf,
            "trunk": robot.links[robot.trunk].name,
            "mass_kg": robot.mass(),
            "com_height_m": robot.home_com_height(),
            "joints": joints,
            "links": links,
            "home": { "q_ref": home.q_ref, "tau_ff": home.tau_ff },
        },
    })
}

#[derive(Deserialize)]
struct Hello {
    protocol: u64,
}

/// The readings of a tick.
#[derive(Serialize)]
struct Reading<'a> {
    r#type: &'static str,
    time_s: f64,
    q: &'a [f64],
    dq: &'a [f64],
    /// Rotation from the trunk's frame to the world: w, x, y, z.
    orientation: [f64; 4],
    gyro: [f64; 3],
    accelerometer: [f64; 3],
    left: SoleLoad,
    right: SoleLoad,
}

#[derive(Serialize)]
struct SoleLoad {
    force: [f64; 3],
    moment: [f64; 3],
}

impl<'a> Reading<'a> {
    fn of(sensed: &'a Sensed) -> Self {
        let (imu, turn) = (&sensed.imu, &sensed.imu.orientation);
        let load = |Wrench { force, moment }: Wrench| SoleLoad {
            force: force.into(),
            moment: moment.into(),
        };
        let PerFoot { left, right } = sensed.soles;
        Self {
            r#type: "tick",
            time_s: sensed.time_s,
            q: &sensed.q,
            dq: &sensed.dq,
            orientation: [turn.w, turn.i, turn.j, turn.k],
            gyro: imu.gyro.into(),
            accelerometer: imu.accelerometer.into(),
            left: load(left),
            right: load(right),
        }
    }
}

/// The answer to a tick.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    #[serde(default)]
    q_ref: Vec<f64>,
    dq_ref: Option<Vec<f64>>,
    tau_ff: Option<Vec<f64>>,
    gains: Option<Vec<[f64; 2]>>,
    phase: Option<String>,
    /// Numbers for traces.
    #[serde(default)]
    numbers: Map<String, Value>,
    /// The reason why the program cannot go on.
    error: Option<String>,
}
