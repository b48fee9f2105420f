//! A child process that answers each line with a line, within a time limit. What it writes to stderr is kept, to be shown
//! if it fails.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Longest accepted answer (bytes), and how much of stderr is kept.
const MOST_BYTES: u64 = 1_000_000;
const LAST_WORDS: usize = 1000;
/// How long a child may take to end after its input was closed.
const FAREWELL: Duration = Duration::from_millis(300);

/// A running child.
pub(super) struct Talker {
    child: Child,
    /// None once it was closed, with which a child has to end.
    stdin: Option<ChildStdin>,
    answers: Mutex<Receiver<Result<String, String>>>,
    words: Arc<Mutex<VecDeque<u8>>>,
}

impl Talker {
    /// Starts a program. Errors are in words.
    pub fn start(command: &mut Command) -> Result<Self, String> {
        own_group(command);
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = piped.spawn().map_err(|e| format!("cannot be started: {e}"))?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else { return Err("has no pipes".into()) };
        // The channel holds one answer. A child that talks without end then waits for its reader.
        let (sender, answers) = sync_channel(1);
        thread::spawn(move || pass_on(BufReader::new(stdout), &sender));
        let words = Arc::new(Mutex::new(VecDeque::new()));
        let kept = Arc::clone(&words);
        thread::spawn(move || keep(stderr, &kept));
        Ok(Self { child, stdin: Some(stdin), answers: Mutex::new(answers), words })
    }

    /// Sends a line, which ends with a line feed, and waits for the answer. After an error the child is of no use. Errors
    /// are in words.
    pub fn ask(&mut self, line: &str, limit: Duration) -> Result<String, String> {
        match self.answers().try_recv() {
            Ok(Ok(answer)) => return Err(self.failed(format!("spoke without being asked: {}", in_short(&answer)))),
            Ok(Err(problem)) => return Err(self.failed(problem)),
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => {}
        }
        // A child that has ended takes no line. Why it did is in what it answered last.
        let sent = self.stdin.as_mut().map(|stdin| stdin.write_all(line.as_bytes()).and_then(|()| stdin.flush()));
        match self.answers().recv_timeout(limit) {
            Ok(Ok(answer)) if matches!(sent, Some(Ok(()))) => Ok(answer),
            Ok(Ok(_)) => Err(self.failed("reads no lines".into())),
            Ok(Err(problem)) => Err(self.failed(problem)),
            Err(RecvTimeoutError::Timeout) => {
                Err(self.failed(format!("gave no answer within {} s", limit.as_secs_f64())))
            }
            Err(RecvTimeoutError::Disconnected) => Err(self.failed("has ended".into())),
        }
    }

    fn answers(&mut self) -> &mut Receiver<Result<String, String>> {
        self.answers.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the child, and adds how it ended and its last words to the problem.
    fn failed(&mut self, problem: String) -> String {
        let ended = self.end();
        let words = self.words.lock().unwrap_or_else(PoisonError::into_inner);
        let words = String::from_utf8_lossy(&words.iter().copied().collect::<Vec<u8>>()).trim().to_string();
        let words = if words.is_empty() { String::new() } else { format!("; on stderr: {words}") };
        format!("{problem}{ended}{words}")
    }

    /// Closes its input, gives it a moment to end by itself, and then kills it. Returns how it ended by itself, in words.
    fn end(&mut self) -> String {
        self.stdin = None;
        let until = Instant::now() + FAREWELL;
        while Instant::now() < until {
            match self.child.try_wait() {
                Ok(Some(status)) if status.success() => return String::new(),
                Ok(Some(status)) => return format!(" ({status})"),
                Ok(None) => thread::sleep(Duration::from_millis(2)),
                Err(_) => break,
            }
        }
        // It may have ended in the meantime, and then there is nothing to kill.
        _ = self.child.kill();
        _ = self.child.wait();
        String::new()
    }
}

impl Drop for Talker {
    fn drop(&mut self) {
        self.end();
    }
}

/// Reads lines until the end or the first problem.
fn pass_on(mut stdout: impl BufRead, answers: &SyncSender<Result<String, String>>) {
    loop {
        let mut line = Vec::new();
        let answer = match stdout.by_ref().take(MOST_BYTES + 1).read_until(b'\n', &mut line) {
            Err(e) => Err(format!("cannot be read: {e}")),
            Ok(0) => Err("has closed its output".into()),
            Ok(_) if line.len() as u64 > MOST_BYTES => {
                Err(format!("answered with a line of more than {MOST_BYTES} bytes"))
            }
            Ok(_) => String::from_utf8(line).map_err(|_| "answered with something that is not UTF-8".into()),
        };
        let is_last = answer.is_err();
        if answers.send(answer).is_err() || is_last {
            return;
        }
    }
}

/// Keeps the end of a stream.
fn keep(mut stream: impl Read, words: &Mutex<VecDeque<u8>>) {
    let mut bytes = [0; 512];
    while let Ok(count @ 1..) = stream.read(&mut bytes) {
        let mut words = words.lock().unwrap_or_else(PoisonError::into_inner);
        words.extend(&bytes[..count]);
        let too_many = words.len().saturating_sub(LAST_WORDS);
        words.drain(..too_many);
    }
}

/// The beginning of an answer, on one line.
pub(super) fn in_short(answer: &str) -> String {
    const MOST: usize = 80;
    let line = answer.trim_end();
    let start: String = line.chars().take(MOST).collect();
    if line.chars().count() > MOST { format!("{start}...") } else { start }
}

/// Lets Ctrl-C reach this program alone, so that children do not die in the middle of their episodes.
#[cfg(unix)]
fn own_group(command: &mut Command) {
    std::os::unix::process::CommandExt::process_group(command, 0);
}

#[cfg(not(unix))]
fn own_group(_command: &mut Command) {}
