//! A child process that answers each line with a line, within a time limit. The end of its stderr is kept, and is shown
//! if the child fails.
//!
//! The pipes do not block. So a child that does not read, or never stops writing, meets the same limit as a child that
//! does not answer. No thread reads the pipes: they are closed with the [`Talker`], even if other programs hold their
//! other ends.
//!
//! A child has a process group of its own, which is killed at the end with all processes that the child has started in
//! it. If this program is killed, a shell beside it, the [`Guard`], sees its pipe close and kills the groups.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::ioctl_fionbio;
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
use standfast_core::error::shortage;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// If true, no answer of a child is waited for any longer.
pub static STOP: AtomicBool = AtomicBool::new(false);

/// Longest accepted answer, and length of the end of stderr that is kept (bytes).
const MOST_BYTES: usize = 1_000_000;
const LAST_WORDS: usize = 1000;
/// Longest time that a child may take to end after its input was closed.
const FAREWELL: Duration = Duration::from_millis(300);
/// Time between two looks at [`STOP`] while an answer is waited for. An answer that comes sooner still counts.
const GLANCE: Duration = Duration::from_millis(20);

/// Why there is no answer.
#[derive(Debug)]
pub(super) enum Trouble {
    /// What the child did wrong, as a sentence without its subject.
    OfChild(String),
    /// What the machine lacks. It says nothing about the child.
    OfMachine(String),
    /// [`STOP`] was set.
    Stopped,
}

impl From<String> for Trouble {
    fn from(problem: String) -> Self {
        Trouble::OfChild(problem)
    }
}

/// A running child.
pub(super) struct Talker {
    child: Child,
    /// Input of the child. It is None once it was closed, after which the child has to end.
    stdin: Option<ChildStdin>,
    stdout: ChildStdout,
    stderr: ChildStderr,
    /// Bytes from stdout that belong to no answer yet, and whether stdout has ended.
    heard: Vec<u8>,
    is_silent: bool,
    /// Last bytes from stderr, and whether stderr has ended.
    words: VecDeque<u8>,
    is_speechless: bool,
}

impl Talker {
    /// Starts a program.
    pub fn start(command: &mut Command) -> Result<Self, Trouble> {
        let fail = |e: io::Error| match shortage(&e) {
            Some(remedy) => Trouble::OfMachine(format!(
                "the program of a controller cannot be started: {e}; {remedy}"
            )),
            None => Trouble::OfChild(format!("cannot be started: {e}")),
        };
        let piped = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        // Ctrl-C reaches this program alone, so that children do not die in the middle of their episodes.
        let mut child = piped.process_group(0).spawn().map_err(fail)?;
        GUARD.watch(&child).map_err(|e| {
            _ = kill_process_group(Pid::from_child(&child), Signal::KILL);
            _ = child.wait();
            fail(e)
        })?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else {
            unreachable!("all three were asked for")
        };
        let unblocked = ioctl_fionbio(&stdin, true)
            .and(ioctl_fionbio(&stdout, true))
            .and(ioctl_fionbio(&stderr, true));
        let (heard, words, [is_silent, is_speechless]) = (Vec::new(), VecDeque::new(), [false; 2]);
        let talker = Self {
            child,
            stdin: Some(stdin),
            stdout,
            stderr,
            heard,
            is_silent,
            words,
            is_speechless,
        };
        unblocked.map_err(|e| fail(e.into())).map(|()| talker)
    }

    /// Sends a line, which ends with a line feed, and waits for the answer. Both together take at most `limit`. After
    /// an error the child is of no use.
    pub fn ask(&mut self, line: &str, limit: Duration) -> Result<String, Trouble> {
        self.exchange(line.as_bytes(), limit)
            .map_err(|trouble| match trouble {
                Trouble::OfChild(problem) => self.failed(problem).into(),
                other => other,
            })
    }

    fn exchange(&mut self, mut unsent: &[u8], limit: Duration) -> Result<String, Trouble> {
        self.hear()?;
        match self.answer()? {
            Some(answer) => {
                return Err(format!("spoke without being asked: {}", in_short(&answer)).into());
            }
            None if self.is_silent => return Err("has closed its output".to_string().into()),
            None => {}
        }
        let began = Instant::now();
        // A child that has ended takes no line. The reason is in its last output.
        let mut is_deaf = false;
        loop {
            if !unsent.is_empty() && !is_deaf {
                match self
                    .stdin
                    .as_mut()
                    .map_or(Ok(0), |stdin| stdin.write(unsent))
                {
                    Ok(sent) => unsent = &unsent[sent..],
                    Err(e) if is_for_later(&e) => {}
                    Err(_) => is_deaf = true,
                }
            }
            self.wait(
                !unsent.is_empty() && !is_deaf,
                GLANCE.min(limit.saturating_sub(began.elapsed())),
            )?;
            self.hear()?;
            match self.answer()? {
                Some(answer) if unsent.is_empty() => return Ok(answer),
                Some(_) => return Err("reads no lines".to_string().into()),
                None if self.is_silent => return Err("has closed its output".to_string().into()),
                None => {}
            }
            let waited = began.elapsed();
            if waited >= GLANCE && STOP.load(Ordering::Relaxed) {
                return Err(Trouble::Stopped);
            }
            if waited >= limit {
                let limit_s = limit.as_secs_f64();
                let did_not = if unsent.is_empty() {
                    "gave no answer"
                } else {
                    "did not read what it was sent"
                };
                return Err(format!("{did_not} within {limit_s} s").into());
            }
        }
    }

    /// Waits until there is something to read or, if `is_sending`, something can be sent; at most for `limit`.
    fn wait(&self, is_sending: bool, limit: Duration) -> Result<(), String> {
        let mut pipes = vec![PollFd::new(&self.stdout, PollFlags::IN)];
        // A stderr that is closed would be ready at all times.
        if !self.is_speechless {
            pipes.push(PollFd::new(&self.stderr, PollFlags::IN));
        }
        if let Some(stdin) = self.stdin.as_ref().filter(|_| is_sending) {
            pipes.push(PollFd::new(stdin, PollFlags::OUT));
        }
        let limit = Timespec {
            tv_sec: limit.as_secs() as i64,
            tv_nsec: limit.subsec_nanos().into(),
        };
        match poll(&mut pipes, Some(&limit)) {
            Err(e) if e != rustix::io::Errno::INTR => Err(format!("cannot be waited for: {e}")),
            _ => Ok(()),
        }
    }

    /// Reads the available output, up to one answer.
    fn hear(&mut self) -> Result<(), String> {
        self.hear_words();
        let mut bytes = [0; 1 << 14];
        let mut is_whole = self.heard.contains(&b'\n');
        while !is_whole && !self.is_silent && self.heard.len() <= MOST_BYTES {
            match self.stdout.read(&mut bytes) {
                Ok(0) => self.is_silent = true,
                Ok(count) => {
                    is_whole = bytes[..count].contains(&b'\n');
                    self.heard.extend(&bytes[..count]);
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if e.kind() == ErrorKind::WouldBlock => break,
                Err(e) => return Err(format!("cannot be read: {e}")),
            }
        }
        Ok(())
    }

    /// The first line of the output or, after its end, the rest. It is None if there is no whole line.
    fn answer(&mut self) -> Result<Option<String>, String> {
        let end = match self.heard.iter().position(|&byte| byte == b'\n') {
            Some(at) => at + 1,
            None if self.is_silent || self.heard.len() > MOST_BYTES => self.heard.len(),
            None => 0,
        };
        if end > MOST_BYTES {
            return Err(format!(
                "answered with a line of more than {MOST_BYTES} bytes"
            ));
        }
        let line: Vec<u8> = self.heard.drain(..end).collect();
        let line =
            String::from_utf8(line).map_err(|_| "answered with something that is not UTF-8")?;
        Ok(Some(line).filter(|line| !line.is_empty()))
    }

    /// Reads the available bytes of stderr, and keeps the last ones.
    fn hear_words(&mut self) {
        /// Largest number of reads, enough for a full pipe. A child that never stops writing must still be asked in
        /// between.
        const MOST_READS: usize = 64;
        let mut bytes = [0; 1 << 14];
        for _ in 0..MOST_READS {
            match self.stderr.read(&mut bytes) {
                Ok(count @ 1..) => self.words.extend(&bytes[..count]),
                Err(e) if is_for_later(&e) => return,
                _ => {
                    self.is_speechless = true;
                    return;
                }
            }
            let too_many = self.words.len().saturating_sub(LAST_WORDS);
            self.words.drain(..too_many);
        }
    }

    /// Ends the child, and adds its exit status and its last output to stderr to the problem.
    fn failed(&mut self, problem: String) -> String {
        let ended = match self.end() {
            Some(status) if !status.success() => format!(" ({status})"),
            _ => String::new(),
        };
        let words = String::from_utf8_lossy(self.words.make_contiguous())
            .trim()
            .to_string();
        let words = if words.is_empty() {
            String::new()
        } else {
            format!("; on stderr: {words}")
        };
        format!("{problem}{ended}{words}")
    }

    /// Closes the child's input, waits a moment for the child to end, and then kills the rest of its group. Returns the
    /// exit status if the child ended by itself.
    fn end(&mut self) -> Option<ExitStatus> {
        self.stdin = None;
        let (group, until) = (Pid::from_child(&self.child), Instant::now() + FAREWELL);
        let mut has_ended = has_ended(group);
        while !has_ended && Instant::now() < until {
            // A child that is about to end may write more to stderr than a pipe can hold.
            self.hear_words();
            thread::sleep(Duration::from_millis(2));
            has_ended = self::has_ended(group);
        }
        // A child keeps its process number until it is waited for, so no other process can have the number here. The
        // child may have left its group, and then there may be nothing to kill.
        _ = kill_process_group(group, Signal::KILL);
        _ = self.child.kill();
        GUARD.forget(&self.child);
        let status = self.child.wait();
        self.hear_words();
        status.ok().filter(|_| has_ended)
    }
}

impl Drop for Talker {
    fn drop(&mut self) {
        self.end();
    }
}

/// Whether a child has ended. It still has to be waited for.
fn has_ended(child: Pid) -> bool {
    let look = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT | WaitIdOptions::NOHANG;
    // A process that cannot be waited for does not exist.
    waitid(WaitId::Pid(child), look).map_or(true, |status| status.is_some())
}

/// Whether a pipe may be ready to read or write at a later time.
fn is_for_later(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// The beginning of an answer, on one line.
pub(super) fn in_short(answer: &str) -> String {
    shortened(answer.trim_end(), 80)
}

/// The first `most` characters of a text.
pub(super) fn shortened(text: &str, most: usize) -> String {
    let start: String = text.chars().take(most).collect();
    if text.chars().count() > most {
        format!("{start}...")
    } else {
        start
    }
}

/// A shell that kills all children if this program is killed. It reads from a pipe that closes with this program, and
/// does nothing until then.
static GUARD: Guard = Guard(Mutex::new(None));

struct Guard(Mutex<Option<ChildStdin>>);

impl Guard {
    const SCRIPT: &str = "\
trap '' HUP INT TERM
groups=' '
while read -r change group; do
  case $change in
    +) groups=\"$groups$group \" ;;
    -) case $groups in *\" $group \"*) groups=\"${groups%% \"$group\" *} ${groups#* \"$group\" }\" ;; esac ;;
  esac
done
for group in $groups; do kill -s KILL -- \"-$group\"; done 2>/dev/null";

    /// Adds a child's group to the guarded ones. It fails if the shell cannot be started.
    fn watch(&self, child: &Child) -> io::Result<()> {
        let mut shell = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if shell.is_none() {
            let mut command = Command::new("/bin/sh");
            command
                .args(["-c", Self::SCRIPT])
                .current_dir("/")
                .process_group(0);
            command
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .stderr(Stdio::null());
            match command.spawn() {
                Ok(mut started) => *shell = started.stdin.take(),
                Err(e) if shortage(&e).is_some() => return Err(e),
                Err(e) => {
                    log::debug!("children outlive this program if it is killed: /bin/sh: {e}")
                }
            }
        }
        Self::tell(&mut shell, '+', child);
        Ok(())
    }

    /// Removes a child's group from the guarded ones.
    fn forget(&self, child: &Child) {
        Self::tell(
            &mut self.0.lock().unwrap_or_else(PoisonError::into_inner),
            '-',
            child,
        );
    }

    fn tell(shell: &mut Option<ChildStdin>, change: char, child: &Child) {
        let told = shell.as_mut().map_or(Ok(()), |shell| {
            shell.write_all(format!("{change} {}\n", child.id()).as_bytes())
        });
        if told.is_err() {
            // The shell was killed from outside. The next child starts another one.
            *shell = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn started(script: &str) -> Talker {
        Talker::start(Command::new("sh").args(["-c", script])).unwrap()
    }

    fn problem(talker: &mut Talker, line: &str) -> String {
        match talker.ask(line, Duration::from_millis(300)) {
            Err(Trouble::OfChild(problem)) => problem,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn an_exchange_ends_whatever_the_child_does() {
        let long = "x".repeat(200_000) + "\n";
        for (script, line, words) in [
            ("sleep 982", "hello\n", "gave no answer within 0.3 s"),
            (
                "sleep 982",
                &long,
                "did not read what it was sent within 0.3 s",
            ),
            (
                "exec 0<&-; sleep 982",
                &long,
                "did not read what it was sent within 0.3 s",
            ),
            ("sleep 1; echo early; sleep 982", &long, "did not read"),
            (
                "tr '\\0' x </dev/zero",
                &long,
                "answered with a line of more than 1000000 bytes",
            ),
            (
                "tr '\\0' x </dev/zero >&2",
                &long,
                "did not read what it was sent within 0.3 s; on stderr: xxx",
            ),
            (
                "read line; exit 3",
                "hello\n",
                "has closed its output (exit status: 3)",
            ),
            (
                "read line; printf '\\377\\n'",
                "hello\n",
                "answered with something that is not UTF-8",
            ),
            (
                "read line; sleep 982 & exit 3",
                "hello\n",
                "gave no answer within 0.3 s (exit status: 3)",
            ),
        ] {
            let told = problem(&mut started(script), line);
            assert!(told.starts_with(words), "{script}: {told}");
        }
        let mut talker = started("while read line; do echo \"$line\"; done");
        for line in [&long, "short\n", &long] {
            assert_eq!(talker.ask(line, Duration::from_secs(100)).unwrap(), *line);
        }
        let mut talker = started("read line; echo one; echo two; sleep 982");
        assert_eq!(
            talker.ask("hello\n", Duration::from_secs(100)).unwrap(),
            "one\n"
        );
        thread::sleep(Duration::from_millis(50));
        assert_eq!(
            problem(&mut talker, "hello\n"),
            "spoke without being asked: two"
        );
    }

    #[test]
    fn grandchildren_end_with_the_child_and_the_pipes_are_closed() {
        let mut talker = started("read line; sleep 982 & echo $!; cat");
        let grandchild = talker.ask("hello\n", Duration::from_secs(100)).unwrap();
        let grandchild = Pid::from_raw(grandchild.trim().parse().unwrap()).unwrap();
        let runs = || {
            let stat =
                std::fs::read_to_string(format!("/proc/{}/stat", grandchild.as_raw_nonzero()));
            stat.is_ok_and(|stat| {
                stat.rsplit_once(") ")
                    .is_some_and(|(_, state)| !state.starts_with('Z'))
            })
        };
        assert!(runs() || !cfg!(target_os = "linux"));
        drop(talker);
        // The kernel takes a moment.
        for _ in 0..1000 {
            if !runs() {
                return;
            }
            thread::sleep(Duration::from_millis(10));
        }
        panic!("the grandchild is still there");
    }

    /// The guard is told to forget a group of another guard, which was killed from outside. This once doubled the
    /// guard's list.
    #[test]
    fn the_guard_forgets_only_what_it_knows() {
        let mut shell = Command::new("/bin/sh")
            .args(["-c", Guard::SCRIPT])
            .stdin(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stdin = shell.stdin.take().unwrap();
        stdin
            .write_all("- 999999999\n".repeat(64).as_bytes())
            .unwrap();
        drop(stdin);
        let ended = (0..3000).find_map(|_| {
            thread::sleep(Duration::from_millis(10));
            shell.try_wait().unwrap()
        });
        _ = shell.kill();
        assert!(ended.is_some_and(|status| status.success()), "{ended:?}");
    }
}
