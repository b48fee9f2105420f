//! The page of a film as a reader meets it: in a browser, from a file, with nothing else to load.

mod common;

use common::browser::{Browser, Page};
use common::{Bench, config, push};
use nalgebra::{Isometry3, Point2, Point3, Quaternion, Translation3, UnitQuaternion};
use serde_json::{Value, json};
use standfast::episode::{Disturbance, EpisodeConfig, Film, Outcome};
use standfast::report::replay::{Head, page};
use standfast::robot::{Foot, Kinematics, Shape};
use standfast::sim::{Ground, Variation};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

const SCREENS: [(u32, u32, &str); 4] =
    [(1200, 900, "light"), (1200, 900, "dark"), (390, 844, "light"), (390, 844, "dark")];
/// Positions in a page are as near as this to those of the film (m).
const NEAR_M: f64 = 1e-4;

/// A push from behind, to the right: `paper` switches gains and makes a footstep.
fn stepping() -> &'static Film {
    static FILM: OnceLock<Film> = OnceLock::new();
    FILM.get_or_init(|| film("paper", 3.6, config(4.0)))
}

/// The same push, to which `hold` falls.
fn fallen() -> &'static Film {
    static FILM: OnceLock<Film> = OnceLock::new();
    FILM.get_or_init(|| film("hold", 3.6, config(3.0)))
}

fn film(gains: &str, impulse_n_s: f64, config: EpisodeConfig) -> Film {
    let bench = Bench::new(gains);
    let disturbance = Disturbance { pushes: vec![push(impulse_n_s, -20.0)], ..Disturbance::default() };
    Film::take(&bench.robot, &bench.design, &config, disturbance, 0.8, &mut |_| {})
}

fn head() -> Head {
    Head {
        title: "A push".into(),
        lines: vec!["push      3.6 N s".into(), "outcome   as it was".into()],
        command: Some("standfast push --impulse 3.6 --heading -20 --replay replay.html".into()),
        back: Some("report.html#telling".into()),
    }
}

fn written(folder: &TempDir, film: &Film, head: &Head) -> PathBuf {
    let file = folder.path().join("replay.html");
    fs::write(&file, page(film, head).unwrap()).unwrap();
    file
}

fn assert_no_problems(tab: &mut Page, file: &Path) {
    let problems = tab.problems(file);
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Draws and reads the pixels of a canvas: a hash of all, the share of purple ones (the robot's own colour), their highest
/// row (share of the height), and how many colours there are.
const LOOK: &str = "(id = 'view') => {
    replay.draw();
    const canvas = document.getElementById(id), { width, height } = canvas;
    const pen = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
    pen.drawImage(canvas, 0, 0);
    const pixels = pen.getImageData(0, 0, width, height).data, colors = new Set();
    let hash = 2166136261, purple = 0, top = height;
    for (let i = 0; i < pixels.length; i += 4) {
        const [r, g, b] = [pixels[i], pixels[i + 1], pixels[i + 2]];
        hash = Math.imul(hash ^ (r << 16 | g << 8 | b), 16777619);
        colors.add(r << 16 | g << 8 | b);
        if (b > 60 && b > 1.25 * r && r > 1.2 * g) {
            purple++;
            top = Math.min(top, Math.floor(i / 4 / width));
        }
    }
    return { hash, purple: purple / (width * height), top: top / height, colors: colors.size };
}";

fn look(tab: &mut Page, canvas: &str) -> Value {
    tab.evaluate(&format!("({LOOK})('{canvas}')"))
}

fn look_at(tab: &mut Page, time_s: f64) -> Value {
    tab.evaluate(&format!("replay.seek({time_s})"));
    look(tab, "view")
}

fn time_s(tab: &mut Page) -> f64 {
    tab.evaluate("replay.state.time").as_f64().unwrap()
}

fn press(tab: &mut Page, key: &str) {
    tab.call("Input.dispatchKeyEvent", json!({ "type": "keyDown", "key": key }));
    tab.call("Input.dispatchKeyEvent", json!({ "type": "keyUp", "key": key }));
}

/// Clicks into an element, at shares of its width and height.
fn click_in(tab: &mut Page, id: &str, across: f64, down: f64) {
    let script = format!(
        "(() => {{
            const element = document.getElementById('{id}');
            element.scrollIntoView({{ block: 'center' }});
            const {{ left, top, width, height }} = element.getBoundingClientRect();
            return [left + {across} * width, top + {down} * height];
        }})()"
    );
    let at = tab.evaluate(&script);
    tab.click(at[0].as_f64().unwrap(), at[1].as_f64().unwrap());
}

fn text(tab: &mut Page, id: &str) -> String {
    tab.evaluate(&format!("document.getElementById('{id}').textContent")).as_str().unwrap().into()
}

#[test]
fn the_robot_shows_on_every_screen_and_the_page_asks_for_nothing() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let film = fallen();
    assert_eq!(film.record.outcome, Outcome::Fell, "this film is to show a fall");
    let file = written(&folder, film, &head());
    let html = fs::read_to_string(&file).unwrap();
    for word in ["http:", "https:", "url(", "@import", "import(", "eval(", &folder.path().display().to_string()] {
        assert!(!html.contains(word), "the page contains {word}");
    }
    for (width, height, scheme) in SCREENS {
        let mut tab = browser.tab(width, height, scheme);
        tab.open(&file);
        let wide = tab.evaluate("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(wide <= width.into(), "{wide} px on a screen of {width} px");
        let dark = tab.evaluate("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)";
        assert_eq!(dark, scheme == "dark");
        let standing = look_at(&mut tab, 0.0);
        let lying = look_at(&mut tab, film.snapshots.last().unwrap().time_s);
        eprintln!("{width} px, {scheme}: standing {standing}, lying {lying}");
        for seen in [&standing, &lying] {
            assert!(seen["purple"].as_f64().unwrap() > 0.02, "no robot: {seen}");
            assert!(seen["colors"].as_u64().unwrap() > 1000, "hardly a picture: {seen}");
        }
        let fallen_by = lying["top"].as_f64().unwrap() - standing["top"].as_f64().unwrap();
        assert!(fallen_by > 0.1, "its highest point is lower by {fallen_by} of the picture");
        let plot = look(&mut tab, "plot-x");
        assert!(plot["colors"].as_u64().unwrap() > 30, "an empty plot: {plot}");
        assert_no_problems(&mut tab, &file);
    }
    // Whoever does not see the page hears names.
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    let nameless = "[...document.querySelectorAll('button, input, select, canvas, output')]
        .filter((e) => !(e.getAttribute('aria-label') || e.textContent).trim()).map((e) => e.outerHTML)";
    assert_eq!(tab.evaluate(nameless), json!([]));
}

#[test]
fn what_the_page_shows_is_what_the_film_holds() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let film = stepping();
    let file = written(&folder, film, &head());
    let mut tab = browser.tab(600, 600, "light");
    tab.open(&file);
    const EVERY: usize = 5;
    let shown = tab.evaluate(&format!(
        "Array.from({{ length: Math.ceil(replay.film.count / {EVERY}) }}, (_, k) => replay.film.at(replay.film.time({EVERY} * k)))"
    ));
    let shown = shown.as_array().unwrap();
    assert_eq!(shown.len(), film.snapshots.len().div_ceil(EVERY), "a moment for each tick");
    let mut worst = Worst::default();
    let mut kinematics = Kinematics::new(&film.robot);
    for (shown, snapshot) in shown.iter().zip(film.snapshots.iter().step_by(EVERY)) {
        kinematics.update(&film.robot, &snapshot.posture);
        for (i, link) in film.robot.links.iter().enumerate() {
            let pose = pose(&shown["poses"][i]);
            for solid in &link.visuals {
                let corner = match solid.shape {
                    Shape::Box { half } => Point3::from(half),
                    Shape::Cylinder { radius, length } => Point3::new(radius, 0.0, length / 2.0),
                    Shape::Sphere { radius } => Point3::new(0.0, 0.0, radius),
                };
                let corner = solid.pose * corner;
                worst.see("robot", (pose * corner - kinematics.link_pose(i) * corner).norm());
            }
        }
        let flat = |p: Point2<f64>| vec![p.x, p.y];
        worst.compare("com", &shown["com"], Some(vec![snapshot.com.x, snapshot.com.y, snapshot.com.z]));
        worst.compare("dcm", &shown["dcm"], Some(flat(snapshot.dcm)));
        worst.compare("zmp", &shown["zmp"], snapshot.zmp.map(flat));
        worst.compare("zmp_ref", &shown["zmpRef"], Some(flat(snapshot.zmp_ref)));
        let all = |points: &[Point2<f64>]| Some(points.iter().flat_map(|p| [p.x, p.y]).collect());
        worst.compare("support", &flattened(&shown["support"]), all(&snapshot.support));
        for gain in 0..film.gains.len() {
            let slice = snapshot.slices.get(gain).map_or(&[][..], |slice| slice);
            worst.compare("slices", &flattened(&shown["slices"][gain]), all(slice));
        }
        let landing: Vec<_> = snapshot.footstep.iter().flatten().map(|corner| corner.xy()).collect();
        worst.compare("footstep", &flattened(&shown["footstep"]), all(&landing));
        for (i, foot) in Foot::BOTH.into_iter().enumerate() {
            let at = snapshot.contacts[foot].map(|arrow| arrow.point.coords.as_slice().to_vec());
            worst.compare("contacts", &shown["contacts"][i]["point"], at);
        }
        worst.compare("push", &shown["push"]["point"], snapshot.push.map(|push| push.point.coords.as_slice().to_vec()));
        assert_eq!(shown["phase"], snapshot.phase.name());
        assert_eq!(shown["gain"].as_u64(), snapshot.gain.map(|gain| gain as u64));
    }
    eprintln!("largest differences (m): {:?}", worst.0);
    assert!(worst.0.len() >= 9 && worst.0.iter().all(|(_, error)| *error < NEAR_M), "{:?}", worst.0);
    let marks = tab.evaluate("replay.film.marks.map((mark) => [mark.kind, mark.from_s])");
    let marked = |kind: &str| -> Vec<f64> {
        let of_kind = marks.as_array().unwrap().iter().filter(|mark| mark[0] == kind);
        of_kind.map(|mark| mark[1].as_f64().unwrap()).collect()
    };
    assert_eq!(marked("push"), [0.5]);
    assert_eq!(marked("footstep"), film.record.footsteps.iter().map(|step| step.lift_s).collect::<Vec<_>>());
    assert!(!marked("footstep").is_empty() && !marked("switch").is_empty(), "{marks}");
    assert_eq!(tab.evaluate("document.querySelectorAll('#marks i').length"), marks.as_array().unwrap().len());
    // One moment as it is told.
    let swinging = film.snapshots.iter().find(|s| s.footstep.is_some()).unwrap();
    look_at(&mut tab, swinging.time_s);
    assert_eq!(text(&mut tab, "phase"), "swing right");
    assert_eq!(text(&mut tab, "clock"), format!("{:.3} s", swinging.time_s));
    assert_no_problems(&mut tab, &file);
}

#[test]
fn the_ground_is_that_of_the_trial() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let bench = Bench::new("hold");
    let slope = (Some(2.0), Some(-60.0));
    let variation = Variation {
        slope_deg: slope.0,
        slope_heading_deg: slope.1,
        ground_step_m: Some(0.004),
        ..Variation::default()
    };
    let disturbance = Disturbance { pushes: vec![push(1.0, 0.0)], variation, ..Disturbance::default() };
    let film = Film::take(&bench.robot, &bench.design, &config(1.0), disturbance, 0.0, &mut |_| {});
    let file = written(&folder, &film, &head());
    let mut tab = browser.tab(800, 600, "light");
    tab.open(&file);
    for (i, snapshot) in film.snapshots.iter().enumerate().step_by(100) {
        let ground = Ground { slope: snapshot.slope, ..Ground::new(&film.robot, &variation) };
        for (x, y) in [(0.0, 0.0), (0.03, -0.05), (0.3, 0.1), (-0.2, 0.4)] {
            let script = format!("replay.film.height(replay.film.at(replay.film.time({i})).slope, {x}, {y}) + 0");
            let shown_m = tab.evaluate(&script).as_f64().unwrap();
            let height_m = ground.height_m(Point2::new(x, y));
            assert!((shown_m - height_m).abs() < NEAR_M, "at ({x}, {y}): {shown_m} m, not {height_m} m");
        }
    }
    let level = look_at(&mut tab, 0.0);
    assert!(level["purple"].as_f64().unwrap() > 0.02, "{level}");
    assert_no_problems(&mut tab, &file);
}

/// The largest difference of each kind (m).
#[derive(Default)]
struct Worst(std::collections::BTreeMap<&'static str, f64>);

impl Worst {
    fn see(&mut self, what: &'static str, error: f64) {
        let worst = self.0.entry(what).or_default();
        *worst = worst.max(error);
    }

    fn compare(&mut self, what: &'static str, shown: &Value, held: Option<Vec<f64>>) {
        let Some(held) = held else { return assert!(shown.is_null(), "{what}: {shown}, but there is none") };
        let shown: Vec<f64> = shown.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert_eq!(shown.len(), held.len(), "{what}");
        for (a, b) in shown.iter().zip(held) {
            self.see(what, (a - b).abs());
        }
    }
}

fn flattened(corners: &Value) -> Value {
    corners.as_array().unwrap().iter().flat_map(|corner| corner.as_array().unwrap().clone()).collect()
}

fn pose(shown: &Value) -> Isometry3<f64> {
    let part = |name: &str, i: usize| shown[name][i].as_f64().unwrap();
    let turn = Quaternion::new(part("q", 3), part("q", 0), part("q", 1), part("q", 2));
    let at = Translation3::new(part("p", 0), part("p", 1), part("p", 2));
    Isometry3::from_parts(at, UnitQuaternion::from_quaternion(turn))
}

#[test]
fn time_is_scrubbed_and_linked_and_runs() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let film = stepping();
    let file = written(&folder, film, &head());
    let (last_s, tick_s) = (film.snapshots.last().unwrap().time_s, film.control_period_s);
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    let at = |tab: &mut Page, expected_s: f64, near_s: f64, what: &str| {
        let time_s = time_s(tab);
        assert!((time_s - expected_s).abs() <= near_s, "{what}: at {time_s} s, not {expected_s} s");
        let told = tab.evaluate("replay.draw(), parseFloat(document.getElementById('clock').textContent)");
        assert!((told.as_f64().unwrap() - time_s).abs() < 1e-3, "{what}: told as {told} s");
    };
    let exact_s = 1e-9;
    at(&mut tab, 0.0, exact_s, "at first");
    for (key, expected_s) in
        [("ArrowRight", tick_s), ("ArrowRight", 2.0 * tick_s), ("ArrowLeft", tick_s), ("End", last_s), ("Home", 0.0)]
    {
        press(&mut tab, key);
        at(&mut tab, expected_s, exact_s, key);
    }
    press(&mut tab, "ArrowRight");
    assert_eq!(tab.evaluate("location.hash"), "#t=0.002");
    // The time line is 8 px longer on each side than the time: half the knob. Of a plot, the frame.
    click_in(&mut tab, "time", 0.5, 0.5);
    at(&mut tab, last_s / 2.0, 0.01, "time line");
    click_in(&mut tab, "plot-y", 0.99, 0.5);
    at(&mut tab, last_s, exact_s, "end of a plot");
    let width = tab.evaluate("document.getElementById('plot-x').clientWidth").as_f64().unwrap();
    click_in(&mut tab, "plot-x", (44.0 + 0.25 * (width - 54.0)) / width, 0.5);
    at(&mut tab, last_s / 4.0, 0.01, "a quarter of a plot");
    tab.evaluate("new Promise((done) => { addEventListener('hashchange', done); location.hash = '#t=0.6'; })");
    at(&mut tab, 0.6, exact_s, "address");

    press(&mut tab, "[");
    press(&mut tab, "[");
    assert_eq!(tab.evaluate("replay.state.speed"), 0.2);
    let began_ms = tab.evaluate("performance.now()").as_f64().unwrap();
    press(&mut tab, " ");
    let wait = "new Promise((done) => setTimeout(done, 700))";
    tab.evaluate(wait);
    assert_eq!(tab.evaluate("document.getElementById('play').getAttribute('aria-label')"), "pause");
    let slow_s = time_s(&mut tab) - 0.6;
    let passed_s = (tab.evaluate("performance.now()").as_f64().unwrap() - began_ms) / 1000.0;
    assert!(slow_s > 0.0 && slow_s <= 0.2 * passed_s + 0.01, "at 1/5 it went {slow_s} s in {passed_s} s");
    press(&mut tab, " ");
    let paused_s = time_s(&mut tab);
    tab.evaluate(wait);
    assert_eq!(time_s(&mut tab), paused_s, "paused");
    tab.evaluate("document.getElementById('speed').value = '1', document.getElementById('speed').dispatchEvent(new Event('change'))");
    press(&mut tab, "End");
    click_in(&mut tab, "play", 0.5, 0.5);
    tab.evaluate(&wait.replace("700", "200"));
    let from_start_s = time_s(&mut tab);
    assert!(from_start_s < last_s, "from the end it plays from the start");
    tab.evaluate(
        "new Promise((done) => { const look = () => replay.state.playing ? setTimeout(look, 50) : done(); look(); })",
    );
    at(&mut tab, last_s, exact_s, "the end");
    assert_no_problems(&mut tab, &file);

    let mut tab = browser.tab(1200, 900, "light");
    let url = format!("file://{}#t=1.2", file.display());
    tab.call("Page.navigate", json!({ "url": url }));
    tab.evaluate(
        "new Promise((done) => { const look = () => window.replay ? done() : setTimeout(look, 20); look(); })",
    );
    at(&mut tab, 1.2, exact_s, "a link");
}

#[test]
fn overlays_and_views_change_the_picture_and_come_back() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let film = stepping();
    let file = written(&folder, film, &head());
    let mut tab = browser.tab(900, 700, "light");
    tab.open(&file);
    let swinging_s = film.snapshots.iter().find(|s| s.footstep.is_some()).unwrap().time_s + 0.04;
    let pushed_s = film.pushes[0].start_s + 0.02;
    for (id, key, at_s) in [
        ("com", "c", pushed_s),
        ("dcm", "d", pushed_s),
        ("zmp", "z", pushed_s),
        ("zmpRef", "w", pushed_s),
        ("support", "s", pushed_s),
        ("sets", "i", pushed_s),
        ("contacts", "g", pushed_s),
        ("push", "p", pushed_s),
        ("body", "b", pushed_s),
        ("footstep", "f", swinging_s),
        ("trail", "t", swinging_s),
    ] {
        let before = look_at(&mut tab, at_s);
        click_in(&mut tab, &format!("show-{id}"), 0.5, 0.5);
        let without = look(&mut tab, "view");
        assert_ne!(before["hash"], without["hash"], "{id} makes no difference");
        assert_eq!(
            tab.evaluate(&format!("document.getElementById('show-{id}').getAttribute('aria-pressed')")),
            "false"
        );
        press(&mut tab, key);
        assert_eq!(before["hash"], look(&mut tab, "view")["hash"], "{id} does not come back");
    }
    for (curve, key) in [("com", "c"), ("support", "s"), ("zmp", "z")] {
        let before = look(&mut tab, "plot-x");
        press(&mut tab, key);
        assert_ne!(before["hash"], look(&mut tab, "plot-x")["hash"], "{curve} is not in the plot");
        press(&mut tab, key);
    }
    let home = look(&mut tab, "view");
    let mut seen = vec![home["hash"].clone()];
    for key in ["2", "3", "4"] {
        press(&mut tab, key);
        seen.push(look(&mut tab, "view")["hash"].clone());
    }
    let drag = |kind: &str, x: f64, buttons: u8, modifiers: u8| json!({ "type": kind, "x": x, "y": 300, "button": "left", "buttons": buttons, "modifiers": modifiers, "clickCount": 1 });
    for shift in [0, 8] {
        press(&mut tab, "1");
        assert_eq!(look(&mut tab, "view")["hash"], home["hash"], "reset");
        for (kind, x, buttons) in [("mousePressed", 200.0, 1), ("mouseMoved", 260.0, 1), ("mouseReleased", 260.0, 0)] {
            tab.call("Input.dispatchMouseEvent", drag(kind, x, buttons, shift));
        }
        seen.push(look(&mut tab, "view")["hash"].clone());
    }
    press(&mut tab, "1");
    let wheel = json!({ "type": "mouseWheel", "x": 200, "y": 300, "deltaX": 0, "deltaY": -240 });
    tab.call("Input.dispatchMouseEvent", wheel);
    let near = look(&mut tab, "view");
    assert!(near["purple"].as_f64() > home["purple"].as_f64(), "nearer it is larger: {near}, {home}");
    let count = seen.len();
    seen.sort_by_key(Value::to_string);
    seen.dedup();
    assert_eq!(seen.len(), count, "two views are the same");
    assert_no_problems(&mut tab, &file);
}

#[test]
fn without_webgl_the_rest_works() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = written(&folder, stepping(), &head());
    let mut tab = browser.tab(1200, 900, "light");
    let none = "const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
            return kind.startsWith('webgl') ? null : get.call(this, kind, ...more);
        };";
    tab.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": none }));
    tab.open(&file);
    let told = tab.evaluate("document.getElementById('stage').innerText");
    assert!(told.as_str().unwrap().starts_with("No 3D view here"), "{told}");
    let plot = look(&mut tab, "plot-x");
    press(&mut tab, "End");
    assert_eq!(time_s(&mut tab), stepping().snapshots.last().unwrap().time_s);
    assert_ne!(plot["hash"], look(&mut tab, "plot-x")["hash"], "the plot keeps step");
    press(&mut tab, "2");
    assert_no_problems(&mut tab, &file);
}

#[test]
fn names_are_text_whatever_they_contain() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let evil = |n: u8| {
        format!(
            "</title></code></pre></script><script>window.evil={n}</script><!--<img src=x onerror=window.evil={n}>\"'&\\u003c"
        )
    };
    let mut film = stepping().clone();
    film.gain_set = evil(1);
    film.gains.iter_mut().for_each(|name| *name = evil(2));
    film.robot.name = evil(3);
    film.robot.links[0].name = evil(4);
    film.record.fell_at_s = Some(1.0);
    film.record.fall_cause = Some(evil(5));
    let back = Some("javascript:window.evil=6".to_string());
    let file = written(&folder, &film, &Head { title: evil(7), lines: vec![evil(8)], command: Some(evil(9)), back });
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    look_at(&mut tab, 0.1);
    assert_eq!(tab.evaluate("typeof window.evil"), "undefined");
    assert_eq!(tab.evaluate("document.querySelectorAll('img, a').length"), 0);
    assert_eq!(tab.evaluate("document.title"), evil(7).as_str());
    assert_eq!(text(&mut tab, "command-text"), evil(9));
    assert_eq!(text(&mut tab, "gain"), evil(2));
    let marked = tab.evaluate("[...document.querySelectorAll('#marks .fall')].map((mark) => mark.title)");
    assert!(marked[0].as_str().unwrap().contains(&evil(5)), "{marked}");
    assert_no_problems(&mut tab, &file);
}

#[test]
fn a_page_of_four_seconds_is_small_and_always_the_same() {
    let whole = EpisodeConfig { end_early: false, ..config(4.0) };
    let film = film("paper", 3.6, whole);
    assert_eq!(film.snapshots.len(), 2001);
    let html = page(&film, &head()).unwrap();
    eprintln!("{} bytes", html.len());
    assert!(html.len() < 600_000, "{} bytes", html.len());
    assert!(html == page(&film, &head()).unwrap());
    // A longer film is thinned out.
    let mut long = film.clone();
    for _ in 0..3 {
        long.snapshots.extend(film.snapshots.iter().cloned());
    }
    let html = page(&long, &head()).unwrap();
    assert!(html.len() < 1_000_000, "{} bytes", html.len());
}
