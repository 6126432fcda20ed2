//! A step of a floating shell: the two stages of the reduced shell's step (Alexander 1977), with the turn as a product of exponentials
//! (Crouch, Grossman 1993): R⁺ = R exp((1 − γ)hω₁) exp(γhω⁺). Among contacts it is one stage over the whole step. Where stiffness relaxes in
//! the first stage what the step does not resolve, that stage stands, as in `methods/reduced/step.rs`.

use super::place::Rates;
use super::stage::Stage;
use super::{At, Floating};
use crate::load::BodyLoad;
use crate::methods::Acting;
use crate::reduced::sum_of;
use crate::step::stages::{GAMMA, NOTHING, ONWARD, RELAXING, RESOLVED, SUDDEN, Stages};
use crate::{Error, ErrorKind, Result};

impl Floating {
    /// One step of `h`. Changes nothing on failure.
    pub(super) fn advance_by(&mut self, acting: &Acting, h: f64) -> Result<()> {
        match acting.passage {
            Some(passage) => self.pass_by(acting, &passage, h),
            None => self.step_in_frame(acting, h),
        }
    }

    /// The same where the frame's motion is in the loads. Changes nothing on failure.
    pub(super) fn step_in_frame(&mut self, acting: &Acting, h: f64) -> Result<()> {
        let (shell, reduced, rigid) = (self.shell.clone(), self.reduced.clone(), self.rigid.clone());
        let at = At::of(&shell, &reduced, &rigid, acting);
        self.room.dead.set(&shell, &reduced, &rigid, acting.load, acting.external);
        self.newton.take_work();
        self.begin(at);
        let before = self.kinetic(&self.rates);
        let sudden = at.points.is_some_and(|points| points.is_sudden());
        let (mut converged, mut work) = if sudden { (false, 0.0) } else { self.stages(at, acting.load, h) };
        if !converged {
            self.begin(at);
            let stage = Stage { tau: h, share: 1.0, near: false, damped: self.set_viscosity() };
            self.set_out(h);
            converged = self.advance(at, acting.load, stage);
            work = h * self.power_of_constraints();
            self.pace(0, false);
            self.pace(2, true);
            let [start, _, end] = &self.room.paces;
            self.estimate.of_one(h, start.iter().zip(end).map(|(start, end)| [*start, *end]));
        }
        if at.points.is_some_and(|points| points.is_passive()) && acting.load.spin_rate().is_none() {
            self.gain_nothing(before + work);
        }
        self.record_outcomes(at);
        let finite = (self.constraints.work + work).is_finite() && self.constraints.is_finite();
        if !finite || !self.is_within_range(&self.next, &self.next_rates) {
            let message = format!("the step of {h:?} s does not give finite positions");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        self.place.copy_from(&self.next);
        self.rates.copy_from(&self.next_rates);
        self.unconverged += u64::from(!converged);
        self.work = self.newton.take_work();
        self.constraints.accept(work);
        Ok(())
    }

    /// A stage starts where the step does, with its momenta.
    fn begin(&mut self, at: At) {
        let Self { from, with, began, place, rates, room, points, .. } = self;
        from.copy_from(place);
        began.copy_from(place);
        at.reduced.set_moments(at.rigid, (&place.q, &rates.q), &mut room.moments);
        with.set(at, (place, rates), &room.moments);
        room.z.fill(0.0);
        if let Some(energy) = at.points {
            self.body.take(at.shell, at.reduced, energy.points());
            points.follow(&self.body, at.rigid, &rates.flight(place), &room.z);
        }
    }

    /// Guesses the end of a first stage by the rates at its start.
    fn set_out(&mut self, tau: f64) {
        let Self { from, rates, next, .. } = self;
        next.copy_from(from);
        next.q.iter_mut().zip(&rates.q).for_each(|(q, rate)| *q += tau * rate);
        next.slide += tau * rates.slide;
        next.turn_by(&(tau * rates.spin));
    }

    /// Sets the next place and its rates. Returns whether the searches converged, and the work of constraints.
    fn stages(&mut self, at: At, load: &BodyLoad, h: f64) -> (bool, f64) {
        let (mut before, mut left, mut standing) = (0.0, h, 0);
        let end = loop {
            let done = self.two_stages(at, load, left, standing < RELAXING);
            if !done.stands {
                break done;
            }
            let Self { begins, place, rates, next, next_rates, .. } = self;
            if standing == 0 {
                begins.0.copy_from(place);
                begins.1.copy_from(rates);
            }
            place.copy_from(next);
            rates.copy_from(next_rates);
            self.begin(at);
            standing += 1;
            before += done.work;
            left *= 1.0 - GAMMA;
        };
        if standing > 0 {
            self.place.copy_from(&self.begins.0);
            self.rates.copy_from(&self.begins.1);
        }
        (end.converged, before + end.work)
    }

    /// The same, or one stage where that stands and `may_stand`.
    fn two_stages(&mut self, at: At, load: &BodyLoad, h: f64, may_stand: bool) -> Stages {
        let tau = GAMMA * h;
        let first = Stage { tau, share: GAMMA, near: false, damped: self.set_viscosity() };
        self.set_out(tau);
        if !self.advance(at, load, first) {
            return Stages { stands: false, converged: false, work: 0.0 };
        }
        if may_stand && self.relaxes(tau) {
            return Stages { stands: true, converged: true, work: tau * self.power_of_constraints() };
        }
        let work = ONWARD * tau * self.power_of_constraints();
        self.pace(0, false);
        self.pace(1, true);
        let Self { from, with, elsewhere, began, place, rates, next, next_rates, room, .. } = self;
        elsewhere.set(at, (next, next_rates), &room.moments);
        elsewhere.go_on(with, ONWARD);
        with.q.copy_from_slice(&elsewhere.q);
        (with.slide, with.spin) = (elsewhere.slide, elsewhere.spin);
        began.copy_from(next);
        for (k, q) in from.q.iter_mut().enumerate() {
            *q = place.q[k] + ONWARD * (next.q[k] - place.q[k]);
            let gained = next_rates.q[k] - rates.q[k];
            next.q[k] = *q + tau * (next_rates.q[k] + ONWARD * gained); // with the acceleration of the first stage
        }
        from.slide = place.slide + ONWARD * (next.slide - place.slide);
        from.turn = place.turn;
        from.turn_by(&(ONWARD * tau * next_rates.spin));
        next.slide = from.slide + tau * (next_rates.slide + ONWARD * (next_rates.slide - rates.slide));
        next.turn = from.turn;
        next.turn_by(&(tau * (next_rates.spin + ONWARD * (next_rates.spin - rates.spin))));
        let converged = self.advance(at, load, Stage { share: 1.0, near: true, ..first });
        let work = work + tau * self.power_of_constraints();
        self.pace(2, true);
        let [start, first, end] = &self.room.paces;
        self.estimate.of_stages(h, (0..end.len()).map(|k| [start[k], first[k], end[k]]));
        Stages { stands: false, converged, work }
    }

    /// Whether the fields jump in a stage of `tau` where stiffness resists, and not inertia.
    fn relaxes(&mut self, tau: f64) -> bool {
        let Self { place, rates, next, newton, damping, room, .. } = self;
        let jump = |k: usize| next.q[k] - place.q[k] - tau * rates.q[k];
        let coasted = sum_of(&rates.q, &rates.q, |rate, _| (tau * rate).powi(2));
        let moved: f64 = (0..place.q.len()).map(|k| jump(k) * jump(k)).sum();
        let size = sum_of(&place.q, &place.q, |q, _| q * q);
        if moved <= SUDDEN * SUDDEN * coasted || moved <= NOTHING * NOTHING * size {
            return false;
        }
        room.start.fill(0.0);
        (0..place.q.len()).for_each(|k| room.start[k] = jump(k));
        let alpha = tau.recip();
        newton.filter(alpha * (alpha + damping.mass), &mut room.start);
        let kept: f64 = (0..place.q.len()).map(|k| jump(k) * room.start[k]).sum();
        kept < RESOLVED * moved
    }

    /// Takes down rates, `next` or those at the start, for the estimate of the step's error. The centre's way is exact.
    fn pace(&mut self, at: usize, next: bool) {
        let rates = if next { &self.next_rates } else { &self.rates };
        let (fields, rigid) = self.room.paces[at].split_at_mut(rates.q.len());
        fields.copy_from_slice(&rates.q);
        self.rigid.coordinates(&rates.spin, &crate::Vec3::zeros(), rigid);
    }

    /// The damping of the fields beside ξ at the start of the step; false if there is none.
    fn set_viscosity(&mut self) -> bool {
        let zeta = self.damping.stiffness;
        let modal = self.modal_damping.iter().any(|c| *c > 0.0);
        let viscosity = &mut self.room.viscosity;
        if zeta > 0.0 {
            let energy = self.reduced.elastic(self.form);
            energy.viscosity(&self.place.q, self.newton.scratch().own(), viscosity);
            *viscosity *= zeta;
        } else if modal {
            viscosity.fill(0.0);
        }
        self.modal_damping.iter().enumerate().for_each(|(k, c)| viscosity[(k, k)] += c);
        zeta > 0.0 || modal
    }

    /// Slows the next motion down where it has more kinetic energy than there was, with what loads did since: what stands still gives none.
    fn gain_nothing(&mut self, before: f64) {
        let loads = {
            let dead = &self.room.dead;
            let of = |place: &super::Place| dead.work(&place.slide, &place.turn.to_rotation_matrix(), &place.q);
            of(&self.next) - of(&self.place)
        };
        let energy = self.reduced.elastic(self.form);
        let scratch = self.newton.scratch().own();
        let stored = energy.value(&self.next.q, scratch) - energy.value(&self.place.q, scratch);
        self.reduced.set_moments(&self.rigid, (&self.next.q, &self.next_rates.q), &mut self.room.moments);
        let (room, moving) = ((before + loads - stored).max(0.0), self.kinetic(&self.next_rates));
        if moving > room {
            Rates::scale(&mut self.next_rates, (room / moving).sqrt());
        }
    }
}
