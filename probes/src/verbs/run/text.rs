//! What a person reads at the end of a run.

use super::answer::{Answer, Figures, LeftOut, Oracle, Slowed};
use super::tuning::{Origin, OriginKind};
use crate::args::{Run, Scene};
use crate::replay::WINDOW;
use crate::shell;
use crate::terminal::Terminal;
use sapwise_lab::text::{count, duration, grouped, grouped_count};
use std::path::Path;

/// Totals, figures, what there is to say about them, and what to do next.
pub(super) fn text(arguments: &Run, answer: &Answer<'_>, origin: &Origin, terminal: Terminal) -> String {
    let head = format!(
        "{}, {} of {}, medians of {}, verified against each other",
        answer.scenario,
        count(answer.frames, "frame"),
        extent(answer),
        count(answer.repeats, "repeat")
    );
    let mut text = format!("{}\n", terminal.head(&head));
    text += &format!("Tuning: {}. {}\n\n", origin.text(), learning(answer));
    text += &totals(answer, terminal);
    for (id, LeftOut { after_frame, frames, at_least_ms }) in &answer.left_out {
        let after = after_frame.map_or("from the first on".to_owned(), |frame| format!("after frame {frame}"));
        let missing = count(*frames, "frame");
        text += &format!(
            "{id} was not timed in {missing} {after}, because it failed or was far slower than the best; {} in the others\n",
            duration(at_least_ms * 1e6)
        );
    }
    text += &format!("\n{}\n", figures(answer, terminal));
    text += &comparisons(answer);
    if let Some(slowed) = &answer.co_runner {
        text += &format!("\n{}", co_runner(slowed));
    }
    if let Some(load) = answer.foreign_load {
        text += &format!("\nOther programs took {:.0} % of the CPU, median over the frames.", load * 100.0);
    }
    for warning in &answer.warnings {
        text += &format!("\n{} {warning}", terminal.warning("warning:"));
    }
    if answer.interrupted {
        text += &format!("\n{} only complete repeats are shown.", terminal.warning("Interrupted:"));
    }
    for (verb, path) in [("Recorded", &arguments.record), ("Traced", &arguments.trace), ("Drawn", &arguments.plot)] {
        text += &path.as_ref().map(|p| format!("\n{verb} in {}.", p.display())).unwrap_or_default();
    }
    text + &format!("\nNext: {}", next_step(arguments, origin))
}

/// The next command to try.
fn next_step(arguments: &Run, origin: &Origin) -> String {
    let scene = match &arguments.scene {
        Scene::Scenario(scenario) => scenario.to_string(),
        Scene::Stream(path) => shell::path(path),
    };
    match (origin.from, &arguments.plot) {
        (_, None) => shell::again(&["--plot", "run.svg"]),
        (OriginKind::Prediction, _) => "sapwise probe --out report.json".to_owned(),
        (_, Some(_)) => format!("sapwise run {scene}"),
    }
}

/// What stands below the picture: the figures, where the tuning comes from, and the command that makes it again.
pub(super) fn caption(arguments: &Run, answer: &Answer<'_>, origin: &Origin) -> Vec<String> {
    let Figures { switches, explored, .. } = answer.figures;
    let name = answer.scenario;
    vec![
        format!(
            "{name}: regret {}; {switches} switch{}, {} explored; times over {}, decisions of the last",
            spread(&answer.figures),
            if switches == 1 { "" } else { "es" },
            count(explored, "frame"),
            count(answer.repeats, "repeat")
        ),
        format!("Tuning: {}. {}", origin.text(), learning(answer)),
        format!("Made by: {}", command(arguments)),
    ]
}

fn extent(answer: &Answer<'_>) -> String {
    let (least, most) = (answer.objects.min, answer.objects.max);
    let most_of_them = grouped_count(most, "object");
    if least == most { most_of_them } else { format!("{} to {most_of_them}", grouped(least as u64)) }
}

fn learning(answer: &Answer<'_>) -> &'static str {
    match (answer.learning, answer.exploring) {
        (true, true) => "Learning and exploring.",
        (true, false) => "Learning, without exploring.",
        (false, _) => "Without learning.",
    }
}

/// What each algorithm takes, and in how many frames of the last repeat it ran.
fn totals(answer: &Answer<'_>, terminal: Terminal) -> String {
    let oracle = answer.total_ms.oracle;
    let row = |name: &str, ms: Option<f64>, frames: String| {
        let ratio = ms.map_or("-".to_owned(), |ms| format!("{:.3}", ms / oracle));
        vec![name.to_owned(), ms.map_or("-".to_owned(), |ms| duration(ms * 1e6)), ratio, frames]
    };
    let mut names: Vec<(&String, Option<f64>)> = answer.total_ms.fixed.iter().map(|(id, ms)| (id, Some(*ms))).collect();
    names.extend(answer.left_out.keys().map(|id| (id, None)));
    let total = |ms: Option<f64>| ms.unwrap_or(f64::INFINITY);
    names.sort_by(|a, b| total(a.1).total_cmp(&total(b.1)));
    let mut rows =
        vec![["run by", "total", "over the oracle", "adaptive ran it in (last repeat)"].map(str::to_owned).to_vec()];
    rows.push(row("oracle (best at every frame)", Some(oracle), String::new()));
    rows.push(row("adaptive", Some(answer.total_ms.adaptive), String::new()));
    rows.extend(names.into_iter().map(|(id, ms)| {
        let ran = answer.frames_run.get(id).copied().unwrap_or(0);
        row(id, ms, count(ran, "frame"))
    }));
    terminal.table(&rows)
}

/// The figures of all frames and of each segment.
fn figures(answer: &Answer<'_>, terminal: Terminal) -> String {
    let head = [
        "frames",
        "regret",
        "median of repeats",
        "their quartiles",
        "vs windows",
        "switches",
        "frames explored",
        "worst frame",
    ];
    let row = |frames: String, f: &Figures| {
        let quartiles = f.regret_quartiles.map_or("-".to_owned(), |[a, b]| format!("{} to {}", percent(a), percent(b)));
        let worst = f.worst_frame.zip(f.worst_frame_at);
        let worst = worst.map_or("-".to_owned(), |(ratio, at)| format!("{ratio:.2} times the oracle's, frame {at}"));
        vec![
            frames,
            percent(f.regret),
            f.regret_median.map_or("-".to_owned(), percent),
            quartiles,
            percent(f.window_regret),
            f.switches.to_string(),
            f.explored.to_string(),
            worst,
        ]
    };
    let mut rows = vec![head.map(str::to_owned).to_vec(), row("all".to_owned(), &answer.figures)];
    rows.extend(answer.parts.iter().map(|p| row(format!("{} to {}", p.from_frame, p.to_frame), &p.figures)));
    terminal.table(&rows)
}

/// A regret with the spread of the repeats.
fn spread(figures: &Figures) -> String {
    let repeats = figures.regret_median.zip(figures.regret_quartiles);
    let repeats = repeats.map_or(String::new(), |(median, [low, high])| {
        format!(" (single repeats: median {}, quartiles {} to {})", percent(median), percent(low), percent(high))
    });
    percent(figures.regret) + &repeats
}

/// A sentence where the regret lies outside of the quartiles of the repeats.
fn outside(figures: &Figures) -> Option<String> {
    let [low, high] = figures.regret_quartiles?;
    (figures.regret < low || figures.regret > high).then(|| {
        "The regret lies outside the quartiles of the repeats: it is computed from times over all repeats, theirs from single noisy samples. \
         More --repeats bring the two together."
            .to_owned()
    })
}

fn comparisons(answer: &Answer<'_>) -> String {
    let mut lines = Vec::new();
    if !answer.best_fixed.is_empty() {
        lines.push(format!(
            "Adaptive takes {:.3} of the time of the best fixed, {}.",
            answer.over_best_fixed, answer.best_fixed
        ));
    }
    lines.push(
        "Regret is the time of the adaptive choice over that of an oracle, less one. The oracle runs the best algorithm of every frame.".to_owned(),
    );
    lines.push(format!(
        "Vs windows: the oracle runs one algorithm for {WINDOW} frames at a time. An incremental algorithm rebuilds its data now and then, and an \
         oracle\nthat chooses for each frame alone avoids the frames of the rebuild, which no real choice can."
    ));
    lines.push(match answer.oracle {
        Oracle::Halves => "The oracle chooses on one half of the repeats and is timed on the other.".to_owned(),
        Oracle::Optimistic => {
            "One repeat: the oracle takes the minimum of every frame, which is biased by noise; two or more --repeats remove that bias.".to_owned()
        }
    });
    lines.extend(outside(&answer.figures));
    lines.join("\n")
}

fn co_runner(slowed: &Slowed) -> String {
    let reached = match slowed.slowdown {
        Some(ratio) => format!("a loop beside the frames then took {ratio:.2} times as long"),
        None => "no frame ran before it to compare with".to_owned(),
    };
    let threads = count(slowed.threads as usize, "thread");
    format!("From frame {} on {threads} ran beside it: {reached}.", slowed.from_frame)
}

fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}

/// The command that makes the picture again, without folders, which are of this machine alone.
fn command(arguments: &Run) -> String {
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut words = vec!["sapwise run".to_owned()];
    words.push(match &arguments.scene {
        Scene::Scenario(scenario) => scenario.to_string(),
        Scene::Stream(path) => name(path),
    });
    words.extend(arguments.tuning.as_deref().map(|path| format!("--tuning {}", name(path))));
    words.extend(arguments.objects.map(|n| format!("--objects {n}")));
    words.extend(arguments.swing.map(|least| format!("--swing {least}")));
    words.extend(arguments.frames.map(|n| format!("--frames {n}")));
    words.push(format!("--repeats {} --seed {}", arguments.repeats, arguments.seed));
    words.extend(arguments.co_runner.map(|c| format!("--co-runner {c}")));
    for (flag, given) in [("--no-learning", arguments.no_learning), ("--no-exploring", arguments.no_exploring)] {
        words.extend(given.then(|| flag.to_owned()));
    }
    for (flag, given) in [("--no-gpus", arguments.gpus.no_gpus), ("--software-gpus", arguments.gpus.software_gpus)] {
        words.extend(given.then(|| flag.to_owned()));
    }
    words.extend(arguments.gpus.only.iter().map(|gpu| format!("--gpu {gpu}")));
    words.extend(arguments.plot.as_deref().map(|path| format!("--plot {}", name(path))));
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Arguments, Verb};
    use clap::Parser;

    #[test]
    fn the_command_below_a_picture_makes_it_again() {
        let said = |words: &str| match Arguments::parse_from(words.split(' ')).verb {
            Verb::Run(run) => command(&run),
            _ => panic!("another verb"),
        };
        for words in [
            "sapwise run slab --repeats 6 --seed 1",
            "sapwise run uniform --tuning t.json --objects 9 --swing 3 --frames 7 --repeats 2 --seed 4 --no-gpus",
            "sapwise run s.npy --repeats 1 --seed 1 --co-runner 3:2 --no-learning --no-exploring --plot p.svg",
            "sapwise run mixed --repeats 6 --seed 1 --gpu 0 --gpu 2 --plot p.svg",
        ] {
            assert_eq!(said(words), words);
        }
        let named = said("sapwise run /a/s.npy --tuning /b/t.json --plot c/p.svg");
        assert_eq!(named, "sapwise run s.npy --tuning t.json --repeats 6 --seed 1 --plot p.svg");
    }
}
