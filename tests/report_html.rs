//! The page of a campaign as a reader meets it: in a browser, from a file, with nothing else to load.

mod common;

use common::browser::{Browser, Page};
use common::program::{SHORT, folder, standfast};
use serde_json::{Value, json};
use standfast::campaign::Folder;
use standfast::report::html;
use std::{fs, path::Path, path::PathBuf};

/// A name that a page must not take for its own words.
const TITLE: &str = "<img src=x onerror=alert(1)> & \"friends\"";

/// A small campaign's page in a folder: real trials, and judgements of every kind.
fn page(folder: &Path) -> (PathBuf, Value) {
    let more = ["--gains=switching", "--gains=catch", "--trials=12", "--set=push.heading_deg={uniform=[-180, 180]}"];
    standfast(folder, &[&SHORT[..], &more].concat()).success();
    let out = folder.join("out");
    let rows = Folder::existing(&out).unwrap().rows().unwrap();
    let mut summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    let pair = |a: &str, b: &str, verdict: &str| {
        json!({ "a": a, "b": b, "both": 7, "only_a": 3, "only_b": 1, "neither": 1, "difference": 0.17,
            "ci95": [-0.2, 0.5], "mcnemar_p": 0.6, "holm_p": 1.0, "verdict": verdict, "words": format!("{a}, {b}: {TITLE}"),
            "strata": [{ "by": "heading_sector", "label": "left", "trials": 5, "difference": 0.2, "ci95": [-0.1, 0.5] }],
            "settling_s": { "pairs": 7, "nonzero": 6, "p": 0.3, "median": 0.1, "ci95": [-0.1, 0.3] } })
    };
    summary["name"] = TITLE.into();
    summary["pairs"] = json!([
        pair("hold", "switching", "not_resolved"),
        pair("hold", "catch", "a_better"),
        pair("switching", "catch", "same"),
        pair("catch", "hold", "b_better")
    ]);
    summary["gates"] = json!([{ "name": "catch >= 0.80", "status": "failed", "observed": 0.5, "interval": [0.2, 0.8],
        "required": 0.8, "confidence": 0.95, "set": "catch", "lost_trial": 3 }, { "name": TITLE, "status": "passed" }]);
    summary["warnings"] = json!([TITLE]);
    let text = html::page(&summary, &rows).unwrap();
    assert_eq!(text, html::page(&summary, &rows).unwrap());
    let machine = folder.display().to_string();
    assert!(!text.contains(&machine), "the page names {machine}");
    let file = folder.join("report.html");
    fs::write(&file, text).unwrap();
    (file, summary)
}

/// Of the screenshot: neither blank nor of one colour, whatever the size and the scheme.
fn assert_shows_something(browser: &mut Browser, png: &str, what: &str) {
    let (colors, most) = browser.tab(100, 100, "light").colors(png);
    eprintln!("{what}: {colors} colours, the most frequent on {:.1} % of the page", 100.0 * most);
    assert!(colors > 300 && most < 0.97, "{what}: {colors} colours, one of them on {:.1} % of the page", 100.0 * most);
}

fn assert_no_problems(page: &mut Page, file: &Path) {
    let problems = page.problems(file);
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn the_page_shows_on_every_screen_and_asks_for_nothing() {
    let Some(mut browser) = Browser::start() else { return };
    let dir = folder();
    let (file, _) = page(dir.path());
    for (width, height, scheme) in [(1200, 900, "light"), (1200, 900, "dark"), (390, 800, "light")] {
        let mut tab = browser.tab(width, height, scheme);
        tab.open(&file);
        let wide = tab.evaluate("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(wide <= width.into(), "{wide} px on a screen of {width} px");
        let dark = tab.evaluate("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)";
        assert_eq!(dark, scheme == "dark");
        assert_no_problems(&mut tab, &file);
        let png = tab.screenshot();
        assert_shows_something(&mut browser, &png, &format!("{width} px, {scheme}"));
    }
}

#[test]
fn the_page_shows_without_javascript() {
    let Some(mut browser) = Browser::start() else { return };
    let dir = folder();
    let (file, _) = page(dir.path());
    let mut tab = browser.tab(1200, 900, "light");
    tab.call("Emulation.setScriptExecutionDisabled", json!({ "value": true }));
    tab.open(&file);
    let png = tab.screenshot();
    assert_shows_something(&mut browser, &png, "without JavaScript");
}

#[test]
fn a_click_on_a_trial_copies_the_command_that_replays_it_and_a_pair_can_be_chosen() {
    let Some(mut browser) = Browser::start() else { return };
    let dir = folder();
    let (file, summary) = page(dir.path());
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    assert_eq!(tab.evaluate("document.querySelector('.kicker b').textContent"), TITLE);

    // The third trial on the map of the second set, placed by the page's own promise: up is forward, left is left.
    let at = tab.evaluate(
        "(async () => {
            const map = document.querySelectorAll('.map')[1];
            const scrolled = new Promise((done) => document.addEventListener('scroll', () => setTimeout(done, 50)));
            map.scrollIntoView({ block: 'center' });
            await scrolled;
            const [, impulse, heading] = JSON.parse(document.getElementById('trials').textContent).trials[2];
            const turn = heading * Math.PI / 180, length = 130 * impulse / map.dataset.most;
            const dot = new DOMPoint(-length * Math.sin(turn), -length * Math.cos(turn));
            const { x, y } = dot.matrixTransform(map.getScreenCTM());
            return [x, y];
        })()",
    );
    tab.click(at[0].as_f64().unwrap(), at[1].as_f64().unwrap());
    let told = "new Promise((done) => setTimeout(() => done(document.getElementById('toast').textContent), 300))";
    let toast = tab.evaluate(told).as_str().unwrap().to_string();
    let second = summary["sets"][1]["name"].as_str().unwrap();
    let command = format!("standfast push --trial 2 --campaign campaign.toml --gains {second}");
    assert!(toast.ends_with(&command), "{toast:?} is not {command:?}");
    let tip = tab.evaluate("document.getElementById('tip').hidden ? '' : document.getElementById('tip').textContent");
    assert!(tip.as_str().unwrap().starts_with("trial 2: "), "{tip}");
    assert_eq!(
        tab.evaluate("document.querySelectorAll('.here').length"),
        tab.evaluate("document.querySelectorAll('.map').length")
    );

    let shown =
        "[...document.querySelectorAll('#maps [data-pair]')].filter((p) => !p.hidden).map((p) => p.dataset.pair)";
    assert_eq!(tab.evaluate(shown), json!(["0"]));
    for (choice, expected) in [("2", json!(["2"])), ("all", json!(["0", "1", "2", "3"]))] {
        let choose = format!(
            "(() => {{ const c = document.querySelector('.choose-pair'); c.value = '{choice}';
                c.dispatchEvent(new Event('change')); }})()"
        );
        tab.evaluate(&choose);
        assert_eq!(tab.evaluate(shown), expected);
    }
    assert_no_problems(&mut tab, &file);
}
