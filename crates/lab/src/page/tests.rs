//! The page in a browser. Where none is installed these tests say so and pass, unless `SAPWISE_REQUIRE_BROWSER=1`; where
//! `SAPWISE_SCREENSHOTS` names a folder they leave pictures there.

#[path = "../../tests/browser/mod.rs"]
mod browser;

use super::*;
use browser::{Browser, ENTER};
use serde_json::json;
use std::path::PathBuf;

/// Names that break a page which trusts them.
const HOSTILE: [&str; 6] = [
    "</script><img src=x onerror=\"document.title='broken'\"><svg onload=alert(1)>",
    "\"quotes\" 'and' & &amp; <b>bold</b>",
    "\u{202e}עברית العربية 0-9",
    "👩‍🚀 emoji \u{0} \u{7f} \u{feff}",
    "=HYPERLINK(\"http://example.com\")",
    "",
];

/// Calls `check` with a browser that shows this page, and the folder of its file.
fn with_browser(test: &str, page: &Page, check: impl FnOnce(&Browser, &dyn Fn())) {
    let Some(browser) = Browser::start(test) else { return };
    let folder = tempfile::tempdir().unwrap();
    let file: PathBuf = folder.path().join("page.html");
    std::fs::write(&file, html(page)).unwrap();
    browser.view(1600, 1000, false);
    // Whatever the browser does on its own when it starts is not the page's.
    drop((browser.requests(), browser.console()));
    browser.open(&file);
    check(&browser, &|| browser.open(&file));
}

fn columns(titles: &[&str]) -> Vec<Column> {
    titles.iter().map(|t| Column { title: (*t).to_owned(), key: (*t).to_owned() }).collect()
}

fn text(text: &str) -> Cell {
    Cell::Text(text.to_owned())
}

fn number(value: f64, shown: &str) -> Cell {
    Cell::Number { value, shown: shown.to_owned() }
}

fn missing_cell() -> Cell {
    Cell::Missing("this machine has no \"GPU\"".to_owned())
}

fn row(cells: Vec<Cell>) -> Row {
    Row { cells, reports: Vec::new() }
}

fn table_block(id: &str, table: DataTable) -> Block {
    Block::Table { id: id.to_owned(), caption: format!("The table {id}"), table, csv: format!("tables/{id}.csv") }
}

/// A table with ties, figures whose text sorts otherwise than their values, and a missing one.
fn small() -> DataTable {
    let cells = [
        ("b", Some((2e6, "2.00 ms"))),
        ("a", Some((9e5, "900 us"))),
        ("R10", None),
        ("R9", Some((2e6, "2.00 ms"))),
        ("c", Some((-1.0, "-1 ns"))),
    ];
    let cell = |c: Option<(f64, &str)>| c.map_or_else(missing_cell, |(value, shown)| number(value, shown));
    DataTable {
        columns: columns(&["name", "time"]),
        rows: cells.map(|(name, c)| row(vec![text(name), cell(c)])).to_vec(),
    }
}

fn large(rows: usize, columns: usize) -> DataTable {
    let value = |r: usize, c: usize| ((r * 7919 + c * 104_729) % 100_003) as f64 * 1234.5;
    let cell = |r: usize, c: usize| {
        if c == 0 {
            return text(&format!("machine-{r}"));
        }
        if (r + c).is_multiple_of(11) {
            return missing_cell();
        }
        number(value(r, c), &crate::text::duration(value(r, c)))
    };
    let titles: Vec<String> = (0..columns).map(|c| format!("column {c} in ns")).collect();
    DataTable {
        columns: titles.iter().map(|t| Column { title: t.clone(), key: t.clone() }).collect(),
        rows: (0..rows)
            .map(|r| Row { cells: (0..columns).map(|c| cell(r, c)).collect(), reports: vec![r % 30] })
            .collect(),
    }
}

/// A picture in the colours of the figures, with a hostile name escaped as plotters does it.
fn picture() -> String {
    let lines: String = (0..12)
        .map(|k| {
            let (x, y) = (90 + 80 * k, 60 + 35 * k);
            format!(
                "<line opacity=\"1\" stroke=\"#D0D0D0\" stroke-width=\"1\" x1=\"{x}\" y1=\"60\" x2=\"{x}\" y2=\"500\"/>\n\
                 <circle cx=\"{x}\" cy=\"{y}\" r=\"6\" opacity=\"0.8\" fill=\"#0072B2\" stroke=\"none\"/>\n\
                 <text x=\"{x}\" y=\"520\" font-family=\"sans-serif\" font-size=\"14\" opacity=\"1\" fill=\"#5A5A5A\">\n1{k}00\n</text>\n"
            )
        })
        .collect();
    format!(
        "<?xml version=\"1.0\"?>\n<svg width=\"1100\" height=\"560\" viewBox=\"0 0 1100 560\" xmlns=\"http://www.w3.org/2000/svg\">\n\
         <rect x=\"0\" y=\"0\" width=\"1100\" height=\"560\" opacity=\"1\" fill=\"#FFFFFF\" stroke=\"none\"/>\n{lines}\
         <polyline fill=\"none\" opacity=\"1\" stroke=\"#000000\" stroke-width=\"2\" points=\"90,60 90,500 1060,500\"/>\n\
         <text x=\"550\" y=\"40\" text-anchor=\"middle\" font-family=\"sans-serif\" font-size=\"22\" opacity=\"1\" fill=\"#000000\">\n\
         &lt;/script&gt;&lt;img onerror=&quot;1&quot;&gt; time of a frame\n</text>\n</svg>\n"
    )
}

/// A page of everything, in every size.
fn rich() -> Page {
    let long = "x".repeat(300);
    let reports = (1..=90).map(|k| Source {
        label: format!("R{k}"),
        file: format!("datasets/2026-11-{:02}-machine-{k}-{}.json", k % 30 + 1, HOSTILE[k % HOSTILE.len()]),
        note: if k == 3 { long.clone() } else { format!("real_full, {k} threads") },
    });
    let hostile: Vec<Row> = HOSTILE
        .iter()
        .chain([&long.as_str()])
        .map(|&name| Row {
            cells: vec![text(name), text(name), number(1.5, "1.50"), Cell::Missing(name.to_owned())],
            reports: vec![0, 1, 2, 7],
        })
        .collect();
    let mut hostile = DataTable { columns: columns(&["name", HOSTILE[0], &long, "4"]), rows: hostile };
    hostile.rows[0].reports = (0..60).step_by(2).collect();
    hostile.rows[1].reports = (0..26).collect();
    let figure = |id: &str| Block::Figure {
        id: id.to_owned(),
        caption: format!(
            "Time of a frame over the number of objects. From R1 to R26, by `sapwise study`. {}",
            HOSTILE[0]
        ),
        svg: picture(),
        links: ["SVG", "PNG", "CSV"].map(|t| (t.to_owned(), format!("figures/a b.{}", t.to_lowercase()))).to_vec(),
        alt: format!("Rising curves {}", HOSTILE[1]),
    };
    let section = |id: &str, title: &str, blocks| Section { id: id.to_owned(), title: title.to_owned(), blocks };
    Page {
        title: format!("What hardware does to broad phases {}", HOSTILE[0]),
        lead: vec!["90 reports, 30 machines. ".repeat(12), long.clone()],
        command: format!("sapwise study datasets/*.json --out 'a \"folder\" <b>' {long}"),
        reports: reports.collect(),
        sections: vec![
            section(
                "small",
                "A small table",
                vec![Block::Text("Some words. ".repeat(40)), table_block("small", small())],
            ),
            section(
                "figures",
                "Figures",
                vec![figure("f"), figure("f"), Block::List(HOSTILE.map(str::to_owned).to_vec())],
            ),
            section(
                "large",
                "A large table",
                vec![table_block("large", large(200, 14)), table_block("middle", large(20, 5))],
            ),
            section(
                "odd",
                &format!("Odd names {} {long}", HOSTILE[0]),
                vec![
                    table_block("hostile", hostile),
                    Block::Missing("no report has a GPU, so there is no crossover to show".to_owned()),
                    table_block("empty", DataTable { columns: columns(&["a"]), rows: Vec::new() }),
                    Block::Figure {
                        id: String::new(),
                        caption: String::new(),
                        svg: String::new(),
                        links: Vec::new(),
                        alt: String::new(),
                    },
                ],
            ),
        ],
    }
}

/// The texts of a column, from the top, of the rows that are shown.
fn column(browser: &Browser, table: &str, column: usize) -> Vec<String> {
    let cells = browser.value(&format!(
        "[...document.querySelectorAll('#{table} tbody tr:not([hidden])')].map(r => r.cells[{column}].textContent)"
    ));
    cells.as_array().unwrap().iter().map(|c| c.as_str().unwrap().to_owned()).collect()
}

#[test]
fn it_fits_every_window_in_light_and_dark() {
    with_browser("it_fits_every_window_in_light_and_dark", &rich(), |browser, open| {
        for (width, height) in [(400, 800), (1600, 1000)] {
            for dark in [false, true] {
                browser.view(width, height, dark);
                open();
                let name = format!("page-{width}-{}", if dark { "dark" } else { "light" });
                browser.screenshot(&name);
                assert_eq!(browser.console(), [""; 0], "{name}");
                let wide = browser.value("document.documentElement.scrollWidth").as_u64().unwrap();
                assert!((1..=u64::from(width)).contains(&wide), "{name}: {wide} px wide");
                assert_eq!(browser.unreadable(), [""; 0], "{name}");
                let paper = browser.value("getComputedStyle(document.body).backgroundColor");
                assert_eq!(paper != json!("rgb(255, 255, 255)"), dark, "{name}: {paper}");
                let colours = browser.value(
                    "['rect', 'polyline', 'text'].map(t => getComputedStyle(document.querySelector(`svg ${t}`)))\
                    .map((s, k) => [s.fill, s.stroke, s.fill][k])",
                );
                assert_eq!(colours[0], paper, "{name}");
                assert_eq!(colours[1] != json!("rgb(0, 0, 0)"), dark, "{name}: {colours}");
                assert_eq!(colours[2] != json!("rgb(90, 90, 90)"), dark, "{name}: {colours}");
            }
        }
        let requests = browser.requests();
        assert_eq!(requests.len(), 5, "{requests:?}");
        assert!(requests.iter().all(|r| r.starts_with("file://") && r.ends_with("/page.html")), "{requests:?}");
    });
}

#[test]
fn columns_sort() {
    with_browser("columns_sort", &rich(), |browser, _| {
        let (names, times) = (|| column(browser, "small-2", 0), "#small-2 th:nth-child(2)");
        let as_made = ["b", "a", "R10", "R9", "c"];
        assert_eq!(names(), as_made);
        let time = format!("{times} button");
        let sorted = || browser.value(&format!("document.querySelector('{times}').ariaSort"));
        assert_eq!(sorted(), json!("none"));
        browser.click(&time);
        // By value and not by text, ties as they were, the missing one last.
        assert_eq!((names(), sorted()), (["c", "a", "b", "R9", "R10"].map(str::to_owned).to_vec(), json!("ascending")));
        browser.type_into(&time, ENTER);
        assert_eq!(
            (names(), sorted()),
            (["b", "R9", "a", "c", "R10"].map(str::to_owned).to_vec(), json!("descending"))
        );
        browser.type_into(&time, " ");
        assert_eq!((names(), sorted()), (as_made.map(str::to_owned).to_vec(), json!("none")));
        // Words as people order them.
        browser.click("#small-2 th:first-child button");
        assert_eq!(names(), ["a", "b", "c", "R9", "R10"]);
        // A large one, from within its box.
        browser.click("#large-2 th:nth-child(2) button");
        let values = browser
            .value("[...document.querySelectorAll('#large-2 tbody tr')].map(r => r.cells[1].dataset.value || null)");
        let values: Vec<f64> = values
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_str().map_or(f64::INFINITY, |v| v.parse().unwrap()))
            .collect();
        assert!(values.len() == 200 && values.is_sorted() && values[199].is_infinite(), "{values:?}");
        assert_eq!(browser.console(), [""; 0]);
    });
}

#[test]
fn rows_are_filtered() {
    with_browser("rows_are_filtered", &rich(), |browser, _| {
        assert_eq!(
            browser.value("document.querySelectorAll('#small-2 input, #middle input, #large-2 input').length"),
            json!(2)
        );
        let field = "#reports-table input";
        browser.type_into(field, "datasets MACHINE-7");
        // 7 and 70 to 79.
        assert_eq!(column(browser, "reports-table", 0).len(), 11);
        assert_eq!(
            browser.value("document.querySelector('#reports-table output').textContent"),
            json!("11 of 90 rows")
        );
        browser.click("#reports-table th:first-child button");
        assert_eq!(column(browser, "reports-table", 0)[..2], ["R7", "R70"]);
        // A link to a row that is filtered away shows it.
        browser.click("#hostile tbody tr:nth-child(3) a[href='#report-8']");
        // A browser tells of another address when it gets to it.
        let all = |_: &u32| {
            let shown = column(browser, "reports-table", 0).len() == 90;
            std::thread::sleep(std::time::Duration::from_millis(if shown { 0 } else { 20 }));
            shown
        };
        assert!((0..500).find(all).is_some());
        let seen = "(() => { const b = document.querySelector('#report-8').getBoundingClientRect();
            const box = document.querySelector('#reports-table .scroll').getBoundingClientRect();
            return b.top >= Math.max(box.top, 0) && b.bottom <= Math.min(box.bottom, innerHeight); })()";
        assert_eq!(browser.value(seen), json!(true));
        assert_eq!(browser.console(), [""; 0]);
    });
}

#[test]
fn hostile_names_are_shown_as_they_are() {
    let page = rich();
    with_browser("hostile_names_are_shown_as_they_are", &page, |browser, _| {
        assert_eq!(browser.value("document.title"), json!(page.title));
        assert_eq!(
            browser.value("['img', 'b', 'script', 'a[href^=http]'].map(s => document.querySelectorAll(s).length)"),
            json!([0, 0, 1, 0])
        );
        let shown = column(browser, "hostile", 0);
        for (name, shown) in HOSTILE.iter().zip(&shown) {
            // HTML has no NUL.
            assert_eq!(shown.trim(), name.replace('\0', "").trim(), "{name:?}");
        }
        assert_eq!(browser.value("new Set([...document.querySelectorAll('[id]')].map(e => e.id)).size === document.querySelectorAll('[id]').length"), json!(true));
        let lost = "[...document.querySelectorAll('a[href^=\"#\"]')].filter(a => !document.getElementById(a.getAttribute('href').slice(1))).length";
        assert_eq!(browser.value(lost), json!(0));
    });
}

#[test]
fn all_of_it_is_printed_and_in_light() {
    with_browser("all_of_it_is_printed_and_in_light", &rich(), |browser, _| {
        browser.view_print();
        let style = |selector: &str, property: &str| {
            browser.value(&format!("getComputedStyle(document.querySelector('{selector}')).{property}"))
        };
        assert_eq!(style("body", "backgroundColor"), json!("rgb(255, 255, 255)"));
        assert_eq!(style("svg rect", "fill"), json!("rgb(255, 255, 255)"));
        assert_eq!(style(".tall", "maxHeight"), json!("none"));
        assert_eq!(style(".tall thead th", "position"), json!("static"));
        assert_eq!(style(".tall thead button", "display"), json!("contents"));
        assert_eq!(style("main a", "textDecorationLine"), json!("none"));
        assert_eq!(
            browser
                .value("document.querySelector('#hostile details a').checkVisibility({ contentVisibilityAuto: true })"),
            json!(true)
        );
        browser.print("page");
    });
}

#[test]
fn it_can_be_read_without_scripts() {
    with_browser("it_can_be_read_without_scripts", &rich(), |browser, open| {
        browser.allow_scripts(false);
        open();
        browser.screenshot("page-1600-without-scripts");
        assert_eq!(browser.value("document.querySelectorAll('button, input').length"), json!(0));
        assert_eq!(browser.value("document.querySelectorAll('#large-2 tbody tr').length"), json!(200));
        assert_eq!(
            column(browser, "small-2", 1),
            ["2.00 ms", "900 us", "–this machine has no \"GPU\"", "2.00 ms", "-1 ns"]
        );
    });
}

#[test]
fn nothing_is_fetched_and_a_large_table_is_no_large_file() {
    let section = Section { blocks: vec![table_block("t", large(1000, 40))], ..Section::default() };
    let page = Page { sections: vec![section], ..Page::default() };
    let file = html(&page);
    assert!(file.len() < 3_000_000, "{} bytes", file.len());
    for address in ["http:", "https:", "//", "url(", "@import"] {
        let script = include_str!("page.js");
        assert!(!file.replace(script, "").contains(address), "{address}");
    }
    assert!(file.contains("default-src 'none'; style-src 'sha256-"));
    let empty = html(&Page::default());
    assert!(empty.contains("<h1></h1>") && !empty.contains("id=\"reports\""));
}
