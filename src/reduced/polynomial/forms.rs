//! The forms of a polynomial energy, as sums over pairs of vertices.
//!
//! An edge's strain √(2k_L/L) (l − L) is to first order √(2k_L/L) y/(2L), a triangle's √(2k_A/Ā) (A − Ā) likewise √(2k_A/Ā) Σ cot ᾱ y/4
//! over its edges. Their parts along the stress fields S weigh 1, and those along R weigh the share α, where R holds what S leaves of the
//! strains of shapes that the shell is likely to take. No sum over elements is left.
//!
//! What bending lacks is compressed alike (`corrections`).
//!
//! Where the membrane carries the loads, the first of the stress fields are turned to hold most of the strains, and count by engineering strains:
//! C sums over elements ∂²ε/∂y² at the y that go with a form, by least squares over the shapes.

use super::bends::{Bend, Pairs, cubic, hessians};
use super::corrections::{SOFTEST, corrections};
use super::engineering::{Matrix, Vector};
use super::pairs::{self, Gains, Rows};
use super::{CARRYING, Coefficients, Engineering, Form, LEADING, PolynomialEnergy};
use crate::energy::{Mirror, Term};
use crate::modes::symmetric_eigen;
use crate::reduced::basis::MULTIPLICATION;
use crate::reduced::products::WIDTH;
use crate::reduced::sampling::Random;
use crate::reduced::{Assumed, basis};
use crate::{ErrorKind, Result, Shell, Vec3, threads};
use faer::{Mat, MatMut};
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// Residual fields, about: as a share of all fields, and where the membrane carries the loads.
const RESIDUALS: f64 = 0.15;
const MEMBRANE_RESIDUALS: usize = 40;
/// Of a normal matrix's trace, what keeps it regular where shapes strain fewer forms than there are.
const RIDGE: f64 = 1e-10;
/// Shapes that are mixed of two others, and how much of either there is, at most.
const MIXED: usize = 200;
const MOST: [f64; 2] = [1.0, 0.7];
/// φ of a negative weight is near s² up to this multiple of the largest s of the shapes.
const BEYOND: f64 = 3.0;
/// Of the stiffness at rest that bending and the membrane's forms have, the least that the polynomial has along any direction. Where fields stretch
/// hinges the cubic can be softer than none, and few forms correct it.
const LEAST_STIFFNESS: f64 = 0.5;
/// Of the whole stiffness, what stands for that of directions which neither bend nor strain along a form.
const NEXT_TO_NOTHING: f64 = 1e-6;
/// Nanoseconds that what a bend is made of takes, about.
const BEND: u64 = 20_000;

/// What the coefficients are made of.
pub struct Sources<'a> {
    /// Whose energy it is.
    pub shell: &'a Shell,
    /// B.
    pub columns: &'a [Vec<Vec3>],
    /// How many of them, the first, are modes.
    pub modes: usize,
    /// On all elements of the membrane.
    pub assumed: &'a Assumed,
    /// Shapes q that the shell is likely to take.
    pub shapes: &'a [Vec<f64>],
    /// Pairs times shapes, at most, beyond those.
    pub gains: usize,
    /// At rest, of all elements.
    pub stiffness: &'a DMatrix<f64>,
}

/// The energy; none where its numbers leave the range, or that of the shell is none of the terms above. `watch` is told the share of the work done.
pub fn make(sources: &Sources, watch: &mut dyn FnMut(f64) -> Result<()>) -> Result<Option<PolynomialEnergy>> {
    let Some(told) = Told::of(sources.shell) else { return Ok(None) };
    match coefficients(sources, &told, watch) {
        Ok(coefficients) => Ok(Some(PolynomialEnergy::new(&coefficients)).filter(PolynomialEnergy::is_finite)),
        Err(error) if error.kind == ErrorKind::Numerical => Ok(None),
        Err(error) => Err(error),
    }
}

/// What the shell's energy tells of its elements.
struct Told {
    strains: Strains,
    bends: Vec<Bend>,
    /// What vertices from n_vertices on are the images of.
    images: Vec<(u32, Mirror)>,
    pairs: Vec<[u32; 2]>,
}

impl Told {
    /// None where it cannot say, or where the shell is not at rest.
    fn of(shell: &Shell) -> Option<Self> {
        if shell.is_stressed() {
            return None;
        }
        let (mut elements, mut curvatures, mut folded, mut images) = (vec![], vec![], vec![], vec![]);
        let mut pairs = Pairs::new(&shell.mesh);
        let told = shell.energy.visit_terms(&shell.mesh.positions, &mut |term| match term {
            Term::Stretch(terms, curvature) => {
                elements.push(terms.iter().map(|(pair, p)| (pairs.number(*pair), *p)).collect());
                curvatures.push(curvature.to_vec());
            }
            Term::Bend(folds, rows) => folded.push((folds.to_vec(), rows.to_vec())),
            Term::Image(vertex, plane) => images.push((vertex, *plane)),
        });
        if !told {
            return None;
        }
        let mut bends = threads::map(&folded, BEND * folded.len() as u64, |(folds, rows)| Bend::new(folds, rows));
        bends.iter_mut().for_each(|bend| bend.number(&mut pairs));
        Some(Self { strains: Strains { elements, curvatures }, bends, images, pairs: pairs.list })
    }
}

fn coefficients(sources: &Sources, told: &Told, watch: &mut dyn FnMut(f64) -> Result<()>) -> Result<Coefficients> {
    let Sources { shell, columns, assumed, .. } = *sources;
    let Told { strains, bends, images, pairs } = told;
    let (rows, rest) = (Rows::new(columns, images), with_images(&shell.mesh.positions, images));
    let shapes = mixed(sources.shapes, sources.gains / pairs.len().max(1));
    let gains = Gains::new(&rest, pairs, &rows, &shapes);
    watch(0.1)?;
    let slopes = Gains::slopes(&rest, pairs, &rows, SOFTEST.min(sources.modes));
    let (corrections, signs) = corrections(bends, [&slopes, &gains], pairs.len())?;
    watch(0.3)?;
    let taken = assumed.stresses.nrows() + signs.len();
    let carries = assumed.membrane_share >= CARRYING;
    let residuals = if carries { MEMBRANE_RESIDUALS } else { (RESIDUALS * rows.n as f64) as usize };
    let filled = (taken + residuals + WIDTH / 2) / WIDTH * WIDTH; // those that fill a register are free
    let residuals = filled.saturating_sub(taken);
    let mut fields = strains.fields(assumed, &gains, residuals)?;
    let (assuming, membrane) = (assumed.stresses.nrows(), fields.ncols());
    let membrane_pairs = strains.transposed(&fields, pairs.len());
    watch(0.4)?;
    let mut all = Mat::from_fn(pairs.len(), membrane + signs.len(), |e, k| match k < membrane {
        true => membrane_pairs[(e, k)],
        false => corrections[(e, k - membrane)],
    });
    let mut strained = all.transpose() * gains.matrix().transpose();
    let counts = carries && membrane >= LEADING && strains.is_curved();
    if counts {
        turn([&mut fields, &mut all, &mut strained], assuming)?;
    }
    let engineering = if counts { strains.engineering(&fields, &gains, &strained) } else { None };
    let mut forms = pairs::forms(&rest, pairs, &rows, all.as_ref());
    watch(0.7)?;
    for (k, form) in forms.iter_mut().enumerate() {
        form.weight = match k.checked_sub(membrane) {
            None if k < assuming => 1.0,
            None => assumed.membrane_share,
            Some(k) => signs[k],
        };
        if form.weight < 0.0 {
            form.bound = bound(&strained, k);
        }
    }
    let [mut bending, stiffness] = hessians(bends, &rows);
    stiffen(&mut bending, (&forms, membrane), &stiffness, sources.stiffness);
    watch(0.8)?;
    Ok(Coefficients { forms, membrane, bending, stiffness, cubic: cubic(bends, &rows), engineering })
}

/// Makes the stiffness at rest, C₂ + Σ w A Aᵀ, that of bending's own Hessian and the membrane's forms along directions where it is less than
/// [`LEAST_STIFFNESS`] of it.
fn stiffen(
    bending: &mut DMatrix<f64>,
    (forms, membrane): (&[Form], usize),
    exact: &DMatrix<f64>,
    whole: &DMatrix<f64>,
) {
    let (mut own, mut wanted) = (bending.clone(), exact + NEXT_TO_NOTHING * whole);
    for (k, form) in forms.iter().enumerate() {
        let linear = DVector::from_column_slice(&form.linear);
        own.ger(form.weight, &linear, &linear, 1.0);
        if k < membrane {
            wanted.ger(form.weight, &linear, &linear, 1.0);
        }
    }
    let Some(lower) = Cholesky::new(wanted).map(|factor| factor.l()) else { return };
    let Some(half) = lower.solve_lower_triangular(&own) else { return };
    let Some(whitened) = lower.solve_lower_triangular(&half.transpose()) else { return };
    if !whitened.iter().all(|x| x.is_finite()) {
        return;
    }
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(whitened);
    for (share, direction) in eigenvalues.iter().zip(eigenvectors.column_iter()).filter(|(x, _)| **x < LEAST_STIFFNESS)
    {
        let force = &lower * direction;
        bending.ger(1.0 - share, &force, &force, 1.0);
    }
}

/// The vertices' places, and those of the images.
fn with_images(rest: &[Vec3], images: &[(u32, Mirror)]) -> Vec<Vec3> {
    let image = |(v, plane): &(u32, Mirror)| plane.image(&rest[*v as usize]);
    rest.iter().copied().chain(images.iter().map(image)).collect()
}

/// 1/S² of a form whose values at the shapes are a row of `strained`.
fn bound(strained: &Mat<f64>, form: usize) -> f64 {
    let largest = (0..strained.ncols()).map(|s| strained[(form, s)].abs()).fold(0.0, f64::max);
    if largest > 0.0 { (BEYOND * largest).powi(-2) } else { 0.0 }
}

/// The shapes, and sums of parts of two of them.
fn mixed(shapes: &[Vec<f64>], most: usize) -> Vec<Vec<f64>> {
    let mut random = Random::new();
    let mut all = shapes.to_vec();
    if !shapes.is_empty() {
        for _ in 0..MIXED.min(most) {
            let mut share = || 0.5 + 0.5 * random.next();
            let [i, j] = [share(), share()].map(|x| ((x * shapes.len() as f64) as usize).min(shapes.len() - 1));
            let [a, b] = [MOST[0] * share(), MOST[1] * share()];
            all.push(shapes[i].iter().zip(&shapes[j]).map(|(x, y)| a * x + b * y).collect());
        }
    }
    all
}

/// The map from y of the pairs to the membrane's strains, in the order of its elements: factors of y, and second derivatives by these y.
struct Strains {
    elements: Vec<Vec<(usize, f64)>>,
    curvatures: Vec<Vec<f64>>,
}

impl Strains {
    /// S, and orthonormal fields of what it leaves of the strains at shapes with the gains (elements × fields).
    fn fields(&self, assumed: &Assumed, gains: &Gains, residuals: usize) -> Result<Mat<f64>> {
        let stresses = &assumed.stresses;
        let mut fields = Mat::from_fn(self.elements.len(), stresses.nrows(), |e, k| stresses[(k, e)]);
        let mut left = Mat::<f64>::zeros(self.elements.len(), gains.shapes);
        let work = MULTIPLICATION * (left.nrows() * left.ncols() * (2 * fields.ncols() + 40)) as f64;
        threads::share_items(&mut basis::strips(&mut left, basis::STRIP), work as u64, |(first, left)| {
            self.place(gains, *first, left.as_mut());
            let held = fields.transpose() * &*left;
            *left -= &fields * held;
            for column in left.as_mut().col_iter_mut() {
                let factor = column.norm_l2().max(f64::MIN_POSITIVE).sqrt().recip();
                column.iter_mut().for_each(|x| *x *= factor);
            }
        });
        if left.ncols() > 0 {
            basis::extend(&mut fields, left, residuals)?;
        }
        Ok(fields)
    }

    /// The strains at some of the shapes, from the `first` on (elements × shapes).
    fn place(&self, gains: &Gains, first: usize, mut strains: MatMut<'_, f64>) {
        let mut row = vec![0.0; strains.ncols()];
        for (e, element) in self.elements.iter().enumerate() {
            row.fill(0.0);
            for (pair, factor) in element {
                row.iter_mut().zip(&gains.of(*pair)[first..]).for_each(|(sum, y)| *sum += factor * y);
            }
            row.iter().enumerate().for_each(|(s, strain)| strains[(e, s)] = *strain);
        }
    }

    /// Whether any is not linear in y.
    fn is_curved(&self) -> bool {
        self.curvatures.iter().flatten().any(|x| *x != 0.0)
    }

    /// C of the first fields, whose values at the shapes with these gains are the first rows of `strained`.
    fn engineering(&self, fields: &Mat<f64>, gains: &Gains, strained: &Mat<f64>) -> Option<Engineering> {
        let s = strained.subrows(0, LEADING);
        let weight = |shape: usize| s.col(shape).norm_l2().max(f64::MIN_POSITIVE).recip(); // of squares
        let weighed = Mat::from_fn(gains.shapes, LEADING, |shape, k| weight(shape) * s[(k, shape)]);
        let normal = s * &weighed;
        let mut normal = Matrix::from_fn(|i, j| 0.5 * (normal[(i, j)] + normal[(j, i)]));
        let ridge = RIDGE * normal.trace();
        (0..LEADING).for_each(|k| normal[(k, k)] += ridge);
        let inverse = normal.cholesky()?.inverse();
        let along = gains.matrix().transpose() * (weighed * Mat::from_fn(LEADING, LEADING, |i, j| inverse[(i, j)]));
        let mut engineering = Engineering([Matrix::zeros(); LEADING]);
        for (e, (element, curvature)) in self.elements.iter().zip(&self.curvatures).enumerate() {
            let mut own = Matrix::zeros();
            let both = (0..element.len()).flat_map(|m| (0..=m).map(move |n| (m, n)));
            for ((m, n), second) in both.zip(curvature) {
                let [left, right] = [m, n].map(|m| Vector::from_fn(|k, _| along[(element[m].0, k)]));
                let share = if m == n { 0.5 * second } else { *second };
                own += share * (left * right.transpose() + right * left.transpose());
            }
            engineering.0.iter_mut().enumerate().for_each(|(j, of)| *of -= fields[(e, j)] * own);
        }
        Some(engineering)
    }

    /// The strains along fields, as sums over pairs (pairs × fields).
    fn transposed(&self, fields: &Mat<f64>, pairs: usize) -> Mat<f64> {
        let mut sums = Mat::zeros(pairs, fields.ncols());
        for (e, element) in self.elements.iter().enumerate() {
            for (pair, factor) in element {
                (0..fields.ncols()).for_each(|k| sums[(*pair, k)] += factor * fields[(e, k)]);
            }
        }
        sums
    }
}

/// Turns the stress fields so that the first have most of the strains at shapes (forms × shapes), which count by the roots of their sizes: the
/// fields, their sums over pairs and their values.
fn turn([fields, sums, strained]: [&mut Mat<f64>; 3], assuming: usize) -> Result<()> {
    let mut own = strained.subrows(0, assuming).to_owned();
    for shape in own.as_mut().col_iter_mut() {
        let factor = shape.norm_l2().max(f64::MIN_POSITIVE).sqrt().recip();
        shape.iter_mut().for_each(|s| *s *= factor);
    }
    let (_, vectors) = symmetric_eigen((&own * own.transpose()).as_ref())?;
    let turn = vectors.as_ref().reverse_cols();
    for matrix in [fields, sums] {
        let turned = matrix.subcols(0, assuming) * turn;
        matrix.subcols_mut(0, assuming).copy_from(&turned);
    }
    let turned = turn.transpose() * strained.subrows(0, assuming);
    strained.subrows_mut(0, assuming).copy_from(&turned);
    Ok(())
}
