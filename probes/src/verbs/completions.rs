//! `sapwise completions`: what a shell completes the command by.

use crate::args::{Arguments, Completions};
use crate::exit::Outcome;
use crate::output;
use anyhow::Context;
use clap::{Command, CommandFactory};

/// The name of the program, whatever a user's own calls itself: the shell looks it up by this.
const NAME: &str = "sapwise";

pub(crate) fn run(arguments: &Completions) -> anyhow::Result<Outcome> {
    output::print(&script(arguments)?)?;
    Ok(Outcome::Done)
}

fn script(arguments: &Completions) -> anyhow::Result<String> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut shown(&Arguments::command()).propagate_version(true), NAME, &mut script);
    String::from_utf8(script).context("the completions are no text")
}

/// The command without what is hidden, which the scripts would offer.
fn shown(command: &Command) -> Command {
    let copy = Command::new(command.get_name().to_owned())
        .about(command.get_about().cloned().unwrap_or_default())
        .args(command.get_arguments().filter(|arg| !arg.is_hide_set()).cloned())
        .subcommands(command.get_subcommands().filter(|verb| !verb.is_hide_set()).map(shown));
    match command.get_version() {
        Some(version) => copy.version(version.to_owned()),
        None => copy,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use clap_complete::Shell;
    use std::process::Command as Process;

    fn of(shell: Shell) -> String {
        script(&Completions { shell }).unwrap()
    }

    #[test]
    fn every_shell_completes_verbs_options_and_values_but_nothing_hidden() {
        for shell in Shell::value_variants() {
            let script = of(*shell);
            for offered in ["predict", "dry-run", "co-runner"] {
                assert!(script.contains(offered), "{shell} lacks {offered}");
            }
            for hidden in ["leashed", "unrestricted", "gpu-algorithms"] {
                assert!(!script.contains(hidden), "{shell} offers {hidden}");
            }
        }
        // These two complete the values of options, too.
        for shell in [Shell::Bash, Shell::Zsh] {
            let script = of(shell);
            for value in ["fragmentation", "grid-sap@cpu1", "cache"] {
                assert!(script.contains(value), "{shell} lacks {value}");
            }
        }
    }

    #[test]
    fn shells_that_are_there_take_their_script() {
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("script");
            std::fs::write(&path, of(shell)).unwrap();
            match Process::new(shell.to_string()).arg("-n").arg(&path).output() {
                Ok(ended) => assert!(ended.status.success(), "{shell}: {}", String::from_utf8_lossy(&ended.stderr)),
                Err(why) => eprintln!("the script for {shell} is not looked at: {why}"),
            }
        }
    }
}
