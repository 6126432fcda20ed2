//! The section "POLY" of a saved model ([`crate::model::file`]): the polynomial energy of a reduced shell with f fields, by k forms, m of
//! them the membrane's. Symmetric arrays are saved where i ≥ j ≥ l.
//!
//! | what | type |
//! |---|---|
//! | f, k, m; equilibria that were tried | 4 × u32 |
//! | their errors, median and nine tenths, by the polynomial and by the sampled energy; reach and strain | 6 × f64 |
//! | w, 1/S², A and Q of each form | k (2 + f + f(f + 1)/2) × f64 |
//! | C₂, bending's rest Hessian | f(f + 1) × f64 |
//! | C₃ | f(f + 1)(f + 2)/6 × f64 |
//! | the range; models of before it was known lack it | f64 |
//! | C of the first forms, if they count by engineering strains: of each, where a ≥ b | 0 or 288 × f64 |

use super::super::{MAX_FIELDS, MAX_STRESSES};
use super::engineering::Matrix;
use super::{Coefficients, Engineering, Errors, Form, Gate, LARGEST, LEADING, PolynomialEnergy, unseen};
use crate::real::Real;
use crate::{Error, ErrorKind, Result};
use nalgebra::DMatrix;

const FRONT: usize = 16;
const FACTS: usize = 6;
/// Bytes of C.
const ENGINEERING: usize = 8 * LEADING * LEADING * (LEADING + 1) / 2;
/// Beside stress fields: of residual strains and corrections.
const MORE_FORMS: usize = 64;

fn invalid<T>(message: impl Into<String>) -> Result<T> {
    Err(Error::new(ErrorKind::InvalidData, message))
}

/// Bytes of a section.
fn size(n: usize, forms: usize) -> usize {
    let triangle = n * (n + 1) / 2;
    FRONT + 8 * (FACTS + forms * (2 + n + triangle) + 2 * triangle + triangle * (n + 2) / 3)
}

fn put_triangle(matrix: &DMatrix<f64>, out: &mut Vec<u8>) {
    (0..matrix.nrows()).for_each(|i| (0..=i).for_each(|j| matrix[(i, j)].put(out)));
}

/// Numbers in turn.
struct Reader<'a> {
    rest: std::slice::ChunksExact<'a, u8>,
}

impl Reader<'_> {
    fn number(&mut self) -> f64 {
        self.rest.next().map_or(f64::NAN, f64::get)
    }

    fn numbers(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.number()).collect()
    }

    fn triangle(&mut self, n: usize) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let x = self.number();
                (matrix[(i, j)], matrix[(j, i)]) = (x, x);
            }
        }
        matrix
    }
}

impl PolynomialEnergy {
    /// Size of [`PolynomialEnergy::save`].
    pub fn saved_size(&self) -> usize {
        size(self.n(), self.n_saved()) + 8 + if self.engineering.is_some() { ENGINEERING } else { 0 }
    }

    /// Appends the content of the section.
    pub fn save(&self, out: &mut Vec<u8>) {
        let Coefficients { forms, membrane, bending, stiffness, cubic, engineering } = self.coefficients();
        let Gate { tried, polynomial, sampled, reach, strain, range, .. } = self.gate;
        [self.n() as u32, forms.len() as u32, membrane as u32, tried].iter().for_each(|x| out.extend(x.to_le_bytes()));
        [polynomial.median, polynomial.most, sampled.median, sampled.most, reach, strain]
            .iter()
            .for_each(|x| x.put(out));
        for Form { weight, bound, linear, quadratic } in &forms {
            [weight, bound].into_iter().chain(linear).for_each(|x| x.put(out));
            put_triangle(quadratic, out);
        }
        put_triangle(&bending, out);
        put_triangle(&stiffness, out);
        for (i, matrix) in cubic.iter().enumerate() {
            (0..=i).for_each(|j| (0..=j).for_each(|l| matrix[(j, l)].put(out)));
        }
        range.put(out);
        for matrix in engineering.iter().flat_map(|engineering| &engineering.0) {
            (0..LEADING).for_each(|i| (0..=i).for_each(|j| matrix[(i, j)].put(out)));
        }
    }

    /// What [`PolynomialEnergy::save`] wrote, for a reduced shell of `n` fields.
    pub fn load(n: usize, content: &[u8]) -> Result<Self> {
        let Some((front, rest)) = content.split_at_checked(FRONT) else {
            return invalid(format!("{} bytes are not a polynomial energy", content.len()));
        };
        let count = |at: usize| u32::from_le_bytes(front[4 * at..4 * at + 4].try_into().expect("four bytes"));
        let [fields, forms, membrane] = [0, 1, 2].map(|at| count(at) as usize);
        if fields != n || n > MAX_FIELDS || forms > MAX_STRESSES + MORE_FORMS || membrane > forms {
            let message =
                format!("a polynomial energy of {fields} fields, {membrane} of {forms} forms is out of range");
            return invalid(message);
        }
        let least = size(n, forms);
        if ![least, least + 8, least + 8 + ENGINEERING].contains(&content.len()) {
            let message = format!("{} bytes are not those of a polynomial energy of {n} fields", content.len());
            return invalid(message);
        }
        let mut from = Reader { rest: rest.chunks_exact(8) };
        let [own, other] = [(); 2].map(|()| Errors { median: from.number(), most: from.number() });
        let (reach, strain) = (from.number(), from.number());
        let mut gate = Gate { tried: count(3), polynomial: own, sampled: other, reach, strain, ..Gate::default() };
        let form = |_| Form {
            weight: from.number(),
            bound: from.number(),
            linear: from.numbers(n),
            quadratic: from.triangle(n),
        };
        let forms: Vec<Form> = (0..forms).map(form).collect();
        let [bending, stiffness] = [(); 2].map(|()| from.triangle(n));
        let mut cubic = vec![DMatrix::zeros(n, n); n];
        for i in 0..n {
            for j in 0..=i {
                for l in 0..=j {
                    let x = from.number();
                    for [i, j, l] in [[i, j, l], [i, l, j], [j, i, l], [j, l, i], [l, i, j], [l, j, i]] {
                        cubic[i][(j, l)] = x;
                    }
                }
            }
        }
        gate.unseen = unseen(forms[..membrane].iter().map(|form| form.weight));
        gate.range = match content.len() > least {
            true => from.number(),
            false if gate.holds() => gate.reach,
            false => 0.0,
        };
        let engineering = (content.len() > least + 8).then(|| {
            Engineering(std::array::from_fn(|_| {
                let square = from.triangle(LEADING);
                Matrix::from_fn(|i, j| square[(i, j)])
            }))
        });
        if engineering.is_some() && membrane < LEADING {
            return invalid(format!("{membrane} forms of the membrane are too few to count by engineering strains"));
        }
        if gate.range < 0.0 {
            return invalid("the range of its polynomial energy is negative");
        }
        if !rest.chunks_exact(8).map(f64::get).all(|x| x.abs() <= LARGEST) {
            return invalid("a coefficient of its polynomial energy is no number, or beyond all shells");
        }
        let weighs = |(k, form): (usize, &Form)| form.bound >= 0.0 && (form.weight > 0.0 || k >= membrane);
        if !forms.iter().enumerate().all(weighs) || forms.last().is_some_and(|form| form.weight == 0.0) {
            return invalid("a weight of its polynomial energy is not positive");
        }
        let coefficients = Coefficients { forms, membrane, bending, stiffness, cubic, engineering };
        let energy = Self { gate, ..Self::new(&coefficients) };
        if !energy.is_finite() {
            return invalid("a coefficient of its polynomial energy is beyond numbers of 32 bits");
        }
        Ok(energy)
    }
}
