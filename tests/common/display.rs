//! A display of one's own (Xvfb) with a hand on keyboard and mouse (xdotool).

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// With this in the environment a display that cannot be had is a failure.
const NEED: &str = "STANDFAST_NEED_DISPLAY";
const PROGRAMS: [&str; 2] = ["Xvfb", "xdotool"];

pub struct Display {
    server: Child,
    /// As in DISPLAY.
    pub name: String,
}

impl Display {
    /// None, and a word on stderr, if there can be none and the environment does not ask for one.
    pub fn start() -> Option<Self> {
        if let Some(program) = PROGRAMS.into_iter().find(|program| in_path(program).is_none()) {
            assert!(std::env::var_os(NEED).is_none(), "{NEED} is set, but {program} is not in PATH");
            eprintln!(
                "skipped: {program} is not in PATH (apt-get install xvfb xdotool); {NEED}=1 makes this a failure"
            );
            return None;
        }
        // The server finds a free number and tells it.
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-noreset", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb did not start");
        Some(Self { server, name: format!(":{}", number.trim()) })
    }

    /// What `xdotool` prints; None if it fails.
    pub fn ask(&self, args: &[&str]) -> Option<String> {
        let output = Command::new("xdotool").env("DISPLAY", &self.name).args(args).output().unwrap();
        output.status.success().then(|| String::from_utf8(output.stdout).unwrap().trim().to_string())
    }

    pub fn tell(&self, args: &[&str]) {
        assert!(self.ask(args).is_some(), "xdotool {args:?}");
    }

    /// Waits for the window with this title, puts it at the upper left and gives it the keyboard.
    pub fn window(&self, title: &str) {
        let end = Instant::now() + Duration::from_secs(60);
        let id = loop {
            let found = self.ask(&["search", "--onlyvisible", "--name", title]);
            if let Some(id) = found.as_deref().and_then(|ids| ids.lines().next()) {
                break id.to_string();
            }
            assert!(Instant::now() < end, "no window {title:?}");
            std::thread::sleep(Duration::from_millis(100));
        };
        self.tell(&["windowmove", &id, "0", "0", "windowfocus", "--sync", &id]);
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // It may have gone already.
        _ = self.server.kill();
        _ = self.server.wait();
    }
}

/// How many colours a picture has.
pub fn colors(picture: &Path) -> std::collections::HashMap<[u8; 3], usize> {
    let mut counts = std::collections::HashMap::new();
    for pixel in image::open(picture).unwrap().to_rgb8().pixels() {
        *counts.entry(pixel.0).or_default() += 1;
    }
    counts
}

fn in_path(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders).map(|folder| folder.join(name)).find(|path| path.is_file())
}
