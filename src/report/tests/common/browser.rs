//! A page in headless Chromium: how it looks, what it reports, and what it requests from the network.
//!
//! It uses the Chrome DevTools Protocol over two pipes (`--remote-debugging-pipe`): JSON messages that end with a zero
//! byte, to file descriptor 3 of the browser and from its descriptor 4. A shell connects them, so no port is opened.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];
/// If this is set in the environment, a missing browser is a failure.
const NEED: &str = "STANDFAST_NEED_CHROMIUM";
const FLAGS: [&str; 12] = [
    "--headless",
    "--remote-debugging-pipe",
    "--no-sandbox",
    "--disable-gpu",
    // This option gives WebGL without a graphics card.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
];
const SLOW: &str = "GL Driver Message (OpenGL, Performance";
const PATIENCE: Duration = Duration::from_secs(60);

pub struct Browser {
    process: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    /// Number of the last call.
    id: u64,
    /// Events since the page was opened.
    events: Vec<Value>,
    _profile: TempDir,
}

/// One tab.
pub struct Page<'a> {
    browser: &'a mut Browser,
    session: String,
}

impl Browser {
    /// Starts a browser. It is None, with a message on stderr, if there is no browser and the environment does not
    /// require one.
    pub fn start() -> Option<Browser> {
        let Some(program) = NAMES.iter().find_map(|name| in_path(name)) else {
            assert!(
                std::env::var_os(NEED).is_none(),
                "{NEED} is set, but none of {NAMES:?} is in PATH"
            );
            eprintln!(
                "skipped: none of {NAMES:?} is in PATH (apt-get install chromium); {NEED}=1 makes this a failure"
            );
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        let mut process = Command::new("sh")
            .args(["-c", r#"exec "$0" "$@" 3<&0 4>&1 </dev/null >&2"#])
            .arg(program)
            .args(FLAGS)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let (to, from) = (
            process.stdin.take().unwrap(),
            BufReader::new(process.stdout.take().unwrap()),
        );
        // A thread reads, so that a silent browser cannot block the test.
        let (send, receive) = channel();
        std::thread::spawn(move || {
            for message in from.split(0).map_while(Result::ok) {
                if send
                    .send(serde_json::from_slice(&message).unwrap())
                    .is_err()
                {
                    return;
                }
            }
        });
        Some(Browser {
            process,
            to,
            from: receive,
            id: 0,
            events: Vec::new(),
            _profile: profile,
        })
    }

    /// A new empty tab of a size (px), light or dark.
    pub fn tab(&mut self, width: u32, height: u32, scheme: &str) -> Page<'_> {
        let target = self.call(None, "Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let session = self.call(None, "Target.attachToTarget", attach)["sessionId"]
            .as_str()
            .unwrap()
            .to_string();
        self.events.clear();
        let mut page = Page {
            browser: self,
            session,
        };
        for domain in ["Page", "Runtime", "Log", "Network"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        let size =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        page.call("Emulation.setDeviceMetricsOverride", size);
        let scheme = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        page.call("Emulation.setEmulatedMedia", scheme);
        page
    }

    fn call(&mut self, session: Option<&str>, method: &str, params: Value) -> Value {
        self.id += 1;
        let mut message = json!({ "id": self.id, "method": method, "params": params });
        if let Some(session) = session {
            message["sessionId"] = session.into();
        }
        self.to
            .write_all(format!("{message}\0").as_bytes())
            .unwrap();
        loop {
            let answer = self.next(method);
            if answer["id"] == self.id {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
        }
    }

    /// The next message. Events are stored.
    fn next(&mut self, why: &str) -> Value {
        let message = self
            .from
            .recv_timeout(PATIENCE)
            .unwrap_or_else(|e| panic!("{why}: the browser is silent: {e}"));
        if message["method"].is_string() {
            self.events.push(message.clone());
        }
        message
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The browser may have ended already.
        _ = self
            .to
            .write_all(b"{\"id\":0,\"method\":\"Browser.close\"}\0");
        let end = Instant::now() + Duration::from_secs(5);
        while Instant::now() < end && matches!(self.process.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(20));
        }
        _ = self.process.kill();
        _ = self.process.wait();
    }
}

impl Page<'_> {
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        let session = self.session.clone();
        self.browser.call(Some(&session), method, params)
    }

    /// Opens a file and waits until all of it is loaded.
    pub fn open(&mut self, file: &Path) {
        let url = format!("file://{}", file.display());
        let answer = self.call("Page.navigate", json!({ "url": url }));
        assert!(
            answer["errorText"].is_null(),
            "{url}: {}",
            answer["errorText"]
        );
        let loaded = |browser: &Browser| {
            browser
                .events
                .iter()
                .any(|event| event["method"] == "Page.loadEventFired")
        };
        while !loaded(self.browser) {
            self.browser.next("load");
        }
    }

    /// The value of an expression, after waiting for a promise.
    pub fn evaluate(&mut self, script: &str) -> Value {
        let params = json!({ "expression": script, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", params);
        assert!(
            answer["exceptionDetails"].is_null(),
            "{script}: {}",
            answer["exceptionDetails"]
        );
        answer["result"]["value"].clone()
    }

    /// Moves the mouse to a point of the window (px) and clicks.
    pub fn click(&mut self, x: f64, y: f64) {
        for (kind, button, count) in [
            ("mouseMoved", "none", 0),
            ("mousePressed", "left", 1),
            ("mouseReleased", "left", 1),
        ] {
            let event =
                json!({ "type": kind, "x": x, "y": y, "button": button, "clickCount": count });
            self.call("Input.dispatchMouseEvent", event);
        }
    }

    /// The whole page as PNG in base 64.
    pub fn screenshot(&mut self) -> String {
        let params = json!({ "format": "png", "captureBeyondViewport": true });
        self.call("Page.captureScreenshot", params)["data"]
            .as_str()
            .unwrap()
            .into()
    }

    /// Number of colours in a PNG (base 64), and the share of the most frequent colour. The page must be allowed to
    /// load the PNG.
    pub fn colors(&mut self, png: &str) -> (u64, f64) {
        let script = format!(
            "(async () => {{
                const image = new Image();
                image.src = 'data:image/png;base64,{png}';
                await image.decode();
                const canvas = new OffscreenCanvas(image.width, image.height), pen = canvas.getContext('2d');
                pen.drawImage(image, 0, 0);
                const pixels = new Uint32Array(pen.getImageData(0, 0, image.width, image.height).data.buffer);
                const counts = new Map();
                for (const pixel of pixels) counts.set(pixel, (counts.get(pixel) ?? 0) + 1);
                return [counts.size, Math.max(...counts.values()) / pixels.length];
            }})()"
        );
        let found = self.evaluate(&script);
        (found[0].as_u64().unwrap(), found[1].as_f64().unwrap())
    }

    /// Problems since the tab was made: exceptions, errors and warnings on the console, and every request for another
    /// address than `file`.
    pub fn problems(&mut self, file: &Path) -> Vec<String> {
        // Pending events arrive before the answer to this call.
        self.evaluate("new Promise((done) => setTimeout(done, 100))");
        let own = format!("file://{}", file.display());
        let is_own = |url: &Value| {
            url.as_str()
                .is_some_and(|url| url == own || url.starts_with("data:"))
        };
        let events = self
            .browser
            .events
            .iter()
            .map(|event| (event["method"].as_str().unwrap(), &event["params"]));
        let problem = |(method, params): (&str, &Value)| match method {
            "Runtime.exceptionThrown" => Some(format!("exception: {}", params["exceptionDetails"])),
            "Runtime.consoleAPICalled"
                if params["type"] == "error" || params["type"] == "warning" =>
            {
                Some(format!("console: {}", params["args"]))
            }
            // Software rendering warns about its own slowness.
            "Log.entryAdded"
                if params["entry"]["text"]
                    .as_str()
                    .is_some_and(|text| text.contains(SLOW)) =>
            {
                None
            }
            "Log.entryAdded" if params["entry"]["level"] != "verbose" => {
                Some(format!("log: {}", params["entry"]))
            }
            // A picture within the page is reported as a request, too.
            "Network.requestWillBeSent" if !is_own(&params["request"]["url"]) => {
                Some(format!("request: {}", params["request"]["url"]))
            }
            _ => None,
        };
        events.filter_map(problem).collect()
    }
}

fn in_path(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders)
        .map(|folder| folder.join(name))
        .find(|path| path.is_file())
}
