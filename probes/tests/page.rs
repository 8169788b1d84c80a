//! The page of a study, in a browser.

#[path = "../../crates/lab/tests/browser/mod.rs"]
mod browser;
mod common;

use browser::Browser;
use common::{sapwise, success};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What a name may hold, of a machine or a file.
const ODD: &str = "<b>&\"'; =1+1 \u{202e}שלום é";

fn datasets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets")
}

/// A few stored reports, the paper's, and one of a machine with an odd name in a file with one.
fn reports(folder: &Path) -> Vec<PathBuf> {
    let stored = ["full", "1t", "lavapipe", "two-gpus"]
        .map(|n| datasets().join(format!("earlier/amd-epyc-2c-{n}--2026-11-21.json")));
    let mut report: Value = serde_json::from_slice(&std::fs::read(&stored[0]).unwrap()).unwrap();
    report["hardware"]["machine"]["cpu"] = json!(format!("Ödd CPU </script><img src=x onerror=alert(1)> {ODD}"));
    report["hardware"]["machine"]["physical_id"] = json!("0123456789abcdef");
    let odd = folder.join("odd <b>&'; =1+1 é.json");
    std::fs::write(&odd, report.to_string()).unwrap();
    stored.into_iter().chain([datasets().join("published"), odd]).collect()
}

#[test]
fn a_study_can_be_read_in_every_window() {
    let Some(browser) = Browser::start("a_study_can_be_read_in_every_window") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("study");
    success(sapwise().arg("study").args(reports(folder.path())).arg("--out").arg(&out));
    let file = out.join("index.html");
    drop((browser.requests(), browser.console()));
    for (width, height) in [(400, 800), (1600, 1000)] {
        for dark in [false, true] {
            browser.view(width, height, dark);
            browser.open(&file);
            let name = format!("study-{width}-{}", if dark { "dark" } else { "light" });
            browser.screenshot(&name);
            assert_eq!(browser.console(), [""; 0], "{name}");
            let wide = browser.value("document.documentElement.scrollWidth").as_u64().unwrap();
            assert!(wide <= u64::from(width), "{name}: {wide} px wide");
            assert_eq!(browser.unreadable(), [""; 0], "{name}");
        }
    }
    let requests = browser.requests();
    assert_eq!(requests.len(), 4, "{requests:?}");
    assert!(requests.iter().all(|r| r.ends_with("/study/index.html")), "{requests:?}");
    assert_eq!(browser.value("document.querySelectorAll('img, b').length"), json!(0));
    assert!(browser.value("document.querySelectorAll('.picture svg').length").as_u64().unwrap() > 0);
    links_lead_somewhere(&browser, &out);
    every_column_sorts(&browser);
    assert_eq!(browser.console(), [""; 0]);
    browser.print("study");
}

fn links_lead_somewhere(browser: &Browser, out: &Path) {
    let lost = "[...document.querySelectorAll('a[href^=\"#\"]')].map(a => a.getAttribute('href').slice(1)).filter(i => !document.getElementById(i))";
    assert_eq!(browser.value(lost), json!([]));
    let files = browser.value(
        "[...document.querySelectorAll('a:not([href^=\"#\"])')].map(a => decodeURIComponent(a.getAttribute('href')))",
    );
    let files = files.as_array().unwrap();
    assert!(files.len() > 5, "{files:?}");
    for file in files {
        assert!(out.join(file.as_str().unwrap()).is_file(), "{file}");
    }
}

/// Clicks every head twice: figures rise, then fall, with the missing ones last.
fn every_column_sorts(browser: &Browser) {
    let wrong = "(() => {
        const ordered = (values) => values.every((v, k) => k === 0 || values[k - 1] <= v);
        let checked = 0;
        const wrong = [];
        for (const table of document.querySelectorAll('main table')) {
            for (const [column, head] of [...table.tHead.rows[0].cells].entries()) {
                for (const sign of [1, -1]) {
                    head.querySelector('button').click();
                    const cells = [...table.tBodies[0].rows].map((row) => row.cells[column]);
                    const figures = cells.filter((c) => c.dataset.value !== undefined).map((c) => sign * Number(c.dataset.value));
                    const missing = cells.map((c) => c.classList.contains('missing') ? 1 : 0);
                    checked += figures.length > 1 ? 1 : 0;
                    if (!ordered(figures) || !ordered(missing)) wrong.push(head.textContent);
                }
            }
        }
        return checked < 10 ? `only ${checked} columns of figures` : wrong;
    })()";
    assert_eq!(browser.value(wrong), json!([]));
}
