//! Tables: parameters that differ with where the tip stands, or with time.
//!
//! A tool with a rounded rim is narrower where it only touches; a guide that is bent shifts the tip by another amount at each place; a tool
//! that is worn down gets narrower. An effect whose parameter [`varies`](super::Parameter::varies) has, in place of one value, a table of the
//! tip's depth or place, or of the run's time: straight lines between the listed places, and constant beyond the first and the last.
//!
//! Only effects without memory have such parameters: at each moment they act as if the parameter had the table's value there.

use super::{
    EffectError, KNOTS_MAX, Load, Now, OnContact, OnCovering, OnMotion, Parameter, TipState, Values,
};
use crate::Contact;

/// What a table is a function of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// The tip's depth below the covering's surface, in mm.
    Depth,
    /// The tip's x, sensor frame, in mm.
    X,
    /// The tip's y, sensor frame, in mm.
    Y,
    /// The time since the start of the run, in s.
    Time,
}

/// A parameter's values at places; in the parameter's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What it is a function of.
    pub by: By,
    /// In mm or, of time, in s; each greater than the one before.
    pub at: Vec<f64>,
    /// One for each place.
    pub values: Vec<f64>,
}

impl By {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Depth, Self::X, Self::Y, Self::Time];

    /// The name in model files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth_mm",
            Self::X => "x_mm",
            Self::Y => "y_mm",
            Self::Time => "time_s",
        }
    }

    fn of_contact(self, now: Now<'_>, contact: &Contact) -> f64 {
        self.of(now, contact.position_mm, contact.depth_mm)
    }

    fn of_tip(self, now: Now<'_>, tip: &TipState) -> f64 {
        self.of(now, tip.position_mm(), tip.surface_mm - tip.tip_mm[2])
    }

    const fn of(self, now: Now<'_>, [x_mm, y_mm]: [f64; 2], depth_mm: f64) -> f64 {
        match self {
            Self::Depth => depth_mm,
            Self::X => x_mm,
            Self::Y => y_mm,
            Self::Time => now.t_s,
        }
    }
}

impl Table {
    /// The value at a place.
    pub fn value(&self, place: f64) -> f64 {
        between(&self.at, place, |index| self.values[index])
    }

    /// Checks it as that of a parameter.
    pub(super) fn check(&self, effect: &'static str, of: &Parameter) -> Result<(), EffectError> {
        let Parameter { name: parameter, range: [least, most], varies, .. } = *of;
        if !varies.contains(&self.by) {
            return Err(EffectError::NoTable {
                effect,
                parameter: parameter.into(),
                by: self.by.name(),
                varies,
            });
        }
        let refuse = |want| Err(EffectError::Table { effect, parameter, want });
        let [places, values] = [self.at.len(), self.values.len()];
        if places != values || !(1..=KNOTS_MAX).contains(&places) {
            return refuse(format!(
                "must have 1 to {KNOTS_MAX} places, with as many values, not {places} and {values}"
            ));
        }
        if let Some(index) = self.at.iter().position(|at| !at.is_finite()) {
            return refuse(format!("must have finite places; at[{index}] is {}", self.at[index]));
        }
        if let Some(index) = self.at.windows(2).position(|two| two[1] <= two[0]) {
            let [before, after] = [self.at[index], self.at[index + 1]];
            return refuse(format!("must have places in order; {after} follows {before}"));
        }
        if let Some(value) = self.values.iter().find(|value| !(least..=most).contains(value)) {
            return refuse(format!("must have values from {least} to {most}, not {value}"));
        }
        Ok(())
    }
}

/// Straight lines between the values at places; constant before the first and after the last.
pub(super) fn between(at: &[f64], place: f64, value: impl Fn(usize) -> f64) -> f64 {
    let next = at.partition_point(|at| *at <= place);
    let (before, after) = (next.saturating_sub(1), next.min(at.len() - 1));
    let low = value(before);
    if before == after || next == 0 {
        return low;
    }
    low + (value(after) - low) * (place - at[before]) / (at[after] - at[before])
}

/// An effect of which some parameters are tables.
#[derive(Debug)]
pub(crate) struct Tabled<Make> {
    make: Make,
    values: Values,
}

impl<Object: ?Sized> Tabled<fn(&Values) -> Box<Object>> {
    pub(crate) fn of(make: fn(&Values) -> Box<Object>, values: &Values) -> Self {
        Self { make, values: values.clone() }
    }

    /// The effect's object with the values at a place.
    fn at(&self, place: impl Fn(By) -> f64) -> Box<Object> {
        let mut parameters = self.values.parameters.clone();
        for (parameter, table) in &self.values.tables {
            parameters[*parameter] = table.value(place(table.by));
        }
        (self.make)(&Values { parameters, knots: self.values.knots.clone(), tables: Vec::new() })
    }

    fn has_table_of_time(&self) -> bool {
        self.values.tables.iter().any(|(_, table)| table.by == By::Time)
    }
}

impl OnMotion for Tabled<fn(&Values) -> Box<dyn OnMotion>> {
    fn place(&mut self, now: Now<'_>, tip: &mut TipState) {
        self.at(|by| by.of_tip(now, tip)).place(now, tip);
    }

    fn is_timed(&self) -> bool {
        self.has_table_of_time()
    }
}

impl OnContact for Tabled<fn(&Values) -> Box<dyn OnContact>> {
    fn touch(&self, now: Now<'_>, contact: &mut Contact) {
        self.at(|by| by.of_contact(now, contact)).touch(now, contact);
    }

    fn lean(&self, now: Now<'_>, contact: &Contact) -> [f64; 2] {
        self.at(|by| by.of_contact(now, contact)).lean(now, contact)
    }

    fn is_timed(&self) -> bool {
        self.has_table_of_time()
    }
}

impl OnCovering for Tabled<fn(&Values) -> Box<dyn OnCovering>> {
    fn spread(&self, now: Now<'_>, loads: &mut Vec<Load>) {
        let Some(contact) = loads.first().map(|load| load.contact.clone()) else { return };
        self.at(|by| by.of_contact(now, &contact)).spread(now, loads);
    }

    fn spreads(&self) -> bool {
        (self.make)(&self.values).spreads()
    }

    fn signal(&mut self, now: Now<'_>, contact: &Contact, signal_mm: &mut [f64]) {
        self.at(|by| by.of_contact(now, contact)).signal(now, contact, signal_mm);
    }

    fn is_timed(&self) -> bool {
        self.has_table_of_time()
    }
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
