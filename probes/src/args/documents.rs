//! Tests that this program understands the commands in the documents and in its own help.

use super::Arguments;
use clap::{CommandFactory, Parser};

const DOCUMENTS: [(&str, &str); 10] = [
    ("README.md", include_str!("../../../README.md")),
    ("CONTRIBUTING.md", include_str!("../../../CONTRIBUTING.md")),
    ("datasets/README.md", include_str!("../../../datasets/README.md")),
    ("docs/fleet.md", include_str!("../../../docs/fleet.md")),
    ("docs/guide.md", include_str!("../../../docs/guide.md")),
    ("docs/python.md", include_str!("../../../docs/python.md")),
    ("docs/measuring.md", include_str!("../../../docs/measuring.md")),
    ("docs/methodology.md", include_str!("../../../docs/methodology.md")),
    ("docs/limitations.md", include_str!("../../../docs/limitations.md")),
    ("BENCHMARKS.md", include_str!("../../../BENCHMARKS.md")),
];

/// How shell lines call this program. `own` is the example of a program with its own algorithm.
const CALLS: [&str; 5] = [
    "cargo run --release -p sapwise-cli -- ",
    "cargo run --release -p sapwise-cli --example own_algorithm -- ",
    "cargo run --release -- ",
    "sapwise ",
    "own ",
];

/// Returns the arguments of a shell line that calls this program.
fn arguments(line: &str) -> Option<Vec<&str>> {
    let words = CALLS.iter().find_map(|call| line.trim_start().strip_prefix(call))?;
    let words = words.split([';', '|', '>', '&']).next()?.split("  #").next()?;
    Some(std::iter::once("sapwise").chain(words.split_whitespace()).collect())
}

/// Returns the lines of `sh` fences, and the code between backquotes outside of fences.
fn lines(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (k, part) in text.split("```").enumerate() {
        match part.strip_prefix("sh\n") {
            Some(shell) if k % 2 == 1 => found.extend(shell.lines()),
            _ if k % 2 == 0 => found.extend(
                part.split('`').skip(1).step_by(2).filter(|code| code.contains(" --") && !code.contains("--help")),
            ),
            _ => {}
        }
    }
    found
}

#[test]
fn every_command_of_the_documents_and_of_the_help_is_understood() {
    let helps = Arguments::command();
    let helps = helps.get_subcommands().filter_map(|verb| verb.get_after_help());
    let helps: String = helps.map(|help| format!("```sh\n{help}\n```\n")).collect();
    let mut counts = Vec::new();
    for (name, text) in DOCUMENTS.into_iter().chain([("--help", &*helps)]) {
        let commands = lines(text).into_iter().filter_map(arguments).filter(|words| *words != ["sapwise", "VERB"]);
        let understood = commands.inspect(|words| {
            let parsed = Arguments::try_parse_from(words);
            assert!(parsed.is_ok(), "{name}: {}: {}", words.join(" "), parsed.unwrap_err());
        });
        counts.push(understood.count());
    }
    let [documents @ .., helps] = &counts[..] else { panic!("no text") };
    assert!(documents.iter().sum::<usize>() >= 40 && *helps >= 15, "{counts:?}");
}
