//! Where the machines of the training lie, all their parameters taken together.

use super::{GPU_PARAMETERS, PARAMETERS};
use ndarray::{Array1, Array2, s};
use sapwise::model::{Cloud, CloudParameter};
use sapwise::{BackendClass, GpuHardware, GpuKind, Hardware};

/// Least standard deviation of a parameter's logarithm: a tenth, as the ranges allow it. Parameters that all machines share would
/// else put every other machine beyond the training by any difference.
const LEAST_DEVIATION: f64 = 0.1;

/// The cloud of the machines and that of the GPUs that were timed, where there are enough of them: two more than parameters.
/// Below that the correlations say more of who happened to be measured than of machines.
///
/// A physical machine is one point, the mean of its profiles; so is a GPU, by its name and numbers. One that lacks a parameter is
/// left out, and so are programs that act as GPUs.
pub(crate) fn clouds<'a>(profiles: impl Iterator<Item = (&'a Hardware, Vec<&'a GpuHardware>)>) -> Vec<Cloud> {
    let (mut machines, mut gpus) = (Points::new(&PARAMETERS), Points::new(&GPU_PARAMETERS));
    for (hardware, timed) in profiles {
        machines.add(&hardware.machine.physical_id, |name| hardware.value(name));
        for gpu in timed.into_iter().filter(|g| g.gpu.kind != GpuKind::Software) {
            gpus.add(&format!("{} {}", gpu.gpu.device, gpu.gpu.name), |name| gpu.value(name));
        }
    }
    [machines.cloud(BackendClass::Cpu), gpus.cloud(BackendClass::Gpu)].into_iter().flatten().collect()
}

/// Logarithms of the parameters, by machine or GPU.
struct Points {
    names: &'static [&'static str],
    of: Vec<(String, Vec<Sum>)>,
}

/// A sum of logarithms and how many they are.
#[derive(Clone, Copy, Default)]
struct Sum(f64, f64);

impl Points {
    fn new(names: &'static [&'static str]) -> Self {
        Self { names, of: Vec::new() }
    }

    fn add(&mut self, id: &str, value: impl Fn(&str) -> Option<f64>) {
        let k = self.of.iter().position(|p| p.0 == id).unwrap_or_else(|| {
            self.of.push((id.to_owned(), vec![Sum::default(); self.names.len()]));
            self.of.len() - 1
        });
        for (sum, name) in self.of[k].1.iter_mut().zip(self.names) {
            if let Some(value) = value(name).filter(|v| *v > 0.0) {
                *sum = Sum(sum.0 + value.ln(), sum.1 + 1.0);
            }
        }
    }

    fn cloud(&self, processor: BackendClass) -> Option<Cloud> {
        let mean =
            |p: &(String, Vec<Sum>)| p.1.iter().map(|s| (s.1 > 0.0).then(|| s.0 / s.1)).collect::<Option<Array1<f64>>>();
        let points: Vec<Array1<f64>> = self.of.iter().filter_map(mean).collect();
        if points.len() < self.names.len() + 2 {
            return None;
        }
        let farthest_squared = (0..points.len())
            .filter_map(|k| {
                let others: Vec<&Array1<f64>> = points.iter().enumerate().filter(|(o, _)| *o != k).map(|(_, p)| p).collect();
                Some(Normal::new(&others)?.squared_distance(&points[k]))
            })
            .fold(0.0, f64::max);
        let all = Normal::new(&points.iter().collect::<Vec<_>>())?;
        // Six digits, as in a report.
        let six = |x: f64| format!("{x:.5e}").parse().unwrap_or(x);
        let parameter = |(k, name): (usize, &&str)| CloudParameter {
            name: (*name).to_owned(),
            mean_ln: six(all.mean[k]),
            deviation_ln: six(all.deviation[k]),
        };
        Some(Cloud {
            processor,
            points: points.len() as u32,
            parameters: self.names.iter().enumerate().map(parameter).collect(),
            inverse: all.inverse.rows().into_iter().map(|r| r.iter().copied().map(six).collect()).collect(),
            farthest_squared: six(farthest_squared),
        })
    }
}

/// A normal distribution: means and deviations, and the inverse of the correlations.
struct Normal {
    mean: Array1<f64>,
    deviation: Array1<f64>,
    inverse: Array2<f64>,
}

impl Normal {
    /// The correlations are shrunk as if there were as many further points as parameters, all of them without correlation: by
    /// p / (n + p) for n points of p parameters. Without that the inverse of few points makes any other point far.
    fn new(points: &[&Array1<f64>]) -> Option<Self> {
        let (n, p) = (points.len() as f64, points.first()?.len());
        let mean = points.iter().fold(Array1::zeros(p), |sum, x| sum + *x) / n;
        let mut covariance = Array2::<f64>::zeros((p, p));
        for x in points {
            let d = *x - &mean;
            covariance += &Array2::from_shape_fn((p, p), |(i, j)| d[i] * d[j] / (n - 1.0));
        }
        let deviation = covariance.diag().mapv(|v| v.sqrt().max(LEAST_DEVIATION));
        let kept = n / (n + p as f64);
        let shrunk = Array2::from_shape_fn((p, p), |(i, j)| {
            if i == j { 1.0 } else { kept * covariance[(i, j)] / (deviation[i] * deviation[j]) }
        });
        Some(Self { mean, deviation, inverse: inverse(shrunk) })
    }

    fn squared_distance(&self, point: &Array1<f64>) -> f64 {
        let scores = (point - &self.mean) / &self.deviation;
        scores.dot(&self.inverse.dot(&scores))
    }
}

/// The inverse of shrunk correlations by Gauss and Jordan. They are positive definite, so that no pivot is zero.
fn inverse(mut a: Array2<f64>) -> Array2<f64> {
    let n = a.nrows();
    let mut inverse = Array2::eye(n);
    for k in 0..n {
        let pivot = a[(k, k)];
        a.row_mut(k).mapv_inplace(|x| x / pivot);
        inverse.row_mut(k).mapv_inplace(|x| x / pivot);
        let (of_a, of_inverse) = (a.row(k).to_owned(), inverse.row(k).to_owned());
        for other in (0..n).filter(|&o| o != k) {
            let share = a[(other, k)];
            a.slice_mut(s![other, ..]).scaled_add(-share, &of_a);
            inverse.slice_mut(s![other, ..]).scaled_add(-share, &of_inverse);
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_scenes::Random;
    use sapwise::hardware::ParameterId;
    use sapwise::{Machine, Parameter};

    /// A machine whose parameters all follow one size, each with a factor of its own of 20 %.
    fn machine(k: usize, size: f64) -> Hardware {
        let mut random = Random::named(k as u64, &["machine"]);
        let parameters = PARAMETERS.map(|name| Parameter::reported(name, (size + 0.2 * random.normal()).exp(), "test"));
        let machine = Machine { physical_id: format!("{k:016x}"), ..Machine::default() };
        Hardware { machine, parameters: parameters.into(), gpus: Vec::new(), gpu_groups: Vec::new() }
    }

    fn machines(count: usize) -> Vec<Hardware> {
        let mut random = Random::named(7, &["sizes"]);
        (0..count).map(|k| machine(k, random.normal())).collect()
    }

    fn of(machines: &[Hardware]) -> Vec<Cloud> {
        clouds(machines.iter().map(|h| (h, Vec::new())))
    }

    #[test]
    fn machines_of_the_same_kind_lie_within_and_another_combination_does_not() {
        let clouds = of(&machines(30));
        assert_eq!((clouds.len(), clouds[0].points, clouds[0].processor), (1, 30, BackendClass::Cpu));
        let ratio = |h: &Hardware| clouds[0].place(|name| h.value(name)).ratio;
        let mut random = Random::named(8, &["sizes"]);
        let within = (1000..1200).filter(|&k| ratio(&machine(k, random.normal())) <= 1.0).count();
        // The farthest of 30 is passed by about one new machine of 31.
        assert!((170..=200).contains(&within), "{within} of 200");
        let mut odd = machine(2000, 0.0);
        for (name, ln) in [(ParameterId::UsableCores, 1.5_f64), (ParameterId::CacheLlcBytes, -1.5)] {
            odd.parameters.iter_mut().find(|p| p.name == name).unwrap().value = Some(ln.exp());
        }
        let place = clouds[0].place(|name| odd.value(name));
        let mut most = place.most.clone();
        most.sort_unstable();
        assert!(place.ratio > 1.2 && most == [ParameterId::CacheLlcBytes, ParameterId::UsableCores], "{place:?}");
    }

    #[test]
    fn profiles_of_one_machine_are_one_point_and_too_few_machines_no_cloud() {
        let ten = machines(PARAMETERS.len() + 2);
        assert_eq!(of(&ten)[0].points, 10);
        assert!(of(&ten[1..]).is_empty());
        let twice: Vec<Hardware> = ten[1..].iter().chain(&ten[1..]).cloned().collect();
        assert!(of(&twice).is_empty());
        let mut lacking = ten.clone();
        lacking[3].parameters.remove(2);
        assert!(of(&lacking).is_empty());
    }

    #[test]
    fn a_parameter_that_all_machines_share_does_not_put_others_beyond() {
        let mut all = machines(20);
        let at = |h: &mut Hardware, value: f64| {
            h.parameters.iter_mut().find(|p| p.name == ParameterId::CacheLlcBytes).unwrap().value = Some(value);
        };
        all.iter_mut().for_each(|h| at(h, 3e7));
        let cloud = of(&all).remove(0);
        let mut other = all[5].clone();
        at(&mut other, 3.2e7);
        assert!(cloud.place(|name| other.value(name)).ratio < 1.0);
        at(&mut other, 6e8);
        assert!(cloud.place(|name| other.value(name)).ratio > 1.0);
    }

    #[test]
    fn an_inverse_undoes_its_matrix() {
        let a = Array2::from_shape_fn((5, 5), |(i, j)| if i == j { 1.0 } else { 0.6 / (1.0 + (i as f64 - j as f64).abs()) });
        let product = a.dot(&inverse(a.clone()));
        assert!((product - Array2::<f64>::eye(5)).iter().all(|d| d.abs() < 1e-12));
    }
}
