//! A display (Xvfb) for one test, with keyboard and mouse (xdotool), and the picture on it.

use image::{Rgb, RgbImage};
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::channel;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// If this is set in the environment, a missing display is a failure.
const NEED: &str = "STANDFAST_NEED_DISPLAY";
const PROGRAMS: [&str; 2] = ["Xvfb", "xdotool"];
/// Timeout for each action that takes a moment, even on a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(120);
/// Lock for one display at a time, because a window that is rendered in software uses the whole machine.
static TURN: Mutex<()> = Mutex::new(());

pub struct Display {
    server: Child,
    /// The value of DISPLAY.
    pub name: String,
    /// Folder of the picture that the server shows.
    folder: TempDir,
    _turn: MutexGuard<'static, ()>,
}

impl Display {
    /// Starts a display. It is None, with a message on stderr, if there can be no display and the environment does not
    /// require one. It waits until no other test has a display.
    pub fn start() -> Option<Self> {
        if let Some(program) = PROGRAMS
            .into_iter()
            .find(|program| in_path(program).is_none())
        {
            assert!(
                std::env::var_os(NEED).is_none(),
                "{NEED} is set, but {program} is not in PATH"
            );
            eprintln!(
                "skipped: {program} is not in PATH (apt-get install xvfb xdotool); {NEED}=1 makes this a failure"
            );
            return None;
        }
        // A failed test leaves nothing behind that would affect another one.
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().unwrap();
        // The server finds a free number and reports it.
        let mut server = Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x800x24",
                "-nolisten",
                "tcp",
                "-terminate",
                "-fbdir",
            ])
            .arg(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let told = server.stdout.take().unwrap();
        // From here on the server ends with the display.
        let mut display = Self {
            server,
            name: String::new(),
            folder,
            _turn: turn,
        };
        let (tell, number) = channel();
        spawn(move || {
            let mut line = String::new();
            _ = BufReader::new(told).read_line(&mut line);
            _ = tell.send(line);
        });
        let number = number
            .recv_timeout(PATIENCE)
            .expect("Xvfb does not tell its number");
        assert!(!number.trim().is_empty(), "Xvfb did not start");
        display.name = format!(":{}", number.trim());
        Some(display)
    }

    /// Ends the server, as when a display is lost.
    pub fn end(&mut self) {
        // The server may have ended already.
        _ = self.server.kill();
        _ = self.server.wait();
    }

    /// The output of `xdotool`; None if it fails.
    pub fn ask(&self, args: &[&str]) -> Option<String> {
        let output = Command::new("xdotool")
            .env("DISPLAY", &self.name)
            .args(args)
            .output()
            .unwrap();
        output
            .status
            .success()
            .then(|| String::from_utf8(output.stdout).unwrap().trim().to_string())
    }

    pub fn tell(&self, args: &[&str]) {
        assert!(self.ask(args).is_some(), "xdotool {args:?}");
    }

    /// Waits for the window with this title, moves it to the upper left, gives it the keyboard focus, and returns its
    /// number.
    pub fn window(&self, title: &str) -> String {
        let end = Instant::now() + PATIENCE;
        let id = loop {
            let found = self.ask(&["search", "--onlyvisible", "--name", title]);
            if let Some(id) = found.as_deref().and_then(|ids| ids.lines().next()) {
                break id.to_string();
            }
            assert!(Instant::now() < end, "no window {title:?}");
            sleep(Duration::from_millis(100));
        };
        self.tell(&["windowmove", &id, "0", "0", "windowfocus", "--sync", &id]);
        id
    }

    /// The picture on the screen, from the server's own memory, which is a file in the format of `xwd`.
    pub fn screen(&self) -> RgbImage {
        let file = std::fs::read(self.folder.path().join("Xvfb_screen0")).unwrap();
        let word = |i: usize| u32::from_be_bytes(file[4 * i..4 * i + 4].try_into().unwrap());
        let [header, width, height, is_big_endian, bits, stride, colors] =
            [0, 4, 5, 7, 11, 12, 19].map(word);
        assert_eq!((word(1), bits), (7, 32), "an unknown format");
        let pixels = &file[(header + 12 * colors) as usize..];
        RgbImage::from_fn(width, height, |x, y| {
            let at = (y * stride + 4 * x) as usize;
            let pixel = pixels[at..at + 4].try_into().unwrap();
            let pixel = if is_big_endian == 1 {
                u32::from_be_bytes(pixel)
            } else {
                u32::from_le_bytes(pixel)
            };
            let [_, r, g, b] = pixel.to_be_bytes();
            Rgb([r, g, b])
        })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        self.end();
    }
}

fn in_path(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders)
        .map(|folder| folder.join(name))
        .find(|path| path.is_file())
}
