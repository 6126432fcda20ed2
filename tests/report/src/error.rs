//! The report's arithmetic: errors, periods, orders of convergence, Pareto fronts. No timing, no calls of the library.

use crate::mesh::{P3, dot, sub};

/// √(Σ_t Σ_v m |a − b|² / Σ_t Σ_v m |b − rest|²) over frames of positions, m (n) the weights.
pub fn relative_l2<'a>(pairs: impl Iterator<Item = (&'a [P3], &'a [P3])>, rest: &[P3], weights: &[f64]) -> f64 {
    let (mut error, mut size) = (0.0, 0.0);
    for (a, b) in pairs {
        for v in 0..rest.len() {
            let (e, u) = (sub(a[v], b[v]), sub(b[v], rest[v]));
            error += weights[v] * dot(e, e);
            size += weights[v] * dot(u, u);
        }
    }
    (error / size).sqrt()
}

/// Mean time between crossings of the mid-level in one direction, by linear interpolation; `None` below two crossings.
pub fn period(signal: &[f64], interval: f64) -> Option<f64> {
    let (low, high) = range(signal);
    let middle = 0.5 * (low + high);
    let crossings: Vec<f64> = signal
        .windows(2)
        .enumerate()
        .filter(|(_, w)| (w[0] - middle) * (w[1] - middle) < 0.0 || w[1] == middle)
        .map(|(k, w)| (k as f64 + (middle - w[0]) / (w[1] - w[0])) * interval)
        .collect();
    let same_way: Vec<f64> = crossings.iter().copied().step_by(2).collect();
    let spans = same_way.len().checked_sub(1).filter(|n| *n > 0)?;
    Some((same_way[spans] - same_way[0]) / spans as f64)
}

/// Half the range of a signal.
pub fn amplitude(signal: &[f64]) -> f64 {
    let (low, high) = range(signal);
    0.5 * (high - low)
}

fn range(signal: &[f64]) -> (f64, f64) {
    signal.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)))
}

/// log(e₁/e₂)/log(s₁/s₂) for errors at two step or mesh sizes.
pub fn observed_order(errors: [f64; 2], sizes: [f64; 2]) -> f64 {
    (errors[0] / errors[1]).ln() / (sizes[0] / sizes[1]).ln()
}

/// Indices of the points (cost, error) that no other point beats in both, by ascending cost.
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| points[i].0.is_finite() && points[i].1.is_finite()).collect();
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut best = f64::INFINITY;
    order.retain(|&i| {
        let better = points[i].1 < best;
        best = best.min(points[i].1);
        better
    });
    order
}

/// The cheapest point whose error is at most `error`.
pub fn cheapest_within(points: &[(f64, f64)], error: f64) -> Option<usize> {
    pareto_front(points).into_iter().find(|&i| points[i].1 <= error)
}

/// The lower quartile, the median and the upper quartile.
pub fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = share * (sorted.len() - 1) as f64;
        let (low, high) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
        low + (high - low) * place.fract()
    };
    if sorted.is_empty() { [f64::NAN; 3] } else { [at(0.25), at(0.5), at(0.75)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a few operations on numbers near 1.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn the_l2_error_of_a_known_case() {
        let rest = [[0.0; 3], [1.0, 0.0, 0.0]];
        let reference = [[0.0, 3.0, 0.0], [1.0, 0.0, 4.0]];
        let shape = [[0.0, 3.0, 0.5], [1.0, 0.0, 4.0]];
        // Weighted 4 : 1, the error is √(4 · 0.25) and the displacement √(4 · 9 + 16).
        let error = relative_l2([(&shape[..], &reference[..])].into_iter(), &rest, &[4.0, 1.0]);
        assert!((error - 1.0 / 52f64.sqrt()).abs() < ROUNDING);
    }

    #[test]
    fn a_sampled_cosine_has_its_period_and_amplitude() {
        let signal: Vec<f64> =
            (0..=600).map(|k| 2.0 - 3.0 * (f64::from(k) / 600.0 * 5.5 * std::f64::consts::TAU).cos()).collect();
        // Linear interpolation at 109 samples a period: the crossing is off by at most (π/109)²/8 of a sample each.
        assert!((period(&signal, 0.01).unwrap() / (6.0 / 5.5) - 1.0).abs() < 1e-4);
        assert!((amplitude(&signal) - 3.0).abs() < 1e-2, "the peaks are met to half a sample: 1 − cos(π/109)");
        assert_eq!(period(&signal[..50], 0.01), None, "half a swing has no period");
    }

    #[test]
    fn the_order_of_a_power_law() {
        assert!((observed_order([3.0 * 0.04, 3.0 * 0.01], [0.2, 0.1]) - 2.0).abs() < ROUNDING);
    }

    #[test]
    fn the_front_keeps_what_nothing_beats() {
        let points = [(3.0, 1.0), (1.0, 4.0), (2.0, 5.0), (2.0, 2.0), (5.0, 1.0), (0.5, f64::NAN), (9.0, 0.1)];
        assert_eq!(pareto_front(&points), [1, 3, 0, 6]);
        assert_eq!(cheapest_within(&points, 2.0), Some(3));
        assert_eq!(cheapest_within(&points, 0.01), None);
    }

    #[test]
    fn quartiles_of_five() {
        assert_eq!(quartiles(&[5.0, 1.0, 3.0, 2.0, 4.0]), [2.0, 3.0, 4.0]);
    }
}
