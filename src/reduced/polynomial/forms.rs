//! The forms of a polynomial energy, as sums over pairs of vertices.
//!
//! An edge's strain √(2k_L/L) (l − L) is to first order √(2k_L/L) y/(2L), a triangle's √(2k_A/Ā) (A − Ā) likewise √(2k_A/Ā) Σ cot ᾱ y/4
//! over its edges. Their parts along the stress fields S weigh 1, and those along R weigh the share α, where R holds what S leaves of the
//! strains of shapes that the shell is likely to take. No sum over elements is left.
//!
//! What bending lacks, ½ Σ yᵀDy over the hinges, is compressed alike: by the shapes' |D|^½ y, then by the eigenvectors of the signs of D.

use super::bends::{Bend, Pairs, cubic, hessians};
use super::pairs::{self, Gains, Rows};
use super::{CARRYING, Coefficients, Form, PolynomialEnergy};
use crate::energy::{Mirror, Term};
use crate::modes::symmetric_eigen;
use crate::reduced::basis::{MULTIPLICATION, add_lower};
use crate::reduced::products::WIDTH;
use crate::reduced::sampling::Random;
use crate::reduced::{Assumed, basis};
use crate::{ErrorKind, Result, Shell, Vec3, threads};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, Par};
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// Residual fields where bending carries the loads, and where the membrane does; and corrections of bending.
const RESIDUALS: usize = 4;
const MEMBRANE_RESIDUALS: usize = 40;
const CORRECTIONS: usize = 4;
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
/// Bends whose products are summed at once.
const CHUNK: usize = 512;
/// Nanoseconds that what a bend is made of takes, about.
const BEND: u64 = 20_000;

/// What the coefficients are made of.
pub struct Sources<'a> {
    /// Whose energy it is.
    pub shell: &'a Shell,
    /// B.
    pub columns: &'a [Vec<Vec3>],
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
        let (mut elements, mut folded, mut images, mut pairs) = (vec![], vec![], vec![], Pairs::new(&shell.mesh));
        let told = shell.energy.visit_terms(&shell.mesh.positions, &mut |term| match term {
            Term::Stretch(terms) => elements.push(terms.iter().map(|(pair, p)| (pairs.number(*pair), *p)).collect()),
            Term::Bend(folds, rows) => folded.push((folds.to_vec(), rows.to_vec())),
            Term::Image(vertex, plane) => images.push((vertex, *plane)),
        });
        if !told {
            return None;
        }
        let mut bends = threads::map(&folded, BEND * folded.len() as u64, |(folds, rows)| Bend::new(folds, rows));
        bends.iter_mut().for_each(|bend| bend.number(&mut pairs));
        Some(Self { strains: Strains { elements }, bends, images, pairs: pairs.list })
    }
}

fn coefficients(sources: &Sources, told: &Told, watch: &mut dyn FnMut(f64) -> Result<()>) -> Result<Coefficients> {
    let Sources { shell, columns, assumed, .. } = *sources;
    let Told { strains, bends, images, pairs } = told;
    let (rows, rest) = (Rows::new(columns, images), with_images(&shell.mesh.positions, images));
    let shapes = mixed(sources.shapes, sources.gains / pairs.len().max(1));
    let gains = Gains::new(&rest, pairs, &rows, &shapes);
    watch(0.1)?;
    let (corrections, signs) = corrections(bends, &gains, pairs.len())?;
    watch(0.3)?;
    let taken = assumed.stresses.nrows() + signs.len();
    let residuals = if assumed.membrane_share < CARRYING { RESIDUALS } else { MEMBRANE_RESIDUALS };
    let residuals = (taken + residuals).next_multiple_of(WIDTH) - taken; // those that fill a register are free
    let fields = strains.fields(assumed, &gains, residuals)?;
    let (assuming, membrane) = (assumed.stresses.nrows(), fields.ncols());
    let membrane_pairs = strains.transposed(&fields, pairs.len());
    watch(0.4)?;
    let all = Mat::from_fn(pairs.len(), membrane + signs.len(), |e, k| match k < membrane {
        true => membrane_pairs[(e, k)],
        false => corrections[(e, k - membrane)],
    });
    let mut forms = pairs::forms(&rest, pairs, &rows, all.as_ref());
    watch(0.7)?;
    let strained = all.transpose() * gains.matrix().transpose();
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
    Ok(Coefficients { forms, membrane, bending, stiffness, cubic: cubic(bends, &rows) })
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

/// The linear map from y of the edges to the membrane's strains, in the order of its elements.
struct Strains {
    elements: Vec<Vec<(usize, f64)>>,
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

/// |D|^½ y of some bends at shapes with the gains.
struct Roots<'a> {
    bends: &'a [Bend],
    /// Eigenvectors of D by the roots of its eigenvalues.
    roots: Vec<DMatrix<f64>>,
    /// Their signs, and whose pair each is of.
    signs: Vec<f64>,
    rows: Vec<(usize, usize)>,
}

impl<'a> Roots<'a> {
    fn new(bends: &'a [Bend]) -> Self {
        let (mut roots, mut signs, mut rows) = (vec![], vec![], vec![]);
        for (b, bend) in bends.iter().enumerate() {
            let told = bend.correction.iter().all(|x| x.is_finite());
            let size = bend.pairs.len();
            let correction = if told { bend.correction.clone() } else { DMatrix::zeros(size, size) };
            let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(correction);
            signs.extend(eigenvalues.iter().map(|x| x.signum()));
            roots.push(DMatrix::from_fn(size, size, |i, k| eigenvectors[(i, k)] * eigenvalues[k].abs().sqrt()));
            rows.extend((0..size).map(|k| (b, k)));
        }
        Self { bends, roots, signs, rows }
    }

    /// Of each pair (shapes × Σ pairs).
    fn at(&self, gains: &Gains) -> Mat<f64> {
        let mut z = Mat::zeros(gains.shapes, self.rows.len());
        for (row, (b, k)) in self.rows.iter().enumerate() {
            for (i, pair) in self.bends[*b].pairs.iter().enumerate().filter_map(|(i, pair)| Some((i, (*pair)?))) {
                let root = self.roots[*b][(i, *k)];
                z.col_mut(row).iter_mut().zip(gains.of(pair)).for_each(|(sum, y)| *sum += root * y);
            }
        }
        z
    }
}

/// The few sums over pairs (pairs × sums) whose squares, by their signed weights, are near ½ Σ yᵀDy at the shapes; and the weights.
fn corrections(bends: &[Bend], gains: &Gains, pairs: usize) -> Result<(Mat<f64>, Vec<f64>)> {
    let shapes = gains.shapes;
    let parts = threads::parts(bends, CHUNK);
    let work = 3.0 * MULTIPLICATION * (bends.len() * shapes * shapes) as f64;
    let made = threads::map(&parts, work as u64, |part| {
        let mut gram = Mat::<f64>::zeros(shapes, shapes);
        let roots: Vec<Roots> = part.chunks(CHUNK).map(Roots::new).collect();
        for some in &roots {
            let z = some.at(gains);
            add_lower(gram.as_mut(), z.as_ref(), z.transpose());
        }
        (roots, gram)
    });
    let mut gram = Mat::<f64>::zeros(shapes, shapes);
    made.iter().for_each(|(_, part)| gram += part);
    // Shapes count by the roots of their sizes.
    let scale: Vec<f64> = (0..shapes).map(|s| gram[(s, s)].max(f64::MIN_POSITIVE).sqrt().sqrt().recip()).collect();
    let scaled = Mat::from_fn(shapes, shapes, |i, j| scale[i] * gram[(i.max(j), i.min(j))] * scale[j]);
    if shapes == 0 || scaled.norm_max() == 0.0 {
        return Ok((Mat::zeros(pairs, 0), vec![]));
    }
    let (values, vectors) = symmetric_eigen(scaled.as_ref())?;
    let largest = values[shapes - 1];
    let kept: Vec<usize> = (0..shapes).rev().take(CORRECTIONS).filter(|k| values[*k] > 1e-10 * largest).collect();
    let mixing = Mat::from_fn(shapes, kept.len(), |s, k| scale[s] * vectors[(s, kept[k])] / values[kept[k]].sqrt());
    let fields = threads::map(&made, work as u64 / 10, |(roots, _)| {
        roots.iter().map(|some| mixing.transpose() * some.at(gains)).collect::<Vec<_>>()
    });
    let mut sums = Mat::<f64>::zeros(pairs, kept.len());
    let mut signed = Mat::<f64>::zeros(kept.len(), kept.len());
    for (roots, fields) in made.iter().flat_map(|(roots, _)| roots).zip(fields.iter().flatten()) {
        let by_sign = Mat::from_fn(fields.ncols(), kept.len(), |row, k| roots.signs[row] * fields[(k, row)]);
        matmul(signed.as_mut(), Accum::Add, fields, &by_sign, 1.0, Par::Seq);
        for (row, (b, k)) in roots.rows.iter().enumerate() {
            for (i, pair) in roots.bends[*b].pairs.iter().enumerate().filter_map(|(i, pair)| Some((i, (*pair)?))) {
                (0..kept.len()).for_each(|c| sums[(pair, c)] += roots.roots[*b][(i, *k)] * fields[(c, row)]);
            }
        }
    }
    let (weights, turns) = symmetric_eigen(signed.as_ref())?;
    Ok((sums * turns, weights))
}
