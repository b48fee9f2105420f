//! The window of `standfast view` as a person uses it, on a display of its own, by keys and mouse. If no window can be
//! opened, one line says why.

use crate::common::program::{PROGRAM, Run, stderr, stdout};
use std::process::Command;
use tempfile::TempDir;

/// A view without a window, with these variables set (or removed if empty) in its environment.
fn no_window(environment: &[(&str, &str)]) -> Run {
    let mut command = Command::new(PROGRAM);
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET", "RUST_LOG"] {
        command.env_remove(name);
    }
    let folder = TempDir::new().unwrap();
    command.env("XDG_RUNTIME_DIR", folder.path());
    Run::of(command.envs(environment.iter().copied()).args([
        "view",
        "--controller=hold",
        "--seconds=5",
    ]))
}

/// Asserts one line with these words, exit code 2, and nothing on stdout.
fn is_told(view: Run, words: &[&str]) {
    let view = view.code(2);
    assert_eq!(stdout(&view), "");
    let told = stderr(&view);
    assert_eq!(told.lines().count(), 1, "{told}");
    for word in words {
        assert!(told.contains(word), "{word:?} is not in: {told}");
    }
}

#[cfg(not(feature = "view"))]
#[test]
fn a_build_without_the_window_says_how_to_get_one() {
    let view = no_window(&[]);
    let told = stderr(&view);
    is_told(
        view,
        &[
            "no window",
            "cargo build --release --features view",
            "twenty minutes",
        ],
    );
    // Remedies that need no other build come first.
    let at = |words: &str| {
        told.find(words)
            .unwrap_or_else(|| panic!("no {words:?} in {told}"))
    };
    assert!(
        at("standfast push --replay") < at("cargo build")
            && at("standfast replay DIR") < at("cargo build")
    );
}

#[cfg(feature = "view")]
mod window {
    use super::*;
    use crate::common::display::Display;
    use crate::common::program::{folder, standfast, stdout};
    use crate::common::window::{View, ended};
    use image::RgbImage;
    use std::path::Path;

    /// The picture lies left of this, and the panel right of it (px).
    const PANEL_X: u32 = 860;
    const HEIGHT: u32 = 720;
    const COM: [u8; 3] = [0x7b, 0x3f, 0xa0];
    const DCM: [u8; 3] = [0x0b, 0x7a, 0x3b];
    const ZMP_WANTED: [u8; 3] = [0xff, 0x9f, 0x1c];
    const BOB: [u8; 3] = [0xed, 0xa8, 0x26];

    #[test]
    fn without_a_display_one_line_says_so() {
        is_told(
            no_window(&[]),
            &[
                "no display",
                "neither DISPLAY nor WAYLAND_DISPLAY is set",
                "standfast replay",
            ],
        );
        is_told(
            no_window(&[("DISPLAY", ":4077")]),
            &["DISPLAY=:4077 does not answer", "xvfb"],
        );
        is_told(
            no_window(&[("WAYLAND_DISPLAY", "wayland-77")]),
            &["wayland-77 does not answer"],
        );
    }

    #[test]
    fn without_a_graphics_driver_one_line_says_so() {
        let Some(display) = Display::start() else {
            return;
        };
        let missing = [
            ("VK_DRIVER_FILES", "/nonexistent"),
            ("VK_ICD_FILENAMES", "/nonexistent"),
        ];
        let environment = [&missing[..], &[("DISPLAY", display.name.as_str())]].concat();
        is_told(
            no_window(&environment),
            &[
                "no graphics driver",
                "mesa-vulkan-drivers",
                "standfast replay",
            ],
        );
    }

    #[test]
    fn the_robot_is_pushed_pulled_and_switched() {
        let Some(display) = Display::start() else {
            return;
        };
        let folder = folder();
        let arguments = [
            "--controller=switching",
            "--controller=hold",
            "--impulse=2",
            "--heading=90",
            "--screenshot=last.png",
        ];
        // The COM is back within a quarter of a second, which is less than a frame on a busy machine without slow
        // motion.
        let view = View::open(
            &display,
            folder.path(),
            &[&arguments[..], &["--speed=0.2"]].concat(),
        );
        let before = view.frame();
        assert!(before.y_mm.abs() < 3.0, "{before:?}");
        view.press("Return");
        view.once("the push moves the COM to the left", &before, |frame| {
            frame.y_mm > before.y_mm + 3.0
        });
        view.press("2");
        view.press("1");
        view.press("minus");
        assert_eq!(view.frame().speed, 0.1);
        view.press("equal");
        assert_eq!(view.frame().speed, 0.2);
        // The drag begins on the trunk, some distance from the middle of the picture.
        view.drag([500, 240], [530, 240]);
        view.press("space");
        let paused = view.frame();
        view.frames(3);
        assert_eq!(view.frame().time_s, paused.time_s);
        (0..3).for_each(|_| view.press("period"));
        let stepped_s = view.frame().time_s - paused.time_s;
        assert!((stepped_s - 0.006).abs() < 1e-6, "{stepped_s} s");
        // The key is held until a keyboard has repeated it many times, and the program restarts only once.
        view.hold("r");
        view.until("it begins anew", |frame| frame.time_s == 0.0);
        let told = view.quit("q");
        assert!(told.starts_with("1 push, 1 drag (up to "), "{told}");
        let force: f64 = told
            .split("up to ")
            .nth(1)
            .unwrap()
            .split(" N")
            .next()
            .unwrap()
            .parse()
            .unwrap();
        assert!((0.5..40.0).contains(&force), "{told}");
        assert!(
            told.contains("2 changes of controller, 1 restart, "),
            "{told}"
        );
        assert!(told.contains(" ticks (3 single)"), "{told}");
        for robot in [
            "\nsolid, switching in Rapier: ",
            "\nghost, hold in Rapier: ",
        ] {
            assert!(told.contains(robot), "{robot:?} {told}");
        }
        assert!(number_before(&told, " ticks") > 50.0, "{told}");
        assert!(
            (3.0..500.0).contains(&number_before(&told, " mm from its start")),
            "{told}"
        );
        shows_the_robot(
            &image::open(folder.path().join("last.png"))
                .unwrap()
                .to_rgb8(),
        );
    }

    #[test]
    fn overlays_plots_and_another_side_are_to_be_seen() {
        let Some(display) = Display::start() else {
            return;
        };
        let folder = folder();
        // A pendulum hangs drawn back all the time.
        let campaign = "name = \"swung\"\nseed = 1\ntrials = 1\ncontrollers = [\"hold\"]\n[push]\nstart_s = 100\nheading_deg = -60\n\
             [push.pendulum]\nmass_kg = 1\nrope_m = 1.75\ndraw_m = 0.2\n[episode]\nhorizon_s = 200\n";
        std::fs::write(folder.path().join("swung.toml"), campaign).unwrap();
        let view = View::open(
            &display,
            folder.path(),
            &[
                "swung.toml",
                "--trial=0",
                "--controller=switching",
                "--controller=hold",
                "--impulse=1.5",
            ],
        );
        // A push fills the plots, and another one begins, in which the marks are apart.
        view.press("Return");
        let pushed_s = view.frame().time_s;
        view.until("the robot has come back", |frame| {
            frame.time_s > pushed_s + 1.0
        });
        view.press("space");
        view.press("Return");
        let paused_s = view.frame().time_s;
        (0..15).for_each(|_| display.tell(&["key", "period"]));
        view.until("all ticks are done", |frame| {
            frame.time_s > paused_s + 0.029
        });
        // The picture is taken from the screen, and not only from the program.
        let screen = || {
            view.frames(3);
            display.screen()
        };
        let shown = screen();
        shows_the_robot(&shown);
        let bob = count(&shown, [0, PANEL_X], [0, HEIGHT], BOB, 30);
        assert!(bob > 2000, "{bob} pixels of the bob");
        for color in [COM, DCM, ZMP_WANTED] {
            // Thin lines never have quite their nominal colour.
            assert!(
                count(&shown, [PANEL_X, 1200], [350, HEIGHT], color, 40) > 20,
                "{color:x?} in the plots"
            );
        }
        for (key, color) in [("d", DCM), ("w", ZMP_WANTED)] {
            let of_it = |picture: &RgbImage| count(picture, [0, PANEL_X], [0, HEIGHT], color, 3);
            view.press(key);
            let without = screen();
            view.press(key);
            assert!(
                of_it(&shown) > 20 && of_it(&without) == 0,
                "{key}: {} {}",
                of_it(&shown),
                of_it(&without)
            );
            assert!(of_it(&screen()) > 20, "{key} does not come back");
        }
        for key in ["c", "z", "s", "i", "g", "p", "b", "e"] {
            view.press(key);
            let without = screen();
            assert!(
                differing(&shown, &without) > 20,
                "{key} makes no difference"
            );
            view.press(key);
        }
        // The marks of COM, DCM and ZMP cover the trails of so small a push.
        let marks = ["c", "d", "w", "z"];
        marks.iter().for_each(|key| view.press(key));
        let with_trails = screen();
        view.press("t");
        let trails = differing(&with_trails, &screen());
        assert!((21..2000).contains(&trails), "{trails} pixels of trails");
        view.press("t");
        marks.iter().for_each(|key| view.press(key));
        // The view is turned and turned back. The picture is then the same, except for edges, whose smoothing depends
        // on the time.
        let before = screen();
        view.drag([100, 600], [200, 600]);
        let turned = differing(&before, &screen());
        assert!(turned > 20_000, "{turned}");
        view.press("v");
        let back = differing(&before, &screen());
        assert!(back < turned / 4, "{back} of {turned}");
        view.quit("q");
    }

    /// The window shows a trial. Its robot falls, or has come to stand, at the time that `push` states.
    #[test]
    fn a_trial_ends_in_the_window_as_it_does_elsewhere() {
        let folder = folder();
        let trial = ["--campaign=smoke", "--trial=3"];
        for (name, key, words) in [
            ("hold", "fell_at_s", "fell at"),
            ("catch", "settled_at_s", "has stood still since"),
        ] {
            let controller = &*format!("--controller={name}");
            // Each program has a display of its own, since a display ends with its last window.
            let Some(display) = Display::start() else {
                return;
            };
            let push = standfast(
                folder.path(),
                &[&["push", "--json", controller], &trial[..]].concat(),
            )
            .success();
            let push: serde_json::Value = serde_json::from_str(&stdout(&push)).unwrap();
            let (at_s, end_s) = (push[key].as_f64().unwrap(), push["end_s"].as_f64().unwrap());
            let view = View::open(
                &display,
                folder.path(),
                &[&["--speed=1", controller], &trial[..]].concat(),
            );
            view.until("the verdict", |frame| frame.time_s > end_s + 0.1);
            let told = view.quit("q");
            assert!(
                told.contains(&format!("\nsolid, {name} in Rapier: {words} {at_s:.2} s")),
                "{push} {told}"
            );
        }
    }

    #[test]
    fn a_window_that_is_lost_ends_the_program() {
        for destroys in [true, false] {
            let Some(mut display) = Display::start() else {
                return;
            };
            let folder = folder();
            let view = View::open(&display, folder.path(), &["--controller=hold"]);
            let (mut process, told) = view.leave();
            if destroys {
                let id = display.window("standfast");
                display.tell(&["windowclose", &id]);
            } else {
                display.end();
            }
            assert_eq!(ended(&mut process).code(), Some(1), "destroys: {destroys}");
            let told = told.lock().unwrap();
            let is_told = |words: &str| told.iter().any(|line| line.contains(words));
            // Without a server, the X library itself may report this and end the program.
            let words = ["the window is lost", "X connection", "XIO:"];
            assert!(words.into_iter().any(is_told), "{told:?}");
        }
    }

    #[test]
    fn what_is_not_accepted_is_told_before_a_window_opens() {
        let refused = |arguments: &[&str]| {
            let view = standfast(Path::new("."), &[&["view"], arguments].concat()).code(2);
            assert_eq!(stdout(&view), "");
            stderr(&view)
        };
        let words = refused(&["--trial=3"]);
        assert!(
            words.contains("--trial") && words.contains("--campaign"),
            "{words}"
        );
        assert!(refused(&["out", "--trial=3"]).contains("campaign \"out\" not found"));
        assert!(refused(&["--speed=0"]).contains("--speed"));
        assert!(refused(&["--controller=no-such-set"]).contains("no-such-set"));
        assert!(refused(&["--screenshot=picture.bmp"]).contains("png"));
        let three = [
            "--controller=hold",
            "--controller=fixed",
            "--controller=paper",
        ];
        assert!(refused(&three).contains("one or two"));
    }

    /// The number right before `words`.
    fn number_before(told: &str, words: &str) -> f64 {
        told.split(words)
            .next()
            .unwrap()
            .split_whitespace()
            .last()
            .unwrap()
            .parse()
            .unwrap()
    }

    /// Number of pixels of a part of a picture that have a colour, up to a difference `off`.
    fn count(picture: &RgbImage, x: [u32; 2], y: [u32; 2], color: [u8; 3], off: u8) -> usize {
        let is_near = |pixel: [u8; 3]| (0..3).all(|i| pixel[i].abs_diff(color[i]) <= off);
        let at = |y| (x[0]..x[1]).map(move |x| (x, y));
        (y[0]..y[1])
            .flat_map(at)
            .filter(|&(x, y)| is_near(picture.get_pixel(x, y).0))
            .count()
    }

    /// Number of pixels of the picture that differ, without the panel and the rest of the screen.
    fn differing(a: &RgbImage, b: &RgbImage) -> usize {
        let all = (0..HEIGHT).flat_map(|y| (0..PANEL_X).map(move |x| (x, y)));
        all.filter(|&(x, y)| a.get_pixel(x, y) != b.get_pixel(x, y))
            .count()
    }

    /// Asserts that the picture shows purple and white in many shades, on a floor, beside a panel.
    fn shows_the_robot(picture: &RgbImage) {
        let pixels: Vec<[u8; 3]> = picture.pixels().map(|pixel| pixel.0).collect();
        let colors = pixels
            .iter()
            .collect::<std::collections::HashSet<_>>()
            .len();
        assert!(colors > 300, "only {colors} colours");
        let share = |is: fn([f64; 3]) -> bool| {
            pixels.iter().filter(|rgb| is(rgb.map(f64::from))).count() as f64 / pixels.len() as f64
        };
        let purple = share(|[r, g, b]| b > 1.4 * r && r > 1.25 * g && b > 60.0);
        let cream = share(|[r, g, b]| r > 150.0 && r > g && g > b + 8.0 && b > 110.0);
        let panel = share(|rgb| rgb == [248.0, 249.0, 251.0]);
        assert!(
            purple > 0.02 && cream > 0.005 && panel > 0.05,
            "purple {purple}, cream {cream}, panel {panel}"
        );
    }
}
