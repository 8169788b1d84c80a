//! The card of a model: what it was trained on and how well it did.

use crate::train::card;
use sapwise::Model;

/// The card as a page of Markdown.
pub(crate) fn page(model: &Model, notes: &[String]) -> String {
    let mut text = format!("# The model {}\n\nMade by `sapwise train`; this page is generated with it.\n", model.name);
    text.push_str("\n## Trained on\n\n| report | physical machine | label |\n|---|---|---|\n");
    for report in &model.trained_on {
        // The label as it stands in the report.
        let label = serde_json::to_string(&report.label).unwrap_or_default();
        text.push_str(&format!("| {} | {} | {} |\n", report.file, report.physical_id, label.trim_matches('"')));
    }
    text.push_str("\n## Validation\n\n");
    text.push_str(&card::markdown(&model.validation));
    text.push_str("\n## Ranges\n\nA machine outside is extrapolated, and `predict` says so.\n\n");
    let mut rows = vec![["parameter", "lowest", "highest"].map(str::to_owned).to_vec()];
    for range in &model.ranges {
        rows.push(vec![range.parameter.clone(), format!("{:.4}", range.min), format!("{:.4}", range.max)]);
    }
    text.push_str(&markdown(&rows));
    if !notes.is_empty() {
        text.push_str("\n## Notes\n\n");
        notes.iter().for_each(|note| text.push_str(&format!("- {note}\n")));
    }
    text
}

/// Rows as a Markdown table, the first its head.
fn markdown(rows: &[Vec<String>]) -> String {
    let mut text = String::new();
    for (k, row) in rows.iter().enumerate() {
        text.push_str(&format!("| {} |\n", row.join(" | ")));
        if k == 0 {
            text.push_str(&format!("|{}\n", "---|".repeat(row.len())));
        }
    }
    text
}
