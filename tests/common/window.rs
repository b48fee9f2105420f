//! A running `standfast view` on a display of its own, and a person who uses it.

use super::display::{Display, PATIENCE};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

/// The lines that a program prints while it runs.
pub type Told = Arc<Mutex<Vec<String>>>;

/// A running `standfast view`. It reports each frame, so nothing here waits by the clock.
pub struct View<'a> {
    process: Option<Child>,
    display: &'a Display,
    told: Told,
}

/// The report of a frame.
#[derive(Debug)]
pub struct Frame {
    pub number: u64,
    pub time_s: f64,
    pub speed: f64,
    pub y_mm: f64,
}

impl Frame {
    fn told(line: &str) -> Option<Self> {
        let words: Vec<&str> = line
            .split("] frame ")
            .nth(1)?
            .split([' ', ':', ','])
            .collect();
        let number = |at: usize| {
            words
                .iter()
                .filter(|word| !word.is_empty())
                .nth(at)?
                .parse::<f64>()
                .ok()
        };
        // "12: 1.234 s, speed 1, COM 0.1 -0.2 mm"
        Some(Self {
            number: number(0)? as u64,
            time_s: number(1)?,
            speed: number(4)?,
            y_mm: number(7)?,
        })
    }
}

impl<'a> View<'a> {
    /// Opens the window with these further arguments, and gives it the keyboard focus.
    pub fn open(display: &'a Display, folder: &Path, arguments: &[&str]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_standfast"))
            .current_dir(folder)
            .env("DISPLAY", &display.name)
            .env("RUST_LOG", "standfast=trace")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            // If the test is killed, the program must end by itself.
            .args(["view", "--seconds=300"])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (told, stderr) = (Told::default(), process.stderr.take().unwrap());
        let lines = told.clone();
        spawn(move || {
            BufReader::new(stderr)
                .lines()
                .map_while(Result::ok)
                .for_each(|line| lines.lock().unwrap().push(line));
        });
        let view = Self {
            process: Some(process),
            display,
            told,
        };
        // The server ends with its last client, which is the window, so the window must come first.
        view.wait("a frame", || view.last().is_some());
        display.window("standfast");
        view.frames(2);
        view
    }

    fn wait(&self, what: &str, is_so: impl Fn() -> bool) {
        let end = Instant::now() + PATIENCE;
        while !is_so() {
            let told = self.told.lock().unwrap();
            assert!(
                Instant::now() < end,
                "in vain: {what}; {:?}",
                &told[told.len().saturating_sub(5)..]
            );
            drop(told);
            sleep(Duration::from_millis(20));
        }
    }

    fn last(&self) -> Option<Frame> {
        self.told
            .lock()
            .unwrap()
            .iter()
            .rev()
            .find_map(|line| Frame::told(line))
    }

    pub fn frame(&self) -> Frame {
        self.last().unwrap()
    }

    /// Waits for this number of further frames.
    pub fn frames(&self, count: u64) {
        let until = self.frame().number + count;
        self.wait("frames", || self.frame().number >= until);
    }

    pub fn until(&self, what: &str, is_so: impl Fn(&Frame) -> bool) {
        self.wait(what, || is_so(&self.frame()));
    }

    /// Waits until some frame after `before` satisfied `is_so`, even if the last frame does not: a slow machine draws
    /// few frames.
    pub fn once(&self, what: &str, before: &Frame, is_so: impl Fn(&Frame) -> bool) {
        let is_later = |line: &String| {
            Frame::told(line).is_some_and(|f| f.number > before.number && is_so(&f))
        };
        self.wait(what, || self.told.lock().unwrap().iter().any(is_later));
    }

    /// Presses a key and waits until it has been handled.
    pub fn press(&self, key: &str) {
        self.display.tell(&["key", key]);
        self.frames(3);
    }

    /// Presses a key and holds it.
    pub fn hold(&self, key: &str) {
        self.display.tell(&["keydown", key]);
        // The server repeats keys by the clock: 25 times a second after 0.66 s.
        sleep(Duration::from_millis(1500));
        self.display.tell(&["keyup", key]);
        self.frames(3);
    }

    /// Drags with the left button.
    pub fn drag(&self, from: [u32; 2], to: [u32; 2]) {
        let steps = [
            [from[0], from[1], 0],
            [from[0], from[1], 1],
            [to[0], to[1], 0],
            [to[0], to[1], 2],
        ];
        for [x, y, button] in steps {
            match button {
                0 => self
                    .display
                    .tell(&["mousemove", &x.to_string(), &y.to_string()]),
                1 => self.display.tell(&["mousedown", "1"]),
                _ => self.display.tell(&["mouseup", "1"]),
            }
            self.frames(3);
        }
    }

    /// Quits by a key, and returns the output.
    pub fn quit(self, key: &str) -> String {
        self.display.tell(&["key", key]);
        let (mut process, _) = self.leave();
        assert_eq!(ended(&mut process).code(), Some(0));
        let mut told = String::new();
        process
            .stdout
            .take()
            .unwrap()
            .read_to_string(&mut told)
            .unwrap();
        told
    }

    /// Leaves the process and its output to the caller.
    pub fn leave(mut self) -> (Child, Told) {
        (self.process.take().unwrap(), self.told.clone())
    }
}

impl Drop for View<'_> {
    fn drop(&mut self) {
        // The test has failed.
        if let Some(mut process) = self.process.take() {
            _ = process.kill();
            _ = process.wait();
        }
    }
}

/// Waits until a process ends by itself.
pub fn ended(process: &mut Child) -> ExitStatus {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(status) = process.try_wait().unwrap() {
            return status;
        }
        if Instant::now() > end {
            _ = process.kill();
            panic!("it does not end");
        }
        sleep(Duration::from_millis(50));
    }
}
