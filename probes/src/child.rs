//! Parts of a measurement, and whole measurements, in their own processes: a crash costs the part, not the run.

use crate::interrupt;
use anyhow::Context;
use serde::de::DeserializeOwned;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Interval of looking at the clock and for Ctrl-C.
const POLL: Duration = Duration::from_millis(50);

/// Time for a process that stops with this one to write its results. It ends its own parts at once.
const SAVING: Duration = Duration::from_secs(20);

/// The end of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Ended {
    /// With exit status 0.
    Well,
    /// By Ctrl-C, SIGTERM or SIGHUP.
    Interrupted,
    /// In any other way: "was ended by signal 11".
    Badly(String),
}

/// Runs `sapwise part ARGUMENTS` and hands each line that it prints to `on_line`, until it ends, `limit` is over or
/// the user interrupts.
///
/// # Errors
/// When the process can't be started, or `on_line` fails, which ends the process.
pub(crate) fn run_part(
    arguments: &[&str],
    limit: Duration,
    on_line: &mut dyn FnMut(&str) -> anyhow::Result<()>,
) -> anyhow::Result<Ended> {
    let mut command = own_program()?;
    run(command.arg("part").args(arguments), limit, Duration::ZERO, on_line, &mut || {})
}

/// Runs a part and returns the JSON values that it prints, one a line.
///
/// # Errors
/// When the process can't be started.
pub(crate) fn answers<T: DeserializeOwned>(arguments: &[&str], limit: Duration) -> anyhow::Result<(Vec<T>, Ended)> {
    let mut answers = Vec::new();
    let ended = run_part(arguments, limit, &mut |line| {
        // Drivers may print anything on the standard output of the process that loads them.
        answers.extend(serde_json::from_str::<T>(line));
        Ok(())
    })?;
    Ok((answers, ended))
}

/// Runs another `sapwise` with these arguments and environment variables, and calls `on_wait` over and over until it
/// ends. The arguments must include `--leashed`, so that it stops with this process.
///
/// # Errors
/// When the process can't be started.
pub(crate) fn run_verb(
    arguments: &[OsString],
    variables: &[(&str, String)],
    limit: Duration,
    on_wait: &mut dyn FnMut(),
) -> anyhow::Result<Ended> {
    let mut command = own_program()?;
    command.args(arguments).envs(variables.iter().map(|(name, value)| (name, value)));
    run(&mut command, limit, SAVING, &mut |_| Ok(()), on_wait)
}

/// Returns this program as a command: by its path, or by its name on a system that does not report the path, such as
/// Linux without `/proc`.
fn own_program() -> anyhow::Result<Command> {
    let path = std::env::current_exe().or_else(|error| std::env::args_os().next().map(Into::into).ok_or(error));
    Ok(Command::new(path.context("the program can't find itself")?))
}

fn run(
    command: &mut Command,
    limit: Duration,
    saving: Duration,
    on_line: &mut dyn FnMut(&str) -> anyhow::Result<()>,
    on_wait: &mut dyn FnMut(),
) -> anyhow::Result<Ended> {
    let child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("a part of the measurement can't be started as a process")?;
    let mut child = EndedOnDrop(child);
    // Open until the end: the part ends when this pipe closes, so it never outlives this process. Left in the child,
    // `wait` would close it too early.
    let leash = child.0.stdin.take();
    let complaints = child.0.stderr.take().map(last_line);
    let lines = child.0.stdout.take().map(lines);
    let end = Instant::now() + limit;
    let too_long = || Ended::Badly(format!("was stopped after {} s, which is too long", limit.as_secs()));
    while let Some(lines) = &lines {
        match lines.recv_timeout(POLL) {
            Ok(line) => on_line(&line)?,
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if interrupt::requested() {
            // A process that stops with this one gets time to write its results. Others are killed on drop.
            drop(leash);
            let end = Instant::now() + saving;
            while Instant::now() < end && !matches!(lines.recv_timeout(POLL), Err(RecvTimeoutError::Disconnected)) {}
            return Ok(Ended::Interrupted);
        }
        on_wait();
        if Instant::now() >= end {
            return Ok(too_long());
        }
    }
    // It closed its standard output, and may still hang.
    let status = loop {
        if let Some(status) = child.0.try_wait().context("a part of the measurement got lost")? {
            break status;
        }
        if interrupt::requested() {
            return Ok(Ended::Interrupted);
        }
        if Instant::now() >= end {
            return Ok(too_long());
        }
        std::thread::sleep(POLL);
    };
    let complaint = complaints.and_then(|c| c.join().ok()).unwrap_or_default();
    Ok(judge(status, &complaint))
}

/// Calls `act` when the pipe of the process that started this one closes.
pub(crate) fn when_parent_ends(act: impl FnOnce() + Send + 'static) {
    std::thread::spawn(|| {
        // The parent writes nothing, so this returns at the end only.
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        act();
    });
}

struct EndedOnDrop(Child);

impl Drop for EndedOnDrop {
    fn drop(&mut self) {
        // Both fail when it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Returns the lines of a source. A driver may print bytes that are no text.
fn texts(source: impl Read) -> impl Iterator<Item = String> {
    let lines = BufReader::new(source).split(b'\n').map_while(Result::ok);
    lines.map(|line| String::from_utf8_lossy(&line).trim_end_matches('\r').to_owned())
}

/// Returns lines as they come.
fn lines(source: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in texts(source) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

/// Returns the last line of standard error. Reads everything, because a full pipe would stop the part.
fn last_line(source: impl Read + Send + 'static) -> JoinHandle<String> {
    std::thread::spawn(move || texts(source).filter(|l| !l.trim().is_empty()).last().unwrap_or_default())
}

fn judge(status: ExitStatus, complaint: &str) -> Ended {
    if status.success() {
        return Ended::Well;
    }
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        // The terminal sends these to the part as well, which may end first.
        return if matches!(signal, 1 | 2 | 15) {
            Ended::Interrupted
        } else {
            Ended::Badly(format!("was ended by signal {signal}"))
        };
    }
    let status = status.code().map_or("no exit status".to_owned(), |c| format!("exit status {c}"));
    Ended::Badly(if complaint.is_empty() {
        format!("ended with {status}")
    } else {
        format!("ended with {status}: {complaint}")
    })
}
