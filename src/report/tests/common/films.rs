//! Films and their pages, for tests of the pages.

use super::browser::Page;
use super::{Bench, config, push};
use serde_json::{Value, json};
use standfast_report::replay::{Head, page};
use standfast_sim::Engine;
use standfast_sim::episode::{Disturbance, EpisodeConfig, Film};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// A push from behind and to the right, for which `paper` switches gains and takes a footstep.
pub fn stepping() -> &'static Film {
    static FILM: OnceLock<Film> = OnceLock::new();
    FILM.get_or_init(|| film("paper", 3.6, config(4.0)))
}

/// The push of [`stepping`], after which `hold` falls.
pub fn fallen() -> &'static Film {
    static FILM: OnceLock<Film> = OnceLock::new();
    FILM.get_or_init(|| film("hold", 3.6, config(3.0)))
}

pub fn film(gains: &str, impulse_n_s: f64, config: EpisodeConfig) -> Film {
    let bench = Bench::new(gains);
    let disturbance = Disturbance {
        pushes: vec![push(impulse_n_s, -20.0)],
        ..Disturbance::default()
    };
    Film::take(
        &bench.robot,
        &bench.factory,
        &config,
        disturbance,
        (config.until(), 0.8),
        &mut |_| {},
    )
    .unwrap()
}

/// A substitute for a film of the same push in another engine: the film of `hold`.
pub fn ghost() -> Film {
    Film {
        engine: Engine::Mujoco,
        ..fallen().clone()
    }
}

pub fn head() -> Head {
    Head {
        title: "A push".into(),
        lines: vec!["push      3.6 N s".into(), "outcome   as it was".into()],
        command: "standfast push --impulse 3.6 --heading -20 --replay replay.html".into(),
        of_result: true,
        ..Head::default()
    }
}

pub fn written(folder: &TempDir, film: &Film, head: &Head) -> PathBuf {
    written_with(folder, film, None, head)
}

pub fn written_with(folder: &TempDir, film: &Film, ghost: Option<&Film>, head: &Head) -> PathBuf {
    let file = folder.path().join("replay.html");
    fs::write(&file, page(film, ghost, head).unwrap()).unwrap();
    file
}

pub fn assert_no_problems(tab: &mut Page, file: &Path) {
    let problems = tab.problems(file);
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Draws and reads the pixels of a canvas: a hash of all, the share of purple ones (the robot's colour), their highest
/// row (share of the height), and the number of colours.
pub const LOOK: &str = "(id = 'view') => {
    replay.draw();
    const canvas = document.getElementById(id), { width, height } = canvas;
    const pen = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
    pen.drawImage(canvas, 0, 0);
    if (id === 'view') pen.drawImage(document.getElementById('over'), 0, 0);
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

pub fn look(tab: &mut Page, canvas: &str) -> Value {
    tab.evaluate(&format!("({LOOK})('{canvas}')"))
}

pub fn look_at(tab: &mut Page, time_s: f64) -> Value {
    tab.evaluate(&format!("replay.seek({time_s})"));
    look(tab, "view")
}

pub fn time_s(tab: &mut Page) -> f64 {
    tab.evaluate("replay.state.time").as_f64().unwrap()
}

pub fn press(tab: &mut Page, key: &str) {
    tab.call(
        "Input.dispatchKeyEvent",
        json!({ "type": "keyDown", "key": key }),
    );
    tab.call(
        "Input.dispatchKeyEvent",
        json!({ "type": "keyUp", "key": key }),
    );
}

/// Clicks into an element, at shares of its width and height.
pub fn click_in(tab: &mut Page, id: &str, across: f64, down: f64) {
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

pub fn text(tab: &mut Page, id: &str) -> String {
    tab.evaluate(&format!("document.getElementById('{id}').textContent"))
        .as_str()
        .unwrap()
        .into()
}
