//! Which CPU and which GPUs make a machine.

use super::specification::{Cpu, Form, Gpu, Specifications};
use anyhow::{Result, bail};
use sapwise_scenes::Random;

/// A machine that could be bought.
#[derive(Debug, Clone)]
pub(super) struct Build<'a> {
    pub(super) cpu: &'a Cpu,
    /// Cards first, then what is inside the CPU. Two cards are alike.
    pub(super) gpus: Vec<&'a Gpu>,
}

/// Years between a CPU and a card in one machine, at most.
const MOST_YEARS: u32 = 3;
/// Draws of GPUs for a CPU whose machine stands there already, before it is passed over.
const DRAWS: u64 = 20;

/// `count` different machines. No CPU stands in two of them before each stands in one.
///
/// # Errors
/// When the specifications make fewer.
pub(super) fn builds(specifications: &Specifications, count: usize, seed: u64) -> Result<Vec<Build<'_>>> {
    let mut builds: Vec<Build<'_>> = Vec::new();
    let mut names: Vec<String> = Vec::new();
    let mut random = Random::new(seed);
    for round in 0.. {
        let before = builds.len();
        for k in random.shuffled(specifications.cpus.len()) {
            let cpu = &specifications.cpus[k];
            let draw = |again: u64| Build::draw(cpu, &specifications.gpus, seed, round * DRAWS + again);
            let new = (0..DRAWS).map(draw).find(|b| !names.contains(&b.name()));
            if builds.len() < count
                && let Some(build) = new
            {
                names.push(build.name());
                builds.push(build);
            }
        }
        if builds.len() == count {
            break;
        }
        if builds.len() == before {
            bail!("these specifications make {before} different machines, not {count}; ask for fewer with --machines");
        }
    }
    Ok(builds)
}

impl<'a> Build<'a> {
    fn draw(cpu: &'a Cpu, gpus: &'a [Gpu], seed: u64, again: u64) -> Self {
        let inside = gpus.iter().find(|g| g.inside.as_ref() == Some(&cpu.name));
        let fits = |g: &&Gpu| {
            let form = g.form == cpu.form || cpu.form == Form::Server && g.form == Form::Desktop;
            g.card.is_some() && form && g.year.abs_diff(cpu.year) <= MOST_YEARS
        };
        let cards: Vec<&Gpu> = gpus.iter().filter(fits).collect();
        let mut random = Random::named(seed, &[&cpu.name, "GPUs", &again.to_string()]);
        let many = match (random.uniform(), inside) {
            _ if cards.is_empty() => 0,
            // A laptop has room for one card.
            (draw, _) if cpu.form == Form::Laptop => usize::from(draw >= 0.5),
            (draw, Some(_)) => usize::from(draw >= 0.5),
            (draw, None) => usize::from(draw >= 0.25) + usize::from(draw >= 0.75),
        };
        let card = cards.get((random.uniform() * cards.len() as f64) as usize);
        let gpus = card.into_iter().cycle().take(many).copied().chain(inside).collect();
        Self { cpu, gpus }
    }

    /// Parts as the name of a file.
    pub(super) fn name(&self) -> String {
        let words: Vec<String> = match &self.gpus[..] {
            [] => vec![slug(&self.cpu.name), "no-gpu".to_owned()],
            [one, two] if one.name == two.name => vec![slug(&self.cpu.name), "2x".to_owned(), slug(&one.name)],
            gpus => [&self.cpu.name].into_iter().chain(gpus.iter().map(|g| &g.name)).map(|n| slug(n)).collect(),
        };
        format!("simulated-{}", words.join("-"))
    }

    /// An id that no measured machine has: those are hashes of what a CPU says of itself.
    pub(super) fn physical_id(&self) -> String {
        let parts = self.gpus.iter().map(|g| g.name.as_str());
        let words: Vec<&str> = ["simulated", &self.cpu.name].into_iter().chain(parts).collect();
        format!("{:016x}", Random::named(0, &words).bits())
    }
}

/// Letters and digits in lower case, with dashes for everything between.
fn slug(name: &str) -> String {
    let lower = name.to_lowercase().replace('+', " plus ");
    let words = lower.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    words.collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests {
    use super::super::specification::built_in;
    use super::*;

    #[test]
    fn machines_differ_and_each_cpu_comes_once_before_any_comes_twice() {
        let specifications = built_in().unwrap();
        let many = specifications.cpus.len();
        let builds = builds(&specifications, many + 5, 1).unwrap();
        let unique = |texts: Vec<String>| texts.iter().collect::<std::collections::BTreeSet<_>>().len();
        assert_eq!(unique(builds.iter().map(Build::name).collect()), many + 5);
        assert_eq!(unique(builds.iter().map(Build::physical_id).collect()), many + 5);
        assert_eq!(unique(builds[..many].iter().map(|b| b.cpu.name.clone()).collect()), many);
        let with = |count| builds.iter().filter(|b| b.gpus.len() == count).count();
        assert!([0, 1, 2].into_iter().all(|k| with(k) >= 5), "{:?}", [0, 1, 2].map(with));
    }

    #[test]
    fn parts_of_one_machine_fit_together() {
        let specifications = built_in().unwrap();
        for build in builds(&specifications, 60, 7).unwrap() {
            for gpu in &build.gpus {
                match &gpu.inside {
                    Some(cpu) => assert_eq!(*cpu, build.cpu.name),
                    None => {
                        assert!(gpu.year.abs_diff(build.cpu.year) <= 3 && build.cpu.form != Form::Board, "{build:?}")
                    }
                }
            }
            assert!(build.gpus.len() <= 2 && build.gpus.is_sorted_by_key(|g| g.inside.is_some()), "{build:?}");
        }
    }

    #[test]
    fn more_machines_than_there_can_be_are_refused() {
        let mut specifications = built_in().unwrap();
        specifications.cpus.truncate(2);
        specifications.gpus.clear();
        let error = builds(&specifications, 3, 1).unwrap_err().to_string();
        assert!(error.contains("2 different machines"), "{error}");
    }

    #[test]
    fn names_of_files_are_plain() {
        assert_eq!(slug("Xeon Platinum 8480+"), "xeon-platinum-8480-plus");
        assert_eq!(slug("Radeon Graphics (Ryzen 7 4800U)"), "radeon-graphics-ryzen-7-4800u");
    }
}
