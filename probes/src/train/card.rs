//! The scores of a validation as a table to read.

use sapwise::model::{MethodScore, Validation};

const HEADINGS: [&str; 5] = ["way to choose", "mean regret", "95th percentile", "points over 10 %", "gap closed"];

/// The table with aligned columns, for a terminal.
pub(crate) fn text(validation: &Validation) -> String {
    let rows: Vec<[String; 5]> =
        [HEADINGS.map(str::to_owned)].into_iter().chain(validation.methods.iter().map(cells)).collect();
    let width = |column: usize| rows.iter().map(|r| r[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 5] = std::array::from_fn(width);
    let mut text = heading(validation) + "\n";
    if validation.methods.is_empty() {
        return text;
    }
    for row in &rows {
        let cell =
            |k: usize| if k == 0 { format!("{:<1$}", row[0], widths[0]) } else { format!("{:>1$}", row[k], widths[k]) };
        text += (0..5).map(cell).collect::<Vec<String>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}

/// The same as Markdown, for the model card.
pub(crate) fn markdown(validation: &Validation) -> String {
    let mut text = heading(validation) + "\n";
    if validation.methods.is_empty() {
        return text;
    }
    let line = |cells: [String; 5]| format!("| {} |\n", cells.join(" | "));
    text += "\n";
    text += &line(HEADINGS.map(str::to_owned));
    text += "|---|---:|---:|---:|---:|\n";
    text.extend(validation.methods.iter().map(|m| line(cells(m))));
    text
}

fn heading(validation: &Validation) -> String {
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let data =
        format!("{} in {}", count(validation.physical_machines, "physical machine"), count(validation.profiles, "profile"));
    if validation.methods.is_empty() {
        return format!("{data}; not validated.");
    }
    let doubt = if validation.held_out == "profile" { " This says little about machines never seen." } else { "" };
    format!("{data}; each {} left out in turn.{doubt}", validation.held_out)
}

fn cells(score: &MethodScore) -> [String; 5] {
    let percent = |v: f64| format!("{:.1} %", 100.0 * v);
    [
        score.name.clone(),
        percent(score.mean_regret),
        percent(score.p95_regret),
        percent(score.share_over_10_percent),
        percent(score.closed_gap),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn validation() -> Validation {
        let score = |name: &str, mean_regret| MethodScore {
            name: name.to_owned(),
            mean_regret,
            p95_regret: 0.2,
            share_over_10_percent: 0.5,
            closed_gap: 0.9,
        };
        Validation {
            held_out: "profile".to_owned(),
            physical_machines: 1,
            profiles: 3,
            methods: vec![score("physics", 0.04), score("nearest machine", 12.3)],
        }
    }

    #[test]
    fn columns_are_aligned_and_the_numbers_of_machines_stand_above() {
        let text = text(&validation());
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "1 physical machine in 3 profiles; each profile left out in turn. This says little about machines never seen."
        );
        assert!(lines[1..].iter().all(|l| l.chars().count() == lines[1].chars().count()), "{text}");
        assert!(lines[3].contains("1230.0 %"), "{text}");
    }

    #[test]
    fn the_card_is_a_table_and_without_scores_a_sentence() {
        let text = markdown(&validation());
        assert!(text.contains("\n| physics | 4.0 % | 20.0 % | 50.0 % | 90.0 % |\n"), "{text}");
        let none = Validation { methods: Vec::new(), ..validation() };
        assert_eq!(markdown(&none), "1 physical machine in 3 profiles; not validated.\n");
    }
}
