//! The page of a film as a reader sees it: in a browser, from a file, without network.

use crate::common::browser::{Browser, Page};
use crate::common::films::{
    assert_no_problems, click_in, fallen, ghost, head, look, look_at, press, stepping, text,
    time_s, written, written_with,
};
use serde_json::{Value, json};
use standfast_report::replay::Head;
use standfast_sim::Engine;
use standfast_sim::episode::{Film, Outcome};
use std::fs;

const SCREENS: [(u32, u32, &str); 4] = [
    (1200, 900, "light"),
    (1200, 900, "dark"),
    (390, 844, "light"),
    (390, 844, "dark"),
];

#[test]
fn the_robot_shows_on_every_screen_and_the_page_asks_for_nothing() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let film = fallen();
    assert_eq!(
        film.record.outcome,
        Outcome::Fell,
        "this film is to show a fall"
    );
    let file = written(&folder, film, &head());
    let html = fs::read_to_string(&file).unwrap();
    for word in [
        "http:",
        "https:",
        "url(",
        "@import",
        "import(",
        "eval(",
        &folder.path().display().to_string(),
    ] {
        assert!(!html.contains(word), "the page contains {word}");
    }
    for (width, height, scheme) in SCREENS {
        let mut tab = browser.tab(width, height, scheme);
        tab.open(&file);
        let wide = tab
            .evaluate("document.documentElement.scrollWidth")
            .as_u64()
            .unwrap();
        assert!(wide <= width.into(), "{wide} px on a screen of {width} px");
        // All controls of time are in one row, no word is in two lines, and on a telephone each control is as large as
        // a thumb.
        let controls = "[...document.querySelectorAll('.line button, .line select, .line output')].filter((e) => e.checkVisibility())";
        let rows = tab.evaluate(&format!("new Set({controls}.map((e) => {{ const box = e.getBoundingClientRect(); return Math.round((box.top + box.bottom) / 2); }})).size"));
        assert_eq!(rows, 1, "rows of controls on a screen of {width} px");
        let heights = "[...document.querySelectorAll('button, select, #time')].filter((e) => e.checkVisibility())
            .map((e) => [e.textContent, e.getBoundingClientRect().height])";
        let all = |is_fit: &str| {
            format!("{heights}.filter(([, height]) => !({is_fit})).map(([text]) => text)")
        };
        assert_eq!(
            tab.evaluate(&all("height < 46")),
            json!([]),
            "words in two lines on a screen of {width} px"
        );
        if width < 500 {
            // Robot, controls of time and both plots are visible at once.
            let lowest =
                tab.evaluate("document.getElementById('plot-y').getBoundingClientRect().bottom");
            assert!(
                lowest.as_f64().unwrap() <= height.into(),
                "the plots end at {lowest} px of {height} px"
            );
            assert_eq!(
                tab.evaluate(&all("height >= 32")),
                json!([]),
                "too small for a thumb"
            );
        }
        let dark =
            tab.evaluate("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)";
        assert_eq!(dark, scheme == "dark");
        let standing = look_at(&mut tab, 0.0);
        let lying = look_at(&mut tab, film.snapshots.last().unwrap().time_s);
        eprintln!("{width} px, {scheme}: standing {standing}, lying {lying}");
        for seen in [&standing, &lying] {
            assert!(seen["purple"].as_f64().unwrap() > 0.02, "no robot: {seen}");
            assert!(
                seen["colors"].as_u64().unwrap() > 1000,
                "hardly a picture: {seen}"
            );
        }
        let fallen_by = lying["top"].as_f64().unwrap() - standing["top"].as_f64().unwrap();
        assert!(
            fallen_by > 0.1,
            "its highest point is lower by {fallen_by} of the picture"
        );
        let plot = look(&mut tab, "plot-x");
        assert!(
            plot["colors"].as_u64().unwrap() > 30,
            "an empty plot: {plot}"
        );
        assert_no_problems(&mut tab, &file);
    }
    // A screen reader finds names.
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    let nameless = "[...document.querySelectorAll('button, input, select, canvas:not([aria-hidden]), output')]
        .filter((e) => !(e.getAttribute('aria-label') || e.textContent).trim()).map((e) => e.outerHTML)";
    assert_eq!(tab.evaluate(nameless), json!([]));
}

#[test]
#[ignore = "draws in a browser for a quarter of a minute"]
fn time_is_scrubbed_and_linked_and_runs() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let film = stepping();
    let file = written(&folder, film, &head());
    let (last_s, tick_s) = (film.snapshots.last().unwrap().time_s, film.control_period_s);
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    let at = |tab: &mut Page, expected_s: f64, near_s: f64, what: &str| {
        let time_s = time_s(tab);
        assert!(
            (time_s - expected_s).abs() <= near_s,
            "{what}: at {time_s} s, not {expected_s} s"
        );
        let told =
            tab.evaluate("replay.draw(), parseFloat(document.getElementById('clock').textContent)");
        assert!(
            (told.as_f64().unwrap() - time_s).abs() < 1e-3,
            "{what}: told as {told} s"
        );
    };
    let exact_s = 1e-9;
    at(
        &mut tab,
        film.pushes[0].start_s,
        exact_s,
        "at first, at the push",
    );
    press(&mut tab, "Home");
    for (key, expected_s) in [
        (".", tick_s),
        (".", 2.0 * tick_s),
        (",", tick_s),
        ("ArrowRight", tick_s + 0.1),
        ("End", last_s),
        ("Home", 0.0),
    ] {
        press(&mut tab, key);
        at(&mut tab, expected_s, exact_s, key);
    }
    press(&mut tab, ".");
    assert_eq!(tab.evaluate("location.hash"), "#t=0.002");
    // The time line is 8 px longer than the time on each side, half the width of the knob. A plot is as wide as its
    // frame.
    click_in(&mut tab, "time", 0.5, 0.5);
    at(&mut tab, last_s / 2.0, 0.01, "time line");
    click_in(&mut tab, "plot-y", 0.99, 0.5);
    at(&mut tab, last_s, exact_s, "end of a plot");
    let width = tab
        .evaluate("document.getElementById('plot-x').clientWidth")
        .as_f64()
        .unwrap();
    click_in(
        &mut tab,
        "plot-x",
        (44.0 + 0.25 * (width - 54.0)) / width,
        0.5,
    );
    at(&mut tab, last_s / 4.0, 0.01, "a quarter of a plot");
    tab.evaluate("new Promise((done) => { addEventListener('hashchange', done); location.hash = '#t=0.6'; })");
    at(&mut tab, 0.6, exact_s, "address");

    press(&mut tab, "-");
    press(&mut tab, "-");
    assert_eq!(tab.evaluate("replay.state.speed"), 0.2);
    let began_ms = tab.evaluate("performance.now()").as_f64().unwrap();
    press(&mut tab, " ");
    let wait = "new Promise((done) => setTimeout(done, 700))";
    tab.evaluate(wait);
    assert_eq!(
        tab.evaluate("document.getElementById('play').getAttribute('aria-label')"),
        "pause"
    );
    let slow_s = time_s(&mut tab) - 0.6;
    let passed_s = (tab.evaluate("performance.now()").as_f64().unwrap() - began_ms) / 1000.0;
    assert!(
        slow_s > 0.0 && slow_s <= 0.2 * passed_s + 0.01,
        "at 1/5 it went {slow_s} s in {passed_s} s"
    );
    press(&mut tab, " ");
    let paused_s = time_s(&mut tab);
    tab.evaluate(wait);
    assert_eq!(time_s(&mut tab), paused_s, "paused");
    tab.evaluate("document.getElementById('speed').value = '1', document.getElementById('speed').dispatchEvent(new Event('change'))");
    press(&mut tab, "End");
    click_in(&mut tab, "play", 0.5, 0.5);
    tab.evaluate(&wait.replace("700", "200"));
    let from_start_s = time_s(&mut tab);
    assert!(
        from_start_s < last_s,
        "from the end it plays from the start"
    );
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
fn a_link_is_to_the_moment_that_is_shown() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = written(&folder, stepping(), &head());
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    for (hash, expected_s) in [
        ("#t=0.6", 0.6),
        ("#t=.5", 0.5),
        ("#t=1.2s", 1.2),
        ("#t=1.", 1.0),
        ("#t=x", 1.0),
    ] {
        tab.evaluate(&format!(
            "new Promise((done) => {{ addEventListener('hashchange', done); location.hash = '{hash}'; }})"
        ));
        assert!(
            (time_s(&mut tab) - expected_s).abs() < 1e-9,
            "{hash}: {}",
            time_s(&mut tab)
        );
    }
    // The first picture may show a moment before the requested start.
    let next = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))";
    tab.evaluate(&format!(
        "replay.seek(0.6), replay.play(), replay.state.last += 300, {next}"
    ));
    assert!(
        time_s(&mut tab) >= 0.6,
        "it began by going back, to {} s",
        time_s(&mut tab)
    );
    // The link is copied while the film plays, and also if a browser does not allow the address to be changed.
    let pressed = "(() => {
        document.querySelector('[data-do=link]').click();
        return [replay.state.playing, replay.state.time, document.getElementById('toast').textContent];
    })()";
    for refuse in [false, true] {
        if refuse {
            tab.evaluate("history.replaceState = () => { throw new Error('not here'); }, 0");
        }
        tab.evaluate(&format!("replay.seek(0.6), replay.play(), {next}, {next}"));
        let shown = tab.evaluate(pressed);
        assert!(
            shown[0] == true && shown[1].as_f64() > Some(0.6),
            "it plays: {shown}"
        );
        let link = shown[2].as_str().unwrap();
        let linked_s: f64 = link.rsplit_once("#t=").unwrap().1.parse().unwrap();
        assert!(
            (linked_s - shown[1].as_f64().unwrap()).abs() < 1e-4,
            "{shown}"
        );
        assert!(
            link.contains("file://") && link.matches('#').count() == 1,
            "{link}"
        );
        tab.evaluate("replay.pause()");
    }
    assert_no_problems(&mut tab, &file);
}

/// A held key starts playing or hides only once, but steps through time repeatedly. After a click the keys still
/// control time.
#[test]
fn a_held_key_acts_once_and_a_click_takes_no_key_away() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = written(&folder, stepping(), &head());
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    let hold = |tab: &mut Page, key: &str| {
        for repeats in [false, true, true, true] {
            tab.call(
                "Input.dispatchKeyEvent",
                json!({ "type": "keyDown", "key": key, "autoRepeat": repeats }),
            );
        }
        tab.call(
            "Input.dispatchKeyEvent",
            json!({ "type": "keyUp", "key": key }),
        );
    };
    let is_shown = "document.getElementById('show-com').getAttribute('aria-pressed')";
    hold(&mut tab, "c");
    assert_eq!(tab.evaluate(is_shown), "false");
    press(&mut tab, "Home");
    hold(&mut tab, ".");
    assert!(
        (time_s(&mut tab) - 4.0 * stepping().control_period_s).abs() < 1e-9,
        "at {} s",
        time_s(&mut tab)
    );
    let plays = |tab: &mut Page| tab.evaluate("replay.state.playing");
    tab.evaluate("document.querySelector('[data-do=view-top]').id = 'view-top'");
    for clicked in ["show-com", "view-top"] {
        click_in(&mut tab, clicked, 0.5, 0.5);
        let before_s = time_s(&mut tab);
        press(&mut tab, ".");
        assert!(time_s(&mut tab) > before_s, "after a click on {clicked}");
        assert_eq!(plays(&mut tab), false);
        hold(&mut tab, " ");
        assert_eq!(plays(&mut tab), true, "after a click on {clicked}");
        press(&mut tab, " ");
        press(&mut tab, "Home");
    }
    assert_eq!(
        tab.evaluate(is_shown),
        "true",
        "by the click, and by nothing else"
    );
    assert_no_problems(&mut tab, &file);
}

#[test]
fn without_scripts_the_page_says_so_first() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let warning = Some("this is not the trial as it was".to_string());
    let file = written(&folder, stepping(), &Head { warning, ..head() });
    let mut tab = browser.tab(1200, 900, "light");
    tab.call(
        "Emulation.setScriptExecutionDisabled",
        json!({ "value": true }),
    );
    tab.open(&file);
    let told = tab.evaluate("document.body.innerText");
    let order = [
        "recovered",
        "Beware: this is not the trial as it was",
        "This page draws with JavaScript",
        "outcome   as it was",
        "To make this page again, run this in the result folder:",
        "standfast push",
    ];
    let at = order.map(|part| {
        told.as_str()
            .unwrap()
            .find(part)
            .unwrap_or_else(|| panic!("no {part:?} in {told}"))
    });
    assert!(at.is_sorted(), "{at:?} in {told}");
    let seen = "[...document.querySelectorAll('button, input, canvas')].filter((e) => e.checkVisibility()).length";
    assert_eq!(tab.evaluate(seen), 0, "what does nothing is not shown");
}

#[test]
#[ignore = "draws in a browser for a third of a minute"]
fn overlays_and_views_change_the_picture_and_come_back() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let film = stepping();
    let file = written(&folder, film, &head());
    let mut tab = browser.tab(900, 700, "light");
    tab.open(&file);
    let swinging_s = film
        .snapshots
        .iter()
        .find(|s| s.footstep.is_some())
        .unwrap()
        .time_s
        + 0.04;
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
            tab.evaluate(&format!(
                "document.getElementById('show-{id}').getAttribute('aria-pressed')"
            )),
            "false"
        );
        press(&mut tab, key);
        assert_eq!(
            before["hash"],
            look(&mut tab, "view")["hash"],
            "{id} does not come back"
        );
    }
    for (curve, key) in [("com", "c"), ("support", "s"), ("zmp", "z")] {
        let before = look(&mut tab, "plot-x");
        press(&mut tab, key);
        assert_ne!(
            before["hash"],
            look(&mut tab, "plot-x")["hash"],
            "{curve} is not in the plot"
        );
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
        for (kind, x, buttons) in [
            ("mousePressed", 200.0, 1),
            ("mouseMoved", 260.0, 1),
            ("mouseReleased", 260.0, 0),
        ] {
            tab.call("Input.dispatchMouseEvent", drag(kind, x, buttons, shift));
        }
        seen.push(look(&mut tab, "view")["hash"].clone());
    }
    // The arrow keys control time, even after a click into the view. If the view has the keyboard focus, they orbit.
    press(&mut tab, "1");
    let shown_s = time_s(&mut tab);
    press(&mut tab, "ArrowLeft");
    assert!(time_s(&mut tab) < shown_s);
    press(&mut tab, "ArrowRight");
    assert_eq!(
        look(&mut tab, "view")["hash"],
        home["hash"],
        "0.1 s back and on"
    );
    tab.evaluate("document.getElementById('view').focus()");
    for key in ["ArrowLeft", "ArrowUp", "+"] {
        press(&mut tab, key);
        seen.push(look(&mut tab, "view")["hash"].clone());
    }
    assert!((time_s(&mut tab) - shown_s).abs() < 1e-9);
    tab.evaluate("document.activeElement.blur()");
    press(&mut tab, "1");
    let wheel = json!({ "type": "mouseWheel", "x": 200, "y": 300, "deltaX": 0, "deltaY": -240 });
    tab.call("Input.dispatchMouseEvent", wheel);
    let near = look(&mut tab, "view");
    assert!(
        near["purple"].as_f64() > home["purple"].as_f64(),
        "nearer it is larger: {near}, {home}"
    );
    let count = seen.len();
    seen.sort_by_key(Value::to_string);
    seen.dedup();
    assert_eq!(seen.len(), count, "two views are the same");
    assert_no_problems(&mut tab, &file);
}

#[test]
#[ignore = "draws in a browser for a quarter of a minute"]
fn a_key_hides_the_ghost() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (film, ghost) = (stepping(), ghost());
    let purple = |seen: &Value| seen["purple"].as_f64().unwrap();
    // At the same place, the solid robot hides the ghost.
    let twin = Film {
        engine: Engine::Mujoco,
        ..film.clone()
    };
    for (beside, parts) in [(&twin, false), (&ghost, true)] {
        let file = written_with(&folder, film, Some(beside), &head());
        let mut tab = browser.tab(1200, 900, "light");
        tab.open(&file);
        let plot = look(&mut tab, "plot-x");
        press(&mut tab, "e");
        assert_ne!(
            plot["hash"],
            look(&mut tab, "plot-x")["hash"],
            "its COM is not in the plot"
        );
        press(&mut tab, "e");
        // Without the marks, only the robots remain.
        press(&mut tab, "c");
        press(&mut tab, "z");
        let with = look_at(&mut tab, 1.2);
        press(&mut tab, "e");
        let without = look(&mut tab, "view");
        let pressed =
            tab.evaluate("document.getElementById('show-ghost').getAttribute('aria-pressed')");
        assert_eq!(pressed, "false");
        assert_eq!(with["hash"] != without["hash"], parts, "{with} {without}");
        assert!(
            purple(&without) >= purple(&with) && purple(&without) > 0.02,
            "{with} {without}"
        );
        click_in(&mut tab, "show-ghost", 0.5, 0.5);
        assert_eq!(
            with["hash"],
            look(&mut tab, "view")["hash"],
            "it does not come back"
        );
        let badges = "[...document.querySelectorAll('.badge')].map((badge) => badge.textContent)";
        let ended = if parts { "fell" } else { "recovered" };
        let told = [
            format!("{}: recovered", film.controller),
            format!("{}: {ended}", beside.controller),
        ];
        assert_eq!(tab.evaluate(badges), json!(told));
        assert_no_problems(&mut tab, &file);
    }
    // A page without a ghost has no such key.
    let mut tab = browser.tab(390, 844, "dark");
    tab.open(&written(&folder, film, &head()));
    let plain = look(&mut tab, "view");
    press(&mut tab, "e");
    assert_eq!(plain["hash"], look(&mut tab, "view")["hash"]);
    assert_eq!(
        tab.evaluate("document.getElementById('show-ghost')"),
        Value::Null
    );
}

/// What is saved is decoded by the browser, which knows nothing of how it was written: size, number of pictures, the share
/// of purple (the robot) in each sixth of the first and of the last one, and the highest purple row.
const SAVED: &str = "(async () => {
    while (!document.getElementById('saved')) await new Promise((done) => setTimeout(done, 50));
    const { href, download } = document.getElementById('saved');
    const data = Uint8Array.from(atob(href.split(',')[1]), (c) => c.charCodeAt()), type = href.slice(5, href.indexOf(';'));
    const images = [], video = document.createElement('video');
    const until = (event) => new Promise((done) => { video['on' + event] = done; });
    let count = null;
    if (type === 'video/webm') {
        video.src = href;
        await until('loadeddata');
        for (const time of [0, 1e6]) {
            video.currentTime = time;
            await until('seeked');
            images.push(await createImageBitmap(video));
        }
    } else {
        const decoder = new ImageDecoder({ data, type });
        await Promise.all([decoder.tracks.ready, decoder.completed]);
        count = decoder.tracks.selectedTrack.frameCount;
        for (const frameIndex of [0, count - 1]) images.push((await decoder.decode({ frameIndex })).image);
    }
    const pictures = [];
    for (const image of images) {
        const width = image.displayWidth ?? image.width, height = image.displayHeight ?? image.height;
        const pen = new OffscreenCanvas(width, height).getContext('2d');
        pen.drawImage(image, 0, 0);
        const pixels = pen.getImageData(0, 0, width, height).data, sixths = [0, 0, 0, 0, 0, 0];
        let top = height;
        for (let i = 0; i < pixels.length; i += 4) {
            const [r, g, b] = pixels.slice(i, i + 3), at = i / 4;
            if (!(b > 60 && b > 1.25 * r && r > 1.2 * g)) continue;
            sixths[Math.floor((6 * (at % width)) / width)] += 6 / (width * height);
            top = Math.min(top, at / width / height);
        }
        pictures.push({ width, height, sixths, top });
    }
    // However long a picture takes to be drawn, a video lasts as long as its moments and the last picture.
    const length = count ?? video.currentTime, is_whole = count === null ? length > 0.3 && length < 3 : count > 5;
    return { href, download, is_whole, first: pictures[0], last: pictures[1] };
})()";

#[test]
#[ignore = "draws in a browser for a quarter of a minute"]
fn the_page_saves_what_it_shows_and_the_same_bytes_again() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = written(&folder, fallen(), &head());
    let mut saved = |kind: &str| {
        let mut tab = browser.tab(900, 700, "light");
        let asked = format!("{}#t=0.4&speed=5&view=front&save={kind}", file.display());
        // The page may load nothing, also no video.
        tab.call("Page.setBypassCSP", json!({ "enabled": true }));
        tab.open(asked.as_ref());
        let found = tab.evaluate(SAVED);
        let view = tab.evaluate("[replay.camera.elevation, document.getElementById('view').width, document.getElementById('view').height]");
        assert!((view[0].as_f64().unwrap() - 6_f64.to_radians()).abs() < 1e-9);
        (found, [view[1].clone(), view[2].clone()])
    };
    let size = |picture: &Value| [picture["width"].clone(), picture["height"].clone()];
    let top = |picture: &Value| picture["top"].as_f64().unwrap();
    for (kind, ending) in [
        ("png", "png"),
        ("strip", "png"),
        ("film", "gif"),
        ("webm", "webm"),
    ] {
        let (found, view) = saved(kind);
        assert_eq!(found["download"], format!("A-push.{ending}"));
        // The browser stamps a video with its own clock.
        assert!(
            kind == "webm" || saved(kind).0["href"] == found["href"],
            "other bytes of {kind}"
        );
        let (first, last) = (&found["first"], &found["last"]);
        match kind {
            "png" => assert_eq!(size(first), view),
            "strip" => {
                assert_eq!(size(first), [1440, 320].map(Value::from));
                let sixths = first["sixths"].as_array().unwrap();
                assert!(
                    sixths.iter().all(|share| share.as_f64().unwrap() > 0.02),
                    "{sixths:?}"
                );
            }
            _ => {
                let px = if kind == "film" { 120 } else { 240 };
                assert_eq!(size(last), [4 * px, 3 * px].map(Value::from));
                assert_eq!(found["is_whole"], true, "{kind}");
                assert!(top(last) > top(first) + 0.1, "no fall: {first} {last}");
            }
        }
    }
}

#[test]
fn without_webgl_the_rest_works() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = written(&folder, stepping(), &head());
    let mut tab = browser.tab(1200, 900, "light");
    let none = "const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
            return kind.startsWith('webgl') ? null : get.call(this, kind, ...more);
        };";
    tab.call(
        "Page.addScriptToEvaluateOnNewDocument",
        json!({ "source": none }),
    );
    tab.open(&file);
    let told = tab.evaluate("document.getElementById('stage').innerText");
    assert!(
        told.as_str()
            .unwrap()
            .starts_with("No 3D view here: this browser lacks WebGL 2"),
        "{told}"
    );
    let plot = look(&mut tab, "plot-x");
    press(&mut tab, "End");
    assert_eq!(
        time_s(&mut tab),
        stepping().snapshots.last().unwrap().time_s
    );
    assert_ne!(
        plot["hash"],
        look(&mut tab, "plot-x")["hash"],
        "the plot keeps step"
    );
    press(&mut tab, "2");
    assert_no_problems(&mut tab, &file);
}

#[test]
fn names_are_text_whatever_they_contain() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let evil = |n: u8| {
        format!(
            "</title></code></pre></script><script>window.evil={n}</script><!--<img src=x onerror=window.evil={n}>\"'&\\u003c"
        )
    };
    let mut film = stepping().clone();
    film.controller = evil(1);
    film.regions.fill(evil(2));
    for snapshot in &mut film.snapshots {
        for region in &mut snapshot.regions {
            region.name = evil(2);
        }
        snapshot.gain = snapshot.gain.is_some().then(|| evil(2));
    }
    film.robot.name = evil(3);
    film.record.fell_at_s = Some(1.0);
    film.record.fall_cause = Some(evil(5));
    let head = Head {
        title: evil(7),
        warning: Some(evil(10)),
        lines: vec![evil(8)],
        command: evil(9),
        of_result: false,
    };
    let file = written(&folder, &film, &head);
    let mut tab = browser.tab(1200, 900, "light");
    tab.open(&file);
    look_at(&mut tab, 0.1);
    assert_eq!(tab.evaluate("typeof window.evil"), "undefined");
    assert_eq!(
        tab.evaluate("document.querySelectorAll('img, a').length"),
        0
    );
    assert_eq!(tab.evaluate("document.title"), evil(7).as_str());
    assert_eq!(text(&mut tab, "command-text"), evil(9));
    assert_eq!(text(&mut tab, "warning"), format!("Beware: {}", evil(10)));
    assert_eq!(text(&mut tab, "gain"), evil(2));
    let marked =
        tab.evaluate("[...document.querySelectorAll('#marks .fall')].map((mark) => mark.title)");
    assert!(marked[0].as_str().unwrap().contains(&evil(5)), "{marked}");
    assert_no_problems(&mut tab, &file);
}
