//! Axes: where a value is, and which numbers stand beside it.

use super::font;
use super::style::{LABEL, line_height};

/// Values beyond these are drawn at the edge: nothing that is measured has them, and powers of them overflow.
const LEAST: f64 = 1e-30;
const MOST: f64 = 1e30;
/// How many times its low end the high end of a logarithmic axis is at least: with less there may be one number only beside it.
const NARROWEST: f64 = 5.0;

/// A range of values from the left or from below.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
    /// Instead of numbers.
    names: Option<Vec<Tick>>,
}

/// A number beside an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

/// How an axis lies, which says how many numbers have room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lies {
    Flat,
    Upright,
}

impl Axis {
    /// A logarithmic axis for all of these values that are finite and over zero, with this factor of room on both ends.
    pub(super) fn log(values: impl IntoIterator<Item = f64>, room: f64) -> Self {
        let shown = values.into_iter().filter(|v| v.is_finite() && *v > 0.0).map(|v| v.clamp(LEAST, MOST));
        let (low, high) = shown.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
        let (low, high) = if low > high { (1.0, 10.0) } else { (low / room, high * room) };
        let wider = (NARROWEST / (high / low)).sqrt().max(1.0);
        Self { low: low / wider, high: high * wider, logarithmic: true, names: None }
    }

    /// The same logarithmic axis with that share of it more at each end.
    pub(super) fn wider(self, share: f64) -> Self {
        let factor = (self.high / self.low).powf(share);
        Self { low: self.low / factor, high: self.high * factor, ..self }
    }

    /// A linear axis between these values.
    pub(super) fn linear(low: f64, high: f64) -> Self {
        let sound = low.is_finite() && high.is_finite() && low < high && high - low <= MOST;
        let (low, high) = if sound { (low, high) } else { (0.0, 1.0) };
        Self { low, high, logarithmic: false, names: None }
    }

    /// The same range with these words beside it, as far as they have room.
    pub(super) fn with_names(self, names: Vec<Tick>) -> Self {
        Self { names: Some(names), ..self }
    }

    pub(super) fn ends(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// The share of the axis below a value, from 0 to 1. `None` for no number and, on a logarithmic axis, for what is not over zero.
    pub(super) fn share(&self, value: f64) -> Option<f64> {
        if value.is_nan() || (self.logarithmic && value <= 0.0) {
            return None;
        }
        let value = value.clamp(self.low, self.high);
        Some(if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        })
    }

    /// The same for the end of a bar or a field: what is below every value of the axis is at its low end.
    pub(super) fn end(&self, value: f64) -> Option<f64> {
        if value.is_nan() { None } else { Some(self.share(value).unwrap_or(0.0)) }
    }

    /// As many numbers as fit on that length.
    pub(super) fn ticks(&self, length: i32, lies: Lies) -> Vec<Tick> {
        if let Some(names) = &self.names {
            let mut kept: Vec<Tick> = Vec::new();
            for name in names {
                kept.push(name.clone());
                // One that has no room beside the last one is left away.
                if !self.fit(&kept[kept.len().saturating_sub(2)..], length, lies) {
                    kept.pop();
                }
            }
            return kept;
        }
        let mut coarser = 0;
        loop {
            let ticks = if self.logarithmic { self.decades(coarser) } else { self.steps(coarser) };
            if ticks.len() <= 1 || self.fit(&ticks, length, lies) {
                return ticks;
            }
            coarser += 1;
        }
    }

    fn fit(&self, ticks: &[Tick], length: i32, lies: Lies) -> bool {
        let place = |tick: &Tick| self.share(tick.value).unwrap_or(0.0) * f64::from(length);
        let needs = |tick: &Tick| match lies {
            Lies::Flat => font::width(&tick.label, LABEL) + 12,
            Lies::Upright => line_height(LABEL) + 4,
        };
        let apart =
            |pair: &[Tick]| place(&pair[1]) - place(&pair[0]) >= f64::from(needs(&pair[0]) + needs(&pair[1])) / 2.0;
        ticks.windows(2).all(apart)
    }

    /// 1, 2 and 5 of each decade; or decades, then every second one, and so on.
    fn decades(&self, coarser: i32) -> Vec<Tick> {
        let digits: &[f64] = if coarser == 0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let every = coarser.max(1);
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let values =
            (first..=last).filter(|k| k.rem_euclid(every) == 0).flat_map(|k| digits.iter().map(move |d| (*d, k)));
        // A power with a negative exponent is not the nearest number, and would be written with all its digits.
        let values = values.map(|(d, k)| if k < 0 { d / 10_f64.powi(-k) } else { d * 10_f64.powi(k) });
        self.ticks_at(values)
    }

    /// Multiples of 1, 2 or 5 of a decade, ten of them at most.
    fn steps(&self, coarser: i32) -> Vec<Tick> {
        let least = (self.high - self.low) / 10.0;
        let decade = least.log10().floor() as i32;
        let steps = [1.0, 2.0, 5.0];
        let candidates = (0..).map(|k: i32| (steps[k as usize % 3], decade + k / 3));
        let mut wide = candidates.skip_while(|&(d, k)| d * 10_f64.powi(k) < least * (1.0 - 1e-9));
        let Some((digit, exponent)) = wide.nth(coarser as usize) else { return Vec::new() };
        let step = digit * 10_f64.powi(exponent);
        let (first, last) = ((self.low / step).ceil(), (self.high / step).floor());
        let count = (last - first).clamp(0.0, 100.0) as i32;
        // As above.
        let value = |k: i32| {
            let times = (first + f64::from(k)) * digit;
            if exponent < 0 { times / 10_f64.powi(-exponent) } else { times * 10_f64.powi(exponent) }
        };
        self.ticks_at((0..=count).map(value))
    }

    fn ticks_at(&self, values: impl Iterator<Item = f64>) -> Vec<Tick> {
        let inside = values.filter(|v| *v >= self.low && *v <= self.high);
        inside.map(|value| Tick { value, label: number(value) }).collect()
    }
}

/// A number in as few letters as it needs, without an exponent where that is short.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    let scaled = |unit: f64, name: &str| format!("{}{name}", rounded(value / unit));
    match size {
        _ if size == 0.0 => "0".to_owned(),
        _ if !value.is_finite() || !(1e-4..1e15).contains(&size) => format!("{value:.1e}").replace(".0e", "e"),
        _ if size < 1e4 => rounded(value),
        _ if size < 1e6 => scaled(1e3, "k"),
        _ if size < 1e9 => scaled(1e6, "M"),
        _ if size < 1e12 => scaled(1e9, "G"),
        _ => scaled(1e12, "T"),
    }
}

/// Three digits that count, without zeros at the end of a fraction; whole numbers keep theirs.
fn rounded(value: f64) -> String {
    let whole = value.abs().log10().floor() as i32 + 1;
    let text = format!("{value:.*}", (3 - whole).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A unit of time that leaves numbers short, with its length in nanoseconds: that of the middle of the values.
pub(super) fn time_unit(ns: impl IntoIterator<Item = f64>) -> (&'static str, f64) {
    let logarithms: Vec<f64> = ns.into_iter().filter(|v| v.is_finite() && *v > 0.0).map(f64::ln).collect();
    let low = logarithms.iter().copied().fold(f64::INFINITY, f64::min);
    let high = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let middle = if low > high { 1e3 } else { ((low + high) / 2.0).exp() };
    match middle {
        m if m < 1e3 => ("ns", 1.0),
        m if m < 1e6 => ("us", 1e3),
        m if m < 1e9 => ("ms", 1e6),
        _ => ("s", 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, length: i32, lies: Lies) -> Vec<String> {
        axis.ticks(length, lies).into_iter().map(|t| t.label).collect()
    }

    #[test]
    fn numbers_are_short() {
        let numbers = [0.0, 0.02, 0.1, 1.0, 2.5, 50.0, 1000.0, 5000.0, 1e4, 2.5e5, 1e6, 2e9, 1e12, 1e15, 1e-7, -20.0];
        let expected = [
            "0", "0.02", "0.1", "1", "2.5", "50", "1000", "5000", "10k", "250k", "1M", "2G", "1T", "1e15", "1e-7",
            "-20",
        ];
        assert_eq!(numbers.map(number), expected);
    }

    #[test]
    fn labels_become_fewer_where_there_is_no_room() {
        let axis = Axis::log([10.0, 1e6], 1.0);
        assert_eq!(labels(&axis, 900, Lies::Flat)[..5], ["10", "20", "50", "100", "200"]);
        assert_eq!(labels(&axis, 400, Lies::Flat), ["10", "100", "1000", "10k", "100k", "1M"]);
        assert_eq!(labels(&axis, 150, Lies::Flat), ["100", "10k", "1M"]);
        let linear = Axis::linear(0.0, 600.0);
        assert_eq!(labels(&linear, 600, Lies::Flat), ["0", "100", "200", "300", "400", "500", "600"]);
        assert_eq!(labels(&linear, 60, Lies::Upright), ["0", "500"]);
        assert_eq!(labels(&Axis::linear(0.0, 0.5), 600, Lies::Flat)[..3], ["0", "0.05", "0.1"]);
    }

    #[test]
    fn every_range_has_an_axis() {
        let ranges: [&[f64]; 9] = [
            &[],
            &[f64::NAN, f64::INFINITY],
            &[0.0, -3.0],
            &[7.0],
            &[7.0, 7.000001],
            &[1e12],
            &[1e-12, 1e12],
            &[f64::MIN_POSITIVE, f64::MAX],
            &[2.1, 10.4],
        ];
        for values in ranges {
            let axis = Axis::log(values.iter().copied(), 1.2);
            for (length, lies) in [(300, Lies::Flat), (300, Lies::Upright), (10, Lies::Flat)] {
                let ticks = axis.ticks(length, lies);
                assert!(length == 10 || ticks.len() >= 2, "{values:?} {ticks:?}");
            }
            for value in values.iter().filter(|v| **v > 0.0) {
                assert!((0.0..=1.0).contains(&axis.share(*value).unwrap()));
            }
            assert_eq!((axis.share(f64::NAN), axis.share(0.0), axis.end(0.0)), (None, None, Some(0.0)));
        }
        for (low, high) in [(0.0, 0.0), (f64::NAN, 1.0), (3.0, 2.0), (0.0, f64::INFINITY), (0.0, 1e-9), (0.0, 1e20)] {
            assert!(Axis::linear(low, high).ticks(300, Lies::Flat).len() >= 2, "{low} {high}");
        }
    }

    #[test]
    fn the_unit_of_time_fits() {
        let units = [vec![], vec![5.0], vec![1e3, 1e5], vec![1e5, 1e9], vec![2e9], vec![f64::NAN, 0.0]];
        assert_eq!(units.map(|ns| time_unit(ns).0), ["us", "ns", "us", "ms", "s", "us"]);
    }
}
