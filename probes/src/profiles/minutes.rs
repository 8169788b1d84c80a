//! Times of minutes and hours.

use std::time::Duration;

/// A time with the unit that suits it.
pub(super) fn minutes(time: Duration) -> String {
    match time.as_secs() {
        seconds @ 0..100 => format!("{seconds} s"),
        seconds @ 100..6000 => format!("{} min", seconds.div_ceil(60)),
        seconds => format!("{} h {:02} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_unit_that_suits_them() {
        let told = [0, 99, 100, 5999, 6000, 7325].map(|s| minutes(Duration::from_secs(s)));
        assert_eq!(told, ["0 s", "99 s", "2 min", "100 min", "1 h 40 min", "2 h 02 min"]);
    }
}
