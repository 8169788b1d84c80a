//! A headless Chromium that tests drive, over WebDriver as chromedriver speaks it. Whatever goes wrong is a panic.

#![allow(dead_code, reason = "each test program uses a part of this")]

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::channel;
use std::time::Duration;

/// Longer than anything takes here, on a slow machine as well: only a browser that hangs gets this far.
const LIMIT: Duration = Duration::from_secs(120);

/// The key Enter, as WebDriver writes it.
pub(crate) const ENTER: &str = "\u{e007}";

/// One browser with one window. Ends with this.
pub(crate) struct Browser {
    agent: ureq::Agent,
    /// Where the session takes its commands.
    session: String,
    driver: Child,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// A browser. `None`, with a line that says so, where none is installed; a failure then where the environment says
    /// `SAPWISE_REQUIRE_BROWSER=1`.
    pub(crate) fn start(test: &str) -> Option<Self> {
        let browser = Self::try_start();
        if let Err(why) = &browser {
            let required = std::env::var("SAPWISE_REQUIRE_BROWSER").is_ok_and(|v| v == "1");
            assert!(!required, "SAPWISE_REQUIRE_BROWSER=1, and {why}");
            eprintln!("{test} is skipped: {why}. On Debian: apt-get install chromium chromium-driver");
        }
        browser.ok()
    }

    /// # Errors
    /// When something is not installed.
    fn try_start() -> Result<Self, String> {
        let started = Command::new("chromedriver").arg("--port=0").stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
        let mut driver = match started {
            Err(error) if error.kind() == ErrorKind::NotFound => return Err("there is no chromedriver".to_owned()),
            started => started.unwrap(),
        };
        let output = driver.stdout.take().unwrap();
        let (sender, port) = channel();
        // Reads on to the end: a full pipe would stop the driver.
        std::thread::spawn(move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if let Some(port) = line.split("successfully on port ").nth(1) {
                    let _ = sender.send(port.trim_end_matches('.').to_owned());
                }
            }
        });
        let port = port.recv_timeout(LIMIT).expect("chromedriver names its port");
        // The proxy that an environment names is none for this machine itself.
        let config = ureq::Agent::config_builder().proxy(None).http_status_as_error(false).timeout_global(Some(LIMIT));
        let agent = config.build().new_agent();
        let profile = tempfile::tempdir().unwrap();
        let mut browser =
            Self { agent, session: format!("http://127.0.0.1:{port}/session"), driver, _profile: profile };
        let arguments = [
            "--headless=new",
            // Root, which continuous integration often is, may use no sandbox; /dev/shm of a container is too small.
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            &format!("--user-data-dir={}", browser._profile.path().display()),
        ];
        let mut options = json!({ "args": arguments });
        if let Some(program) = installed() {
            options["binary"] = json!(program);
        }
        let wanted = json!({
            "browserName": "chrome",
            "goog:chromeOptions": options,
            "goog:loggingPrefs": { "browser": "ALL", "performance": "ALL" },
        });
        match browser.try_post("", &json!({ "capabilities": { "alwaysMatch": wanted } })) {
            Ok(session) => browser.session = format!("{}/{}", browser.session, session["sessionId"].as_str().unwrap()),
            Err(error) if error.contains("cannot find Chrome binary") => return Err("there is no Chromium".to_owned()),
            Err(error) => panic!("{error}"),
        }
        Ok(browser)
    }

    /// Opens a file from disk.
    pub(crate) fn open(&self, file: &Path) {
        let path = file.canonicalize().unwrap();
        self.post("/url", &json!({ "url": format!("file://{}", path.display()) }));
    }

    /// Makes the window that many pixels wide and high inside, and its user one who likes it dark or light.
    pub(crate) fn view(&self, width: u32, height: u32, dark: bool) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.devtools("Emulation.setDeviceMetricsOverride", &size);
        let scheme = json!({ "name": "prefers-color-scheme", "value": if dark { "dark" } else { "light" } });
        self.devtools("Emulation.setEmulatedMedia", &json!({ "media": "", "features": [scheme] }));
        assert_eq!(self.value("innerWidth"), json!(width));
    }

    /// Shows what a printer would get, to a user who likes it dark.
    pub(crate) fn view_print(&self) {
        let scheme = json!({ "name": "prefers-color-scheme", "value": "dark" });
        self.devtools("Emulation.setEmulatedMedia", &json!({ "media": "print", "features": [scheme] }));
    }

    /// Allows or forbids scripts from the next page on. [`Self::value`] works either way.
    pub(crate) fn allow_scripts(&self, allow: bool) {
        self.devtools("Emulation.setScriptExecutionDisabled", &json!({ "value": !allow }));
    }

    /// The value of an expression of JavaScript in the page.
    pub(crate) fn value(&self, expression: &str) -> Value {
        self.post("/execute/sync", &json!({ "script": format!("return {expression}"), "args": [] }))
    }

    /// Clicks the middle of the first element that a CSS selector finds. A failure where something else is in the way.
    pub(crate) fn click(&self, selector: &str) {
        self.post(&format!("{}/click", self.element(selector)), &json!({}));
    }

    /// Gives an element the focus and types into it.
    pub(crate) fn type_into(&self, selector: &str, keys: &str) {
        self.post(&format!("{}/value", self.element(selector)), &json!({ "text": keys }));
    }

    /// What the page and the browser wrote to the console since the last call.
    pub(crate) fn console(&self) -> Vec<String> {
        let entries = self.post("/se/log", &json!({ "type": "browser" }));
        entries.as_array().unwrap().iter().map(|e| format!("{}: {}", e["level"], e["message"])).collect()
    }

    /// The addresses that the window asked for since the last call, its page among them. Those of the browser's own first tab, which a
    /// slow start still loads, are none of the page's.
    pub(crate) fn requests(&self) -> Vec<String> {
        let entries = self.post("/se/log", &json!({ "type": "performance" }));
        let events = entries.as_array().unwrap().iter().map(|e| e["message"].as_str().unwrap());
        let events = events.map(|e| serde_json::from_str::<Value>(e).unwrap()["message"].take());
        let sent = events.filter(|e| e["method"] == "Network.requestWillBeSent");
        let of_page =
            sent.filter(|e| !e["params"]["documentURL"].as_str().unwrap_or_default().starts_with("chrome://"));
        of_page.map(|e| e["params"]["request"]["url"].as_str().unwrap().to_owned()).collect()
    }

    /// Elements whose text has too little contrast with what is behind it, by WCAG AA. Panics on a page that has little text.
    pub(crate) fn unreadable(&self) -> Vec<String> {
        let found = self.value(UNREADABLE);
        let found = found.as_array().expect("a page with a hundred texts");
        found.iter().map(|e| e.as_str().unwrap().to_owned()).collect()
    }

    /// Keeps a picture of the whole page for eyes, where somebody wants one. Nobody else waits for it: a Chromium that has just opened a
    /// page on a busy machine may say that there is nothing to take a picture of ("0 width").
    pub(crate) fn screenshot(&self, name: &str) {
        if pictures().is_some() {
            let picture = self.devtools("Page.captureScreenshot", &json!({ "captureBeyondViewport": true }));
            keep(&format!("{name}.png"), &picture["data"]);
        }
    }

    /// Prints the page to PDF and keeps that for eyes.
    pub(crate) fn print(&self, name: &str) {
        keep(&format!("{name}.pdf"), &self.post("/print", &json!({ "background": true })));
    }

    fn element(&self, selector: &str) -> String {
        let found = self.post("/element", &json!({ "using": "css selector", "value": selector }));
        // The name that the standard gives to the one field of an answer that is an element.
        format!("/element/{}", found["element-6066-11e4-a52e-4f735466cecf"].as_str().unwrap())
    }

    fn devtools(&self, command: &str, parameters: &Value) -> Value {
        self.post("/goog/cdp/execute", &json!({ "cmd": command, "params": parameters }))
    }

    fn post(&self, command: &str, body: &Value) -> Value {
        self.try_post(command, body).unwrap_or_else(|error| panic!("{command} {body}: {error}"))
    }

    fn try_post(&self, command: &str, body: &Value) -> Result<Value, String> {
        let request = self.agent.post(format!("{}{command}", self.session)).content_type("application/json");
        let mut answer = request.send(body.to_string()).unwrap();
        let text = answer.body_mut().with_config().limit(1 << 28).read_to_string().unwrap();
        let value = serde_json::from_str::<Value>(&text).unwrap()["value"].take();
        if answer.status().is_success() { Ok(value) } else { Err(value["message"].to_string()) }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Ends the browser, which outlives its driver otherwise. Either may have ended already.
        let _ = self.agent.delete(&self.session).call();
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

const UNREADABLE: &str = "(() => {
    const numbers = (colour) => colour.match(/[\\d.]+/g).map(Number);
    const light = (colour) => numbers(colour).slice(0, 3).map((v) => v / 255)
        .map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
        .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
    const behind = (e) => {
        const colour = e ? getComputedStyle(e).backgroundColor : 'rgb(255, 255, 255)';
        return numbers(colour)[3] === 0 ? behind(e.parentElement) : colour;
    };
    const own = (e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
    const all = [...document.body.querySelectorAll('*')].filter((e) => own(e) && !e.closest('script, title'));
    const ratio = (e) => {
        const style = getComputedStyle(e);
        const both = [light(e.closest('svg') ? style.fill : style.color), light(behind(e))].sort((a, b) => b - a);
        return (both[0] + 0.05) / (both[1] + 0.05);
    };
    return all.length < 100 ? null : all.filter((e) => ratio(e) < 4.5).map((e) => e.outerHTML.slice(0, 200));
})()";

/// The browser of this machine. The driver knows the usual places as well, but not all names.
fn installed() -> Option<PathBuf> {
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    names.iter().flat_map(|name| folders.iter().map(move |f| f.join(name))).find(|p| p.is_file())
}

/// The folder that `SAPWISE_SCREENSHOTS` names, for pictures.
fn pictures() -> Option<PathBuf> {
    std::env::var_os("SAPWISE_SCREENSHOTS").map(PathBuf::from)
}

/// Writes a file into the folder for pictures, and nothing without one.
fn keep(name: &str, base64: &Value) {
    let bytes = BASE64_STANDARD.decode(base64.as_str().unwrap()).unwrap();
    if let Some(folder) = pictures() {
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(name), bytes).unwrap();
    }
}
