//! The pages of real results as a reader sees them: in a browser, from a file, without network.

use crate::common::browser::{Browser, Page};
use crate::common::program::{folder, short, standfast, stdout};
use serde_json::{Value, json};
use std::{fs, path::Path, path::PathBuf};

/// Number of trials that is large enough for both recoveries and falls.
const TRIALS: &str = "--trials=16";
const AROUND: &str = "--set=push.heading_deg={uniform=[-180, 180]}";

/// Runs a small campaign of these controllers, with further arguments, into a folder. Returns its page.
fn campaign(folder: &Path, out: &str, gains: &[&str], more: &[&str], code: i32) -> PathBuf {
    let gains: Vec<String> = gains
        .iter()
        .map(|set| format!("--controller={set}"))
        .collect();
    let out_option = format!("--out={out}");
    let own = |arg: &&str| !["--out=out", "--controller=hold"].contains(arg);
    let mut args: Vec<&str> = short(&[AROUND]).into_iter().filter(own).collect();
    args.extend(
        gains
            .iter()
            .map(String::as_str)
            .chain(more.iter().copied())
            .chain([out_option.as_str()]),
    );
    standfast(folder, &args).code(code);
    folder.join(out).join("report.html")
}

/// The page of two controllers, with gates that have each kind of answer.
fn gated(folder: &Path) -> PathBuf {
    let gates = [
        "--gate=hold >= 0",
        "--gate=hold >= 1",
        "--gate=switching >= hold - 0.9",
        "--gate=switching >= hold",
        "--set=gates.unresolved=fail",
    ];
    campaign(
        folder,
        "gated",
        &["hold", "switching"],
        &[&[TRIALS], &gates[..]].concat(),
        100,
    )
}

/// The page of three controllers, which are three pairs. More trials distinguish controllers than are shown.
fn three(folder: &Path) -> PathBuf {
    campaign(
        folder,
        "three",
        &["hold", "switching", "fixed"],
        &["--trials=80"],
        0,
    )
}

/// The page of a campaign that ends when decided.
fn sequential(folder: &Path) -> PathBuf {
    campaign(
        folder,
        "sequential",
        &["hold", "fixed"],
        &["--until-resolved", "--trials=50"],
        0,
    )
}

/// The page of a comparison of two results.
fn compared(folder: &Path) -> PathBuf {
    campaign(folder, "a", &["hold", "switching"], &[TRIALS], 0);
    campaign(folder, "b", &["fixed"], &[TRIALS], 0);
    standfast(folder, &["compare", "a", "b", "--out=compared"]).success();
    folder.join("compared/report.html")
}

/// Asserts that the screenshot is neither blank nor of one colour, for any size and scheme.
fn assert_shows_something(browser: &mut Browser, png: &str, what: &str) {
    let (colors, most) = browser.tab(100, 100, "light").colors(png);
    eprintln!(
        "{what}: {colors} colours, the most frequent on {:.1} % of the page",
        100.0 * most
    );
    assert!(
        colors > 300 && most < 0.97,
        "{what}: {colors} colours, one of them on {:.1} % of the page",
        100.0 * most
    );
}

fn assert_no_problems(page: &mut Page, file: &Path) {
    let problems = page.problems(file);
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// The texts of all elements for a selector, each on one line.
fn texts(page: &mut Page, selector: &str) -> Vec<String> {
    let script = format!(
        "[...document.querySelectorAll('{selector}')].map((e) => e.innerText.replace(/\\s+/g, ' '))"
    );
    serde_json::from_value(page.evaluate(&script)).unwrap()
}

/// The number of elements for a selector.
fn count(page: &mut Page, selector: &str) -> u64 {
    page.evaluate(&format!("document.querySelectorAll('{selector}').length"))
        .as_u64()
        .unwrap()
}

/// Links without a target in the page, and links to other files.
const DEAD_LINKS: &str = "[...document.querySelectorAll('a')].map((a) => a.getAttribute('href'))
    .filter((link) => link.startsWith('#') && !document.getElementById(link.slice(1)))";
const FILES: &str = "[...document.querySelectorAll('a')].map((a) => a.getAttribute('href'))
    .filter((link) => !link.startsWith('#'))";
/// Sections in the order of the navigation and in the order of the page; and links of the navigation after which the
/// heading is not visible, or lies under the navigation.
const SECTIONS: &str = "[[...document.querySelectorAll('nav a')].map((a) => a.hash.slice(1)),
    [...document.querySelectorAll('main > section')].map((section) => section.id)]";
const BLIND_LINKS: &str = "(async () => {
    const blind = [];
    for (const link of document.querySelectorAll('nav a')) {
        link.click();
        await new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)));
        const heading = document.querySelector(link.hash + ' h2'), { left, top } = heading.getBoundingClientRect();
        if (document.elementFromPoint(left + 4, top + 4) !== heading) blind.push(link.hash);
    }
    return blind;
})()";

#[test]
fn every_kind_of_result_shows_on_every_screen_and_asks_for_nothing() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let dir = folder();
    let machine = dir.path().display().to_string();
    let (light, dark, phone) = (
        (1200, 900, "light"),
        (1200, 900, "dark"),
        (390, 800, "light"),
    );
    let gated = gated(dir.path());
    let mut tab = browser.tab(1200, 900, "light");
    tab.call(
        "Emulation.setScriptExecutionDisabled",
        json!({ "value": true }),
    );
    tab.open(&gated);
    let png = tab.screenshot();
    assert_shows_something(&mut browser, &png, "without JavaScript");
    for (file, screens) in [
        (gated, &[light, dark, phone][..]),
        (sequential(dir.path()), &[light]),
        (compared(dir.path()), &[phone]),
    ] {
        let text = fs::read_to_string(&file).unwrap();
        assert!(!text.contains(&machine), "the page names {machine}");
        for &(width, height, scheme) in screens {
            let mut tab = browser.tab(width, height, scheme);
            tab.open(&file);
            let wide = tab
                .evaluate("document.documentElement.scrollWidth")
                .as_u64()
                .unwrap();
            assert!(wide <= width.into(), "{wide} px on a screen of {width} px");
            let dark = tab.evaluate("getComputedStyle(document.body).backgroundColor")
                != "rgb(255, 255, 255)";
            assert_eq!(dark, scheme == "dark");
            assert_eq!(tab.evaluate(DEAD_LINKS), json!([]));
            let sections = tab.evaluate(SECTIONS);
            assert!(
                sections[0] == sections[1] && sections[0].as_array().unwrap().len() > 6,
                "{sections}"
            );
            assert_eq!(
                (&sections[0][0], &sections[0][2]),
                (&json!("maps"), &json!("watch"))
            );
            assert_eq!(tab.evaluate(BLIND_LINKS), json!([]), "{width} px");
            assert!(count(&mut tab, "#watch .film") > 0);
            let linked = tab.evaluate(FILES);
            assert!(
                !linked.as_array().unwrap().is_empty(),
                "no replay is linked"
            );
            for link in linked
                .as_array()
                .unwrap()
                .iter()
                .map(|link| link.as_str().unwrap())
            {
                let target = file.parent().unwrap().join(link);
                assert!(
                    link.contains("replays/trial-") && target.is_file(),
                    "{link} from {}",
                    file.display()
                );
            }
            assert_no_problems(&mut tab, &file);
            let png = tab.screenshot();
            assert_shows_something(
                &mut browser,
                &png,
                &format!("{}, {width} px, {scheme}", file.display()),
            );
        }
    }
}

#[test]
fn gates_are_told_in_their_unit_and_lead_to_a_lost_trial() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let dir = folder();
    let file = gated(dir.path());
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    let gates = texts(&mut tab, ".gates li");
    for (gate, parts) in gates.iter().zip([
        &[
            "passed hold >= 0 ",
            "the rate is ",
            " % at 95 % confidence), and 0.0 % are required.",
        ][..],
        &[
            "failed hold >= 1 ",
            " at 95 % confidence), and 100.0 % are required.",
            "a lost trial, ",
        ],
        &[
            "passed switching >= hold - 0.9 ",
            "the difference is ",
            " confidence), and \u{2212}90.0 points are required.",
        ],
        &[
            "unresolved switching >= hold ",
            " and 0.0 points are required.",
            "an unresolved gate counts as failed",
        ],
    ]) {
        let gate = gate.replace('\u{a0}', " ");
        parts
            .iter()
            .for_each(|part| assert!(gate.contains(part), "{part:?} is not in {gate:?}"));
    }
    // The link leads to the row with the reason. Its number leads to the maps and stays marked there.
    tab.evaluate("document.querySelector('.gates li:nth-child(2) a').click()");
    let row = texts(&mut tab, ".telling tr:target");
    assert!(row.len() == 1 && row[0].starts_with("hold "), "{row:?}");
    assert_eq!(
        count(&mut tab, "details[open] .telling tr:target"),
        1,
        "the row is folded"
    );
    tab.evaluate("document.querySelector('.telling tr:target [data-trial]').click()");
    tab.evaluate("document.body.dispatchEvent(new PointerEvent('pointermove', { bubbles: true }))");
    assert_eq!(tab.evaluate("location.hash"), "#maps");
    assert_eq!((count(&mut tab, ".here"), count(&mut tab, ".map")), (3, 3));
    tab.evaluate("document.body.click()");
    assert_eq!(count(&mut tab, ".here"), 0);
    // Parts that are folded on the screen are printed.
    let folded = "[...document.querySelectorAll('details:not([open]) > *:not(summary)')]";
    let seen = format!("{folded}.map((part) => part.checkVisibility())");
    assert_eq!(tab.evaluate(&format!("{seen}.includes(true)")), false);
    tab.call("Emulation.setEmulatedMedia", json!({ "media": "print" }));
    assert_eq!(tab.evaluate(&format!("{seen}.includes(false)")), false);
    // The command reproduces the same fall.
    let command = texts(&mut tab, ".gates .command").remove(0);
    let words: Vec<&str> = command
        .strip_prefix("standfast push ")
        .unwrap()
        .split(' ')
        .collect();
    let push = standfast(
        file.parent().unwrap(),
        &[&["push", "--json"], &words[..]].concat(),
    )
    .success();
    let replayed: Value = serde_json::from_str(&stdout(&push)).unwrap();
    assert_ne!(replayed["outcome"], "Recovered", "{replayed}");
    assert_no_problems(&mut tab, &file);
}

#[test]
fn a_click_on_a_trial_copies_the_command_that_replays_it_and_a_pair_can_be_chosen() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let dir = folder();
    let file = three(dir.path());
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);

    // A trial on the map of the second controller, at the place that the page promises: up is forward, left is left.
    let at = tab.evaluate(
        "(async () => {
            const map = document.querySelectorAll('.map')[1];
            map.scrollIntoView({ block: 'center', behavior: 'instant' });
            await new Promise((done) => setTimeout(done, 300));
            // A hard push, since soft ones lie close together.
            const { trials } = JSON.parse(document.getElementById('trials').textContent);
            const [trial, impulse, heading] = trials.find((trial) => trial[1] > 0.7 * map.dataset.most);
            const turn = heading * Math.PI / 180, length = 130 * impulse / map.dataset.most;
            const dot = new DOMPoint(-length * Math.sin(turn), -length * Math.cos(turn));
            const { x, y } = dot.matrixTransform(map.getScreenCTM());
            return [x, y, trial];
        })()",
    );
    tab.click(at[0].as_f64().unwrap(), at[1].as_f64().unwrap());
    let told = "new Promise((done) => setTimeout(() => done(document.getElementById('toast').textContent), 300))";
    let toast = tab.evaluate(told).as_str().unwrap().to_string();
    let trial = &at[2];
    let command =
        format!("standfast push --campaign campaign.toml --trial {trial} --controller switching");
    assert!(toast.ends_with(&command), "{toast:?} is not {command:?}");
    let tip = texts(&mut tab, "#tip:not([hidden])");
    assert!(
        tip.len() == 1 && tip[0].starts_with(&format!("trial {trial}: ")),
        "{tip:?}"
    );
    // Three controllers are three pairs.
    assert_eq!((count(&mut tab, ".here"), count(&mut tab, ".map")), (6, 6));

    // A trial that distinguishes two controllers and is not mentioned elsewhere.
    let apart = tab.evaluate(
        "(() => {
            const code = document.querySelector('.apart .command');
            code.click();
            return [code.textContent, document.getElementById('toast').textContent];
        })()",
    );
    let (number, toast) = (apart[0].as_str().unwrap(), apart[1].as_str().unwrap());
    assert!(
        toast.contains(&format!(
            "--campaign campaign.toml --trial {number} --controller "
        )),
        "{toast}"
    );

    let shown = "[...document.querySelectorAll('#maps [data-pair]')].filter((p) => !p.hidden).map((p) => p.dataset.pair)";
    for (choice, expected) in [("2", json!(["2"])), ("all", json!(["0", "1", "2"]))] {
        let choose = format!(
            "(() => {{ const c = document.querySelector('.choose-pair'); c.value = '{choice}';
                c.dispatchEvent(new Event('change')); }})()"
        );
        tab.evaluate(&choose);
        assert_eq!(tab.evaluate(shown), expected);
    }
    assert_no_problems(&mut tab, &file);
}
