//! One page of HTML to read: text, tables that sort, figures. Everything is in the file, so that it opens from disk and by mail.
//!
//! It knows nothing of what it shows. Whatever a caller passes is text and is escaped, save the figures, which are SVG of our own; a
//! browser that opens the page runs and asks for nothing but the script and the style that are in it.

mod content;
mod figure;
mod ids;
mod link;
mod table;

#[cfg(test)]
mod tests;

use crate::data_table::{Cell, Column, DataTable, Row};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use ids::Ids;
use link::{Reports, href};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest, Sha256};

pub(crate) use content::{Block, Page, Section, Source};

/// What a link to the list of reports ends with.
const REPORTS: &str = "reports";

/// The page as a file.
pub(crate) fn html(page: &Page) -> String {
    // A browser turns the line ends of Windows, which a checkout may have brought in, into plain ones before it takes the hash.
    let style = include_str!("page.css").replace("\r\n", "\n");
    let script = include_str!("page.js").replace("\r\n", "\n");
    let policy = format!(
        "default-src 'none'; style-src {}; script-src {}; img-src data:; base-uri 'none'; form-action 'none'",
        hash(&style),
        hash(&script)
    );
    let reports = Reports::new(&page.reports);
    let mut ids = Ids::default();
    ids.take(REPORTS);
    (0..page.reports.len()).for_each(|k| drop(ids.take(&link::report(k))));
    let sections: Vec<(String, &Section)> = page.sections.iter().map(|s| (ids.take(&s.id), s)).collect();
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="referrer" content="no-referrer";
                // Without an icon of its own a browser asks the server of a page for one.
                link rel="icon" href="data:,";
                title { (page.title) }
                style { (PreEscaped(&style)) }
            }
            body {
                header {
                    h1 { (page.title) }
                    @for paragraph in &page.lead { p { (paragraph) } }
                    @if !page.command.is_empty() { p.made { "Made by" } pre tabindex="0" { code { (page.command) } } }
                }
                nav aria-label="Contents" {
                    h2 { "Contents" }
                    ol {
                        @for (id, section) in &sections { li { a href={ "#" (id) } { (section.title) } } }
                        @if !page.reports.is_empty() { li { a href={ "#" (REPORTS) } { "Reports" } } }
                    }
                }
                main {
                    @for (id, section) in &sections {
                        section id=(id) aria-labelledby={ (id) "-title" } {
                            h2 id={ (id) "-title" } { (section.title) " " (anchor(id)) }
                            @for block in &section.blocks { (self::block(block, &reports, &mut ids)) }
                        }
                    }
                    @if !page.reports.is_empty() { (sources(&page.reports, &reports, &mut ids)) }
                }
                script { (PreEscaped(&script)) }
            }
        }
    }
    .into_string()
}

fn block(block: &Block, reports: &Reports<'_>, ids: &mut Ids) -> Markup {
    match block {
        Block::Text(text) => html! { p { (text) } },
        Block::List(points) => html! { ul { @for point in points { li { (point) } } } },
        Block::Missing(what) => missing(what),
        Block::Table { id, caption, table, csv } => {
            let id = ids.take(id);
            html! {
                figure.table id=(id) {
                    figcaption id={ (id) "-caption" } { (caption) " " (anchor(&id)) }
                    (table::table(&id, table, reports, &|_| None))
                    @if !csv.is_empty() { p.links { a href=(href(csv)) { "CSV" } } }
                }
            }
        }
        Block::Figure { id, caption, svg, links, alt } => {
            let id = ids.take(id);
            html! {
                figure.picture id=(id) {
                    @match figure::inline(svg, &id, alt) {
                        Some(svg) => div.scroll tabindex="0" role="region" aria-labelledby={ (id) "-caption" } { (PreEscaped(svg)) },
                        None => (missing("this figure is no SVG with a size")),
                    }
                    figcaption id={ (id) "-caption" } { (caption) " " (anchor(&id)) }
                    @if !links.is_empty() {
                        p.links { @for (text, path) in links { a href=(href(path)) { (text) } " " } }
                    }
                }
            }
        }
    }
}

fn missing(what: &str) -> Markup {
    html! { p.notice role="note" { strong { "Missing: " } (what) } }
}

fn anchor(id: &str) -> Markup {
    html! { a.anchor href={ "#" (id) } aria-label="Link to this" { "#" } }
}

/// The list of reports, where the links of the tables lead.
fn sources(sources: &[Source], reports: &Reports<'_>, ids: &mut Ids) -> Markup {
    let column = |title: &str, key: &str| Column { title: title.to_owned(), key: key.to_owned() };
    let columns = vec![column("Report", "report"), column("File", "file"), column("What it is", "note")];
    let cells = |s: &Source| [&s.label, &s.file, &s.note].map(|t| Cell::Text(t.clone())).to_vec();
    let rows = sources.iter().map(|s| Row { cells: cells(s), reports: Vec::new() }).collect();
    let id = ids.take("reports-table");
    html! {
        section id=(REPORTS) aria-labelledby={ (REPORTS) "-title" } {
            h2 id={ (REPORTS) "-title" } { "Reports " (anchor(REPORTS)) }
            figure.table id=(id) {
                figcaption id={ (id) "-caption" } { "The files that the figures are from. Tables name them by the first column." }
                (table::table(&id, &DataTable { columns, rows }, reports, &|row| Some(link::report(row))))
            }
        }
    }
}

/// How a policy names a script or a style that may be there.
fn hash(text: &str) -> String {
    format!("'sha256-{}'", BASE64_STANDARD.encode(Sha256::digest(text)))
}
