//! The statistics as a table, and what may not change in it.

use crate::Result;
use std::collections::BTreeMap;
use std::path::Path;

/// Columns of figures, each with the name that RADV has for it. The first is no statistic but a property.
pub(crate) const COLUMNS: [(&str, &str); 10] = [
    ("subgroup_lanes", ""),
    ("occupancy_subgroups_per_simd", "Subgroups per SIMD"),
    ("vgprs", "VGPRs"),
    ("sgprs", "SGPRs"),
    ("spilled_vgprs", "Spilled VGPRs"),
    ("spilled_sgprs", "Spilled SGPRs"),
    ("scratch_bytes", "Scratch size"),
    ("lds_bytes", "LDS size"),
    ("instructions", "Instructions"),
    ("code_bytes", "Code size"),
];
/// Columns that tell what a row is about.
const KEYS: [&str; 4] = ["driver", "family", "shader", "entry_point"];

/// The head of the CSV.
pub(crate) fn head() -> String {
    let columns: Vec<&str> = KEYS.into_iter().chain(COLUMNS.map(|(name, _)| name)).collect();
    columns.join(",")
}

/// A kernel on a family.
pub(crate) struct Row {
    keys: [String; KEYS.len()],
    values: Vec<u64>,
}

impl Row {
    pub(crate) fn new(driver: &str, family: &str, shader: &str, entry: &str, values: Vec<u64>) -> Self {
        Self { keys: [driver, family, shader, entry].map(str::to_owned), values }
    }

    pub(crate) fn line(&self) -> String {
        let values: Vec<String> = self.values.iter().map(u64::to_string).collect();
        format!("{},{}", self.keys.join(","), values.join(","))
    }

    fn parse(line: &str) -> Option<Self> {
        let fields: Vec<&str> = line.split(',').collect();
        let (keys, values) = fields.split_at_checked(KEYS.len())?;
        let values: Vec<u64> = values.iter().map(|v| v.parse().ok()).collect::<Option<_>>()?;
        (values.len() == COLUMNS.len()).then(|| Self::new(keys[0], keys[1], keys[2], keys[3], values))
    }

    fn driver(&self) -> &str {
        &self.keys[0]
    }

    fn name(&self) -> String {
        format!("{}.{} on {}", self.keys[2], self.keys[3], self.keys[1])
    }

    fn value(&self, column: &str) -> u64 {
        let at = COLUMNS.iter().position(|(name, _)| *name == column);
        self.values[at.expect("a column of the table")]
    }
}

/// What is wrong with the rows after a change, in sentences: `bad` whatever the rows before are, the rest against them.
fn judge(before: &[Row], after: &[Row]) -> (Vec<String>, Vec<String>) {
    let mut bad = Vec::new();
    let mut changed = Vec::new();
    for row in after {
        for column in ["spilled_vgprs", "spilled_sgprs", "scratch_bytes"] {
            if row.value(column) > 0 {
                bad.push(format!("{}: {column} is {}, and must be 0", row.name(), row.value(column)));
            }
        }
    }
    let mut left: BTreeMap<String, &Row> = before.iter().map(|row| (row.name(), row)).collect();
    for row in after {
        let Some(old) = left.remove(&row.name()) else {
            changed.push(format!("{} is new", row.name()));
            continue;
        };
        for (k, &(column, _)) in COLUMNS.iter().enumerate() {
            let (was, is) = (old.values[k], row.values[k]);
            let fell = if column.starts_with("occupancy") && is < was { ", a fall" } else { "" };
            if was != is {
                changed.push(format!("{}: {column} was {was} and is {is}{fell}", row.name()));
            }
        }
    }
    changed.extend(left.keys().map(|name| format!("{name} is gone")));
    (bad, changed)
}

fn read(file: &Path) -> Result<Vec<Row>> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let mut lines = text.lines();
    if lines.next() != Some(head().as_str()) {
        return Err(format!("{}: its head is not {}", file.display(), head()));
    }
    let row = |line| Row::parse(line).ok_or_else(|| format!("{}: not a row of this table: {line}", file.display()));
    let rows: Vec<Row> = lines.map(row).collect::<Result<_>>()?;
    if rows.is_empty() { Err(format!("{} has no rows", file.display())) } else { Ok(rows) }
}

/// Compares two tables. Figures of two versions of a driver are not compared, since the compiler differs: then only spills and scratch count.
pub(crate) fn compare_files(before: &Path, after: &Path) -> Result<()> {
    let (old, new) = (read(before)?, read(after)?);
    let same = old.iter().chain(&new).all(|row| row.driver() == new[0].driver());
    let (mut wrong, changed) = judge(&old, &new);
    if same {
        wrong.extend(changed);
    } else {
        println!(
            "{} was written with {}, and this is {}: no figure is compared; no kernel spills or takes scratch memory all the same",
            before.display(),
            old[0].driver(),
            new[0].driver()
        );
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\nshaders: ")) }
}
