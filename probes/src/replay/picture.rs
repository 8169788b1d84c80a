//! A replay as the plain data that a picture is drawn from.

use super::outcome::Outcome;
use super::settings::ReplaySettings;
use sapwise_lab::figures::ReplayPicture;

/// What the picture of a replay shows.
pub(crate) fn picture(settings: &ReplaySettings, outcome: &Outcome) -> ReplayPicture {
    let frames = &outcome.frames;
    let taken = outcome.last_taken();
    ReplayPicture {
        name: settings.source.name().to_owned(),
        algorithms: outcome.fixed.clone(),
        fixed_ns: (0..outcome.fixed.len()).map(|k| frames.iter().map(|f| f.fixed_ns[k]).collect()).collect(),
        adaptive_ns: frames.iter().map(|f| f.adaptive_ns).collect(),
        objects: frames.iter().map(|f| f.objects).collect(),
        ran: taken.iter().map(|t| t.chosen).collect(),
        explored: taken.iter().map(|t| t.explored).collect(),
        switches: outcome.switches(),
        co_runner_from: settings.co_runner.map(|c| c.from_frame),
    }
}
