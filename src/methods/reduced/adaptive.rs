//! The choice between the forms of a reduced shell in motion: the polynomial within the range where it is as good as the samples, these beyond.
//!
//! Both forms have the same q, so that a change moves nothing. The form that acts is one more unknown: what is saved, cloned or taken back
//! goes on by the same one.

use super::Reduced;
use crate::methods::nodal::are_angles;
use crate::methods::{Acting, Method, Watch};
use crate::reduced::{Form, ReducedShell, Scratch};
use crate::{ErrorKind, Result};

/// Of the range, where the polynomial is taken again.
const RETURN: f64 = 0.8;

/// What a shell that has both forms knows of them.
#[derive(Clone)]
pub(super) struct Adaptive {
    /// |q| up to which the polynomial is as good.
    range: f64,
    /// Room for evaluations of the form that does not act.
    spare: Scratch,
}

impl Adaptive {
    pub(super) fn new(range: f64, spare: Scratch) -> Self {
        Self { range, spare }
    }
}

/// The number that a form is saved as.
fn number(form: Form) -> f64 {
    if form == Form::Sampled { 1.0 } else { 0.0 }
}

impl Reduced {
    /// The method whose form does not change, or that of both.
    pub(super) fn own_method(&self) -> Method {
        match (&self.adaptive, self.form) {
            (Some(_), _) => Method::AdaptiveShell,
            (None, Form::Sampled) => Method::ReducedShell,
            (None, Form::Polynomial) => Method::PolynomialShell,
        }
    }

    /// Goes on by this form, where there are both.
    pub(super) fn take_form(&mut self, form: Form) {
        if let Some(adaptive) = self.adaptive.as_mut().filter(|_| form != self.form) {
            std::mem::swap(self.newton.scratch(), &mut adaptive.spare);
            self.form = form;
        }
    }

    /// The form for where the shell is.
    pub(super) fn choose_form(&mut self) {
        let Some(Adaptive { range, .. }) = self.adaptive else { return };
        let size = self.motion.q.iter().map(|q| q * q).sum::<f64>().sqrt();
        let near = if self.form == Form::Polynomial { range } else { RETURN * range };
        self.take_form(if size <= near && range > 0.0 { Form::Polynomial } else { Form::Sampled });
    }

    /// A step by the form for where it begins.
    pub(super) fn advance_by_choice(&mut self, acting: &Acting, h: f64) -> Result<()> {
        let before = self.form;
        self.choose_form();
        let done = self.advance_by(acting, h);
        if done.is_err() {
            self.take_form(before);
        }
        done
    }

    /// The equilibrium by the form for where it is; by the samples where the polynomial finds none.
    pub(super) fn settle_by_choice(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        if self.adaptive.is_none() {
            return self.find_equilibrium(acting, watch);
        }
        let (form, before) = (self.form, self.motion.clone());
        self.choose_form();
        let found = self.find_equilibrium(acting, watch);
        let by = self.form;
        match &found {
            Ok(_) => self.choose_form(),
            Err(error) if error.kind == ErrorKind::Numerical => self.take_form(Form::Sampled),
            Err(_) => (),
        }
        let again = if self.form == by { found } else { self.find_equilibrium(acting, watch) };
        if again.is_err() {
            self.motion = before;
            self.take_form(form);
        }
        again
    }

    /// Unknowns beside the amplitudes.
    pub(super) fn n_more_unknowns(&self) -> usize {
        usize::from(self.adaptive.is_some()) + self.n_rest_angles()
    }

    /// Appends them, with their rates.
    pub(super) fn add_more_unknowns(&self, [unknowns, rates]: &mut [Vec<f64>; 2]) {
        if self.adaptive.is_some() {
            unknowns.push(number(self.form));
            rates.push(0.0);
        }
        if let Some(yielding) = self.reduced.energy.yielding() {
            unknowns.extend(yielding.rest_angles());
            rates.resize(unknowns.len(), 0.0);
        }
    }

    /// What is behind the amplitudes.
    pub(super) fn set_more_unknowns(&mut self, more: &[f64]) {
        let (form, angles) = more.split_at(more.len() - self.n_rest_angles());
        if let Some(form) = form.first() {
            self.take_form(if *form >= 0.5 { Form::Sampled } else { Form::Polynomial });
        }
        self.take_rest_angles(angles);
    }

    /// Whether it can be a form, and rest angles.
    pub(super) fn can_be_more(&self, more: &[f64]) -> bool {
        let (form, angles) = more.split_at(more.len() - self.n_rest_angles());
        form.iter().all(|form| (0.0..=1.0).contains(form)) && are_angles(angles)
    }

    fn n_rest_angles(&self) -> usize {
        self.reduced.energy.n_yielding()
    }

    /// Creases that yield rest at these angles from here on.
    pub(super) fn take_rest_angles(&mut self, angles: &[f64]) {
        if ReducedShell::set_rest_angles(&mut self.reduced, angles) {
            self.newton.scratch().forget();
        }
    }

    /// Creases that are bent beyond their yield angle rest at another one from here on.
    pub(super) fn yield_creases(&mut self) {
        if self.reduced.energy.yielding().is_none() {
            return;
        }
        if let Some(angles) = self.reduced.energy.yielded(&self.motion.q, self.newton.scratch()) {
            self.take_rest_angles(&angles);
        }
    }

    /// For the plan.
    pub(super) fn tell_form(&self) -> String {
        let Some(Adaptive { range, .. }) = self.adaptive else { return String::new() };
        let size = self.motion.q.iter().map(|q| q * q).sum::<f64>().sqrt();
        let acts = if self.form == Form::Sampled { "the samples act" } else { "the polynomial acts" };
        let size = if range > 0.0 { format!("{:.2} of its range", size / range) } else { "without a range".into() };
        format!("; {acts} at {size}")
    }
}
