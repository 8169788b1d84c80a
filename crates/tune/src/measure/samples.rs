//! Takes samples in windows and discards the windows in which other programs took the CPU.

use std::time::{Duration, Instant};

use super::{Options, Watch};
use crate::hardware::{Parameter, Statistic};

/// How many samples to take, and when to stop.
#[derive(Debug, Clone)]
pub(super) struct Plan<'a> {
    /// Clean samples wanted. Sampling ends with the window in which they are reached.
    pub(super) samples: usize,
    /// No new window begins that would end after this time. At least one sample is always taken.
    pub(super) limit: Duration,
    /// How a value follows from its samples.
    pub(super) statistic: Statistic,
    pub(super) options: &'a Options,
}

impl Plan<'_> {
    /// Takes samples of N parameters together, each given with its name and method. The first failure ends it.
    pub(super) fn measure<const N: usize, E>(
        &self,
        named: [(impl AsRef<str>, String); N],
        sample: impl FnMut() -> Result<[f64; N], E>,
    ) -> Result<Vec<Parameter>, E> {
        let kept = self.sample(sample)?;
        let parameters = named.into_iter().enumerate().map(|(k, (name, method))| {
            // A failed division, or a clock that did not move, yields no finite number.
            let raw = kept.rows.iter().map(|row| row[k]).filter(|x| x.is_finite()).map(six_digits).collect();
            let parameter = Parameter::from_samples(name, self.statistic, raw, &method);
            match parameter.value {
                Some(_) => Parameter { spoiled: kept.spoiled, foreign_load: kept.foreign_load, ..parameter },
                None => parameter,
            }
        });
        Ok(parameters.collect())
    }

    fn sample<const N: usize, E>(&self, mut sample: impl FnMut() -> Result<[f64; N], E>) -> Result<Samples<N>, E> {
        let start = Instant::now();
        let mut windows: Vec<Window<N>> = Vec::new();
        loop {
            let watch = Watch::begin();
            let mut rows = Vec::new();
            loop {
                rows.push(sample()?);
                let enough = watch.is_long_enough() && (watch.before.is_some() || rows.len() >= self.samples);
                if enough || start.elapsed() >= self.limit || self.options.is_stopped() {
                    break;
                }
            }
            windows.push(Window { rows, foreign_load: watch.foreign_load() });
            let clean: usize = windows.iter().filter(|w| w.load() <= Parameter::SPOILING).map(|w| w.rows.len()).sum();
            let over = start.elapsed() + watch.began.elapsed() > self.limit;
            if clean >= self.samples || over || self.options.is_stopped() {
                return Ok(Samples::keep(windows, self.samples));
            }
        }
    }
}

/// Samples that were taken without a pause.
struct Window<const N: usize> {
    rows: Vec<[f64; N]>,
    foreign_load: Option<f64>,
}

impl<const N: usize> Window<N> {
    fn load(&self) -> f64 {
        self.foreign_load.unwrap_or(0.0)
    }
}

/// The kept samples.
struct Samples<const N: usize> {
    rows: Vec<[f64; N]>,
    /// Number of discarded samples.
    spoiled: u32,
    /// Highest foreign load among the kept ones.
    foreign_load: Option<f64>,
}

impl<const N: usize> Samples<N> {
    /// Keeps every clean window, and the least spoiled others until `wanted` samples are kept; in order of
    /// measurement.
    fn keep(windows: Vec<Window<N>>, wanted: usize) -> Self {
        let mut loads: Vec<f64> = windows.iter().flat_map(|w| w.rows.iter().map(|_| w.load())).collect();
        loads.sort_unstable_by(f64::total_cmp);
        let highest = loads.get(wanted.min(loads.len()).max(1) - 1).map_or(0.0, |load| load.max(Parameter::SPOILING));
        let (kept, spoiled): (Vec<_>, Vec<_>) = windows.into_iter().partition(|w| w.load() <= highest);
        Self {
            spoiled: spoiled.iter().map(|w| w.rows.len() as u32).sum(),
            foreign_load: kept.iter().filter_map(|w| w.foreign_load).reduce(f64::max),
            rows: kept.into_iter().flat_map(|w| w.rows).collect(),
        }
    }
}

/// Rounds to six significant digits, which is what a file keeps of a sample.
fn six_digits(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hardware::How;

    fn plan(options: &Options, limit: Duration) -> Plan<'_> {
        Plan { samples: 9, limit, statistic: Statistic::Median, options }
    }

    fn window(value: f64, load: f64) -> Window<1> {
        Window { rows: vec![[value]; 3], foreign_load: Some(load) }
    }

    #[test]
    fn spoiled_windows_are_discarded_in_order() {
        for (windows, load) in
            [([(9.0, 0.4), (1.0, 0.01), (2.0, 0.02)], 0.02), ([(1.0, 0.03), (9.0, 0.4), (2.0, 0.0)], 0.03)]
        {
            let kept = Samples::keep(windows.map(|(value, load)| window(value, load)).into(), 4);
            assert_eq!(kept.rows.as_flattened(), [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
            assert_eq!((kept.spoiled, kept.foreign_load), (3, Some(load)));
        }
    }

    #[test]
    fn without_clean_windows_the_least_spoiled_is_kept() {
        let kept = Samples::keep(vec![window(9.0, 0.4), window(5.0, 0.3)], 2);
        assert_eq!((kept.rows.as_flattened(), kept.spoiled, kept.foreign_load), (&[5.0; 3][..], 3, Some(0.3)));
    }

    #[test]
    fn six_digits_of_any_size() {
        let rounded = [123_456_789.0, 0.000_123_456_78, 0.0, -2.0].map(six_digits);
        assert_eq!(rounded, [123_457_000.0, 0.000_123_457, 0.0, -2.0]);
    }

    #[test]
    fn a_parameter_follows_from_its_raw_samples() {
        let options = Options::default();
        let mut values = [3.000_000_4, f64::NAN, 1.0, 1_234.567_89, f64::INFINITY, 2.0].into_iter();
        let (short, named) = (plan(&options, Duration::from_millis(1)), || [("x_ns", "test".to_owned())]);
        let p = short.measure(named(), || Ok::<_, ()>([values.next().unwrap_or(f64::NAN)])).unwrap();
        assert_eq!((&p[0].raw[..], p[0].value, p[0].samples), (&[3.0, 1.0, 1234.57, 2.0][..], Some(2.5), 4));
        assert_eq!(p[0].disagreement(), None);
        let none = short.measure(named(), || Ok::<_, ()>([f64::NAN])).unwrap();
        assert_eq!((none[0].how, none[0].samples, none[0].spoiled), (How::Missing, 0, 0));
    }

    #[test]
    fn a_failure_ends_the_sampling() {
        let (options, mut left) = (Options::default(), 2);
        let result = plan(&options, Duration::from_secs(60)).measure([("x_ns", String::new())], || {
            left -= 1;
            if left == 0 { Err("broken") } else { Ok([1.0]) }
        });
        assert_eq!((result.err(), left), (Some("broken"), 0));
    }

    #[test]
    fn one_sample_even_without_time() {
        let options = Options::default();
        let named = [("x_ns", String::new()), ("y_ns", String::new())];
        let parameters = plan(&options, Duration::ZERO).measure(named, || Ok::<_, ()>([1.0, 2.0])).unwrap();
        assert_eq!(parameters.iter().map(|p| &p.raw[..]).collect::<Vec<_>>(), [[1.0], [2.0]]);
    }
}
