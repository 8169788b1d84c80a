//! The browser's clock.

use std::time::Duration;
use wasm_bindgen::prelude::*;

/// Readings until the clock counts as coarse: some milliseconds.
const MOST_READINGS: u32 = 100_000;

/// Milliseconds to watch, and the fewest ticks. The first begins anywhere between two.
const WATCHED_MS: f64 = 1.0;
const FEWEST: usize = 2;

/// The tick of a clock that stood still meanwhile: that of a browser that hides the time.
const COARSEST_MS: f64 = 100.0;

#[wasm_bindgen]
extern "C" {
    /// Milliseconds since any moment.
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    pub(crate) fn milliseconds() -> f64;
}

/// Gives the clock to the library.
pub(crate) fn install() {
    sapwise::set_clock(now, duration(tick_ms()));
}

fn now() -> Duration {
    duration(milliseconds())
}

fn duration(ms: f64) -> Duration {
    Duration::from_nanos((ms * 1e6) as u64)
}

/// Returns the least difference of two readings in milliseconds. Pages that are not cross-origin isolated get a clock
/// that ticks every 0.1 ms or every millisecond.
pub(crate) fn tick_ms() -> f64 {
    let began = milliseconds();
    let (mut last, mut ticks, mut least) = (began, 0, COARSEST_MS);
    for _ in 0..MOST_READINGS {
        let now = milliseconds();
        if now > last {
            ticks += 1;
            if ticks >= FEWEST {
                least = least.min(now - last);
                if now - began > WATCHED_MS {
                    break;
                }
            }
            last = now;
        }
    }
    least
}
