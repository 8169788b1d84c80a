//! Samples on this machine, taken in a process of its own.

use super::request::{Reply, SampleRequest, Session};
use crate::child::{Dialogue, Ended};
use crate::gpus::uses;
use crate::output;
use crate::progress::Progress;
use anyhow::Context;
use sapwise::measure::Watch;
use sapwise::{AlgorithmId, Load};
use sapwise_lab::belief::{Answer, Effort, IncrementalMethods, SECONDS, Sample, Source};
use std::time::{Duration, Instant};

/// Opening GPUs takes seconds where a driver compiles on its first start. Without any the process is there at once.
const OPENING: Duration = Duration::from_secs(30);

/// Time that is kept for the answer when a sample may take all that is left.
const ANSWERING: f64 = 0.05;

/// This machine. All samples take [`SECONDS`] at most from the first one on.
pub(crate) struct Live {
    session: Session,
    dialogue: Option<Dialogue>,
    incremental: IncrementalMethods,
    /// When the time is over; `None` before the first sample.
    end: Option<Instant>,
    /// Share of the CPU that other programs take, by the latest figure.
    foreign_load: Option<f64>,
    /// What the user should know.
    remarks: Vec<String>,
    /// Whether an algorithm returned a wrong answer.
    wrong: bool,
    /// Of the milliseconds that all samples take at most.
    progress: Progress,
}

impl Live {
    /// `foreign_load` is what other programs took before, which is taken to go on until a figure of the samples is there.
    pub(crate) fn new(session: Session, foreign_load: Option<f64>) -> Self {
        let incremental = IncrementalMethods::find();
        let progress = Progress::new((SECONDS * 1e3) as u64);
        progress.message(if session.gpus.is_empty() { "samples" } else { "opening GPUs for samples" });
        Self {
            session,
            dialogue: None,
            incremental,
            end: None,
            foreign_load,
            remarks: Vec::new(),
            wrong: false,
            progress,
        }
    }

    /// What the user should know of how the samples were taken, and whether an algorithm returned a wrong answer.
    pub(crate) fn remarks(mut self) -> (Vec<String>, bool) {
        if let Some(load) = self.foreign_load.filter(|&load| load > Watch::SPOILING) {
            self.remarks.push(format!(
                "other programs took {:.0} % of the CPU while samples were taken; predict again when the machine is idle",
                load * 100.0
            ));
        }
        (self.remarks, self.wrong)
    }

    fn left(&self) -> Duration {
        self.end.map_or(Duration::from_secs_f64(SECONDS), |end| end.saturating_duration_since(Instant::now()))
    }

    /// A process that is ready, or how the last one ended. One that ends before it is ready costs all GPUs: without them nothing
    /// is done before that.
    fn ready(&mut self) -> anyhow::Result<Result<Dialogue, Ended>> {
        if let Some(dialogue) = self.dialogue.take() {
            return Ok(Ok(dialogue));
        }
        loop {
            let limit = if self.end.is_none() && !self.session.gpus.is_empty() { OPENING } else { self.left() };
            let mut dialogue = Dialogue::begin(&["samples", &serde_json::to_string(&self.session)?])?;
            let ready = dialogue.listen(limit, |line| match serde_json::from_str(line) {
                Ok(Reply::Ready(remarks)) => Some(remarks),
                // Drivers print what they like on the standard output of whoever loads them.
                _ => None,
            })?;
            match ready {
                Ok(remarks) => {
                    self.remarks.extend(remarks);
                    return Ok(Ok(dialogue));
                }
                Err(Ended::Badly(how)) if !self.session.gpus.is_empty() => {
                    self.remarks.push(format!("no sample was taken on a GPU: the process that opened them {how}"));
                    self.session.gpus.clear();
                }
                Err(ended) => return Ok(Err(ended)),
            }
        }
    }

    /// What is left without these GPUs.
    fn lose(&mut self, gpus: &[u32]) {
        self.session.gpus.retain(|g| !gpus.contains(&g.index));
    }

    fn answer(&mut self, reply: Reply, algorithm: &AlgorithmId, load: &Load, seconds: f64) -> Answer {
        match reply {
            Reply::Taken { ns, noise_ln, foreign_load } => {
                self.foreign_load = foreign_load.or(self.foreign_load);
                // Whoever takes a share of the CPU may have made a frame longer by as much.
                let noise_ln = noise_ln.hypot(self.foreign_load.unwrap_or(0.0));
                Answer::Taken(Sample { load: *load, ns, noise_ln, seconds })
            }
            Reply::Failed { why, wrong } => {
                if wrong {
                    output::complain(&format!("WRONG ANSWER: {algorithm} at {} objects: {why}", load.objects));
                    self.wrong = true;
                }
                Answer::Failed { why, gpus: Vec::new() }
            }
            Reply::TooSlow | Reply::Ready(_) => Answer::Skipped,
        }
    }
}

impl Source for Live {
    fn effort(&self, algorithm: &AlgorithmId, load: &Load) -> Option<Effort> {
        let there = uses(algorithm).iter().all(|k| self.session.gpus.iter().any(|g| g.index == *k));
        there.then(|| Effort { objects: load.objects, is_incremental: self.incremental.contain(algorithm) })
    }

    fn sample(&mut self, algorithm: &AlgorithmId, load: &Load) -> anyhow::Result<Answer> {
        let mut dialogue = match self.ready()? {
            Ok(dialogue) => dialogue,
            Err(Ended::Interrupted) => return Ok(Answer::Over),
            Err(ended) => {
                self.remarks.push(format!("no sample was taken: the process for them {}", told(&ended)));
                return Ok(Answer::Over);
            }
        };
        let began = Instant::now();
        self.end.get_or_insert(began + Duration::from_secs_f64(SECONDS));
        let left = self.left();
        self.progress.position((SECONDS * 1e3) as u64 - left.as_millis() as u64);
        self.progress.message(format!("sample: {algorithm} at {} objects", load.objects));
        let seconds = left.as_secs_f64() - ANSWERING;
        if seconds <= 0.0 {
            return Ok(Answer::Over);
        }
        let request =
            SampleRequest { algorithm: algorithm.clone(), objects: load.objects, pairs: load.pairs as u64, seconds };
        dialogue.tell(&serde_json::to_string(&request).context("a sample can't be asked for")?);
        let heard = dialogue.listen(left, |line| serde_json::from_str::<Reply>(line).ok())?;
        Ok(match heard {
            Ok(reply) => {
                self.dialogue = Some(dialogue);
                self.answer(reply, algorithm, load, began.elapsed().as_secs_f64())
            }
            Err(Ended::Interrupted) => Answer::Over,
            Err(_) if self.left().is_zero() && uses(algorithm).is_empty() => {
                self.remarks.push(format!("{algorithm} at {} objects took longer than all samples may", load.objects));
                Answer::Over
            }
            Err(ended) => {
                let gpus = uses(algorithm).to_vec();
                self.lose(&gpus);
                let why = format!("at {} objects its process {}", load.objects, told(&ended));
                Answer::Failed { why, gpus }
            }
        })
    }
}

fn told(ended: &Ended) -> &str {
    match ended {
        Ended::Well => "ended before its time",
        Ended::Interrupted => "was interrupted",
        Ended::Badly(how) => how,
    }
}
