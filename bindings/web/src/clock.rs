//! The browser's clock.

use std::time::Duration;
use wasm_bindgen::prelude::*;

/// Readings until the clock counts as coarse: some milliseconds.
const MOST_READINGS: u32 = 100_000;

/// Ticks to watch. The first begins anywhere between two.
const TICKS: usize = 8;

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
    let (mut last, mut ticks) = (milliseconds(), Vec::new());
    for _ in 0..MOST_READINGS {
        let now = milliseconds();
        if now > last {
            ticks.push(now - last);
            last = now;
            // Of a coarse clock two are enough.
            if ticks.len() > TICKS || ticks.len() > 1 && ticks.iter().sum::<f64>() > 1.0 {
                break;
            }
        }
    }
    ticks.into_iter().skip(1).reduce(f64::min).unwrap_or(COARSEST_MS)
}
