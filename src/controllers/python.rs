//! Objects of a Python process that has started this program (`standfast.run` of the Python module): many episodes ask one
//! object, and get their answers together.
//!
//! The environment variable [`ADDRESS`] names the Unix socket of the Python process. Each prepared controller has a
//! connection of its own, which begins with a line of JSON from either side. Then a frame of readings is sent, and a frame of
//! commands comes back, and so on. All numbers are little-endian.
//!
//! A frame of readings has `batch` rows, always: what a matrix product gives for a row may depend on the number of rows. It
//! is a u64, the number of rows that count; for each row four u64 (episode, slot, 1 if the episode is new, seed); and for each
//! row its readings as f64, whose places, sizes and units the greeting has under `observation`. The rows that do not count
//! repeat the first one, as a new episode in a slot of their own, the last one. Each open episode has one of `slots` slots.
//!
//! A frame of commands is two u32, the parts that it has (bits in the order of [`PARTS`]) and the number of bytes of a
//! text; the text; and each part as f64, with a row for each row of readings and a column for each joint. The text is
//! empty, or JSON: `{"error": "..."}` ends everything, and `{"failed": {"3": "..."}}` ends the episode of row 3. A row whose
//! kp and kd are all NaN keeps the gains of the servos.

use super::child::STOP;
use super::companion_files;
use super::process::{hello, line};
use super::spec::{ControllerSpec, about, check_name};
use super::turns::{self, Turns, Waiter, locked};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Foot, Robot};
use standfast_core::socket::{Command, Controller, PreparedController, Report, Sensed, TickError};
use standfast_files::assets::{Source, parse_toml};
use std::collections::{BTreeMap, VecDeque};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use toml::Table;

/// The environment variable with the path of the socket.
const ADDRESS: &str = "STANDFAST_PYTHON";
/// The version of the exchange.
const PROTOCOL: u64 = 1;
/// The parts of a command, in the order of their bits and in a frame.
const PARTS: [&str; 5] = ["q_ref", "dq_ref", "tau_ff", "kp", "kd"];
/// Largest number of rows: two batches are open at once, each episode on a thread.
const MOST_BATCH: usize = 512;
/// Longest timeout of an answer that a file may state (s). The greeting and the first answer have at least `START`: a network is
/// loaded.
const MOST_TIMEOUT_S: f64 = 1e6;
const START: Duration = Duration::from_secs(600);
/// Largest number of bytes of a text.
const MOST_BYTES: usize = 1_000_000;
/// Time between two looks at [`STOP`], and at whether a batch that is not full is due.
const GLANCE: Duration = Duration::from_millis(20);
const LOOK: Duration = Duration::from_millis(1);
/// Time after which a row is sent in any case.
const PATIENCE: Duration = Duration::from_secs(1);

/// The content of the controller's file, which the Python module writes.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PythonObject {
    kind: String,
    name: String,
    /// What the object is, for people: its module and its class.
    object: String,
    /// Tells this object from others: the Python process answers for no other.
    version: String,
    /// Number of rows of a frame.
    batch: usize,
    /// Longest time for an answer (s).
    timeout_s: f64,
    /// Path of the file itself. No file states this key.
    #[serde(default)]
    file: String,
}

impl PythonObject {
    /// Reads a file, and keeps its path.
    pub fn read(source: &Source) -> Result<Box<dyn ControllerSpec>> {
        companion_files::refuse_file(source, "`object`, `version`, `batch`, `timeout_s`")?;
        Ok(Box::new(Self {
            file: source.file.clone(),
            ..parse_toml(source)?
        }))
    }

    /// Connects to the Python process and greets it. `slots` is the number of episodes that may be open at once.
    fn connect(&self, robot: &Robot, period_s: f64, slots: usize) -> Result<UnixStream> {
        let Some(address) = std::env::var_os(ADDRESS) else {
            return Err(Error::value(
                &self.file,
                "kind",
                "\"python\"",
                format!(
                    "this controller was an object of another process, of Python: {}. It ended with that process",
                    self.object
                ),
                "`standfast.run(...)` in Python, which makes it anew; a controller in a script has kind = \"process\"",
            ));
        };
        let ended = |problem: String| Error::Ended(format!("{}: {problem}", self.name));
        let mut stream = UnixStream::connect(&address)
            .map_err(|e| ended(format!("the Python process cannot be reached: {e}")))?;
        let mut greeting = hello(robot, period_s, &Table::new());
        greeting["protocol"] = PROTOCOL.into();
        greeting["name"] = self.name.clone().into();
        greeting["version"] = self.version.clone().into();
        greeting["batch"] = self.batch.into();
        greeting["slots"] = (slots + 1).into();
        greeting["observation"] = layout(robot.joints.len()).into();
        let limit = START.max(Duration::from_secs_f64(self.timeout_s));
        let answer = stream
            .set_read_timeout(Some(GLANCE))
            .and_then(|()| stream.set_write_timeout(Some(GLANCE)))
            .map_err(|e| End::Ended(e.to_string()))
            .and_then(|()| send(&mut stream, line(&greeting).as_bytes(), limit))
            .and_then(|()| hear_line(&mut stream, limit));
        let answer = match answer {
            Ok(answer) => answer,
            Err(End::Stopped) => return Err(Error::Interrupted),
            Err(End::Ended(problem)) => return Err(ended(problem)),
        };
        match (answer["error"].as_str(), answer["protocol"].as_u64()) {
            (Some(error), _) => Err(ended(error.into())),
            (None, Some(PROTOCOL)) => Ok(stream),
            _ => Err(ended(format!(
                "the Python module speaks another version of the exchange: {answer}; accepted: {PROTOCOL}"
            ))),
        }
    }
}

impl ControllerSpec for PythonObject {
    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, file: &str) -> Result<()> {
        check_name(file, &self.name)?;
        let (batch, least_s) = (self.batch as f64, 1e-3);
        let numbers = [
            ("batch", batch, 1.0, MOST_BATCH as f64),
            ("timeout_s", self.timeout_s, least_s, MOST_TIMEOUT_S),
        ];
        Error::check_ranges(file, "", &numbers)
    }

    fn tree(&self) -> Table {
        Table::try_from(self).expect("it was read from a table")
    }

    fn not_kept(&self) -> Vec<String> {
        vec![format!("the Python object {}", self.object)]
    }

    /// Two batches: while one is answered, the other is simulated.
    fn open_episodes(&self) -> usize {
        2 * self.batch
    }

    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<PreparedController> {
        // Some are open at the start of a run, beside those of the trials.
        let slots = turns::most_threads(self.open_episodes()) + 16;
        let stream = self.connect(robot, period_s, slots)?;
        let exchange = Arc::new(Exchange {
            name: self.name.clone(),
            joints: robot.joints.len(),
            batch: self.batch,
            slots,
            timeout: Duration::from_secs_f64(self.timeout_s),
            state: Mutex::new(State {
                free: (0..slots).rev().collect(),
                ..State::default()
            }),
            wake: Condvar::new(),
        });
        let served = Arc::clone(&exchange);
        thread::Builder::new()
            .spawn(move || served.serve(stream))
            .map_err(|e| Error::Machine(format!("a thread cannot be started: {e}")))?;
        let open = Arc::new(Open(exchange));
        let about = about("", &format!("the Python object {}", self.object));
        Ok(PreparedController::new(&self.name, about, move |seed| {
            Remote::new(&open, seed)
        }))
    }
}

/// The places of readings in a row.
fn layout(joints: usize) -> Vec<Value> {
    let columns = [
        ("time_s", 1, "s"),
        ("q", joints, "rad"),
        ("dq", joints, "rad/s"),
        ("orientation", 4, "1"),
        ("gyro", 3, "rad/s"),
        ("accelerometer", 3, "m/s^2"),
        ("left_force", 3, "N"),
        ("left_moment", 3, "N m"),
        ("right_force", 3, "N"),
        ("right_moment", 3, "N m"),
    ];
    let mut offset = 0;
    let placed = columns.into_iter().map(|(name, size, unit)| {
        let column = json!({ "name": name, "offset": offset, "size": size, "unit": unit });
        offset += size;
        column
    });
    placed.collect()
}

/// Writes readings as the [`layout`] has them.
fn write_row(sensed: &Sensed, row: &mut Vec<f64>) {
    let (imu, turn) = (&sensed.imu, &sensed.imu.orientation);
    row.clear();
    row.push(sensed.time_s);
    row.extend(&sensed.q);
    row.extend(&sensed.dq);
    row.extend([turn.w, turn.i, turn.j, turn.k]);
    row.extend(imu.gyro.iter().chain(&imu.accelerometer));
    for foot in Foot::BOTH {
        let load = &sensed.soles[foot];
        row.extend(load.force.iter().chain(&load.moment));
    }
}

/// Why there is no answer any more.
#[derive(Debug, Clone)]
enum End {
    Ended(String),
    Stopped,
}

/// All episodes of a prepared controller, and its connection.
struct Exchange {
    name: String,
    joints: usize,
    batch: usize,
    slots: usize,
    timeout: Duration,
    state: Mutex<State>,
    /// Notified when a batch may be due.
    wake: Condvar,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Waiting>,
    /// Slots that no episode has.
    free: Vec<usize>,
    /// Number of episodes so far.
    episodes: u64,
    end: Option<End>,
    is_closed: bool,
}

/// An episode that waits for its answer, and the turns in which its thread goes on.
struct Waiting {
    desk: Arc<Desk>,
    turns: Option<Arc<Turns>>,
    since: Instant,
}

/// What an episode and the connection hand each other.
struct Desk {
    seed: u64,
    content: Mutex<Content>,
}

#[derive(Default)]
struct Content {
    waiter: Arc<Waiter>,
    episode: u64,
    slot: usize,
    is_old: bool,
    row: Vec<f64>,
    /// The parts of the command that the answer has, one after another, or why there is none.
    parts: u32,
    command: Vec<f64>,
    failure: Option<Failure>,
}

#[derive(Clone)]
enum Failure {
    OfEpisode(String),
    OfAll(End),
}

impl Exchange {
    /// Sends frames of readings and hands the answers out, until the controller is dropped or there is no answer.
    fn serve(&self, mut stream: UnixStream) {
        // The first call may compile.
        let (mut frame, mut limit) = (Vec::new(), START.max(self.timeout));
        while let Some(batch) = self.next() {
            let answer = self
                .ask(&mut stream, &batch, &mut frame, limit)
                .and_then(|parts| self.hand_out(&batch, parts, &frame));
            limit = self.timeout;
            if let Err(end) = answer {
                let waiting = {
                    let mut state = locked(&self.state);
                    state.end = Some(end.clone());
                    std::mem::take(&mut state.waiting)
                };
                for Waiting { desk, turns, .. } in batch.into_iter().chain(waiting) {
                    locked(&desk.content).failure = Some(Failure::OfAll(end.clone()));
                    let waiter = Arc::clone(&locked(&desk.content).waiter);
                    go_on(turns.as_deref(), &waiter);
                }
                return;
            }
        }
    }

    /// The rows to send next, as soon as they are due: a full batch, or all rows if nobody computes who could add one.
    /// It is None if the controller was dropped.
    fn next(&self) -> Option<Vec<Waiting>> {
        let mut state = locked(&self.state);
        loop {
            if state.is_closed {
                return None;
            }
            // Nobody else can add a row to that of a single episode.
            let is_due = state.waiting.len() >= self.batch
                || state.free.len() + 1 == self.slots
                || state.waiting.iter().any(|waiting| match &waiting.turns {
                    None => true,
                    Some(turns) => turns.are_idle(),
                })
                || STOP.load(Ordering::Relaxed)
                || state
                    .waiting
                    .front()
                    .is_some_and(|first| first.since.elapsed() > PATIENCE);
            let count = self.batch.min(state.waiting.len());
            if is_due && count > 0 {
                return Some(state.waiting.drain(..count).collect());
            }
            state = match count {
                0 => self
                    .wake
                    .wait(state)
                    .unwrap_or_else(PoisonError::into_inner),
                _ => {
                    let woken = self.wake.wait_timeout(state, LOOK);
                    woken.unwrap_or_else(PoisonError::into_inner).0
                }
            };
        }
    }

    /// Sends a frame of readings, and reads the answer into `frame`. Returns which parts it has, and its text.
    fn ask(
        &self,
        stream: &mut UnixStream,
        batch: &[Waiting],
        frame: &mut Vec<u8>,
        limit: Duration,
    ) -> Result<(u32, Value), End> {
        frame.clear();
        frame.extend((batch.len() as u64).to_le_bytes());
        let desks: Vec<_> = batch.iter().map(|waiting| &waiting.desk).collect();
        for desk in &desks {
            let content = locked(&desk.content);
            let is_new = u64::from(!content.is_old);
            for number in [content.episode, content.slot as u64, is_new, desk.seed] {
                frame.extend(number.to_le_bytes());
            }
        }
        for _ in desks.len()..self.batch {
            for number in [u64::MAX, self.slots as u64, 1, 0] {
                frame.extend(number.to_le_bytes());
            }
        }
        for row in 0..self.batch {
            let content = locked(&desks.get(row).unwrap_or(&desks[0]).content);
            frame.extend(content.row.iter().flat_map(|number| number.to_le_bytes()));
        }
        send(stream, frame, limit)?;

        let mut head = [0; 8];
        hear(stream, &mut head, limit)?;
        let [parts, text] = [0, 4]
            .map(|at| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]));
        if text as usize > MOST_BYTES || parts >> PARTS.len() != 0 {
            return Err(End::Ended("its answer is no frame of commands".into()));
        }
        frame.resize(text as usize, 0);
        hear(stream, frame, limit)?;
        let text: Value = match frame.is_empty() {
            true => Value::Null,
            false => serde_json::from_slice(frame)
                .map_err(|e| End::Ended(format!("the text of its answer is no JSON: {e}")))?,
        };
        if let Some(error) = text["error"].as_str() {
            return Err(End::Ended(error.into()));
        }
        if parts & 1 == 0 {
            return Err(End::Ended("its answer has no q_ref".into()));
        }
        let numbers = parts.count_ones() as usize * self.batch * self.joints;
        frame.resize(size_of::<f64>() * numbers, 0);
        hear(stream, frame, limit)?;
        Ok((parts, text))
    }

    /// Hands each episode of a batch its answer, and lets it go on.
    fn hand_out(
        &self,
        batch: &[Waiting],
        (parts, text): (u32, Value),
        frame: &[u8],
    ) -> Result<(), End> {
        let failed: BTreeMap<usize, String> = match &text["failed"] {
            Value::Null => BTreeMap::new(),
            failed => Deserialize::deserialize(failed)
                .map_err(|e| End::Ended(format!("`failed` of its answer: {e}")))?,
        };
        let width = size_of::<f64>() * self.joints;
        for (row, Waiting { desk, turns, .. }) in batch.iter().enumerate() {
            let mut content = locked(&desk.content);
            content.parts = parts;
            content.command.clear();
            for part in frame.chunks_exact(self.batch * width) {
                let numbers = part[row * width..][..width].chunks_exact(size_of::<f64>());
                let numbers = numbers.map(|bytes| {
                    f64::from_le_bytes(bytes.try_into().expect("chunks have this length"))
                });
                content.command.extend(numbers);
            }
            content.failure = failed.get(&row).cloned().map(Failure::OfEpisode);
            let waiter = Arc::clone(&content.waiter);
            drop(content);
            go_on(turns.as_deref(), &waiter);
        }
        Ok(())
    }
}

/// Lets a thread go on, in its turn.
fn go_on(turns: Option<&Turns>, waiter: &Arc<Waiter>) {
    match turns {
        Some(turns) => turns.ask(waiter),
        None => waiter.go(),
    }
}

/// The hold on the connection that the prepared controller has, and each of its episodes. It ends with the last of them.
struct Open(Arc<Exchange>);

impl Drop for Open {
    fn drop(&mut self) {
        locked(&self.0.state).is_closed = true;
        self.0.wake.notify_one();
    }
}

/// The controller in one episode.
struct Remote {
    open: Arc<Open>,
    desk: Arc<Desk>,
    /// Whether the episode has a slot, as it does from its first tick on.
    has_slot: bool,
}

impl Remote {
    fn new(open: &Arc<Open>, seed: u64) -> Self {
        let content = Mutex::default();
        Self {
            open: Arc::clone(open),
            desk: Arc::new(Desk { seed, content }),
            has_slot: false,
        }
    }

    /// Puts the readings among those that wait, and waits for the answer.
    fn ask(&mut self, sensed: &Sensed) -> Result<(), Failure> {
        let (exchange, turns) = (&self.open.0, turns::present());
        let waiter = Waiter::of_this_thread();
        {
            let mut state = locked(&exchange.state);
            if let Some(end) = &state.end {
                return Err(Failure::OfAll(end.clone()));
            }
            let mut content = locked(&self.desk.content);
            if !self.has_slot {
                content.slot = state.free.pop().ok_or_else(|| {
                    let slots = exchange.slots;
                    let remedy = "take a larger `batch`, or fewer --threads";
                    Failure::OfAll(End::Ended(format!(
                        "more than {slots} episodes are open at once; {remedy}"
                    )))
                })?;
                content.episode = state.episodes;
                state.episodes += 1;
                self.has_slot = true;
            }
            write_row(sensed, &mut content.row);
            content.waiter = Arc::clone(&waiter);
            drop(content);
            state.waiting.push_back(Waiting {
                desk: Arc::clone(&self.desk),
                turns: turns.clone(),
                since: Instant::now(),
            });
            // From the first row on, the other side looks whether a batch is due.
            let count = state.waiting.len();
            if count == 1 || count == exchange.batch || turns.is_none() {
                exchange.wake.notify_one();
            }
        }
        if let Some(turns) = &turns {
            turns.give();
            if turns.are_idle() {
                exchange.wake.notify_one();
            }
        }
        waiter.wait();
        let mut content = locked(&self.desk.content);
        content.is_old = true;
        content.failure.take().map_or(Ok(()), Err)
    }
}

impl Controller for Remote {
    fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
        let Exchange { name, joints, .. } = &*Arc::clone(&self.open.0);
        sensed.check(*joints)?;
        let answer = self.ask(sensed);
        answer.map_err(|failure| match failure {
            Failure::OfEpisode(problem) => TickError::Failed(format!("{name}: {problem}")),
            Failure::OfAll(End::Ended(problem)) => TickError::Ended(format!("{name}: {problem}")),
            Failure::OfAll(End::Stopped) => TickError::Interrupted,
        })?;
        let content = locked(&self.desk.content);
        let mut parts = content.command.chunks_exact(*joints);
        let mut part = |bit: u32| {
            (content.parts >> bit & 1 == 1)
                .then(|| parts.next())
                .flatten()
        };
        for (bit, to) in [&mut command.q_ref, &mut command.dq_ref, &mut command.tau_ff]
            .into_iter()
            .enumerate()
        {
            to.clear();
            match part(bit as u32) {
                Some(numbers) => to.extend(numbers),
                None => to.resize(*joints, 0.0),
            }
        }
        command.gains = part(3)
            .zip(part(4))
            .filter(|(kp, kd)| !kp.iter().chain(*kd).all(|gain| gain.is_nan()))
            .map(|(kp, kd)| kp.iter().zip(kd).map(|(kp, kd)| [*kp, *kd]).collect());
        Ok(())
    }

    fn report(&self) -> Report<'_> {
        Report::of_phase("python")
    }

    /// The memory of the object is not seen here.
    fn fork(&self) -> Option<Box<dyn Controller>> {
        None
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        if self.has_slot {
            let slot = locked(&self.desk.content).slot;
            locked(&self.open.0.state).free.push(slot);
        }
    }
}

/// Sends bytes within a time.
fn send(stream: &mut UnixStream, mut bytes: &[u8], limit: Duration) -> Result<(), End> {
    let began = Instant::now();
    while !bytes.is_empty() {
        let sent = patiently(began, limit, "did not read what it was sent", || {
            stream.write(bytes)
        })?;
        bytes = &bytes[sent..];
    }
    Ok(())
}

/// Fills `bytes` within a time.
fn hear(stream: &mut UnixStream, mut bytes: &mut [u8], limit: Duration) -> Result<(), End> {
    let began = Instant::now();
    while !bytes.is_empty() {
        let heard = patiently(began, limit, "gave no answer", || stream.read(bytes))?;
        bytes = &mut bytes[heard..];
    }
    Ok(())
}

/// Reads a line of JSON within a time. Nothing follows it until the other side is asked.
fn hear_line(stream: &mut UnixStream, limit: Duration) -> Result<Value, End> {
    let (began, mut text, mut bytes) = (Instant::now(), Vec::new(), [0; 1 << 12]);
    while text.last() != Some(&b'\n') && text.len() <= MOST_BYTES {
        let heard = patiently(began, limit, "gave no answer", || stream.read(&mut bytes))?;
        text.extend(&bytes[..heard]);
    }
    serde_json::from_slice(&text).map_err(|e| End::Ended(format!("its greeting is no JSON: {e}")))
}

/// Repeats a transfer that is not possible yet, until the time is over or [`STOP`] is set. Returns the number of bytes, at
/// least one.
fn patiently(
    began: Instant,
    limit: Duration,
    problem: &str,
    mut transfer: impl FnMut() -> std::io::Result<usize>,
) -> Result<usize, End> {
    let gone = || End::Ended("the Python process has closed the connection".into());
    loop {
        match transfer() {
            Ok(0) => return Err(gone()),
            Ok(count) => return Ok(count),
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                if STOP.load(Ordering::Relaxed) {
                    return Err(End::Stopped);
                }
                if began.elapsed() >= limit {
                    let limit_s = limit.as_secs_f64();
                    return Err(End::Ended(format!("{problem} within {limit_s} s")));
                }
            }
            Err(e) if matches!(e.kind(), ErrorKind::BrokenPipe | ErrorKind::ConnectionReset) => {
                return Err(gone());
            }
            Err(e) => {
                return Err(End::Ended(format!(
                    "the Python process cannot be asked: {e}"
                )));
            }
        }
    }
}
