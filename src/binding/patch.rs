//! A smooth function on a triangle from its values and slopes at the corners: the reduced element of Clough and Tocher.
//!
//! Cubic on each of the three parts about the centroid, with a continuous gradient across them and, where the corners' slopes agree, across
//! the sides to other triangles. Along a side the slope across it is linear. Quadratic functions are met exactly.

use crate::Vec3;

/// What the function depends on linearly: the values at the corners, then at corner i the slopes along the sides to i + 1 and to i + 2.
pub type Data = [f64; 9];

/// Factors of the data at the control points: along the sides, at the corners and the middles of the three parts, and in the centre.
pub struct Patch {
    parts: [[Data; 10]; 3],
}

fn value(i: usize) -> Data {
    std::array::from_fn(|d| f64::from(u8::from(d == i)))
}

/// A third of the way from corner `i` along its side to `j`.
fn along(i: usize, j: usize) -> Data {
    let slope = 3 + 2 * i + usize::from(j != (i + 1) % 3);
    std::array::from_fn(|d| if d == slope { 1.0 / 3.0 } else { value(i)[d] })
}

fn sum<const N: usize>(terms: [(f64, &Data); N]) -> Data {
    std::array::from_fn(|d| terms.iter().map(|(factor, data)| factor * data[d]).sum())
}

/// The middle of the part at the side from `i` to `j`, so that the slope across the side is linear.
fn middle(corners: &[Vec3; 3], (i, j): (usize, usize), [at_i, at_j]: [&Data; 2]) -> Data {
    let side = corners[j] - corners[i];
    let center = corners.iter().sum::<Vec3>() / 3.0;
    let s = (center - corners[i]).dot(&side) / side.norm_squared();
    let (near_i, near_j) = (along(i, j), along(j, i));
    let first = sum([(s - 1.0, &value(i)), (-s, &near_i), (1.0, at_i)]);
    let last = sum([(s - 1.0, &near_j), (-s, &value(j)), (1.0, at_j)]);
    sum([(0.5, &first), (0.5, &last), (1.0 - s, &near_i), (s, &near_j)])
}

impl Patch {
    /// On the triangle of these corners, of positive area.
    pub fn new(corners: &[Vec3; 3]) -> Self {
        let third = 1.0 / 3.0;
        let next = |i: usize| (i + 1) % 3;
        let last = |i: usize| (i + 2) % 3;
        let inner: [Data; 3] = std::array::from_fn(|i| {
            sum([(third, &value(i)), (third, &along(i, next(i))), (third, &along(i, last(i)))])
        });
        // Of the side opposite to k.
        let middles: [Data; 3] = std::array::from_fn(|k| {
            let (i, j) = (next(k), last(k));
            middle(corners, (i, j), [&inner[i], &inner[j]])
        });
        let deep: [Data; 3] =
            std::array::from_fn(|i| sum([(third, &inner[i]), (third, &middles[next(i)]), (third, &middles[last(i)])]));
        let center = sum([(third, &deep[0]), (third, &deep[1]), (third, &deep[2])]);
        let parts = std::array::from_fn(|k| {
            let (i, j) = (next(k), last(k));
            [value(i), along(i, j), along(j, i), value(j), inner[i], middles[k], inner[j], deep[i], deep[j], center]
        });
        Self { parts }
    }

    /// Factors of the data at barycentric coordinates `b`, and of the function's rate there when these change by `rate` (their sum by nothing).
    pub fn at(&self, b: &[f64; 3], rate: &[f64; 3]) -> [Data; 2] {
        let k = (0..3).min_by(|i, j| b[*i].total_cmp(&b[*j])).unwrap_or(0);
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let within = |b: &[f64; 3]| [b[i] - b[k], b[j] - b[k], 3.0 * b[k]];
        let ([u, v, w], [du, dv, dw]) = (within(b), within(rate));
        let here = [
            u * u * u,
            3.0 * u * u * v,
            3.0 * u * v * v,
            v * v * v,
            3.0 * u * u * w,
            6.0 * u * v * w,
            3.0 * v * v * w,
            3.0 * u * w * w,
            3.0 * v * w * w,
            w * w * w,
        ];
        let by_u = [u * u, 2.0 * u * v, v * v, 0.0, 2.0 * u * w, 2.0 * v * w, 0.0, w * w, 0.0, 0.0];
        let by_v = [0.0, u * u, 2.0 * u * v, v * v, 0.0, 2.0 * u * w, 2.0 * v * w, 0.0, w * w, 0.0];
        let by_w = [0.0, 0.0, 0.0, 0.0, u * u, 2.0 * u * v, v * v, 2.0 * u * w, 2.0 * v * w, w * w];
        let moving: [f64; 10] = std::array::from_fn(|n| 3.0 * (du * by_u[n] + dv * by_v[n] + dw * by_w[n]));
        let combine = |factors: &[f64; 10]| -> Data {
            std::array::from_fn(|d| factors.iter().zip(&self.parts[k]).map(|(factor, point)| factor * point[d]).sum())
        };
        [combine(&here), combine(&moving)]
    }
}

/// The number of the slope at corner `i` along its side to corner `i + 1 + which`.
pub fn slope(i: usize, which: usize) -> usize {
    3 + 2 * i + which
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Vec3; 3] = [Vec3::new(0.1, 0.2, 0.0), Vec3::new(1.3, -0.1, 0.0), Vec3::new(0.4, 0.9, 0.0)];

    fn place(b: &[f64; 3]) -> Vec3 {
        (0..3).map(|i| b[i] * CORNERS[i]).sum()
    }

    /// The data of a function with this gradient.
    fn data(f: impl Fn(&Vec3) -> f64, gradient: impl Fn(&Vec3) -> Vec3) -> Data {
        let mut data = [0.0; 9];
        for i in 0..3 {
            data[i] = f(&CORNERS[i]);
            for which in 0..2 {
                let side = CORNERS[(i + 1 + which) % 3] - CORNERS[i];
                data[slope(i, which)] = gradient(&CORNERS[i]).dot(&side);
            }
        }
        data
    }

    fn applied(factors: &Data, data: &Data) -> f64 {
        factors.iter().zip(data).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn quadratic_functions_and_their_rates_are_met() {
        let f = |x: &Vec3| 0.3 + x.x - 2.0 * x.y + 1.5 * x.x * x.x - 0.7 * x.x * x.y + 0.9 * x.y * x.y;
        let g = |x: &Vec3| Vec3::new(1.0 + 3.0 * x.x - 0.7 * x.y, -2.0 - 0.7 * x.x + 1.8 * x.y, 0.0);
        let (patch, data) = (Patch::new(&CORNERS), data(f, g));
        for b in [[0.2, 0.3, 0.5], [0.6, 0.3, 0.1], [0.05, 0.15, 0.8], [1.0, 0.0, 0.0], [0.5, 0.5, 0.0]] {
            let rate = [0.4, -1.1, 0.7];
            let [here, moving] = patch.at(&b, &rate);
            assert!((applied(&here, &data) - f(&place(&b))).abs() < 1e-14, "{b:?}");
            assert!((applied(&moving, &data) - g(&place(&b)).dot(&place(&rate))).abs() < 1e-13, "{b:?}");
        }
    }

    #[test]
    fn rates_are_those_of_differences_also_across_the_parts() {
        let patch = Patch::new(&CORNERS);
        let data = [0.3, -1.0, 0.7, 0.2, 1.1, -0.4, 0.9, 0.5, -0.8];
        let h = 1e-6;
        for b in [[0.2, 0.3, 0.5], [0.45, 0.45, 0.1], [0.3, 0.4, 0.3], [1.0 / 3.0; 3]] {
            for rate in [[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [0.3, -0.8, 0.5]] {
                let at = |s: f64| applied(&patch.at(&std::array::from_fn(|i| b[i] + s * rate[i]), &rate)[0], &data);
                let difference = (at(h) - at(-h)) / (2.0 * h);
                let exact = applied(&patch.at(&b, &rate)[1], &data);
                // Second differences jump at the parts' sides: the central difference is off by half of that times h.
                assert!((difference - exact).abs() < 1e-5, "{b:?} {rate:?}: {difference} {exact}");
            }
        }
    }

    #[test]
    fn the_slope_across_a_side_depends_on_its_ends_alone_and_linearly() {
        let patch = Patch::new(&CORNERS);
        let side = CORNERS[1] - CORNERS[0];
        let foot = CORNERS[0] + side * ((CORNERS[2] - CORNERS[0]).dot(&side) / side.norm_squared());
        let s = (foot - CORNERS[0]).dot(&side) / side.norm_squared();
        let across = [s - 1.0, -s, 1.0]; // from the foot to the third corner
        let data = [0.3, -1.0, 0.7, 0.2, 1.1, -0.4, 0.9, 0.5, -0.8];
        let rate = |t: f64| applied(&patch.at(&[1.0 - t, t, 0.0], &across)[1], &data);
        let (first, last) = (rate(0.0), rate(1.0));
        for t in [0.1, 0.37, 0.5, 0.9] {
            assert!((rate(t) - (1.0 - t) * first - t * last).abs() < 1e-14);
        }
    }
}
