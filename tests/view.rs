//! The window of `standfast view`, as a person uses it: under a display of its own, by keys and mouse. Where there can be
//! no window, one line says why.

mod common;

use assert_cmd::assert::Assert;
use common::program::stderr;
use tempfile::TempDir;

/// A view that finds no window: with these set (empty: removed) in its environment.
fn no_window(environment: &[(&str, &str)]) -> Assert {
    let mut command = assert_cmd::Command::cargo_bin("standfast").unwrap();
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET", "RUST_LOG"] {
        command.env_remove(name);
    }
    let folder = TempDir::new().unwrap();
    command.env("XDG_RUNTIME_DIR", folder.path());
    command.envs(environment.iter().copied()).args(["view", "--gains=hold", "--seconds=5"]).assert()
}

/// One line with these words, exit code 2, nothing on stdout.
fn is_told(view: Assert, words: &[&str]) {
    let view = view.code(2).stdout("");
    let told = stderr(&view);
    assert_eq!(told.lines().count(), 1, "{told}");
    for word in words {
        assert!(told.contains(word), "{word:?} is not in: {told}");
    }
}

#[cfg(not(feature = "view"))]
#[test]
fn a_build_without_the_window_says_how_to_get_one() {
    is_told(no_window(&[]), &["cargo build --release --features view", "standfast replay"]);
}

#[cfg(feature = "view")]
mod window {
    use super::*;
    use common::display::{Display, colors};
    use common::program::{folder, short, standfast, stdout};
    use std::io::Read;
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant};

    /// A frame takes up to this long where many share a machine that has no graphics card.
    const FRAME: Duration = Duration::from_millis(2500);
    const PATIENCE: Duration = Duration::from_secs(60);

    #[test]
    fn without_a_display_one_line_says_so() {
        is_told(no_window(&[]), &["no display", "neither DISPLAY nor WAYLAND_DISPLAY is set", "standfast replay"]);
        is_told(no_window(&[("DISPLAY", ":4077")]), &["DISPLAY=:4077 does not answer", "xvfb"]);
        is_told(no_window(&[("WAYLAND_DISPLAY", "wayland-77")]), &["wayland-77 does not answer"]);
    }

    #[test]
    fn without_a_graphics_driver_one_line_says_so() {
        let Some(display) = Display::start() else { return };
        let missing = [("VK_DRIVER_FILES", "/nonexistent"), ("VK_ICD_FILENAMES", "/nonexistent")];
        let environment = [&missing[..], &[("DISPLAY", display.name.as_str())]].concat();
        is_told(no_window(&environment), &["no graphics driver", "mesa-vulkan-drivers", "standfast replay"]);
    }

    #[test]
    fn the_robot_is_pushed_pulled_and_switched() {
        let Some(display) = Display::start() else { return };
        let folder = folder();
        let arguments = ["--gains=switching", "--gains=hold", "--impulse=1", "--heading=90", "--screenshot=last.png"];
        let view = View::open(&display, folder.path(), &arguments);
        view.press("Return");
        view.press("2");
        view.press("1");
        // The trunk, some way from the middle of the picture; the robot stands still again.
        let at = |x: u32| display.tell(&["mousemove", &x.to_string(), "240"]);
        at(500);
        sleep(FRAME);
        display.tell(&["mousedown", "1"]);
        sleep(FRAME);
        at(530);
        sleep(FRAME);
        display.tell(&["mouseup", "1"]);
        view.press("space");
        (0..3).for_each(|_| view.press("period"));
        let told = view.quit("q");
        assert!(told.starts_with("1 pushes, 1 drags (up to "), "{told}");
        let force: f64 = told.split("up to ").nth(1).unwrap().split(" N").next().unwrap().parse().unwrap();
        assert!((0.5..40.0).contains(&force), "{told}");
        assert!(told.contains("2 gain switches, 0 restarts"), "{told}");
        assert!(told.contains(" ticks (3 single)"), "{told}");
        assert!(number_before(&told, " ticks") > 200.0, "{told}");
        shows_the_robot(&folder.path().join("last.png"));
    }

    #[test]
    fn a_trial_of_a_result_is_shown_and_scrubbed() {
        let Some(display) = Display::start() else { return };
        let folder = folder();
        standfast(folder.path(), &short(&["--trials=3"])).success();
        let view = View::open(&display, folder.path(), &["out", "--trial=1", "--screenshot=last.png"]);
        view.press("Home");
        view.press("period");
        (0..2).for_each(|_| view.press("Right"));
        let told = view.quit("Escape");
        assert!(told.starts_with("trial 1, gain set hold: "), "{told}");
        assert!(told.contains("shown at 0.202 s"), "{told}");
        assert!(number_before(&told, " ticks recorded") >= 200.0, "{told}");
        shows_the_robot(&folder.path().join("last.png"));
    }

    #[test]
    fn what_is_not_accepted_is_told_before_a_window_opens() {
        let refused = |arguments: &[&str]| {
            let view = standfast(Path::new("."), &[&["view"], arguments].concat()).code(2);
            assert_eq!(stdout(&view), "");
            stderr(&view)
        };
        assert!(refused(&["--trial=3"]).contains("--trial"));
        assert!(refused(&["--speed=0"]).contains("--speed"));
        assert!(refused(&["--gains=no-such-set"]).contains("no-such-set"));
        assert!(refused(&["--screenshot=picture.bmp"]).contains("png"));
    }

    /// The number that stands right before some words.
    fn number_before(told: &str, words: &str) -> f64 {
        told.split(words).next().unwrap().split_whitespace().last().unwrap().parse().unwrap()
    }

    /// Purple and white in many shades, on a floor, beside a panel.
    fn shows_the_robot(picture: &Path) {
        let colors = colors(picture);
        assert!(colors.len() > 300, "only {} colours", colors.len());
        let share = |is: fn([f64; 3]) -> bool| {
            let found: usize = colors.iter().filter(|(rgb, _)| is(rgb.map(f64::from))).map(|(_, count)| count).sum();
            found as f64 / colors.values().sum::<usize>() as f64
        };
        let purple = share(|[r, g, b]| b > 1.4 * r && r > 1.25 * g && b > 60.0);
        let cream = share(|[r, g, b]| r > 150.0 && r > g && g > b + 8.0 && b > 110.0);
        let panel = share(|rgb| rgb == [248.0, 249.0, 251.0]);
        assert!(purple > 0.02 && cream > 0.005 && panel > 0.05, "purple {purple}, cream {cream}, panel {panel}");
    }

    /// A running `standfast view`.
    struct View<'a> {
        process: Child,
        display: &'a Display,
    }

    impl<'a> View<'a> {
        fn open(display: &'a Display, folder: &Path, arguments: &[&str]) -> Self {
            let process = Command::new(env!("CARGO_BIN_EXE_standfast"))
                .current_dir(folder)
                .env("DISPLAY", &display.name)
                .env_remove("WAYLAND_DISPLAY")
                .arg("view")
                .args(arguments)
                .stdout(Stdio::piped())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            let view = Self { process, display };
            display.window("standfast");
            sleep(FRAME);
            view
        }

        /// Presses a key and waits until it is seen to.
        fn press(&self, key: &str) {
            self.display.tell(&["key", key]);
            sleep(FRAME);
        }

        /// Quits by a key; what was printed.
        fn quit(mut self, key: &str) -> String {
            self.press(key);
            let end = Instant::now() + PATIENCE;
            let status = loop {
                if let Some(status) = self.process.try_wait().unwrap() {
                    break status;
                }
                assert!(Instant::now() < end, "it does not quit");
                sleep(Duration::from_millis(50));
            };
            assert_eq!(status.code(), Some(0));
            let mut told = String::new();
            self.process.stdout.take().unwrap().read_to_string(&mut told).unwrap();
            told
        }
    }

    impl Drop for View<'_> {
        fn drop(&mut self) {
            // It has quit, unless the test failed.
            _ = self.process.kill();
            _ = self.process.wait();
        }
    }
}
