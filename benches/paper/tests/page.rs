//! `standfast-paper page` from outside: what it writes, that it writes the same every time, and that its captions agree
//! with the library.

mod measured;
mod verdicts;

use crate::common::Bench;
use crate::common::browser::Browser;
use crate::common::program::{files, folder, standfast as program, stderr, stdout};
use measured::{impose, scenario_push};
use nalgebra::Vector2;
use serde_json::{Value, json};
use standfast::core::control::home_polygon;
use standfast::core::lipm::cpi_set::{CpiSet, Inclusion};
use standfast::core::robot::Foot;
use standfast::sim::episode::Footstep;
use std::collections::BTreeMap;
use std::fs;
use std::sync::OnceLock;

const FILES: [&str; 12] = [
    "fig03-inclusion.svg",
    "fig04-regions.svg",
    "fig05-sequence.svg",
    "fig06-swing-foot.svg",
    "fig07-robot.svg",
    "fig08-imposed.svg",
    "fig09-responses-imposed.svg",
    "fig10-gauge.svg",
    "fig12-push-behind.svg",
    "fig13-push-diagonal.svg",
    "fig14-responses-pushed.svg",
    "index.html",
];
const FIGURES: [&str; 11] = ["3", "4", "5", "6", "7", "8", "9", "10", "12", "13", "14"];

/// Two runs of the command, one with `--json`, and the other into the folder of an earlier run.
struct Runs {
    json: Value,
    table: String,
    /// The files that each run wrote, by name.
    written: [BTreeMap<String, Vec<u8>>; 2],
}

fn runs() -> &'static Runs {
    static RUNS: OnceLock<Runs> = OnceLock::new();
    RUNS.get_or_init(|| {
        let dir = folder();
        let earlier = dir.path().join("b");
        fs::create_dir(&earlier).unwrap();
        for name in FILES {
            fs::write(earlier.join(name), "of an earlier run").unwrap();
        }
        let run = |args: &[&str]| stdout(&program(dir.path(), args).success());
        let [json, table] = std::thread::scope(|scope| {
            let first = scope.spawn(|| run(&["page", "--out=a", "--json"]));
            let second = scope.spawn(|| run(&["page", "--out=b"]));
            [first.join().unwrap(), second.join().unwrap()]
        });
        let written = ["a", "b"].map(|out| files(&dir.path().join(out)));
        Runs {
            json: serde_json::from_str(&json).unwrap(),
            table,
            written,
        }
    })
}

fn page() -> &'static str {
    std::str::from_utf8(&runs().written[0]["index.html"]).unwrap()
}

/// Asserts that the page contains these words, with numbers that stay with their units.
fn tells(words: &str) {
    assert!(page().replace('\u{a0}', " ").contains(words), "{words}");
}

/// The page without measured times.
fn without_times(page: &[u8]) -> String {
    let page = std::str::from_utf8(page).unwrap();
    let (before, rest) = page.split_once("<!--timing-->").unwrap();
    let (times, after) = rest.split_once("<!--/timing-->").unwrap();
    assert!(times.contains("0.15 ms") && times.contains("μs"), "{times}");
    format!("{before}{after}")
}

fn figure(number: &str) -> &'static Value {
    let figures = runs().json["figures"].as_array().unwrap();
    figures
        .iter()
        .find(|figure| figure["figure"] == number)
        .unwrap_or_else(|| panic!("no Fig. {number}"))
}

fn numbers(number: &str) -> &'static Value {
    &figure(number)["numbers"]
}

#[test]
fn every_figure_is_a_file_and_on_the_page() {
    let Runs { table, written, .. } = runs();
    assert_eq!(written[0].keys().collect::<Vec<_>>(), FILES);
    for number in FIGURES {
        let file = figure(number)["file"].as_str().unwrap();
        let title = figure(number)["title"].as_str().unwrap();
        tells(&format!("<h2>Fig. {number}: {title}</h2>"));
        let is_row =
            |line: &str| line.starts_with(&format!("Fig. {number} ")) && line.contains(file);
        assert!(table.lines().any(is_row), "{table}");
        let svg = std::str::from_utf8(&written[0][file]).unwrap();
        let document = roxmltree::Document::parse(svg).unwrap_or_else(|e| panic!("{file}: {e}"));
        assert!(
            document
                .root_element()
                .has_tag_name(("http://www.w3.org/2000/svg", "svg")),
            "{file}"
        );
        let elements = document
            .descendants()
            .filter(|node| node.is_element())
            .count();
        assert!(elements > 20, "{file}: {elements} elements");
        // Its panels stand beside and below each other, inside of the picture.
        let side = |node: roxmltree::Node, name| {
            node.attribute(name)
                .map_or(0.0, |px| px.parse::<f64>().unwrap())
        };
        let place = |node| ["x", "y", "width", "height"].map(|name| side(node, name));
        let [_, _, width, height] = place(document.root_element());
        let panels = document
            .root_element()
            .children()
            .filter(|node| node.has_tag_name("svg"))
            .map(place);
        let panels: Vec<[f64; 4]> = panels.collect();
        for (i, [x, y, w, h]) in panels.iter().enumerate() {
            assert!(x + w < width && y + h < height, "{file}: panel {i}");
            let apart = |[u, v, ..]: &[f64; 4]| u >= &(x + w) || v >= &(y + h);
            assert!(
                panels[i + 1..].iter().all(apart),
                "{file}: panel {i} is covered"
            );
        }
        assert!(panels.len() > 1, "{file}");
    }
    for number in ["1", "2", "11"] {
        tells(&format!("<dt>Fig. {number}</dt>"));
    }
}

#[test]
fn only_the_times_differ_between_two_runs() {
    let [a, b] = &runs().written;
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in a {
        if name == "index.html" {
            assert!(
                without_times(bytes) == without_times(&b[name]),
                "the pages differ beyond the times"
            );
        } else {
            assert!(*bytes == b[name], "{name} differs");
        }
    }
}

/// Length of the first footstep (mm), as a caption states it.
fn in_words(footstep: &Footstep) -> String {
    let [x, y] = [0, 1].map(|axis| 1e3 * (footstep.to_m[axis] - footstep.from_m[axis]));
    let forward = format!(
        "{:.0} mm {}",
        x.abs(),
        if x < 0.0 { "backward" } else { "forward" }
    );
    let left = format!(
        "{:.0} mm to the {}",
        y.abs(),
        if y < 0.0 { "right" } else { "left" }
    );
    if y.abs() < 0.5 {
        forward
    } else {
        format!("{forward} and {left}")
    }
}

/// Fig. 4, 5, 8, 12, 13: compares with footsteps computed by the library.
#[test]
fn captions_tell_the_footsteps_that_the_scenarios_take() {
    let bench = Bench::new("paper");
    for (name, number) in [("push-behind", "12"), ("push-diagonal", "13")] {
        let record = bench.push(scenario_push(name));
        let footstep = record.footsteps.taken[0];
        assert_eq!(
            numbers(number)["footsteps"][0],
            json!(footstep),
            "Fig. {number}"
        );
        tells(&format!("The foot goes {}.", in_words(&footstep)));
        assert_eq!(footstep.foot, Foot::Right, "{name}");
        let at = &numbers("5")[name.replace('-', "_")];
        assert_eq!(at["landing_s"], footstep.land_s);
        assert_eq!(
            at["left_sets_s"].as_f64(),
            record.totals.get("left_sets_at_s")
        );
        for time_s in [footstep.lift_s, footstep.land_s] {
            tells(&format!("t = {time_s:.3} s"));
        }
    }
    assert_eq!(numbers("4")["foot"], numbers("12")["footsteps"][0]["foot"]);
    for (name, key) in [("error-backward", "a"), ("error-diagonal", "b")] {
        let footsteps = impose(&bench, name).footsteps;
        assert_eq!(numbers("8")[key]["footsteps"], json!(footsteps));
        tells(&format!(
            "The {} foot goes {}.",
            footsteps[0].foot.name(),
            in_words(&footsteps[0])
        ));
    }
}

/// Fig. 3 and 6: compares with sets that are searched and strides that are measured again.
#[test]
fn captions_tell_the_sets_and_the_ways_of_the_gain_set() {
    let bench = Bench::new("paper");
    let family = &bench.design().family;
    let allowed = home_polygon(&bench.robot).inset(family.zmp_margin).unwrap();
    let sets = CpiSet::search_family(family, &allowed).unwrap();
    let nested = Inclusion::of(&sets).unwrap().failures().is_empty();
    assert!(nested && numbers("3")["nested"] == nested);
    assert_eq!(numbers("3")["sets"].as_array().unwrap().len(), sets.len());
    for (set, told) in sets.iter().zip(numbers("3")["sets"].as_array().unwrap()) {
        assert_eq!(
            (&told["gain"], &told["k"]),
            (&json!(set.gain), &json!(set.horizon))
        );
        tells(&format!(
            "<td>{} ({} ms)</td>",
            set.horizon,
            2 * set.horizon
        ));
        let impulse = bench.robot.mass() * set.largest_com_vel_from_rest(Vector2::x());
        tells(&format!("<td>{}</td>", (100.0 * impulse).round() / 100.0));
    }
    let (range, half) = (
        bench.design().stepping().unwrap().range,
        Vector2::new(0.0, 0.097),
    );
    for example in numbers("6")["examples"].as_array().unwrap() {
        let (sin, cos) = example["direction_deg"]
            .as_f64()
            .unwrap()
            .to_radians()
            .sin_cos();
        let ways = [1.0, -1.0].map(|side| range.reach(half, Vector2::new(cos, side * sin)));
        for (way, told) in ways
            .iter()
            .zip(example["reach_left_right_m"].as_array().unwrap())
        {
            assert!((way - told.as_f64().unwrap()).abs() < 1e-4, "{example}");
        }
        assert_eq!(
            example["foot"],
            if ways[0] > ways[1] { "left" } else { "right" }
        );
        tells(&format!(
            "left foot can go {:.0} mm and the right one {:.0} mm",
            1e3 * ways[0],
            1e3 * ways[1]
        ));
    }
}

#[test]
fn a_folder_with_other_things_is_refused_before_anything_is_done() {
    let dir = folder();
    fs::create_dir(dir.path().join("thesis")).unwrap();
    fs::write(dir.path().join("thesis/main.tex"), "").unwrap();
    for (out, words) in [
        ("thesis", "it holds \"main.tex\""),
        ("thesis/main.tex", "it is a file"),
    ] {
        let refused = program(dir.path(), &["page", &format!("--out={out}")]).code(2);
        let message = stderr(&refused);
        assert!(
            message.starts_with(&format!("error: command line: --out = {out}: {words}")),
            "{message}"
        );
        assert_eq!(files(dir.path()).len(), 1);
    }
}

#[test]
fn the_page_needs_nothing_else_and_fits_a_phone() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let dir = folder();
    let file = dir.path().join("index.html");
    fs::write(&file, page()).unwrap();
    for (width, scheme) in [(390, "light"), (390, "dark"), (1200, "light")] {
        let mut tab = browser.tab(width, 900, scheme);
        tab.open(&file);
        let wide = tab.evaluate("document.documentElement.scrollWidth");
        assert!(
            wide.as_u64().unwrap() <= u64::from(width),
            "{wide} px wide on a screen of {width}"
        );
        let shown =
            tab.evaluate("[...document.querySelectorAll('.panel svg')].filter((s) => s.clientWidth > 100).length");
        assert!(shown.as_u64().unwrap() >= 30, "{shown} panels are seen");
        let background = tab.evaluate("getComputedStyle(document.body).backgroundColor");
        assert_eq!(
            background,
            if scheme == "dark" {
                "rgb(20, 23, 27)"
            } else {
                "rgb(255, 255, 255)"
            }
        );
        let problems = tab.problems(&file);
        assert!(problems.is_empty(), "{}", problems.join("\n"));
    }
}
