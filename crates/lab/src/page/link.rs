//! Links, to files beside the page and to rows of its list of reports.

use super::content::Source;
use maud::{Markup, html};
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

/// A table cell with more links than these folds them away.
const SHOWN: usize = 6;

/// All that has a meaning in an address, or may not stand in one.
const SPECIAL: AsciiSet = NON_ALPHANUMERIC.remove(b'-').remove(b'_').remove(b'.').remove(b'~').remove(b'/');

/// The address of a file by its relative path. A colon is escaped, so no path is taken for `javascript:` or another site.
pub(super) fn href(path: &str) -> String {
    let encoded = utf8_percent_encode(path, &SPECIAL).to_string();
    // Two slashes at the beginning would name another site.
    if encoded.starts_with('/') { format!(".{encoded}") } else { encoded }
}

/// What a link to this row of the list of reports ends with.
pub(super) fn report(position: usize) -> String {
    format!("report-{}", position + 1)
}

/// The list of reports, for links.
pub(super) struct Reports<'a> {
    labels: Vec<&'a str>,
}

impl<'a> Reports<'a> {
    pub(super) fn new(sources: &'a [Source]) -> Self {
        Self { labels: sources.iter().map(|s| s.label.as_str()).collect() }
    }

    /// Links to the reports at these ascending positions. Three and more that follow each other are named by the first and the last:
    /// a row that is from a thousand reports would else be a page of its own. Positions beyond the list have no link.
    pub(super) fn links(&self, positions: &[usize]) -> Markup {
        let known = positions.iter().filter(|&&p| p < self.labels.len()).count();
        let runs = self.runs(positions);
        let all = html! {
            @for (k, &(first, last)) in runs.iter().enumerate() {
                @if k > 0 { ", " }
                (self.link(first))
                @if last > first { "–" (self.link(last)) }
            }
        };
        match (runs.first(), runs.last()) {
            (Some(&(first, _)), Some(&(_, last))) if runs.len() > SHOWN => html! {
                details { summary { (self.labels[first]) "…" (self.labels[last]) " (" (known) ")" } (all) }
            },
            _ => html! { (all) @if known > runs.len() { " (" (known) ")" } },
        }
    }

    /// First and last position of what is named together.
    fn runs(&self, positions: &[usize]) -> Vec<(usize, usize)> {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for &position in positions.iter().filter(|&&p| p < self.labels.len()) {
            match runs.last_mut() {
                Some((_, last)) if *last + 1 == position => *last = position,
                _ => runs.push((position, position)),
            }
        }
        // "R1–R2" is no shorter than "R1, R2".
        let split = |(a, b)| if b == a + 1 { vec![(a, a), (b, b)] } else { vec![(a, b)] };
        runs.into_iter().flat_map(split).collect()
    }

    fn link(&self, position: usize) -> Markup {
        html! { a href={ "#" (report(position)) } { (self.labels[position]) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_path_leads_to_another_site() {
        assert_eq!(href("figures/a-b_1.svg"), "figures/a-b_1.svg");
        assert_eq!(href("../a b?#%.csv"), "../a%20b%3F%23%25.csv");
        assert_eq!(href("javascript:alert(1)"), "javascript%3Aalert%281%29");
        assert_eq!(href("//host/x"), ".//host/x");
        assert_eq!(href("\\\\host\\x"), "%5C%5Chost%5Cx");
        assert_eq!(href("é"), "%C3%A9");
    }

    #[test]
    fn reports_that_follow_each_other_are_named_together() {
        let sources: Vec<Source> = (1..=40).map(|k| Source { label: format!("R{k}"), ..Source::default() }).collect();
        let reports = Reports::new(&sources);
        let text = |positions: &[usize]| {
            let links = reports.links(positions).into_string();
            // What stands outside of tags.
            links.split('<').filter_map(|p| p.split('>').next_back()).collect::<String>()
        };
        assert_eq!(text(&[]), "");
        assert_eq!(text(&[0, 1]), "R1, R2");
        assert_eq!(text(&[0, 1, 2, 5, 99]), "R1–R3, R6 (4)");
        assert_eq!(text(&(0..26).collect::<Vec<_>>()), "R1–R26 (26)");
        assert_eq!(reports.links(&[4]).into_string(), "<a href=\"#report-5\">R5</a>");
        let scattered: Vec<usize> = (0..40).step_by(2).collect();
        assert!(reports.links(&scattered).into_string().starts_with("<details><summary>R1…R39 (20)</summary>"));
        assert!(!reports.links(&scattered[..6]).into_string().contains("details"));
    }
}
