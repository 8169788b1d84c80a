//! Parameters of real machines that others published, without timings.

use super::{COMPARED, COMPARED_OF_GPUS, read_text};
use crate::training::{Outside, PublishedShares};
use anyhow::{Context, Result, bail};
use sapwise_tune::Model;
use sapwise_tune::model::{GPU_PREFIX, Range};
use sapwise_tune::stats::quantile;
use std::path::{Path, PathBuf};

/// The file in a folder of reports.
const FILE: &str = "published/machines.csv";

/// Columns that hold no parameter.
const NAMES: [&str; 2] = ["source", "machine"];

/// Values of a parameter that it takes to state their deciles.
const FEWEST_VALUES: usize = 20;

/// Known parameters of each machine, named as in [`Range::parameter`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Published(Vec<Vec<(String, f64)>>);

impl Published {
    /// Reads `published/machines.csv` of every folder among `paths` that has one: `source`, `machine`, and a column
    /// for each known parameter.
    ///
    /// # Errors
    /// Names the file and the line or column that is wrong.
    pub fn read(paths: &[PathBuf]) -> Result<Self> {
        let mut all = Self::default();
        for file in paths.iter().map(|path| path.join(FILE)).filter(|file| file.is_file()) {
            all.0.extend(machines(&read_text(&file)?, &file)?);
        }
        Ok(all)
    }

    /// Gives the ranges of a model their deciles. Returns how many machines lie inside; `None` if
    /// none has a known parameter.
    pub fn compare(&self, model: &mut Model) -> Option<PublishedShares> {
        let mut shares = PublishedShares::default();
        for range in &mut model.ranges {
            let values: Vec<f64> = self.values(&range.parameter).collect();
            if values.len() >= FEWEST_VALUES {
                range.published = (0..=10).filter_map(|k| quantile(&values, f64::from(k) / 10.0)).collect();
                let within = values.iter().filter(|&&value| range.holds(value)).count();
                shares.within.insert(range.parameter.clone(), within as f64 / values.len() as f64);
            }
        }
        shares.cpus = self.outside(&model.ranges, false);
        shares.gpus = self.outside(&model.ranges, true);
        (shares.cpus.machines + shares.gpus.machines > 0).then_some(shares)
    }

    fn values(&self, parameter: &str) -> impl Iterator<Item = f64> {
        self.0.iter().flatten().filter(move |(name, _)| name == parameter).map(|(_, value)| *value)
    }

    /// Counts the machines with parameters of GPUs, or of CPUs, and those with one outside its range.
    fn outside(&self, ranges: &[Range], of_gpus: bool) -> Outside {
        let of_kind = |machine: &&Vec<(String, f64)>| machine.iter().any(|(n, _)| n.starts_with(GPU_PREFIX) == of_gpus);
        let is_outside = |(name, value): &(String, f64)| {
            name.starts_with(GPU_PREFIX) == of_gpus && ranges.iter().any(|r| r.parameter == *name && !r.holds(*value))
        };
        let machines: Vec<_> = self.0.iter().filter(of_kind).collect();
        let outside = machines.iter().filter(|machine| machine.iter().any(is_outside)).count();
        Outside { machines: machines.len(), outside }
    }
}

fn machines(text: &str, file: &Path) -> Result<Vec<Vec<(String, f64)>>> {
    let shown = file.display();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let head = rows.headers().with_context(|| format!("{shown} has no line of column names"))?.clone();
    let known = |name: &str| {
        NAMES.contains(&name)
            || COMPARED.iter().any(|id| id.as_str() == name)
            || name.strip_prefix(GPU_PREFIX).is_some_and(|name| COMPARED_OF_GPUS.iter().any(|id| id.as_str() == name))
    };
    if let Some(name) = head.iter().find(|name| !known(name)) {
        bail!(
            "{shown} has the column {name:?}, which is no parameter that models compare; name it as in the `ranges` of \
             a model, such as {} or {GPU_PREFIX}{}, or delete it",
            COMPARED[0],
            COMPARED_OF_GPUS[0]
        );
    }
    let mut machines = Vec::new();
    for row in rows.records() {
        let row = row.with_context(|| format!("{shown} needs a cell for each column in every line"))?;
        let line = row.position().map_or(0, csv::Position::line);
        let cells = head.iter().zip(&row).filter(|(name, cell)| !NAMES.contains(name) && !cell.is_empty());
        let number = |(name, cell): (&str, &str)| match cell.parse() {
            Ok(value) if f64::is_finite(value) && value > 0.0 => Ok((name.to_owned(), value)),
            _ => bail!(
                "{shown}, line {line}: {name} is {cell:?}, which is no number above zero; write it without a unit, or \
                 leave the cell empty"
            ),
        };
        machines.push(cells.map(number).collect::<Result<_>>()?);
    }
    Ok(machines)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Published> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("published")).unwrap();
        std::fs::write(folder.path().join(FILE), text).unwrap();
        Published::read(&["none".into(), folder.path().to_owned()])
    }

    #[test]
    fn machines_are_compared_with_ranges() {
        let mut text = "source,machine,usable_cores,gpu/read_gb_per_s\n".to_owned();
        (1..=21).for_each(|cores| text.push_str(&format!("s,cpu {cores},{cores},\n")));
        text.push_str("s,card,,900\ns,nothing known,,\n");
        let range = |parameter: &str, min, max| Range { parameter: parameter.to_owned(), min, max, ..Range::default() };
        let ranges = vec![range("usable_cores", 2.0, 10.0), range("gpu/read_gb_per_s", 100.0, 1000.0)];
        let mut model = Model::new("test", Vec::new(), ranges);
        let shares = read(&text).unwrap().compare(&mut model).unwrap();
        // Eleven cores are within a tenth of ten.
        assert_eq!(shares.cpus, Outside { machines: 21, outside: 11 });
        assert_eq!(shares.gpus, Outside { machines: 1, outside: 0 });
        let cores: Vec<f64> = (0..=10).map(|k| 1.0 + 2.0 * f64::from(k)).collect();
        assert_eq!((&model.ranges[0].published, model.ranges[1].published.len()), (&cores, 0));
        assert_eq!(Vec::from_iter(shares.within), [("usable_cores".to_owned(), 10.0 / 21.0)]);
        assert_eq!(Published::read(&["none".into()]).unwrap().compare(&mut model), None);
    }

    #[test]
    fn errors_say_what_to_do() {
        for (text, told) in [
            ("machine,cores\nm,2\n", ["\"cores\"", "or delete it"]),
            ("machine,usable_cores\na,2\nm,2 GB\n", ["line 3: usable_cores is \"2 GB\"", "leave the cell empty"]),
            ("machine,usable_cores\nm,-1\n", ["line 2", "no number above zero"]),
            ("machine,usable_cores\nm\n", ["a cell for each column", "machines.csv"]),
        ] {
            let error = format!("{:#}", read(text).unwrap_err());
            assert!(told.iter().all(|part| error.contains(part)), "{error}");
        }
    }
}
